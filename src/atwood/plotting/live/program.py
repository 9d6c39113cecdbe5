"""A scene as JavaScript that goes on by itself: equations, projection, quantities, places and turns.

What is live is computed by the programs and routines of `simulate`, printed in another language. A scene that needs
more than that is not live, and says why.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import field
from importlib.resources import files
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.javascript.printer import BITS, print_routines
from atwood.codegen.javascript.program import FUNCTIONS, print_program
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.errors import AtwoodError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, Scalar, depends_on, jacobian
from atwood.forms.accelerations import accelerations_of
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.forms.quantities import find_observables
from atwood.forms.sides import has_sides
from atwood.integrators.embedded.rates import write_routines as write_rates
from atwood.integrators.embedded.stepper import FIELDS
from atwood.integrators.embedded.steps import write_routines as write_steps
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.kinematics.mechanism import world_position
from atwood.mechanics.outputs.observables import Observable
from atwood.mechanics.outputs.totals import energies
from atwood.model.compose.composite import Model
from atwood.model.values.space import planar_axes
from atwood.pipeline import assembly_of
from atwood.plotting.live.parameters import live_parameters, with_sliders
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.events.modes import find_event_functions
from atwood.simulation.initialization.start import settle, start_with_line_signs
from atwood.simulation.problem.explicit_scene import program_on_constraints
from atwood.simulation.problem.preparation import problem_of_run
from atwood.simulation.problem.problem import SceneProblem

_OF_QUANTITIES = "path", "unit", "doc", "periodic", "sharing"
"""What pages know of a quantity; see `atwood.mechanics.outputs.observables.Observable`."""


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
    places = {name: place for place, name in enumerate(FIELDS)}
    engine = files("atwood.plotting.live").joinpath("engine.js").read_text(encoding="utf-8")
    return "\n".join(
        [
            "const createEngine = (() => {",
            '"use strict";',
            f"const FIELD = {_json(places)}, ROW = {_json(TABLEAU.rows)};",
            f"const steps = (M, F) => {{\n{print_routines(write_steps(TABLEAU))}",
            "return {begin, run, interpolate};\n};",
            engine,
            "return createEngine;\n})();\n",
        ]
    )


def live_program(
    scene: Model | Assembly,
    form: str | None = None,
    sliders: Sequence[str] = (),
    quantities: Sequence[str] | None = None,
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
    quantities
        Paths of the quantities that can be asked for; all that the state and its accelerations give if not given.
    """
    assembly = assembly_of(scene, form=form)
    try:
        assembly = with_sliders(assembly, sliders)
        _refuse(assembly)
        plan, y = _prepared(assembly)
        made = _Text(plan, y, quantities)
        return LiveProgram(assembly.flat.name, assembly.form, "", made.model(), made.data)
    except _NotLiveError as error:
        return LiveProgram(assembly.flat.name, assembly.form, error.message)


class _NotLiveError(AtwoodError):
    """What a page cannot compute."""


def _refuse(assembly: Assembly) -> None:
    """Say what keeps a scene from being live."""
    for path, local in assembly.mechanism.locals_.items():
        for contact in local.contacts:
            raise _NotLiveError(f"{path}.{contact.law.name} is a gap or dry friction, which pages do not resolve yet")
        for law in local.part.component.laws("update"):
            raise _NotLiveError(f"{path}.{law.name} is an update in Python, and a page has no Python")
    if kinematic_map_of(assembly, assembly.form).has_singular_coordinates:
        raise _NotLiveError("its orientations have three coordinates, which are switched; quaternions are live")


def _prepared(assembly: Assembly) -> tuple[SceneProblem, FloatArray]:
    """Return the plan of a run, and the state at its start."""
    assembly, start = start_with_line_signs(assembly)
    assembly, q, u = settle(assembly, start, assembly.other_mode)
    if not len(q):
        raise _NotLiveError("nothing in it is free to move: its motion is prescribed")
    plan = problem_of_run(assembly, start.time, q, u, start.length, assembly.flat.t_end - start.time)
    plan.keep_better(start.time, q)
    if plan.not_compilable:
        raise _NotLiveError(f"{plan.not_compilable}, and a page has no Python")
    if has_sides(assembly):
        raise _NotLiveError("a law compares what moves, at whose switches pages do not stop yet")
    for one in find_event_functions(assembly):
        if one.target:
            raise _NotLiveError(f"{one.part}.{one.law} is an event that changes something, which pages do not do yet")
    return plan, np.concatenate([q, u])


class _Text:
    """A scene as text, and what goes with it as data.

    Parameters
    ----------
    plan, y
        The scene, and its state at the start.
    quantities
        Paths; None for all.
    """

    def __init__(self, plan: SceneProblem, y: FloatArray, quantities: Sequence[str] | None) -> None:
        self.plan, self.assembly = plan, plan.assembly
        self.equations = self.assembly.own_equations
        self.values = self.assembly.parameter_values.tolist()
        self.programs = self._programs(y)
        known = self._quantities(quantities)
        self.data: dict[str, Any] = {
            "name": self.assembly.flat.name,
            "form": self.assembly.form,
            "start_time": self.assembly.flat.t_start,
            "end_time": self.assembly.flat.t_end,
            "state": y.tolist(),
            "values": self.values,
            "parameters": live_parameters(self.assembly),
            "starts": self._starts(),
            "coordinates": [{"name": one.name, "unit": one.unit} for one in self.equations.names],
            "speeds": [{"name": one.name, "unit": one.unit} for one in self.equations.speed_names],
            "quantities": [{name: getattr(one, name) for name in _OF_QUANTITIES} for one in known],
            "constraints": [one.label for one in self.equations.constraints],
            "kept": list(plan.finding.kept),
            "events": [],
            **self._pictures(),
            **self._sizes(),
        }

    def model(self) -> str:
        """Return the object literal."""
        texts, words = [FUNCTIONS, BITS], {}
        n, m = len(self.equations.coordinates), len(self.equations.speeds)
        accelerations = self.programs["kernel"]
        texts.append(print_routines(write_elimination()))
        texts.append(print_routines(write_rates(n, m, len(accelerations.outputs) == 2, "nearer" in self.programs)))
        for name, program in self.programs.items():
            text, scratch = print_program(name, program)
            texts.append(text)
            words[name] = [len(program.prologue), scratch, *(len(one.expressions) for one in program.outputs)]
        self.data["words"] = words
        names = [*self.programs, *(f"{name}_prologue" for name in self.programs), "rates"]
        names += ["project"] if "nearer" in self.programs else []
        return (
            f"{{data: {_json(self.data)},\nopen: (M, F) => {{\n{''.join(texts)}\nreturn {{{', '.join(names)}}};\n}}}}"
        )

    def _programs(self, y: FloatArray) -> dict[str, Program]:
        """Return accelerations, and what keeps the state on the constraints, by the names that routines call."""
        assembly, plan = self.assembly, self.plan
        if assembly.form == "reduced" and not self.equations.constraints:
            found = accelerations_of(assembly)
            if found is None:
                raise _NotLiveError("its accelerations have no formulas")
            return {"kernel": found.program}
        made = program_on_constraints(plan, assembly.flat.t_start, y)
        self.values += plan.sizes.tolist()
        found_programs = {"kernel": made.accelerations}
        if plan.holds:
            found_programs |= {"nearer": made.projection, "held": self._held()}
        return found_programs

    def _held(self) -> Program:
        """Return the program of what all constraints miss, on position and velocity, and of their slopes."""
        rows, zero = self.equations.constraints, self.equations.graph.zero
        slopes = jacobian([one.rate for one in rows], list(self.equations.speeds))
        dense = [zero] * (len(rows) * len(self.equations.speeds))
        for i, j, entry in slopes.triples:
            dense[i * len(self.equations.speeds) + j] = entry
        groups = {"values": [zero if one.value is None else one.value for one in rows]}
        groups |= {"rates": [one.rate for one in rows], "slopes": dense}
        return self._of_state("held", groups)

    def _of_state(self, name: str, groups: Mapping[str, Sequence[Scalar]], more: Sequence[Expression] = ()) -> Program:
        convert, parameters = self.equations.graph.convert, self.assembly.parameters
        outputs = tuple(OutputGroup(key, tuple(map(convert, values))) for key, values in groups.items())
        inputs = (*state_groups(self.equations), *([InputGroup("a", tuple(more))] if more else []))
        return Program(f"{self.assembly.flat.name} ({name})", inputs, parameters, outputs)

    def _quantities(self, paths: Sequence[str] | None) -> list[Observable]:
        """Add the programs of quantities, energies, places and turns; return the quantities that there are."""
        observables, accelerations = self.assembly.observables, self.equations.accelerations
        symbols = [one.symbol for one in self.assembly.reactions]
        chosen = list(observables) if paths is None else list(paths)
        found = find_observables(self.assembly, chosen)
        reading = {one.path for one in found if symbols and depends_on([one.value], symbols)}
        self.unknown = dict.fromkeys(sorted(reading), "it reads reactions, which pages do not solve for yet")
        known = [one for one in found if one.path not in reading]
        of = {"quantities": [one.value for one in known]}
        of["energies"] = list(energies(self.assembly.mechanism, self.equations))
        self.programs["quantities"] = self._of_state("quantities", of, accelerations)
        return known

    def _pictures(self) -> dict[str, Any]:
        """Add the program of where bodies and nodes are; return what these are."""
        mechanism, space = self.assembly.mechanism, self.assembly.mechanism.space
        placements = self.equations.kinematics.placements
        poses: list[Scalar] = []
        places: list[Scalar] = []

        def place(node: int) -> tuple[Scalar, ...]:
            return tuple(space.vector(world_position(mechanism, placements, node)))

        for body in mechanism.bodies.bodies:
            axes = placements.axes.get(body.index)
            if axes is None and body.index in placements.angles:
                axes = planar_axes(placements.angles[body.index])
            columns = [tuple(axis) for axis in axes] if axes is not None else np.eye(3).tolist()
            poses += [*place(body.root), *(columns[j][i] for i in range(3) for j in range(3))]
        nodes = sorted(placements.positions)
        for node in nodes:
            places += place(node)
        self.programs["places"] = self._of_state("places", {"poses": poses, "places": places})
        at: dict[int, list[str]] = {}
        for (part, name), node in mechanism.graph.node_of.items():
            at.setdefault(node, []).append(f"{part}.{name}")
        body_of = mechanism.bodies.body_of
        return {
            "bodies": [{"index": one.index, "name": one.name, "root": one.root} for one in mechanism.bodies.bodies],
            "nodes": [{"node": one, "body": body_of[one], "connectors": at.get(one, [])} for one in nodes],
            "unknown": self.unknown,
        }

    def _starts(self) -> list[dict[str, Any]]:
        flat, known = self.assembly.flat, self.assembly.start_observables
        given = [(True, flat.start), (False, flat.guess)]
        return [
            {"path": path, "value": value, "unit": known[path].unit, "fixed": fixed}
            for fixed, values in given
            for path, value in values.items()
        ]

    def _sizes(self) -> dict[str, Any]:
        """Return in which units errors are measured."""
        plan, kinematic_map = self.plan, kinematic_map_of(self.assembly, self.assembly.form)
        n, m = len(self.equations.coordinates), len(self.equations.speeds)
        homogeneous = [one for one in kinematic_map.program.orientation_coordinates if one.is_homogeneous]
        return {
            "tolerances": plan.tolerances(1.0, {})[: n + m].tolist(),
            "relative": plan.relative_share,
            "sizes": plan.sizes.tolist(),
            "time": plan.scales.time,
            "length": plan.scales.length,
            "turns": [list(one.coordinates) for one in homogeneous],
        }


def _json(value: object) -> str:
    """Return data as JavaScript that can stand in a page."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("</", "<\\/").replace("<!--", "<\\!--")
