"""The class body of a component turned into its specifications, signature, docstring and errors of names.

Signatures and docstrings are made when somebody asks for them, so that declaring a class costs nothing more.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Collection, Iterable, Iterator
from typing import Any

from atwood.arguments import NAME, check, each, one_of, show
from atwood.display import field_text
from atwood.errors import DeclarationError, MissingNameError, ParameterError, near_matches, suggestion
from atwood.model.declare.connectors import ConnectorSpec
from atwood.model.declare.contact_laws import ContactLaw
from atwood.model.declare.field_functions import StateSpec
from atwood.model.declare.fields import MISSING, Field, ParameterSpec, SignalSpec
from atwood.model.declare.laws import Law, ObservableOptions

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

        return signature_of(cls)

    def _doc(cls) -> str | None:

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
            if isinstance(value, ContactLaw):
                _declare_beside(cls, value)
        elif name in cls._parameters:
            changed = _with_checked_default(cls._parameters[name].with_default(value), cls)
            cls._parameters[name] = changed
            setattr(cls, name, changed)
        elif name in cls._signals:
            replaced = _with_checked_default(cls._signals[name].with_default(value), cls)
            cls._signals[name] = replaced
            setattr(cls, name, replaced)
    _check_reactions(cls)
    _check_energies(cls)


def _declare_beside(cls: Any, law: ContactLaw) -> None:
    """Declare a one-sided law with its reaction and its state."""
    cls._contacts[law.contact.name] = law.contact
    if len(law.names) > 1:
        del cls._laws[law.contact.name]  # its values are quantities, each by itself
    for name, made in law.beside().items():
        if name in vars(cls):
            raise DeclarationError(
                f"{name!r} is declared twice, once by {law.contact.name!r}",
                where=cls.__name__,
                advice="Give one of the two another name.",
            )
        check_reserved(cls, name)
        setattr(cls, name, made)
        if isinstance(made, StateSpec):
            made.__set_name__(cls, name)
            cls._states[name] = made
            seen = ObservableOptions(made.unit.text, made.doc, False, "", law.contact.options.spaces)
            cls._laws[name] = Law("observable", name, seen)
        else:
            cls._laws[name] = made._atwood_law


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


def _check_energies(cls: Any) -> None:
    """Refuse observables with the name of an energy that is told of every component that has one."""
    if not any(law.kind in ("inertia", "lagrangian", "potential") for law in cls._laws.values()):
        return
    for name in ("kinetic_energy", "potential_energy"):
        if (law := cls._laws.get(name)) is not None and law.kind == "observable":
            raise DeclarationError(
                f"the {name.replace('_', ' ')} is a quantity already, by the laws of inertia and potential",
                where=f"{cls.__name__}.{name}",
                advice="Give the observable another name.",
            )


def _merge_inherited(cls: type) -> None:
    """Give a class what all its bases declare, in the order in which Python looks names up."""
    for table in ("_parameters", "_signals", "_connectors", "_states", "_laws", "_contacts"):
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


def signature_of(cls: Any) -> inspect.Signature:
    """Return the signature with which a class of components is called: its parameters, inputs and parts, by name."""
    parts = getattr(cls, "_prototypes", {})
    is_base = cls.__module__.startswith("atwood.model.") and not cls._parameters
    if is_base or not cls.__init__.__module__.startswith("atwood.model."):
        raise AttributeError("__signature__")
    written = [vars(base).get("__annotations__", {}) for base in cls.__mro__]
    fields = {name: spec.default for table in (cls._parameters, cls._signals) for name, spec in _own_first(cls, table)}
    empty = inspect.Parameter.empty
    return inspect.Signature(
        [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=empty if default is MISSING else default,
                annotation=next((one[name] for one in written if name in one), empty),
            )
            for name, default in {**fields, **parts}.items()
        ]
    )


def _own_first(cls: Any, table: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return declarations by name, those of the class itself before those of its bases."""
    return sorted(table.items(), key=lambda one: one[0] not in vars(cls))


def docstring_of(cls: Any) -> str | None:
    """Return the docstring of a class of components, with sections for what it declares, in NumPy's style."""
    own = next((vars(base)["__doc__"] for base in cls.__mro__[:-1] if vars(base).get("__doc__")), None)
    if not (cls._parameters or cls._signals or cls._connectors) or own is None:
        return own
    text = inspect.cleandoc(own)
    written = set(re.findall(r"^(\w+)\n-{3,}$", text, re.MULTILINE))
    sections = {"Parameters": _fields(cls), "Connectors": _connectors(cls), "Quantities": _quantities(cls)}
    for title, entries in sections.items():
        lines = [f"{name} : {kind}\n    {doc}" for name, kind, doc in entries]
        if lines and title not in written:
            text += "\n\n" + "\n".join([title, "-" * len(title), *lines])
    return text


def _fields(cls: Any) -> Iterator[tuple[str, str, str]]:
    for name, spec in _own_first(cls, cls._parameters):
        yield name, ", ".join(_about(spec)), spec.doc
    for name, spec in cls._signals.items():
        yield name, f"{_unit(spec.unit.text)}, input, default {field_text(spec.default)}", spec.doc
    for name, part in getattr(cls, "_prototypes", {}).items():
        several = isinstance(part, list)
        yield name, f"list of {type(part[0]).__name__}" if several else type(part).__name__, "Part; may be replaced."


def _about(spec: ParameterSpec) -> Iterator[str]:
    """Yield what there is to say of what a parameter may be."""
    kinds = {
        "direction": spec.direction,
        "text": spec.text,
        "numbers": spec.array,
        "whole number": spec.integer,
    }
    if spec.choices:
        yield "{" + ", ".join(map(repr, spec.choices)) + "}"
    elif spec.function_of:
        yield f"{_unit(spec.unit.text)}, function of {', '.join(spec.function_of)}"
    elif any(kinds.values()):
        yield next(kind for kind, is_so in kinds.items() if is_so)
    else:
        yield f"{spec.size} numbers in {_unit(spec.unit.text)}" if spec.size else _unit(spec.unit.text)
    for word, bound in (("at least", spec.minimum), ("above", spec.above), ("at most", spec.maximum)):
        if bound is not None:
            yield f"{word} {bound:g}"
    yield "required" if spec.default is MISSING else f"default {field_text(spec.default)}"


def _connectors(cls: Any) -> Iterator[tuple[str, str, str]]:
    for name, spec in cls._connectors.items():
        yield name, spec.kind.__name__ + (f", as many as {spec.count}" if spec.count else ""), spec.doc


def _quantities(cls: Any) -> Iterator[tuple[str, str, str]]:
    for law in cls._laws.values():
        if law.kind == "observable":
            yield law.name, _unit(law.options.unit), law.options.doc
        elif law.kind == "constraint":
            for reaction in law.options.reactions:
                yield reaction, _unit(law.options.unit), law.options.doc


def _unit(text: str) -> str:
    return "number" if text == "1" else text


def given_without_name(kind: str, parameters: Iterable[str], value: Any) -> ParameterError:
    """Return the error of a value that is given by its place, with the call that names the first parameter."""
    first = next(iter(parameters), "")
    call = f"{kind}({f'{first}={show(value)}' if first else ''})"
    return ParameterError("its parameters are given by name", where=kind, advice=f"Write {call}.")


def must_be_given(kind: str, spec: ParameterSpec) -> ParameterError:
    """Return the error of a parameter without default that was not given."""
    unit = "" if spec.unit.text == "1" else f" Unit {spec.unit.text}."
    return ParameterError(
        "it has no default and must be given", where=f"{kind}.{spec.name}", advice=f"{spec.name} is: {spec.doc}{unit}"
    )


def no_such_name(
    kind: str, path: str, name: str, there: Collection[str], connectors: Collection[str]
) -> MissingNameError:
    """Return the error that says what there is instead of a name: something alike, and the connectors."""
    close = near_matches(name, there)
    advice = suggestion(name, close) if close else ""
    if connectors:
        advice += f"{' ' if advice else ''}Its connectors are {', '.join(connectors)}."
    return MissingNameError(f"a {kind} has no {name!r}", where=path or kind, advice=advice)


def no_such_parameter(kind: str, path: str, name: str, known: Collection[str], otherwise: str = "") -> ParameterError:
    """Return the error of a name that is no parameter and no input, with advice where nothing is called alike."""
    advice = suggestion(name, known) or otherwise
    return ParameterError(f"a {kind} has no parameter {name!r}", where=path or kind, advice=advice)


def no_such_reaction(path: str, name: str, readable: Collection[str], is_rigid: bool) -> DeclarationError:
    """Return the error of a law that reads a reaction that it may not read."""
    advice = suggestion(name, readable)
    if is_rigid:
        advice = (
            "What passes through a rigid connection is worked out after the motion: hold the parts by a "
            "@constraint, whose reaction a force may read."
        )
    return DeclarationError(f"this law may not read the reaction {name!r}", where=path, advice=advice)


def no_private_name(kind: str, name: str, component: Any) -> AttributeError:
    """Return the error for a private name that a component does not have."""
    if name in ("_parent", "_name", "_settings", "_token"):
        advice = "Call super().__init__(**values) in it first; parameters need no __init__."
        return MissingNameError("its __init__ does not call that of Component", where=kind, advice=advice)
    return AttributeError(f"{kind!r} has no attribute {name!r}", name=name, obj=component)
