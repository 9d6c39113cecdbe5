"""Commands of theory: a scene in, and what a function of theory says of it out, as tables, text, JSON or a picture."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from atwood.arguments import FLAG, TEXT, Kind
from atwood.cli.command import PICTURE, Request, command, kinds_of
from atwood.cli.output import print_json, warn, writer
from atwood.cli.scenes import pairs, prepare, warn_of_radians
from atwood.display import plain
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import lagrangian_of
from atwood.lazy_dataclasses import replace
from atwood.pipeline import assemble
from atwood.ranges import range_of
from atwood.table import Shown
from atwood.theory.formulas.described import Described, Page, Paged, attributes, is_formula, is_theory, page_of
from atwood.theory.formulas.mathml import document
from atwood.theory.formulas.named import NAMED
from atwood.theory.formulas.notation import notation_of
from atwood.theory.formulas.tree import Symbol
from atwood.theory.hamiltonian.hamiltonian import read_hamiltonian
from atwood.theory.linear.branches import equilibrium_branches
from atwood.theory.linear.equilibria import equilibria
from atwood.theory.linear.normal_modes import NormalModes, normal_modes

_WRITTEN = ("latex", "markdown", "html", "python")
"""Languages in which results are written down, each an option; Python where they can be."""

_PICTURES = {
    "EquilibriumBranches": "plot_branches",
    "FreeRotation": "plot_free_rotation",
    "LinearModel": "plot_bode",
    "NormalModes": "plot_mode",
    "PhaseCloud": "plot_phase_cloud",
    "PhasePortrait": "plot_phase_portrait",
    "PoincareSection": "plot_section",
    "ReducedMotion": "plot_effective_potential",
    "RootLocus": "plot_root_locus",
}
"""Functions of `atwood` that draw results, by their classes."""

_PICTURES_OF_SCENES = {
    "Action": ("simulate", "plot"),
    "ActionAngle": ("phase_portrait", "plot_phase_portrait"),
    "EquationsOfMotion": ("simulate", "plot_mechanism"),
    "Hamiltonian": ("phase_portrait", "plot_phase_portrait"),
    "JoiningMotion": ("", "plot"),
    "Routhian": ("reduced", "plot_effective_potential"),
    "SymmetricTop": ("reduced", "plot_top_path"),
}
"""What is drawn beside formulas, by their classes: a function of the scene (none for a run that a value holds), and the
function that draws what it gives."""

_MOST_PICTURES = 12


def theory_command(name: str, module: str, function: str) -> click.Command:
    """Return the command of a function of theory: its arguments are options, and its scene is the argument."""
    found = getattr(importlib.import_module(module), function)
    of = found.__annotations__["return"].split(" | ")
    made = [vars(importlib.import_module(module)).get(one) for one in of]
    written = [one for one in _WRITTEN if one != "python" or any(hasattr(kind, one) for kind in made)]
    more: dict[str, tuple[Kind, Any]] = dict.fromkeys(written, (FLAG, False))
    more |= {"plot": PICTURE, "named": (NAMED, None)}
    special, own = _SPECIAL.get(name, (None, {}))

    def run(request: Request) -> None:
        written = [one for one in (*_WRITTEN, "as_json") if getattr(request, one, False)]
        if len(written) > 1:
            names = " and ".join(f"--{one.removeprefix('as_')}" for one in written)
            raise UsageError(f"{names} do not go together", advice="Give one of them.")
        if request.named and {"python", "as_json"}.intersection(written):
            raise UsageError(
                "there names stand as they are", where="--named", advice="Give --latex or --html, or none."
            )
        asked, scene = _read(found, request)
        value = _called(found, scene, asked) if special is None else special(found, scene, asked, request)
        if request.plot is not None:
            _draw(value, name, scene, request.plot, asked.get("t_end"))
        if request.named:
            value = [_page(one, scene).named(request.named) for one in _each(value)]
        _show(value, name, scene, written[0] if written else "", request.plot)

    run.__doc__ = inspect.cleandoc((special or found).__doc__ or "").partition("\n\nParameters\n")[0]
    told = [*([special] if special else []), _show, found]
    names = {"named": "--named"} | ({"plot": "--bode,--plot"} if of == ["LinearModel"] else {})
    return command(name, run, *told, more=more | own, names=names)


def _read(function: Callable[..., Any], request: Request) -> tuple[dict[str, Any], Assembly]:
    """Return the arguments that were given, and the scene, assembled as they ask for it."""
    scene, name = prepare(request.scene, request.settings, request.start_values)
    asked = {key: value for key, value in request.of(function).items() if value is not None}
    for key, value in asked.items():
        if kinds_of(function)[key].word == "PATH=VALUE" and isinstance(value, Mapping):
            for path, text in value.items():
                warn_of_radians(scene, path, [text], f"--{key}", text)
    given = {key: asked[key] for key in ("form", "orientation") if key in asked}
    return asked, assemble(scene, name=name, **given)


def _called(function: Callable[..., Any], scene: Assembly, asked: Mapping[str, Any]) -> Any:
    """Call a function of theory with a scene, or with what it takes in place of one."""
    made = {key: kind.of_scene(scene) for key, kind in kinds_of(function).items() if kind.of_scene is not None}
    if "scene" in kinds_of(function):
        made["scene"] = scene
    return function(**made, **asked)


# -- commands with more than their function ----------------------------------------------------------------------------


def _equations(function: Callable[..., Any], scene: Assembly, asked: dict[str, Any], request: Request) -> Any:
    """Write the equations of motion of SCENE: Lagrange's equations, with symbols as in a textbook.

    In space, --orientation euler-zxz gives them in Euler angles; else angular velocities are in the axes of the body.
    """
    if request.values:
        asked["parameters"] = "values"
    if not request.hamiltonian:
        return _called(function, scene, asked)
    if request.python:
        raise UsageError("--hamiltonian is not written in Python", advice="Give --latex, --markdown or --json.")
    return read_hamiltonian(scene, asked["parameters"], asked.get("symbols"), asked["by_part"], asked.get("gauge"))


def _equilibria(function: Callable[..., Any], scene: Assembly, asked: dict[str, Any], request: Request) -> Any:
    """Find the equilibria of SCENE, and whether they are stable."""
    if request.along is None:
        if request.plot is not None:
            raise UsageError("there is nothing to draw", where="--plot", advice="Give --along PATH=FROM:TO too.")
        return _called(function, scene, asked)
    if request.symbolic:
        raise UsageError("--along is of numbers", advice="Leave out --symbolic, or --along.")
    ((path, text),) = pairs([request.along], "--along")
    low, high = range_of(text)
    if isinstance(low, str) or isinstance(high, str):
        raise UsageError(f"{text!r} is no range", where=path, advice="Write --along PATH=FROM:TO, SI units.")
    region = {"region": asked["region"]} if "region" in asked else {}
    return equilibrium_branches(scene, path, (low, high), **region)


def _modes(function: Callable[..., Any], scene: Assembly, asked: dict[str, Any], request: Request) -> Any:
    """Show the normal modes of SCENE: about its start if it is at rest there, else about its stable equilibria."""
    if asked.get("symbolic"):
        return _called(function, scene, asked)
    return modes_of_scene(scene, "at" in asked, lambda: _called(function, scene, asked))


def modes_of_scene(
    scene: Assembly, is_said: bool = False, about: Callable[[], NormalModes] | None = None
) -> list[NormalModes]:
    """Return the modes about what is said, or about the start if it is at rest, else about all stable equilibria."""
    try:
        return [normal_modes(scene) if about is None else about()]
    except UsageError as error:
        found = [] if is_said else [one.modes for one in equilibria(scene) if one.stable]
        if not found:
            raise error
        return found


_SPECIAL: dict[str, tuple[Callable[..., Any], dict[str, tuple[Kind, Any]]]] = {
    "equations": (_equations, {"values": (FLAG, False), "hamiltonian": (FLAG, False)}),
    "equilibria": (_equilibria, {"along": (replace(TEXT, word="PATH=FROM:TO"), None)}),
    "modes": (_modes, {}),
}
"""What commands do beside calling their function, and their further options."""


# -- what is shown -----------------------------------------------------------------------------------------------------


def _show(value: Any, command: str, assembly: Assembly, written: str, picture: Path | None) -> None:
    """Write what was found to standard output, and draw it."""
    scene = assembly.flat.name
    several = _each(value)
    if written == "as_json":
        print_json(_data(value, command, scene))
        return
    if written:
        pages = [_as_written(one, written, assembly) for one in several]
        text = document(f"{scene}: {command}", "\n".join(pages)) if written == "html" else "\n".join(pages)
        click.echo(text, nl=not text.endswith("\n"))
        return
    out = writer()
    for number, one in enumerate(several):
        if number:
            out.line()
        says = vars(type(one)).get("__str__")
        if isinstance(one, Shown) and says in (None, Shown.as_text):
            out.show(*one.tables())
        elif hasattr(one, "text") or is_formula(one) or all("__str__" not in vars(b) for b in type(one).__mro__[:-1]):
            out.line((_as_written(one, "text", assembly), ""))
        else:
            out.line((str(one), ""))
    if picture is not None:
        out.files(plotted=picture)
    elif type(several[0]).__name__ == "PhasePortrait":
        out.line(("Draw it with --plot phase.png.", "dim"))


def _each(value: Any) -> Sequence[Any]:
    """Return what is shown one after another."""
    return value if isinstance(value, (list, tuple)) and not isinstance(value, Shown) else [value]


def _page(value: Any, assembly: Assembly) -> Page:
    """Return the page of what a value holds, in the letters of its scene, or its own."""
    if isinstance(value, Paged) and not isinstance(value, Described):
        return value._page  # type: ignore[no-any-return]

    def known() -> dict[str, Symbol]:
        return {one.name: one for one in notation_of(assembly, lagrangian_of(assembly, assembly.form)).legend}

    return page_of(value, f"{assembly.flat.name}: {_words(value)}", known)


def _as_written(value: Any, language: str, assembly: Assembly) -> str:
    """Return a value in a language, as it writes itself, or by its tables, or as the page of what it holds."""
    if hasattr(value, language) and not isinstance(value, Described):
        return str(getattr(value, language)())
    if not isinstance(value, Shown):
        return str(getattr(_page(value, assembly), language)())
    if language == "latex":
        return "\n\n".join(one.latex() for one in value.tables())
    return value._repr_html_() if language == "html" else f"```text\n{value.as_text()}\n```"


def _words(value: Any) -> str:
    """Return the name of a class in words."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(value).__name__).lower()
    return "result" if words in ("add", "mul", "pow") else words


def _draw(value: Any, command: str, scene: Assembly, file: Path, t_end: Any) -> None:
    """Draw what was found, or the motion that it is of; every mode in a picture of its own, numbered where several."""
    engine = importlib.import_module("atwood")
    first: Any = next(iter(_each(value)), None)
    kind = type(first).__name__
    if kind in _PICTURES_OF_SCENES:
        how, draw = _PICTURES_OF_SCENES[kind]
        given = {} if t_end is None else {"t_end": t_end}
        found = getattr(engine, how)(scene, **given) if how else getattr(first, "result", None)
        getattr(engine, draw)(found, file=file)
        return
    if kind not in _PICTURES:
        motions = "Leave it out; `atwood phase`, `atwood reduced` and `atwood run` draw motions."
        advice = "Leave out --symbolic." if kind.startswith("Symbolic") else motions
        raise UsageError(f"what `{command}` finds here is not drawn", where="--plot", advice=advice)
    draw = getattr(engine, _PICTURES[kind])
    if draw.__name__ != "plot_mode":
        draw(first, file=file)
        return
    count = len(first)
    if count > _MOST_PICTURES:
        warn(f"only the first {_MOST_PICTURES} of {count} modes are drawn")
    for mode in range(min(count, _MOST_PICTURES)):
        draw(first, mode, file if count == 1 else file.with_name(f"{file.stem}-{mode}{file.suffix}"))


def _data(value: Any, command: str, scene: str) -> dict[str, Any]:
    """Return what was found as plain data."""
    if isinstance(value, (list, tuple)):
        return {"scene": scene, command: [_as_data(one) for one in value]}
    found = _as_data(value)
    told: dict[str, Any] = found if isinstance(found, dict) else {command: found}
    return told if hasattr(value, "to_data") or hasattr(value, "to_dict") else {"scene": scene, **told}


def _as_data(value: Any) -> Any:
    """Return a value as it says itself, or by what it holds."""
    if hasattr(value, "to_data") or hasattr(value, "to_dict") or not str(type(value).__module__).startswith("atwood"):
        return plain(value)
    held = {name: _as_data(one) if is_theory(one) else plain(one) for name, one, _ in attributes(value)}
    return held or plain(value)
