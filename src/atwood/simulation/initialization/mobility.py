"""Mechanisms that cannot move: what holds them, and what would have to let go."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import TopologyError
from atwood.expr import Program, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.quantities import known_program
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Constraint
from atwood.model.declare.component import Component
from atwood.model.declare.law import Kind
from atwood.numerics.independence import independent_rows
from atwood.numerics.matrices import LARGEST_FULL, scaled, to_array
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.scales import is_length, motion_scales, scene_length
from atwood.simulation.initialization.start import Start, maximal_state
from atwood.tolerances import tolerances

_SHOWN = 4

_PRESCRIBED: Key[Program] = Key("prescribed")


@dataclass(frozen=True)
class Immobile:
    """A mechanism in which nothing can move: a structure, whose forces are those of statics.

    Attributes
    ----------
    freed
        Joint laws and ties with the degrees of freedom that there would be without each; those that give fewest first.
        None where there are too many to try each.
    surplus
        How many of its constraints follow from the others, so that their reactions are not unique; 0 where that was
        not looked at.
    """

    freed: tuple[tuple[str, int], ...] | None
    surplus: int

    def describe(self) -> str:
        """Return what it is, and what would have to let go, as a sentence."""
        text = "nothing can move: joints and ties hold every body where it is"
        if self.surplus:
            text += f", {self.surplus} of their constraints to spare"
        if self.freed is None:
            text += f" (with more than {LARGEST_FULL} speeds it is not tried what would happen if one let go)"
        elif self.freed:
            ways = [f"{name} ({count})" for name, count in self.freed[:_SHOWN]]
            more = len(self.freed) - _SHOWN
            text += f"; degrees of freedom if one let go: {', '.join(ways)}" + (f" and {more} more" if more > 0 else "")
        else:
            text += "; it takes more than one of them to let go"
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        freed = None
        if self.freed is not None:
            freed = [{"path": path, "degrees_of_freedom": count} for path, count in self.freed]
        return {"freed": freed, "surplus": self.surplus}


def find_immobile(assembly: Assembly, freedom: int, start: Start) -> Immobile | None:
    """Return why nothing can move; None if something can, or is driven."""
    equations = assembly.maximal
    values = [one.value if one.value is not None else one.rate for one in equations.constraints]
    if freedom > 0 or not equations.speeds:
        return None
    if equations.prescribed or any(depends_on(value, assembly.mechanism.relations.roots) for value in values):
        return None  # driven
    if len(equations.speeds) > LARGEST_FULL:
        return Immobile(None, 0)
    scales = motion_scales(equations, start.length)
    q, _ = maximal_state(assembly, start)
    balance = balance_of(assembly, "dae")
    rows = scaled(to_array(balance.at(start.time, q, np.zeros_like(scales)).jacobian), scales)
    errors = balance.errors.of_jacobian(start.time, q, scales)
    groups: dict[str, list[int]] = {}
    for i, one in enumerate(equations.constraints):
        groups.setdefault(_name(assembly, one), []).append(i)
    found = []
    for name, numbers in groups.items():
        others = np.delete(np.arange(len(rows)), numbers)
        left = len(scales) - len(independent_rows(rows[others], errors[others]))
        if left > 0:
            found.append((name, left))
    found.sort(key=lambda one: one[1])
    return Immobile(tuple(found), len(rows) - len(independent_rows(rows, errors)))


def refuse_immobile(assembly: Assembly, freedom: int, start: Start) -> None:
    """Raise if nothing can move, and nothing is driven or may let go later: this is seldom what was meant."""
    if all(_only_holds(part.component) for part in assembly.flat.parts.values()):
        raise TopologyError(
            "there is nothing in it but what is fixed in the world",
            where=assembly.flat.name,
            advice="Add what moves: scene.add('bob', PointMass()), and connect it.",
        )
    found = find_immobile(assembly, freedom, start) if freedom <= 0 and not assembly.modes else None
    if found is None:
        return
    for path, part in _without_moment(assembly):
        raise TopologyError(
            f"it could only turn at {path}, and has no moment of inertia about that place to turn with",
            where=part,
            advice="Give it a moment of inertia, or a centre of mass away from the joint.",
        )
    raise TopologyError(
        found.describe(),
        where=found.freed[0][0] if found.freed else assembly.flat.name,
        advice="Look at the axes and places of the joints; if it is meant as a structure, say structure=True "
        "(on the command line: --structure).",
    )


def _without_moment(assembly: Assembly) -> Iterator[tuple[str, str]]:
    """Yield joints at which a body with mass could turn whose moment of inertia is zero, with a part of the body."""
    bodies, masses = assembly.mechanism.bodies, assembly.maximal.masses.bodies
    for joint in assembly.mechanism.graph.joints:
        for node in (joint.a, joint.b):
            body = bodies.body_of[node]
            if joint.turns and body in masses and body not in bodies.oriented:
                yield joint.part, masses[body].parts[0]


_OTHER_KINDS = tuple(kind for kind in get_args(Kind) if kind != "joint")


def _only_holds(component: Component) -> bool:
    """Return whether all that a component does is to fix frames in the world."""
    fixes = all(law.options.a == "world" and law.options.rigid for law in component.laws("joint"))
    return fixes and not any(component.laws(kind) for kind in _OTHER_KINDS)


def _name(assembly: Assembly, one: Constraint) -> str:
    """Return the path of a law; of the part alone where it has no other law that holds."""
    part, law, _ = one.key
    laws = {other.key[1] for other in assembly.maximal.constraints if other.key[0] == part}
    return part if len(laws) == 1 else f"{part}.{law}"


def check_prescribed(assembly: Assembly, times: FloatArray) -> None:
    """Refuse motions that are prescribed for what is held, or twice over, where they contradict each other."""
    prescribed = assembly.own_equations.prescribed
    if not prescribed:
        return
    program = known_program(assembly, _PRESCRIBED, lambda: [value for _, value in prescribed])
    n, m = len(assembly.own_equations.coordinates), len(assembly.own_equations.speeds)
    idle = (np.zeros(n), np.zeros(m), np.zeros(m), np.zeros(len(assembly.reactions)))
    misses = np.abs(assembly.kernel(program, vectorized=True)(times[None, :], *idle)[0])
    length, equations = scene_length(assembly), assembly.own_equations
    units = np.array([length if is_length(equations, key) else 1.0 for key, _ in prescribed])
    misses = misses / units[:, None]
    if float(np.max(misses)) > tolerances.CLOSED:
        worst, moment = np.unravel_index(int(np.argmax(misses)), misses.shape)
        part, law, _ = prescribed[int(worst)][0]
        raise TopologyError(
            f"the constraint cannot be satisfied: at t = {times[moment]:.6g} a prescribed motion contradicts a "
            "fixed part, by "
            f"{misses[worst, moment] * units[worst]:.3g}",
            where=f"{part}.{law}",
            advice="Two drives, or a drive and a fixed part, prescribe the same motion differently.",
        )
