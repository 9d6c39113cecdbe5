"""What becomes of fields and laws when the class body of a component has been read."""

from __future__ import annotations

from typing import Any

from atwood.arguments import NAME, check, each, one_of
from atwood.errors import DeclarationError
from atwood.model.declare.connectors import ConnectorSpec
from atwood.model.declare.fields import MISSING, Field, ParameterSpec, SignalSpec
from atwood.model.declare.law import Law, ObservableOptions
from atwood.model.declare.states import StateSpec

__all__ = ["ComponentType", "check_reserved", "collect_declarations"]


_WORDS = {
    "spaces": each(one_of(("line", "plane", "space")), "a tuple of 'line', 'plane' and 'space'", 1, single=False),
    "modes": each(NAME, "a tuple of names", single=False),
}
"""Tuples of words in a class body."""


class _Body(dict[str, Any]):
    """The names of a class body; what is declared there is not declared again."""

    def __init__(self, kind: str) -> None:
        super().__init__()
        self._kind = kind

    def __setitem__(self, name: str, value: Any) -> None:
        if _is_declared(self.get(name)) and _is_declared(value):
            raise DeclarationError(
                f"{name!r} is declared twice", where=self._kind, advice="Give one of the two another name."
            )
        super().__setitem__(name, value)


def _is_declared(value: Any) -> bool:
    return isinstance(value, (Field, ConnectorSpec)) or hasattr(value, "_atwood_law")


class ComponentType(type):
    """The type of components: in their class bodies no name is declared twice, and their fields say how to call them.

    What `inspect.signature` and `help` show is made of the fields when it is asked for.
    """

    @property
    def __signature__(cls) -> Any:
        from atwood.model.declare.signatures import signature_of

        return signature_of(cls)

    def _doc(cls) -> str | None:
        from atwood.model.declare.signatures import docstring_of

        return docstring_of(cls)

    __doc__ = property(_doc)

    @classmethod
    def __prepare__(cls, name: str, bases: tuple[type, ...], /, **_: Any) -> _Body:
        """Return what takes up the names of a class body."""
        return _Body(name)


def collect_declarations(cls: Any) -> None:
    """Give a class of components the tables of its fields, connectors and laws: those of its bases and its own."""
    _merge_inherited(cls)
    for name, kind in _WORDS.items():
        if name in vars(cls):
            setattr(cls, name, check(kind, vars(cls)[name], name, cls.__name__, DeclarationError))
    for name, value in list(vars(cls).items()):
        if hasattr(getattr(value, "fget", None) or getattr(value, "func", None), "_atwood_law"):
            advice = "A law is a method: leave out the property."
            raise DeclarationError("a property is no law", where=f"{cls.__name__}.{name}", advice=advice)
        law = getattr(value, "_atwood_law", None)
        if isinstance(value, (Field, ConnectorSpec)) or isinstance(law, Law):
            _check_field_name(cls, name, value)
        if isinstance(value, ParameterSpec):
            cls._parameters[name] = _with_checked_default(value, cls)
        elif isinstance(value, SignalSpec):
            cls._signals[name] = _with_checked_default(value, cls)
        elif isinstance(value, StateSpec):
            cls._states[name] = _with_checked_default(value, cls)
            options = ObservableOptions(value.unit.text, value.doc, False, "", ("line", "plane", "space"))
            cls._laws[name] = Law("observable", name, options)
        elif isinstance(value, ConnectorSpec):
            cls._connectors[name] = value
        elif isinstance(law, Law):
            cls._laws[name] = law
        elif name in cls._parameters:
            changed = _with_checked_default(cls._parameters[name].with_default(value), cls)
            cls._parameters[name] = changed
            setattr(cls, name, changed)
        elif name in cls._signals:
            replaced = _with_checked_default(cls._signals[name].with_default(value), cls)
            cls._signals[name] = replaced
            setattr(cls, name, replaced)
    _check_reactions(cls)


def _check_reactions(cls: Any) -> None:
    """Refuse reactions with the name of a parameter, an input or a connector."""
    taken = {**cls._parameters, **cls._signals, **cls._connectors}
    for law in cls._laws.values():
        for reaction in law.options.reactions if law.kind == "constraint" else ():
            if reaction.partition(".")[0] in taken:
                advice = "Give the reaction another name."
                where = f"{cls.__name__}.{law.name}"
                raise DeclarationError(
                    f"its reaction {reaction!r} has the name of something else", where=where, advice=advice
                )


def _merge_inherited(cls: type) -> None:
    """Give a class what all its bases declare, in the order in which Python looks names up."""
    for table in ("_parameters", "_signals", "_connectors", "_states", "_laws"):
        merged: dict[str, Any] = {}
        for base in reversed(cls.__mro__[1:]):
            merged.update(vars(base).get(table, {}))
        setattr(cls, table, merged)


def _with_checked_default(spec: Any, cls: type) -> Any:
    """Return a field whose default has been checked as a value that is given is."""
    if spec.default is not MISSING:
        spec.default = spec.check(spec.default, f"{cls.__name__}.{spec.name}")
    return spec


def _check_field_name(cls: type, name: str, value: Any) -> None:
    """Refuse a field that is declared elsewhere under another name, or that has the name of something else."""
    if getattr(value, "name", name) != name:
        raise DeclarationError(
            f"{name!r} is a second name for {value.name!r}",
            where=cls.__name__,
            advice=f"Declare {name!r} on its own; its default can be {value.name!r}.",
        )
    check_reserved(cls, name)


def check_reserved(cls: type, name: str) -> None:
    """Refuse a name that every component, or every model, uses for something else."""
    for base in cls.__mro__[1:]:
        if not base.__module__.startswith("atwood.model."):
            continue
        taken = vars(base).get(name)
        if taken is not None and not isinstance(taken, (Field, ConnectorSpec)):
            raise DeclarationError(
                f"the name {name!r} has a meaning of its own in every {base.__name__}",
                where=cls.__name__,
                advice="Choose another name.",
            )
