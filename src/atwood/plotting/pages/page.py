"""A page of a scene that moves in the browser: one file, from results or from a scene."""

from __future__ import annotations

import base64
import inspect
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any, Literal

import numpy as np

from atwood.arguments import FILE, TEXT, Kind, Refused, each, one_of, optional, takes
from atwood.errors import AtwoodError, UsageError, check_known
from atwood.files import check_target, write_atomically
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.model.declare.component import Component
from atwood.pipeline import simulate
from atwood.plotting.diagram import draw_diagram
from atwood.plotting.live import LiveProgram, engine_script, live_program
from atwood.plotting.live.parameters import with_sliders
from atwood.plotting.pages.document import kept_text, write_document
from atwood.plotting.pages.stage import Stage, set_stage
from atwood.plotting.pages.still import still_picture
from atwood.result.files import SavedResult
from atwood.result.result import Result

_LARGEST = 20e6
"""Bytes of a page."""

_LONG = 600
"""A page shows no equations of more operations."""


def _scene_or_results(value: Any) -> Any:
    if isinstance(value, (Model, Assembly, Result, SavedResult)):
        return value
    values = list(value.values()) if isinstance(value, Mapping) else list(value) if isinstance(value, Sequence) else []
    if not values or not all(isinstance(one, (Result, SavedResult)) for one in values):
        raise Refused
    return value


SHOWN = Kind("a scene, a Result, a list of them, or a dictionary of them by name", _scene_or_results)
PATH_LIST = replace(each(TEXT, "paths of quantities, such as 'rod1.angle'"), word="PATH")
SLIDERS = replace(each(TEXT, "paths, such as 'rod1.length' or 'rod1.length=0.5:2'"), word="PATH")


@dataclass(frozen=True, eq=False)
class Page:
    """A page; notebooks show it in a frame.

    Attributes
    ----------
    html
        The whole page.
    mode
        ``"live"`` where the browser solves the equations, else ``"recorded"``.
    reason
        Why it is recorded.
    file
        Where it was saved; None if it was not.
    """

    html: str
    mode: str
    reason: str = ""
    file: Path | None = None

    def save(self, file: str | os.PathLike[str]) -> Page:
        """Save it as a file, and return the page with it."""
        target = Path(file)
        check_page(target)
        write_atomically(target, lambda part: part.write_text(self.html, encoding="utf-8"))
        return replace(self, file=target)

    def __fspath__(self) -> str:
        if self.file is None:
            raise TypeError("this page was not saved: give it a file")
        return str(self.file)

    def __repr__(self) -> str:
        return f"<Page, {self.mode}, {len(self.html) / 1000.0:.0f} kB{f', {self.file}' if self.file else ''}>"

    def _repr_html_(self) -> str:
        address = "data:text/html;base64," + base64.b64encode(self.html.encode()).decode()
        return f'<iframe src="{address}" title="moving scene" style="width:100%;height:640px;border:0"></iframe>'


@takes(
    scene=SHOWN,
    file=optional(FILE),
    show=PATH_LIST,
    sliders=SLIDERS,
    live=one_of(("auto", "never")),
)
def page(
    scene: Model | Assembly | Result | SavedResult | Sequence[Result] | Mapping[str, Result],
    file: str | os.PathLike[str] | None = None,
    *,
    show: str | Sequence[str] = (),
    sliders: str | Sequence[str] = (),
    live: Literal["auto", "never"] = "auto",
) -> Page:
    """Return a page that shows a scene moving: picture, curves, values, energies, equations and parts, in one file.

    The page asks for nothing from any network and needs no library beside it. Several results are shown together.

    Parameters
    ----------
    scene
        A scene, which is simulated; its assembly; a result, also one that was read from a file, which is simulated
        again; or several results, which may have names.
    file
        Where to save it (``.html``).
    show
        Paths of quantities whose curves and values are shown first.
    sliders
        What can be set by a slider, where the page is live: paths of parameters and starts, with bounds in SI units
        where these are not those that are declared, such as ``"rod1.length=0.5:2"``.
    live
        ``"never"`` for a page that only plays what was recorded.

    Returns
    -------
    Page
        The page.

    Raises
    ------
    UsageError
        If a path is not known, bounds are the wrong way round, the file cannot be written, or the page would be larger
        than 20 MB.
    """
    target = None if file is None else Path(file)
    if target is not None:
        check_page(target)
    results = _results(scene)
    for one in results.values():
        if one.assembly.mechanism.space.name != next(iter(results.values())).assembly.mechanism.space.name:
            raise UsageError("results in a plane and in space have no common picture", advice="Make a page of each.")
    known = list(dict.fromkeys(path for one in results.values() for path in one.paths))
    shown = [known_path(path, known) for path in show]
    bounds = dict(map(read_slider, sliders))
    made = make_page(results, shown, bounds, live)
    if len(made.html) > _LARGEST:
        raise UsageError(
            f"the page would have {len(made.html) / 1e6:.0f} MB, and at most {_LARGEST / 1e6:.0f} are written",
            advice="Ask for fewer outputs of the run (outputs=201), or for fewer results.",
        )
    return made if target is None else made.save(target)


def check_page(file: Path) -> None:
    """Refuse a file that could not be written, before any work is done."""
    check_target(file, (".html", ".htm"), "Use .html.")


def _results(scene: Any) -> dict[str, Result]:
    if isinstance(scene, Mapping) and not isinstance(scene, (Result, SavedResult)):
        return {str(name): _result(one) for name, one in scene.items()}
    if not isinstance(scene, Sequence):
        result = _result(scene)
        return {result.method: result}
    scene = [_result(one) for one in scene]
    names = [f"{one.assembly.flat.name}, {one.method}" for one in scene]
    again = len(set(names)) < len(names)
    labels = [f"{k}: {name}" if again else name for k, name in enumerate(names, 1)]
    return dict(zip(labels, scene, strict=True))


def _result(one: Model | Assembly | Result | SavedResult) -> Result:
    """Return a run: of a scene, or again of a file that holds one."""
    if isinstance(one, Result):
        return one
    return simulate(one.scene(), **one.settings()) if isinstance(one, SavedResult) else simulate(one)


def known_path(path: str, known: Sequence[str]) -> str:
    """Return a path, or refuse one that is no quantity."""
    check_known(path, known, f"there is no quantity {path!r}", where="show")
    return path


_BOUNDS = re.compile(r"(?P<path>[^=]+)(=(?P<low>[^:=]+):(?P<high>[^:=]+))?")


def read_slider(text: str) -> tuple[str, tuple[float, float] | None]:
    """Return the path of a slider and its bounds, if it says any."""
    found = _BOUNDS.fullmatch(text.strip())
    try:
        assert found is not None
        limits = None if found["low"] is None else (float(found["low"]), float(found["high"]))
    except (AssertionError, ValueError):
        advice = "Write PATH or PATH=FROM:TO, with numbers in SI units, such as rod1.length=0.5:2."
        raise UsageError(f"{text!r} is no slider", where="sliders", advice=advice) from None
    if limits is not None and not -np.inf < limits[0] < limits[1] < np.inf:
        raise UsageError(
            f"its bounds {limits[0]:g} and {limits[1]:g} are the wrong way round, or the same",
            where=f"sliders, {found['path']}",
            advice="Write the lower one first.",
        )
    return found["path"].strip(), limits


# -- what it holds --------------------------------------------------------------------------------------------------


def make_page(
    results: Mapping[str, Result],
    shown: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float] | None] | None = None,
    live: str = "auto",
    library: str = "",
) -> Page:
    """Return the page of results; `library` says where pages of one site find what draws."""
    made = page_content(results, shown, bounds or {}, live)
    html = write_document(made.payload, still_picture(made.stage, made.payload["title"]), made.modules, library)
    return Page(html, "live" if made.modules else "recorded", made.program.reason)


@dataclass(frozen=True, eq=False)
class Content:
    """What a page of results shows as data, its own modules, the stage of the first one, and its live program."""

    payload: Mapping[str, Any]
    modules: Mapping[str, str]
    stage: Stage
    program: LiveProgram


def page_content(
    results: Mapping[str, Result], shown: Sequence[str], bounds: Mapping[str, tuple[float, float] | None], live: str
) -> Content:
    """Return what a page of results holds."""
    first = next(iter(results.values()))
    stages = [set_stage(one) for one in results.values()]
    program = _live(results, bounds, live)
    modules = {}
    if program.model:
        modules = {
            "engine": kept_text("engine", _engine_sources(), engine_script) + "\nexport { createEngine };",
            "model": f"export const model = {program.model};",
        }
    equations, latex = _equations(first)
    name = first.assembly.flat.name
    payload = {
        "title": name,
        "name": re.sub(r"[^\w.-]+", "-", name),
        "facts": _facts(first),
        "reason": program.reason,
        "rtol": first.run.options.relative_tolerance,
        "show": list(shown) or _first_shown(first),
        "sliders": bounds,
        "runs": [
            run_data(label, one, stage, not program.model)
            for (label, one), stage in zip(results.items(), stages, strict=True)
        ],
        "equations": equations,
        "latex": latex,
        "diagram": draw_diagram(first.assembly),
        "about": _about(first),
        "report": repr(first),
    }
    return Content(payload, modules, stages[0], program)


def _live(results: Mapping[str, Result], bounds: Mapping[str, object], live: str) -> LiveProgram:
    """Return the scene as a program of the page, or why it is none."""
    first = next(iter(results.values())).assembly
    if live == "auto" and len(results) == 1:
        return live_program(first, sliders=list(bounds), drag=True)
    with_sliders(first, list(bounds))  # refuses what is none
    reason = "a record was asked for" if live == "never" else "several results are compared"
    return LiveProgram(first.flat.name, first.form, reason)


def _engine_sources() -> Iterator[bytes]:
    """Yield what the engine's text is made by."""
    root = Path(__file__).parents[2]
    for room in ("codegen", "integrators", "numerics", "plotting/live"):
        yield from (file.read_bytes() for file in sorted((root / room).rglob("*")) if file.suffix in (".py", ".js"))


def _facts(result: Result) -> str:
    return f"{result.method}; energy: {result.energy.describe()}"


def _first_shown(result: Result) -> list[str]:
    """Return what is shown where nothing is asked for: the first coordinates."""
    names = [one.name for one in result.assembly.own_equations.names]
    found = [name for name in names if name in result]
    return (found or list(result.paths))[:3]


def run_data(label: str, result: Result, stage: Stage, is_whole: bool) -> dict[str, Any]:
    """Return what a page holds of a result; of one that it computes itself, how it begins."""
    shown = slice(None) if is_whole else slice(0, 2)
    table = result.table()
    ledger = result.energy
    return {
        "label": label,
        "stage": stage.to_data(),
        "time": result.time[shown],
        "poses": stage.poses[shown].transpose(1, 2, 0).astype(np.float32),  # one number after another along the run
        "quantities": {
            "paths": list(table),
            "units": [result.unit(path) for path in table],
            "values": np.array(list(table.values()))[:, shown],
        },
        "events": [{"time": one.time, "part": one.part, "message": one.message} for one in result.events],
        "energy": {name: getattr(ledger, name)[shown] for name in ("kinetic", "potential", "work")},
        "parts": list(_parts(result.assembly)),
    }


def _parts(assembly: Assembly) -> Iterator[dict[str, Any]]:
    """Yield what the parts are, with their parameters and connectors."""
    for path, part in assembly.flat.parts.items():
        component: Component = part.component
        doc = (inspect.getdoc(type(component)) or "").partition("\n")[0]
        given = [(name, spec, part.values[name]) for name, spec in component.parameter_specs().items()]
        parameters = [
            {"name": name, "value": _shown(value), "unit": spec.unit.text.removeprefix("1"), "doc": spec.doc}
            for name, spec, value in given
            if value is not None
        ]
        names = list(component.connectors())
        kind = type(component).__name__
        yield {"path": path, "kind": kind, "doc": doc, "connectors": names, "parameters": parameters}


def _shown(value: Any) -> str:
    """Return a parameter's value as text: of a function the text that it was given as."""
    return f"{value:.6g}" if isinstance(value, float) else str(getattr(value, "text", value))


def _equations(result: Result) -> tuple[str, str]:
    """Return the equations of motion as MathML and as LaTeX, or why there are none here."""
    from atwood.theory.equations.equations import equations

    try:
        size = sum(result.first_plan.program.operations.values())
        if size > _LONG:
            told = f"They are too long to be read here ({size} operations); `atwood equations` writes them."
            return f"<p>{told}</p>", ""
        found = equations(result.assembly)
        return found.html(), found.latex()
    except AtwoodError as error:
        return f"<p>{escape(str(error))}</p>", ""


def _about(result: Result) -> list[list[str]]:
    """Return a table of how the motion was found."""
    return [
        ["scene", result.assembly.flat.name],
        ["form and solver", result.method],
        ["why this solver", result.solver],
        ["relative tolerance", f"{result.run.options.relative_tolerance:g}"],
        ["time", f"{result.time[0]:g} to {result.time[-1]:g} s, {len(result.time)} output times"],
        ["steps", str(result.statistics.steps)],
        ["energy", result.energy.describe()],
        ["status", result.status.replace("_", " ") + (f": {result.message}" if result.message else "")],
    ]
