"""`atwood list --parts` and `atwood info PART`: the parts of the libraries, and what each of them has."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from atwood.cli.output import print_json, writer
from atwood.cli.scenes import bundled_scenes
from atwood.errors import UsageError, near_matches, suggestion
from atwood.model.compose.composite import Model
from atwood.model.compose.serialization import all_libraries
from atwood.model.declare.component import Component
from atwood.model.declare.fields import MISSING
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.table import table

_EVERYWHERE = ("line", "plane", "space")


def looks_like_a_part(text: str) -> bool:
    """Return whether a word is written as the classes of parts are, and not as scenes or files."""
    return text.isidentifier() and text[0].isupper()


def library_parts() -> dict[str, type[Component]]:
    """Return the parts that the installed libraries offer, by name, in the order of where they are defined."""
    found: dict[str, type[Component]] = {}
    for library in all_libraries():
        try:
            module = importlib.import_module(library)
        except ImportError as error:
            raise UsageError(f"the library cannot be loaded ({error})", where=library) from error
        offered = [getattr(module, name) for name in getattr(module, "__all__", ())]
        kinds = [kind for kind in offered if isinstance(kind, type) and issubclass(kind, Component)]
        for kind in sorted(kinds, key=lambda kind: kind.__module__):
            found.setdefault(kind.__name__, kind)
    return found


def is_a_part(text: str) -> bool:
    """Return whether a word means a part: by how it is written, or as a synonym that no scene has for its name."""
    if looks_like_a_part(text):
        return True
    return not text.endswith(".py") and ":" not in text and text not in bundled_scenes() and bool(parts_called(text))


def parts_called(name: str) -> dict[str, type[Component]]:
    """Return the parts of a name: the one part that has it, or those that textbooks or Modelica call so.

    Of a name with dots, such as ``Modelica.Mechanics.Rotational.Components.Spring``, and of synonyms with dots, the
    shorter has to be the end of the longer. Of several parts those are meant that agree in most of it.
    """
    kinds = library_parts()
    own_names = [one for one in kinds if one == name] or [one for one in kinds if _plain(one) == _plain(name)]
    if own_names:
        return {one: kinds[one] for one in own_names}
    agree = {own: _agreement(name, (*([own] if "." in name else ()), *_synonyms(kind))) for own, kind in kinds.items()}
    most = max(agree.values(), default=0)
    return {own: kinds[own] for own, steps in agree.items() if most and steps == most}


def _agreement(name: str, words: Iterable[str]) -> int:
    """Return in how many steps, from its end, a name agrees with one of several; zero if neither is the other's end."""
    asked, most = [_plain(step) for step in name.split(".")], 0
    for word in words:
        steps = [_plain(step) for step in word.split(".")]
        count = min(len(asked), len(steps))
        if asked[-count:] == steps[-count:]:
            most = max(most, count)
    return most


def _synonyms(kind: type[Component]) -> tuple[str, ...]:
    """Return what else a part is called; what the class that it is derived from is called is another thing."""
    found: tuple[str, ...] = vars(kind).get("synonyms", ())
    return found


def _plain(name: str) -> str:
    return re.sub(r"[\W_]", "", name).casefold()


def mentioning(word: str) -> list[tuple[str, str, str]]:
    """Return parts and scenes in whose names, synonyms or first lines a word occurs: what it is, its name, the line."""
    asked = _plain(word)
    parts = [("part", name, said(kind)[0], _synonyms(kind)) for name, kind in library_parts().items()]
    scenes = [("scene", name, said(kind)[0], ()) for name, kind in bundled_scenes().items()]
    return [
        (what, name, line)
        for what, name, line, more in (*parts, *scenes)
        if asked in _plain("".join((name, line, *more)))
    ]


def list_parts(as_json: bool) -> None:
    """Show the parts of the installed libraries, with one line each."""
    parts = library_parts()
    if as_json:
        rows = ((name, said(kind)[0], list(_synonyms(kind))) for name, kind in parts.items())
        print_json({"parts": [dict(zip(("name", "summary", "synonyms"), row, strict=True)) for row in rows]})
        return
    listed, before = [], ""
    for name, kind in parts.items():
        group = kind.__module__.split(".")[-2]
        listed.append(("" if group == before else group, name, said(kind)[0]))
        before = group
    writer().show(table(("", "", "~"), listed))


def show_part(name: str, as_json: bool, changed: bool = False) -> None:
    """Show what a part has: connectors, parameters, inputs, and the quantities that results have of it."""
    found = parts_called(name)
    if not found:
        raise _no_such_part(name)
    if changed:
        raise UsageError(
            "--set, --start and --moved are for scenes, and this is a part", where=name, advice="Leave them out."
        )
    if as_json:
        shown = [
            {
                "part": own,
                "synonyms": list(_synonyms(kind)),
                "spaces": kind.spaces,
                "text": " ".join(said(kind)),
                **{heading: rows for heading, rows in _tables(kind) if rows},
            }
            for own, kind in found.items()
        ]
        print_json(shown[0] if len(shown) == 1 else {"parts": shown})
        return
    for own, kind in found.items():
        _print_part(own, kind)


def _print_part(name: str, kind: type[Component]) -> None:
    out, tables = writer(), {heading: rows for heading, rows in _tables(kind) if rows}
    out.line((name, "bold"), (_only_in(kind.spaces), ""))
    out.line(("\n".join(said(kind)), ""))
    if _synonyms(kind):
        out.line((f"Also called: {', '.join(_synonyms(kind))}.", ""))
    for heading, rows in tables.items():
        names = {"name": heading, "meaning": "meaning~"}
        out.line()
        out.show(table([names.get(column, column) for column in rows[0]], (row.values() for row in rows)))


def _no_such_part(name: str) -> UsageError:
    """Return the error for a name that is no part; it may be the class of a scene."""
    scene = next((scene for scene, kind in bundled_scenes().items() if kind.__name__ == name), "")
    kinds = library_parts()
    known = [*kinds, *(word for kind in kinds.values() for word in _synonyms(kind))]
    advice = suggestion(name, known) if near_matches(name, known) else "See `atwood list --parts`."
    return UsageError("there is no such part", where=name, advice=f"The scene is {scene!r}." if scene else advice)


def _tables(kind: type[Component]) -> Iterator[tuple[str, list[dict[str, str]]]]:
    """Yield the headings and rows of what a part has."""
    yield (
        "connectors",
        [
            {
                "name": f"{name}[...]" if one.count else name,
                "kind": one.kind.__name__,
                "meaning": one.doc + _only_with(one),
            }
            for name, one in kind.connector_specs().items()
        ],
    )
    yield (
        "parameters",
        [
            {"name": name, "default": _value(one), "unit": _unit(one.unit.text), "meaning": one.doc + _read_by(one)}
            for name, one in kind.parameter_specs().items()
        ],
    )
    yield (
        "inputs",
        [{"name": name, "unit": _unit(one.unit.text), "meaning": one.doc} for name, one in kind.signal_specs().items()],
    )
    yield "quantities", list(_quantities(kind))
    yield "parts", list(_own_parts(kind))


def _own_parts(kind: type[Component]) -> Iterator[dict[str, str]]:
    """Yield the parts of a part that is made of others; their quantities are read as ``part.quantity``."""
    if issubclass(kind, Model):
        for name, part in kind().parts.items():
            yield {"name": name, "kind": type(part).__name__, "meaning": said(type(part))[0]}


def _quantities(kind: type[Component]) -> Iterator[dict[str, str]]:
    """Yield what results have of a part: what it observes, and the reactions of its constraints."""
    for law in kind.laws("observable"):
        options: Any = law.options
        yield {"name": law.name, "unit": _unit(options.unit), "meaning": options.doc + _only_in(options.spaces)}
    for law in kind.laws("constraint"):
        options = law.options
        for reaction in options.reactions:
            yield {"name": reaction, "unit": _unit(options.unit), "meaning": options.doc + _only_in(options.spaces)}


def _value(one: Any) -> str:
    """Return the default of a parameter as a reader writes it."""
    if one.default is MISSING:
        return "required"
    if one.default is None:
        return "none"
    if isinstance(one.default, ParameterExpression):
        return "follows"
    if one.array:
        return f"{len(one.default)} {'rows' if isinstance(one.default[0], tuple) else 'numbers'}"
    if isinstance(one.default, tuple):
        return f"({', '.join(f'{number:g}' for number in one.default)})"
    if one.function_of:
        return f"{one.default} (a function)"
    chosen = one.default if isinstance(one.default, str) else f"{one.default:g}"
    others = [word for word in one.choices if word != chosen]
    return f"{chosen} (or {', '.join(others)})" if others else chosen


def _read_by(one: Any) -> str:
    """Return what a parameter that is a function is a function of."""
    return f" A function of {', '.join(one.function_of)}." if one.function_of else ""


def _unit(text: str) -> str:
    return "" if text == "1" else text


def _only_in(spaces: Sequence[str]) -> str:
    """Return where alone something exists, or nothing if it exists everywhere."""
    return "" if set(spaces) == set(_EVERYWHERE) else f" ({' and '.join(spaces)} only)"


def _only_with(connector: Any) -> str:
    """Return with which words of which choices alone a connector is there."""
    told = [f"{choice}={' or '.join(words)}" for choice, words in connector.when.items()]
    return f" (with {', '.join(told)})" if told else ""


def said(kind: type) -> list[str]:
    """Return what a class says about itself, line by line."""
    lines = (kind.__doc__ or "").strip().split("\n")
    return [line.strip() for line in lines]
