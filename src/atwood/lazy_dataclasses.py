"""Dataclasses whose methods are written when they are first used.

`dataclasses.dataclass` writes and compiles several methods of each class when its module is imported, a third of a
millisecond a class: for all classes of Atwood that takes as long as to import NumPy. A process uses few of them, and
makes few instances of most of these. Here one method, the constructor, is written when a class has got some instances;
all classes share the others, and what sets the fields of the first instances. The standard library is asked when
somebody asks for the fields of a class, as its `fields` and `asdict` do; `replace` is here.
"""

from __future__ import annotations

import dataclasses
from operator import attrgetter
from reprlib import recursive_repr
from threading import RLock
from typing import TYPE_CHECKING, Any, TypeVar

from atwood.display import brief

__all__ = ["dataclass", "made_of", "names_of", "replace"]

_T = TypeVar("_T")

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass, replace as replace
else:

    def replace(one, /, **changes):
        """Return an instance with some fields changed, as `dataclasses.replace` does, which asks for far more."""
        completion = getattr(type(one), "_completion", None)
        if completion is None or type(one) is not completion.cls:
            return dataclasses.replace(one, **changes)
        if not completion.done:
            completion.complete()
        return type(one)(**dict(zip(completion.given_names, completion.taken(one), strict=True)) | changes)

    def dataclass(cls=None, /, *, frozen=False, eq=True):
        """Make a class a dataclass, as `dataclasses.dataclass` does with the same options."""
        return _declare(cls, frozen, eq) if cls is not None else lambda cls: _declare(cls, frozen, eq)


def made_of(cls: type[_T], **fields: Any) -> _T:
    """Return an instance with all its fields given, unchecked: a fifth of the time, for what is made by thousands."""
    one = object.__new__(cls)
    one.__dict__.update(fields)
    return one


def names_of(cls: Any) -> tuple[str, ...]:
    """Return the names of the fields of such a class, those of its bases first."""
    completion = cls._completion
    completion.complete()
    return tuple(completion.found)


_TAKEN = ("__dataclass_fields__", "__dataclass_params__", "__match_args__")
"""What `dataclasses.dataclass` gives a class beside its methods."""

_METHODS = ("__init__", "__repr__", "__eq__", "__hash__")

_FEW = 24
"""For so many instances a class shares what sets their fields: to write a constructor takes as long as some fifty."""

_MISSING = dataclasses.MISSING

_WRITING = RLock()


class _Later:
    """An attribute of a class that is there once the class is completed."""

    def __init__(self, completion: _Completion, name: str) -> None:
        self.completion, self.name = completion, name

    def __get__(self, _: object, owner: type) -> Any:
        if self.name in _TAKEN:
            self.completion.take()
        else:
            self.completion.write()
        return getattr(owner, self.name)


class _Completion:
    """What makes a class a dataclass when that is needed."""

    def __init__(self, cls: Any, frozen: bool) -> None:
        own = vars(cls)
        self.cls, self.frozen, self.done = cls, frozen, False
        self.first: Any = None
        self.construct: Any = None
        self.made_so_far = 0
        self.given = {name: own[name] for name in own.get("__annotations__", ()) if name in own}
        for name, value in self.given.items():  # as instances and readers of the class see the defaults
            if isinstance(value, dataclasses.Field):
                if value.default is _MISSING:
                    delattr(cls, name)
                else:
                    setattr(cls, name, value.default)
        self.made = {name for name in _METHODS if name not in own}
        if any("__repr__" in vars(base) and "_completion" not in vars(base) for base in cls.__mro__[1:-1]):
            self.made.discard("__repr__")  # it shows itself as its base does

    def complete(self) -> None:
        """Find out which fields there are, and which of them are compared, shown and given."""
        with _WRITING:
            if self.done:
                return
            found = self.fields()
            self.found = found
            self.values = _reader([name for name, one in found.items() if one.compare])
            self.shown = [name for name, one in found.items() if one.repr]
            self.given_names = [name for name, one in found.items() if one.init]
            self.taken = _reader(self.given_names)
            self.has_more = hasattr(self.cls, "__post_init__")
            self.done = True

    def write(self) -> None:
        """Write the constructor."""
        self.complete()
        with _WRITING:
            if self.construct is not None:
                return
            construct = _constructor(self.cls, self.found, self.frozen)
            if vars(self.cls).get("__init__") is self.first:  # and not what checks its arguments before
                self.cls.__init__ = construct
            if "__signature__" in vars(self.cls):
                del self.cls.__signature__
            self.construct = construct

    def make(self, one: Any, args: tuple[Any, ...], keywords: dict[str, Any]) -> None:
        """Set the fields of one of the first instances; of what does not fit the constructor complains."""
        self.complete()
        self.made_so_far += 1
        given = dict(zip(self.given_names, args, strict=False)) | keywords
        if self.made_so_far > _FEW or len(given) != len(args) + len(keywords) or not self._put(one, given):
            self.write()
            self.construct(one, *args, **keywords)
        elif self.has_more:
            one.__post_init__()

    def _put(self, one: Any, given: dict[str, Any]) -> bool:
        """Set fields; return whether no value is missing, and there is a field for each."""
        put = object.__setattr__ if self.frozen else setattr
        for name, field in self.found.items():
            if name in given and field.init:
                put(one, name, given.pop(name))
            elif field.default_factory is not _MISSING:
                put(one, name, field.default_factory())
            elif field.default is _MISSING and field.init:
                return False
            elif field.init:
                put(one, name, field.default)
        return not given

    def fields(self) -> dict[str, Any]:
        """Return the fields by name, those of the bases first, without what makes them fields of a class."""
        found: dict[str, Any] = {}
        for base in reversed(self.cls.__mro__[1:]):
            later = vars(base).get("_completion")
            found |= {one.name: one for one in dataclasses.fields(base)} if later is None and _is_done(base) else {}
            found |= {} if later is None else later.own_fields()
        return found | self.own_fields()

    def own_fields(self) -> dict[str, Any]:
        """Return the fields that the class itself declares."""
        found = {}
        for name, kind in vars(self.cls).get("__annotations__", {}).items():
            if "ClassVar" not in str(kind):
                given = self.given.get(name, _MISSING)
                found[name] = given if isinstance(given, dataclasses.Field) else dataclasses.field(default=given)
        return found

    def take(self) -> None:
        """Take what the standard library gives a dataclass beside its methods from a twin of the class."""
        with _WRITING:
            cls = self.cls
            if not isinstance(vars(cls).get(_TAKEN[0]), _Later):
                return
            left_out = {"__dict__", "__weakref__", "__setattr__", "__delattr__", "__signature__", "_completion"}
            left_out |= {*self.made, *_TAKEN}
            own = {name: value for name, value in vars(cls).items() if name not in left_out}
            twin: Any = type(cls)(cls.__name__, cls.__bases__, own | self.given)
            dataclasses.dataclass(frozen=self.frozen, init=False, eq=False, repr=False)(twin)
            for name in _TAKEN:
                setattr(cls, name, twin.__dict__[name])


class _FromFactory:
    """The default of a field whose value is made anew for each instance."""

    def __repr__(self) -> str:
        return "<factory>"


_FROM_FACTORY = _FromFactory()


def _is_done(base: type) -> bool:
    return "__dataclass_fields__" in vars(base)


def _constructor(cls: Any, fields: dict[str, Any], frozen: bool) -> Any:
    """Return the constructor of a class with these fields."""
    known: dict[str, Any] = {"_from_factory": _FROM_FACTORY}
    arguments, lines, values = ["self"], [], {}
    for name, one in fields.items():
        value, makes = name, one.default_factory is not _MISSING
        if makes:
            known[f"_make_{name}"] = one.default_factory
            value = f"_make_{name}() if {name} is _from_factory else {name}" if one.init else f"_make_{name}()"
        elif one.default is not _MISSING:
            known[f"_default_{name}"] = one.default
        if one.init:
            default = "=_from_factory" if makes else f"=_default_{name}" if f"_default_{name}" in known else ""
            arguments.append(f"{name}{default}")
        elif not makes:
            continue  # its default is that of the class
        values[name] = value
    if frozen:  # one by one, so that instances share the names of their fields: a third of the memory of `made_of`
        known["_put"] = object.__setattr__
        lines += [f" _put(self, '{name}', {value})" for name, value in values.items()]
    else:
        lines += [f" self.{name} = {value}" for name, value in values.items()]
    if hasattr(cls, "__post_init__"):
        lines.append(" self.__post_init__()")
    exec(f"def __init__({', '.join(arguments)}):\n" + ("\n".join(lines) or " pass"), known)
    made: Any = known["__init__"]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    kinds = {
        name: kind for base in reversed(cls.__mro__) for name, kind in vars(base).get("__annotations__", {}).items()
    }
    made.__annotations__ = {name: kinds[name] for name, one in fields.items() if one.init} | {"return": None}
    return made


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
    completion = cls._completion = _Completion(cls, frozen)

    def construct(self: Any, *args: Any, **keywords: Any) -> None:
        if completion.construct is None:
            completion.make(self, args, keywords)
        else:  # where something stands before it, such as a check of its arguments
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
