"""Parts: a page for each group of the library's parts, from what they declare; written when the site is built."""

from __future__ import annotations

import contextlib
import inspect
import re
import sys
from collections import defaultdict
from html import escape
from pathlib import Path
from typing import Any

from gallery import write
from part_scenes import code_of, mesh

from atwood import AtwoodError, Component, Result, equations, plot, plot_mechanism
from atwood.cli.parts import _synonyms, _tables, library_parts
from atwood_library.scenes import SCENES

PAGES = Path(__file__).parent / "parts"
_SECTIONS = re.compile(r"\n\n(?:Parameters|Connectors|Quantities)\n-+\n")
_NUMBER = r"\[\d+\]"
_SPACES = {"line": "on a line", "plane": "in a plane", "space": "in space"}
_TITLES = {"parts": "Bodies and masses"}
_LONG = 200
"""Operations of equations that are shown."""

_INTRODUCTION = """Every part of the library: what it is, its connectors, parameters, inputs and quantities, its names
elsewhere, a small scene that runs, with its picture and equations, and scenes that it is in. `atwood info NAME` shows
what it has, also by a name that Modelica or a textbook uses. All are names of `atwood_library`; the
[reference](../api/library.md) has the texts that `help` shows."""


def write_parts(*_: Any) -> None:
    """Write a page for each group of parts, and an index of all."""
    PAGES.mkdir(exist_ok=True)
    groups: dict[str, list[str]] = defaultdict(list)
    for name, kind in library_parts().items():
        groups[kind.__module__.rpartition(".")[0]].append(name)
    used, index = _scenes_of_parts(), ["# Parts", _INTRODUCTION]
    for module, names in groups.items():
        group = module.rpartition(".")[2]
        title = _TITLES.get(group, group.capitalize())
        told = inspect.cleandoc(sys.modules[module].__doc__ or "").partition("\n")[0]
        told = "" if told.endswith(" of the library.") else told
        sections = [_section(name, library_parts()[name], used[name]) for name in names]
        write(PAGES / f"{group}.md", "\n\n".join(one for one in (f"# {title}", told, *sections) if one) + "\n")
        lines = [f"- [{name}]({group}.md#{name.lower()}): {_first_line(library_parts()[name])}" for name in names]
        index += [f"## [{title}]({group}.md)", "\n".join(lines)]
    tree = ["```{toctree}", ":hidden:", "", *(module.rpartition(".")[2] for module in groups), "```"]
    write(PAGES / "index.md", "\n\n".join((*index, "\n".join(tree))) + "\n")


def _said(kind: type[Component]) -> str:
    """Return what a part says of itself, without its fields."""
    return _SECTIONS.split("\n\n" + inspect.cleandoc(kind.__doc__ or ""), maxsplit=1)[0].strip()


def _first_line(kind: type[Component]) -> str:
    return " ".join(_said(kind).partition("\n\n")[0].split())


def _section(name: str, kind: type[Component], scenes: list[str]) -> str:
    """Return what there is to say of a part."""
    where = [_SPACES[one] for one in kind.spaces] if set(kind.spaces) != set(_SPACES) else []
    parts = [f"## {name}", _said(kind), f"Only {' and '.join(where)}." if where else ""]
    parts.append(f"Also called: {', '.join(_synonyms(kind))}." if _synonyms(kind) else "")
    parts += _example(name)
    parts += [_table(heading, rows) for heading, rows in _tables(kind) if rows]
    links = ", ".join(f"[{one}](../gallery/{one}.md)" for one in scenes[:6])
    parts.append(f"In {links}{f' and {len(scenes) - 6} more scenes' if len(scenes) > 6 else ''}." if scenes else "")
    return "\n\n".join(one for one in parts if one)


def _example(name: str) -> list[str]:
    """Return a small scene with a part: how it is written, how it moves, and its equations."""
    code, known = code_of(name), dict[str, Any]()
    with contextlib.chdir(PAGES):  # where the file of its mesh is
        (PAGES / "wedge.stl").write_text(mesh(), encoding="utf-8")
        exec(code, known)
        result: Result = known["result"]
        signals = [path for path in ("source.value", "target.value", "way.value", "block.y") if path in result]
        figure = plot(result, signals) if "block" in known else plot_mechanism(result)
        figure.savefig(PAGES / f"{name}.png", dpi=64, bbox_inches="tight")
        formulas = _equations(result)
    picture = f"![{name} in a small scene]({name}.png)"
    return [f"```python\n{code}```", picture, f"```{{raw}} html\n{formulas}\n```"]


def _equations(result: Result) -> str:
    """Return the equations of a run as they are shown, or why they are not."""
    try:
        size = sum(result.first_plan.program.operations.values())
        if size > _LONG:
            return f"<p>Its equations, of {size} operations, are too long to be read here.</p>"
        found = equations(result.assembly)
    except AtwoodError as error:
        return f"<p>{escape(str(error))}</p>"
    return f"<details><summary>Its equations</summary>{found.html()}</details>"


def _table(heading: str, rows: list[dict[str, str]]) -> str:
    """Return a table of Markdown; its first column is headed by what it lists."""
    columns = [heading if one == "name" else one for one in rows[0]]
    lines = [" | ".join(columns), " | ".join("---" for _ in columns)]
    for row in rows:
        told = {name: text.replace("|", "\\|") for name, text in row.items()}
        told |= {"unit": told["unit"].replace("*", "\\*")} if "unit" in told else {}  # no emphasis
        first, *others = told.values()
        lines.append(" | ".join((f"`{re.sub(_NUMBER, '[...]', first)}`", *others)))
    lines = list(dict.fromkeys(lines))  # parts in a row have one line
    return "\n".join(f"| {line} |" for line in lines)


def _scenes_of_parts() -> dict[str, list[str]]:
    """Return in which scenes of the library a part is, by its name."""
    found: dict[str, list[str]] = defaultdict(list)
    for scene, kind in SCENES.items():
        for name in sorted({type(part).__name__ for part in _leaves(kind())}):
            found[name].append(scene)
    return found


def _leaves(model: Any) -> list[Any]:
    return [leaf for part in model.parts.values() for leaf in (_leaves(part) if hasattr(part, "parts") else [part])]


if __name__ == "__main__":
    write_parts()
