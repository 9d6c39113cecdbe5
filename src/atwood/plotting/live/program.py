"""A scene as JavaScript that goes on by itself: equations, projection, quantities, places and turns.

What is live is computed by the programs and routines of `simulate`, printed in another language. A scene that needs
more than that is not live, and says why.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field
from importlib.resources import files
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.javascript.printer import print_routines
from atwood.errors import AtwoodError
from atwood.forms.assembly import Assembly
from atwood.integrators.embedded.stepper import FIELDS
from atwood.integrators.embedded.steps import write_routines as write_steps
from atwood.integrators.event_location import FIELDS as SEARCH_FIELDS, MOST, ROWS as SEARCH_ROWS, STACK
from atwood.integrators.event_routines import write_routines as write_search
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.integrators.sets import record as sets
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import assembly_of
from atwood.plotting.live.mode import ModeText, NotLiveError, bodies_of, plan_of
from atwood.plotting.live.modes import add_modes
from atwood.plotting.live.parameters import live_parameters, with_sliders, with_zeros
from atwood.plotting.live.pulls import with_pulls
from atwood.plotting.live.start import add_start, add_tangent
from atwood.plotting.live.updates import add_updates
from atwood.simulation.contacts.groups import refuse_groups
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.initialization.start import Start, settle, start_with_line_signs
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.run.run import choice_at_start

_OF_QUANTITIES = "path", "unit", "doc", "periodic", "sharing"
"""What pages know of a quantity; see `atwood.mechanics.outputs.observables.Observable`."""

_POINTS = STACK + MOST + 2
"""Points that a search for events remembers."""


@dataclass(frozen=True, eq=False)
class LiveProgram:
    """A scene that a page can compute itself, or why it cannot.

    Attributes
    ----------
    name, form
        The scene, and the form of its equations.
    reason
        Why it is not live, with component and law; empty where it is.
    model
        A JavaScript expression, an object literal with data and functions: what ``createEngine`` takes. Empty where
        the scene is not live.
    data
        The data in it.
    """

    name: str
    form: str
    reason: str = ""
    model: str = ""
    data: Mapping[str, Any] = field(default_factory=dict)


def engine_script() -> str:
    """Return the JavaScript that runs every live scene: it defines ``createEngine``."""
    engine = files("atwood.plotting.live").joinpath("engine.js").read_text(encoding="utf-8")
    names: dict[str, object] = {"FIELD": _numbered(FIELDS), "ROW": TABLEAU.rows, "SOUGHT": _numbered(SEARCH_FIELDS)}
    names |= {"SEARCHED": SEARCH_ROWS, "POINTS": _POINTS, "SETS": _numbered(sets.FIELDS), "UNIT": sets.UNITS}
    names["SET"] = {"rows": len(sets.ROWS), "capacity": sets.CAPACITY, "entry": len(sets.ENTRY)}
    names |= {"REFUSED": sets.REFUSED}
    return "\n".join(
        [
            "const createEngine = (() => {",
            '"use strict";',
            *(f"const {name} = {_json(value)};" for name, value in names.items()),
            f"const steps = (M, F) => {{\n{print_routines(write_steps(TABLEAU))}",
            "return {begin, run, interpolate};\n};",
            f"const searches = (M, F) => {{\n{print_routines(write_search())}",
            "return {search, restart};\n};",
            engine,
            "return createEngine;\n})();\n",
        ]
    )


def _numbered(names: Mapping[str, object]) -> dict[str, int]:
    return {name: place for place, name in enumerate(names)}


def live_program(
    scene: Model | Assembly,
    form: str | None = None,
    sliders: Sequence[str] = (),
    drag: bool = False,
) -> LiveProgram:
    """Return a scene as JavaScript, or why it is not live.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    form
        See `atwood.assemble`.
    sliders
        Parameters that are to be changed: they stay in the equations where they are zero.
    drag
        Whether bodies can be pulled by a damped spring, which its equations then have.
    """
    assembly, zeros = with_sliders(assembly_of(scene, form=form), sliders)
    try:
        every, start = live_modes(assembly, zeros, drag=drag)
        data = _data(every[0], start)
        modes = [(one.text(), one.data) for one in every]
        texts = ", ".join(f"{{data: {_json(own)},\nopen: {text}}}" for text, own in modes)
        text = f"{{data: {_json(data)},\nmodes: [{texts}]}}"
        return LiveProgram(assembly.flat.name, assembly.form, "", text, data)
    except AtwoodError as error:
        return LiveProgram(assembly.flat.name, assembly.form, ": ".join(filter(None, (error.where, error.message))))


def live_modes(
    assembly: Assembly,
    zeros: Collection[str] = (),
    quantities: Sequence[str] | None = None,
    drag: bool = False,
) -> tuple[list[ModeText], Start]:
    """Return the programs of a scene in each of its modes, that of its start first, and the start.

    Parameters
    ----------
    assembly
        The scene.
    zeros
        Names of symbols of parameters that stay in the equations, and are zero.
    quantities
        Paths of the quantities that can be asked for; all if not given.
    drag
        See `live_program`.

    Raises
    ------
    AtwoodError
        If it is not live.
    """
    _refuse(assembly)
    if drag:
        assembly, idle = with_pulls(assembly)
        zeros = {*zeros, *idle}
    assembly, start = start_with_line_signs(with_zeros(assembly, zeros))
    if assembly.own_equations.contacts:  # refuse what no run can begin with, as friction by undetermined shares
        options = RunOptions(t_end=assembly.flat.t_start + 1.0)
        choice_at_start(assembly, start, options, assembly.other_mode)
    first = ModeText(*_prepared(assembly, start), quantities)
    every = add_modes(first, assembly, start, quantities)
    for one in every:
        add_updates(one)
        for number, symbol in enumerate(one.assembly.parameters):
            if symbol.name in zeros:
                one.data["values"][number] = 0.0
    return every, start


def _refuse(assembly: Assembly) -> None:
    """Say what keeps a scene from being live."""
    refuse_groups(assembly)
    stiff = next((one for one in assembly.own_equations.contacts if one.row.stiffness is not None), None)
    if stiff is not None:
        raise NotLiveError(f"{stiff.row.key[0]} shares loads by its stiffness, which is worked out in Python alone")
    if kinematic_map_of(assembly, assembly.form).has_singular_coordinates:
        raise NotLiveError("its orientations have three coordinates, which are switched; quaternions are live")


def _prepared(assembly: Assembly, start: Start) -> tuple[SceneProblem, FloatArray]:
    """Return the plan of a run, and the state at its start."""
    assembly, q, u = settle(assembly, start, assembly.other_mode)
    if not len(q):
        raise NotLiveError("nothing in it is free to move: its motion is prescribed")
    return plan_of(assembly, start.time, q, u, start.length), np.concatenate([q, u])


def _data(mode: ModeText, start: Start) -> dict[str, Any]:
    """Return what a page knows of a scene in all its modes."""
    flat = mode.flat
    begins = add_start(mode, start)
    add_tangent(mode)
    said = [one for level in ("places", "speeds") for one in begins[level]["targets"]] if begins else []
    return {
        "name": flat.name,
        "form": mode.assembly.form,
        "start_time": flat.t_start,
        "end_time": flat.t_end,
        "parameters": live_parameters(mode.assembly),
        "starts": [{name: one[name] for name in ("path", "value", "unit", "fixed")} for one in said if one["settable"]],
        "start": begins,
        "line": [float(x) for x in mode.assembly.mechanism.space.line or ()],
        "quantities": [{name: getattr(one, name) for name in _OF_QUANTITIES} for one in mode.known],
        "unknown": mode.unknown,
        **bodies_of(mode),
    }


def _json(value: object) -> str:
    """Return data as JavaScript that can stand in a page."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("</", "<\\/").replace("<!--", "<\\!--")
