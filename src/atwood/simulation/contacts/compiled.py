"""What the routine of a set of contacts is given of a scene; see `atwood.integrators.set_routines`."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Program, depends_on, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.constrained import contacts_program
from atwood.forms.loose import loose_equations
from atwood.integrators.set_routines import UNITS
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.model.values.units import ALONG
from atwood.simulation.contacts.values import Layout, layout_of
from atwood.simulation.problem.explicit_scene import light_speeds
from atwood.simulation.problem.problem import SceneProblem


@dataclass(frozen=True, eq=False)
class SetData:
    """Gaps and slips of a scene for the routine.

    Attributes
    ----------
    program, pattern
        See `atwood.forms.constrained.contacts_program`; parameters are those of `values_on_constraints`.
    layout
        The gaps and slips.
    units
        What is known beforehand of each, by the rows of `UNITS`; what is small and slow is that of a tolerance of one.
    """

    program: Program
    pattern: list[tuple[int, int]]
    layout: Layout
    units: FloatArray


def why_in_python(assembly: Assembly) -> str:
    """Return which limit of friction the routine cannot read, and why; empty where it reads all."""
    layout = layout_of(assembly)
    if not (layout.is_curved or layout.is_borne):
        return ""
    own = [one.read for one in layout.contacts]
    borne = [x for x in layout.read if x not in own]
    for one in layout.contacts:
        limits = [limit for way in (1.0, -1.0) for limit in one.towards(way)]
        name = ".".join(one.row.key[:2])
        if depends_on(limits, borne):
            return f"the limit of {name} reads forces of joints"
        if depends_on(list(jacobian(limits, own).entries), own):
            return f"the limit of {name} is curved in a force"
    raise AssertionError("no limit is curved, and none reads forces of joints")


def in_no_contact(assembly: Assembly) -> Assembly:
    """Return a scene in which nothing touches, slips or sticks."""
    held = list(assembly.held_now)
    for place in (place for places in layout_of(assembly).places for place in places):
        held[place] = 0.0
    return assembly.with_held(held)


def set_data(plan: SceneProblem, t: float, y: FloatArray) -> SetData:
    """Return what the routine is given, for a plan and a state of it."""
    assembly, layout = in_no_contact(plan.assembly), layout_of(plan.assembly)
    rows = assembly.rows if assembly.form == "reduced" else assembly.maximal.rows
    equations, loose = loose_equations(assembly, rows)
    own: dict[tuple[str, str], list[ContactRow]] = {}
    for one in assembly.own_equations.contacts:
        own.setdefault(one.row.key[:2], []).append(one)
    program, pattern = contacts_program(
        assembly.flat.name,
        equations,
        loose,
        [own[one.row.key[:2]] for one in layout.first],
        assembly.parameters,
        plan.finding.kept,
        light_speeds(plan, t, y),
    )
    return SetData(program, pattern, layout, _units(layout, plan))


def _units(layout: Layout, plan: SceneProblem) -> FloatArray:
    parts: dict[str, int] = {}
    found, first = np.zeros((len(UNITS), len(layout.first))), 0
    for k, (one, rows) in enumerate(zip(layout.first, layout.units, strict=True)):
        size = plan.scales.of(ALONG[one.law.options.unit])
        values = {
            "first": first,
            "width": len(rows),
            "slip": one.is_slip,
            "at": layout.gap_of[k],
            "speed": one.is_speed,
            "poisson": not one.is_slip and one.law.options.impact_law == "poisson",
            "part": parts.setdefault(one.row.key[0], len(parts)),
            "small": size,
            "slow": size / plan.scales.time,
        }
        for name, value in values.items():
            found[UNITS[name], k] = value
        first += len(rows)
    return found
