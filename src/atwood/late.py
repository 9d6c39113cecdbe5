"""Dataclasses whose methods are written when they are first used.

`dataclasses.dataclass` writes and compiles several methods of each class when its module is imported, a third of a
millisecond a class: for all classes of Atwood that takes as long as to import NumPy. A process uses few of them. Here
the standard library does the same work when a class gets its first instance, or is asked for its fields.
"""

from __future__ import annotations

import dataclasses
from operator import attrgetter
from reprlib import recursive_repr
from threading import RLock
from typing import TYPE_CHECKING, Any

from atwood.showing import brief

__all__ = ["dataclass"]

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True):
        """Make a class a dataclass, as `dataclasses.dataclass` does with the same options."""
        return _declare(cls, frozen, eq) if cls is not None else lambda cls: _declare(cls, frozen, eq)


_TAKEN = ("__dataclass_fields__", "__dataclass_params__", "__match_args__")
"""What `dataclasses.dataclass` gives a class beside its methods."""

_METHODS = ("__init__", "__repr__", "__eq__", "__hash__")

_WRITING = RLock()


class _Later:
    """An attribute of a class that is there once the class is completed."""

    def __init__(self, completion: _Completion, name: str) -> None:
        self.completion, self.name = completion, name

    def __get__(self, _: object, owner: type) -> Any:
        self.completion.complete()
        return getattr(owner, self.name)


class _Completion:
    """What makes a class a dataclass when that is needed."""

    def __init__(self, cls: Any, frozen: bool) -> None:
        own = vars(cls)
        self.cls, self.frozen, self.done = cls, frozen, False
        self.first: Any = None
        self.construct: Any = None
        self.given = {name: own[name] for name in own.get("__annotations__", ()) if name in own}
        for name, value in self.given.items():  # as instances and readers of the class see the defaults
            if isinstance(value, dataclasses.Field):
                if value.default is dataclasses.MISSING:
                    delattr(cls, name)
                else:
                    setattr(cls, name, value.default)
        self.made = {name for name in _METHODS if name not in own}

    def complete(self) -> None:
        """Take constructor and fields from a twin of the class, which the standard library makes a dataclass."""
        with _WRITING:
            if self.done:
                return
            cls = self.cls
            left_out = {"__dict__", "__weakref__", "__setattr__", "__delattr__", "__signature__", *self.made, *_TAKEN}
            own = {name: value for name, value in vars(cls).items() if name not in left_out}
            twin: Any = type(cls)(cls.__name__, cls.__bases__, own | self.given)
            dataclasses.dataclass(frozen=self.frozen, eq=False, repr=False)(twin)
            self.values = _reader([one.name for one in dataclasses.fields(twin) if one.compare])
            self.shown = [one.name for one in dataclasses.fields(twin) if one.repr]
            for name in _TAKEN:
                setattr(cls, name, twin.__dict__[name])
            self.construct = twin.__init__
            if vars(cls).get("__init__") is self.first:  # and not what checks its arguments before
                cls.__init__ = self.construct
            if "__signature__" in vars(cls):
                del cls.__signature__
            self.done = True


def _reader(names: list[str]) -> Any:
    """Return what gives the values of attributes as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


def _refuse_to_assign(_: Any, name: str, __: Any) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(_: Any, name: str) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")


def _declare(cls: Any, frozen: bool, eq: bool) -> Any:
    completion = _Completion(cls, frozen)

    def construct(self: Any, *args: Any, **keywords: Any) -> None:
        completion.complete()
        completion.construct(self, *args, **keywords)

    completion.first = construct

    @recursive_repr()
    def shown(self: Any) -> str:
        completion.complete()
        return brief(self, completion.shown)

    def equal(self: Any, other: Any) -> Any:
        if other.__class__ is not self.__class__:
            return NotImplemented
        if not completion.done:
            completion.complete()
        return completion.values(self) == completion.values(other)

    def hashed(self: Any) -> int:
        if not completion.done:
            completion.complete()
        return hash(completion.values(self))

    methods: dict[str, Any] = {"__init__": construct, "__repr__": shown}
    if eq:
        methods |= {"__eq__": equal, "__hash__": hashed if frozen else None}
    for name in completion.made & set(methods):
        setattr(cls, name, methods[name])
    if frozen:
        cls.__setattr__, cls.__delattr__ = _refuse_to_assign, _refuse_to_delete
    for name in (*_TAKEN, "__signature__"):
        setattr(cls, name, _Later(completion, name))
    return cls
