"""Quantities of components by name: what an observable is outside a law."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Self, overload

from atwood.arguments import Kind, Refused, each, optional
from atwood.errors import UsageError

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    from atwood.model.declare.component import Component
    from atwood.model.declare.law import Law

    _R = TypeVar("_R", default=Any)
else:
    from typing import TypeVar

    _R = TypeVar("_R")


class Quantity(Generic[_R]):
    """A quantity of a component: a name to read it by, ``result[scene["bob2"].position.x]``.

    Parameters
    ----------
    component
        The component.
    name
        Name of the quantity there, such as ``position`` or ``position.x``.
    unit, doc
        Unit and meaning.
    """

    __slots__ = ("component", "doc", "name", "unit")

    def __init__(self, component: Component, name: str, unit: str, doc: str) -> None:
        self.component, self.name, self.unit, self.doc = component, name, unit, doc

    def __str__(self) -> str:
        return self.path

    def __repr__(self) -> str:
        return f"<{self.path} [{self.unit}]: {self.doc}>"

    def __call__(self, *_: Any) -> _R:
        """Refuse: outside a law a quantity has a name and no value."""
        raise UsageError(
            "it has a value only inside a law", where=self.path, advice=f"After a run, read result[{self.path!r}]."
        )

    @property
    def path(self) -> str:
        """The dotted path of the quantity."""
        prefix = self.component.path
        return f"{prefix}.{self.name}" if prefix else self.name

    @property
    def x(self) -> Quantity:
        """The component along x of a vector."""
        return Quantity(self.component, f"{self.name}.x", self.unit, self.doc)

    @property
    def y(self) -> Quantity:
        """The component along y of a vector."""
        return Quantity(self.component, f"{self.name}.y", self.unit, self.doc)

    @property
    def z(self) -> Quantity:
        """The component along z of a vector."""
        return Quantity(self.component, f"{self.name}.z", self.unit, self.doc)


class ObservableLaw(Generic[_R]):
    """An observable in a class body: within a law it is a method, elsewhere it names its `Quantity`."""

    def __init__(self, read: Any, law: Law) -> None:
        self._read = read
        self._atwood_law = law
        self.__doc__ = read.__doc__
        self.__name__ = law.name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: Component, owner: type) -> Quantity[_R]: ...
    def __get__(self, instance: Component | None, owner: type) -> Any:
        if instance is None:
            return self
        if instance._bound is not None:
            return self._read.__get__(instance, owner)
        options = self._atwood_law.options
        return Quantity(instance, self._atwood_law.name, options.unit, options.doc)


def _path(value: Any) -> str:
    if not isinstance(value, (str, Quantity)) or not str(value).strip():
        raise Refused
    return str(value)


PATH = Kind("the path of a quantity, such as 'rod.angle'", _path, "PATH")
PATHS = optional(each(PATH, "the paths of quantities, such as ['rod.angle']"))
