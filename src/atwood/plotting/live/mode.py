"""The programs of a scene in one mode, and the data that go with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.javascript.printer import BITS, print_routines
from atwood.codegen.javascript.program import print_functions, print_program
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.display import data_of
from atwood.errors import AtwoodError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, Scalar, depends_on, read_by, substitute
from atwood.forms.accelerations import accelerations_of
from atwood.forms.assembly import Assembly
from atwood.forms.event_program import solved_reactions
from atwood.forms.loose import in_no_contact, kept_touching
from atwood.forms.program import state_groups
from atwood.forms.quantities import find_observables
from atwood.forms.sides import in_pieces
from atwood.integrators.embedded.rates import write_routines as write_rates
from atwood.integrators.methods.dormand_prince import EXPLICIT
from atwood.integrators.sets import record as sets
from atwood.integrators.sets.resolve import write_sets
from atwood.integrators.step_guard import write_routines as write_guard
from atwood.lazy_dataclasses import replace
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.outputs.event_functions import CLOSES, CONTACT, OPENS, RESTS, STOPS, YIELDS
from atwood.mechanics.outputs.observables import Observable
from atwood.mechanics.outputs.totals import energies
from atwood.model.values.space import planar_axes
from atwood.model.values.units import ALONG
from atwood.plotting.live.parameters import find_parameters
from atwood.plotting.live.pulls import PULL, pulls_of
from atwood.simulation.contacts.compiled import set_data, why_in_python
from atwood.simulation.contacts.values import with_own_sizes
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.events.modes import MARGIN, EventProbe
from atwood.simulation.events.sides import plain_sides
from atwood.simulation.events.time_events import find_schedule
from atwood.simulation.problem.curved_laws import find_curved
from atwood.simulation.problem.explicit_scene import program_on_constraints
from atwood.simulation.problem.preparation import problem_of_run
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.step_guard import guard_program, shortest_judged
from atwood.simulation.run.session import OF_CONTACTS

_BEYOND = 4.0
"""So many times as long as the scene's run switches of functions of time are known beforehand."""


_MOST_CONTACTS = 20
"""So many gaps, and slips without a gap, are resolved in a page."""

_HAPPENED = {CLOSES: sets.CLOSES, OPENS: sets.OPENS, YIELDS: sets.YIELDS, STOPS: sets.STOPS, RESTS: sets.STOPS}


class NotLiveError(AtwoodError):
    """What a page cannot compute."""


def plan_of(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float) -> SceneProblem:
    """Return the plan of a run from a state, with relations of what moves as parameters."""
    sided = in_pieces(assembly)
    if sided.sides is not None:
        sided = replace(sided, side_values=plain_sides(sided, t, q, u))
    plan = problem_of_run(sided, t, q, u, length, assembly.flat.t_end - assembly.flat.t_start)
    plan = with_own_sizes(plan, t, q, u)
    plan.keep_better(t, q)
    if plan.not_compilable:
        raise NotLiveError(f"{plan.not_compilable}, and a page has no Python")
    return plan


class ModeText:
    """A scene in one mode as text, and what goes with it as data.

    Parameters
    ----------
    plan, y
        The scene, and a state that it may have in this mode.
    quantities
        Paths; None for all.

    Attributes
    ----------
    programs
        What is printed, by the names that routines and the engine call.
    data
        The data.
    """

    def __init__(self, plan: SceneProblem, y: FloatArray, quantities: Sequence[str] | None) -> None:
        self.plan = plan = _touching(plan)
        self.assembly = plan.assembly
        self.equations, self.flat = self.assembly.own_equations, self.assembly.flat
        self.programs: dict[str, Program] = {}
        self.known: list[Observable] = []
        self.unknown: dict[str, str] = {}
        self.data: dict[str, Any] = {
            "coordinates": [{"name": one.name, "unit": one.unit} for one in self.equations.names],
            "speeds": [{"name": one.name, "unit": one.unit} for one in self.equations.speed_names],
            "values": self.assembly.parameter_values.tolist(),
            "numbers": {path: number for path, (number, _) in find_parameters(self.assembly).items()},
            "modes": dict(self.assembly.modes),
            "state": y.tolist(),
        }
        self._add_contacts(y)
        self._add_motion(y)
        self._add_guard()
        self._add_quantities(quantities, y)
        self._add_pictures()
        self._add_sizes()
        self.end = self._add_schedule()
        self._add_events(y)
        self._add_sides()

    def text(self) -> str:
        """Return the JavaScript function that makes the functions of the mode, from memory and addresses."""
        n, m = len(self.equations.coordinates), len(self.equations.speeds)
        given, projects = len(self.programs["kernel"].outputs) == 2, "nearer" in self.programs
        judges = write_guard("judge") if "judge" in self.programs else []
        contact = write_sets() if "contacts" in self.programs else []
        routines = [*write_elimination(), *write_rates(n, m, given, projects), *judges, *contact]
        texts = [BITS, print_functions(self.programs.values()), print_routines(routines)]
        words = self.data["words"] = {}
        for name, program in self.programs.items():
            text, scratch = print_program(name, program)
            texts.append(text)
            sizes = [len(one.expressions) for one in program.outputs]
            words[name] = {"derived": len(program.prologue), "scratch": scratch, "outputs": sizes}
        names = [*self.programs, *(f"{name}_prologue" for name in self.programs), "rates"]
        names += [*(["project"] if projects else []), *(["guard"] if judges else []), *(["resolve"] if contact else [])]
        body = "\n".join(texts)
        return f"(M, F) => {{\n{body}\nreturn {{{', '.join(names)}}};\n}}"

    def _add_motion(self, y: FloatArray) -> None:
        """Add accelerations, and what keeps the state on the constraints."""
        assembly, plan = self.assembly, self.plan
        self.data["constraints"] = [one.label for one in self.equations.constraints]
        self.data["kept"] = list(plan.finding.kept)
        if assembly.form == "reduced" and not plan.holds:
            found = accelerations_of(assembly)
            if found is None:
                raise NotLiveError("its accelerations have no formulas")
            self.programs["kernel"] = found.program
            return
        made = program_on_constraints(plan, self.flat.t_start, y)
        self.data["values"] += plan.sizes.tolist()
        self.programs["kernel"] = made.accelerations
        if plan.holds:
            balance = assembly.balance(assembly.form)
            self.programs["nearer"] = made.projection
            if self.equations.constraints:
                self.programs["held"] = balance.constraints_alone
            self.data["watched"] = bool(assembly.form == "reduced" and assembly.reduced.constraints)
            self.data["slopes"] = [balance.jacobian_rows.tolist(), balance.jacobian_columns.tolist()]

    def _add_contacts(self, y: FloatArray) -> None:
        """Add what the routine of a set of contacts is given; none of them holds yet."""
        if not self.equations.contacts:
            return
        why = why_in_python(self.assembly)
        if why:
            raise NotLiveError(f"{why}, which pages do not resolve")
        found = set_data(self.plan, self.flat.t_start, y)
        layout, before = found.layout, len(self.assembly.mechanism.table.values)
        count = sum(at < 0 for at in layout.gap_of)
        if count > _MOST_CONTACTS:
            raise NotLiveError(f"it has {count} contacts, and pages resolve up to {_MOST_CONTACTS}")
        places = [[before + place for place in some] for some in layout.places]
        for place in (place for some in places for place in some):
            self.data["values"][place] = 0.0
        self.programs["contacts"] = found.program
        self.data["contacts"] = {
            "keys": [one.row.key[:2] for one in layout.first],
            "rates": [f"{ALONG[one.law.options.unit]}/s" for one in layout.first],
            "units": found.units.tolist(),
            "places": places,
            "words": [[said and said._asdict() for said in one.told(self.flat.parts)] for one in layout.first],
            "closed": [one.is_closed_at_start(self.flat.parts) for one in layout.first],
            "size": len(layout.contacts),
            "pattern": [one for some in zip(*found.pattern, strict=True) for one in some],
        }

    def _add_guard(self) -> None:
        """Add what judges steps that laws could slip through, whichever values parameters get."""
        curved, span = find_curved(self.assembly), (self.flat.t_start, self.flat.t_end)
        if curved:
            self.programs["judge"] = guard_program(self.assembly, curved)
            self.data["judged"] = [EXPLICIT.reach, shortest_judged(span)]

    def of_state(self, name: str, groups: Mapping[str, Sequence[Scalar]], more: Sequence[Expression] = ()) -> None:
        """Add a program of (t, q, u), and of the accelerations where these are given."""
        convert, parameters = self.equations.graph.convert, self.assembly.parameters
        outputs = tuple(OutputGroup(key, tuple(map(convert, values))) for key, values in groups.items())
        inputs = (*state_groups(self.equations), *([InputGroup("a", tuple(more))] if more else []))
        self.programs[name] = Program(f"{self.flat.name} ({name})", inputs, parameters, outputs)

    def _add_quantities(self, paths: Sequence[str] | None, y: FloatArray) -> None:
        """Add the program of quantities and energies."""
        symbols = [one.symbol for one in self.assembly.reactions]
        every = self.assembly.observables
        own = (path for path in every if not path.startswith(PULL))
        found = find_observables(self.assembly, list(own) if paths is None else paths)
        reading = {one.path for one in found if symbols and depends_on([one.value], symbols)}
        plain = [one for one in found if one.path not in reading]
        of = {"quantities": [one.value for one in plain]}
        of["energies"] = list(energies(self.assembly.mechanism, self.equations))
        self.of_state("quantities", of, self.equations.accelerations)
        self.data["paths"] = {"quantities": [one.path for one in plain]}
        self.known = plain + self._add_loads([one for one in found if one.path in reading], y)

    def _add_loads(self, reading: list[Observable], y: FloatArray) -> list[Observable]:
        """Add the program of what reads reactions, which is asked for now and then; return what it gives."""
        if not reading:
            return []
        symbols = read_by([one.value for one in reading], [one.symbol for one in self.assembly.reactions])
        kept = ReactionSolver(self.assembly, self.flat.t_start, *self.plan.program.split(y)).finding.kept
        # Where laws compare what moves, reactions inside bodies read these as they stand, and not on their sides.
        solved = None if self.assembly.sides else solved_reactions(self.assembly, set(symbols), kept)
        if solved is None:
            self.unknown = dict.fromkeys((one.path for one in reading), "it reads reactions that have no formulas here")
            return []
        values = substitute([one.value for one in reading], solved)
        self.of_state("loads", {"loads": values}, self.equations.accelerations)
        self.data["paths"]["loads"] = [one.path for one in reading]
        return reading

    def _add_pictures(self) -> None:
        """Add the program of where bodies and nodes are."""
        mechanism, space = self.assembly.mechanism, self.assembly.mechanism.space
        placements = self.equations.kinematics.placements
        poses: list[Scalar] = []

        def place(node: int) -> tuple[Scalar, ...]:
            return tuple(space.vector(world_position(mechanism, placements, node)))

        for body in mechanism.bodies.bodies:
            axes = placements.axes.get(body.index)
            if axes is None and body.index in placements.angles:
                axes = planar_axes(placements.angles[body.index])
            columns = [tuple(axis) for axis in axes] if axes is not None else np.eye(3).tolist()
            poses += [*place(body.root), *(columns[j][i] for i in range(3) for j in range(3))]
        places = [one for node in nodes_of(self) for one in place(node)]
        self.of_state("places", {"poses": poses, "places": places})

    def _add_sizes(self) -> None:
        """Add in which units errors are measured."""
        plan, kinematic_map = self.plan, kinematic_map_of(self.assembly, self.assembly.form)
        n, m = len(self.equations.coordinates), len(self.equations.speeds)
        share = OF_CONTACTS if self.equations.contacts else 1.0
        homogeneous = [one for one in kinematic_map.program.orientation_coordinates if one.is_homogeneous]
        self.data |= {
            "tolerances": plan.tolerances(share, {})[: n + m].tolist(),
            "relative": plan.relative_share * share,
            "sizes": plan.sizes.tolist(),
            "time": plan.scales.time,
            "stiffness": plan.scales.force / plan.scales.length,
            "pulls": pulls_of(self.assembly),
            "turns": [list(one.coordinates) for one in homogeneous],
        }

    def _add_schedule(self) -> float:
        """Add when relations of functions of time change, and their values; return until when these are known."""
        flat, assembly = self.flat, self.assembly
        end = flat.t_end + _BEYOND * (flat.t_end - flat.t_start)
        schedule = find_schedule(assembly, flat.t_start, end)
        first = len(assembly.parameters) - len(assembly.relations)
        self.data["schedule"] = {"times": schedule.times.tolist(), "values": schedule.values.T.tolist(), "first": first}
        self.data["schedule"]["end"] = end if assembly.relations or assembly.discrete_states else None
        return end

    def _add_events(self, y: FloatArray) -> None:
        """Add the values of events."""
        t, (q, u) = self.flat.t_start, self.plan.program.split(y)
        probe = EventProbe(self.plan, t, q, u, 1e-12)
        self.data["events"] = []
        for one in probe.event_functions:
            if one.is_there is not None:
                raise NotLiveError(f"{one.part}.{one.law} is an event with a condition, which pages do not read")
        if not probe.event_functions:
            return
        program = probe.program()
        if program is None:
            raise NotLiveError("its events read reactions that have no formulas")
        self.programs["events"] = program
        self.data["events"] = [
            {
                **data_of(one, "part", "law", "message", "target", "direction", "impact"),
                "noted": one.is_noted,
                "small": MARGIN * self.plan.scales.of_law(one.part, one.law, one.unit),
                "updates": [],
            }
            for one in probe.event_functions
        ]
        keys = self.data.get("contacts", {}).get("keys", [])
        for event, function in zip(self.data["events"], probe.event_functions, strict=True):
            if function.target in CONTACT:
                event["contact"] = [keys.index((function.part, function.law)), _HAPPENED.get(function.target, 0)]

    def _add_sides(self) -> None:
        """Add the relations of what moves: their kinds, what each compares with zero, and how large its terms are."""
        sides = self.assembly.sides
        if sides is None:
            return
        known = sides.program(self.assembly)
        groups = state_groups(self.equations)
        self.programs["sides"] = Program(known.name, groups, self.assembly.parameters, known.outputs)
        first = self.assembly.parameters.index(sides.symbols[0])
        self.data["sides"] = {"first": first, "kinds": [one.kind for one in sides.relations]}


def _touching(plan: SceneProblem) -> SceneProblem:
    """Return a plan with the programs for all states of gaps and slips, if there are any."""
    if not plan.assembly.own_equations.contacts:
        return plan
    return plan.in_piece(kept_touching(in_no_contact(plan.assembly)))


def nodes_of(mode: ModeText) -> list[int]:
    """Return the nodes of a scene in the order of their places."""
    return sorted(mode.equations.kinematics.placements.positions)


def bodies_of(mode: ModeText) -> dict[str, Any]:
    """Return what bodies and nodes there are."""
    mechanism: Mechanism = mode.assembly.mechanism
    at: dict[int, list[str]] = {}
    for (part, name), node in mechanism.graph.node_of.items():
        if not part.startswith(PULL):
            at.setdefault(node, []).append(f"{part}.{name}")
    body_of = mechanism.bodies.body_of
    return {
        "bodies": [{"index": one.index, "name": one.name, "root": one.root} for one in mechanism.bodies.bodies],
        "nodes": [{"node": one, "body": body_of[one], "connectors": at.get(one, [])} for one in nodes_of(mode)],
    }
