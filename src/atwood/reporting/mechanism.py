"""The mechanism report: bodies, joints, freedom, constraints, and what was merged, dropped and eliminated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from atwood.arguments import optional, takes
from atwood.display import data_of, fitted, plain
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.constraints.massless_spins import IDLE_SPIN
from atwood.mechanics.constraints.pfaffian import integrable_together
from atwood.model.compose.composite import Model
from atwood.numerics.matrices import scaled, to_array
from atwood.numerics.rank import null_space, row_scales
from atwood.pipeline import SCENE, assemble_flat, assembly_of
from atwood.reporting.offers import Offer, find_offers
from atwood.reporting.parts import (
    BodyEntry,
    DroppedPart,
    JointEntry,
    MergedPart,
    ParameterEntry,
    list_bodies,
    list_dropped,
    list_joints,
    list_merged,
    list_parameters,
    list_ties,
)
from atwood.reporting.text import described, overview
from atwood.simulation.dynamics.scales import motion_names
from atwood.simulation.initialization.mobility import Immobile, find_immobile
from atwood.simulation.initialization.report import InitializationReport, report_initialization
from atwood.simulation.initialization.start import Start, find_start, own_state, settle
from atwood.simulation.problem.arguments import NAME, ORIENTATION
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.problem.problem import SceneProblem
from atwood.table import Shown, Table
from atwood.tolerances import tolerances


@dataclass(frozen=True)
class MechanismReport(Shown):
    """What Atwood made of a scene.

    Attributes
    ----------
    scene, space
        Its name, and what it lives in.
    gravity
        Acceleration of free fall, m/s^2.
    degrees_of_freedom
        Speeds of the reduced form less its independent constraints.
    coordinates
        Coordinates of the reduced form.
    eliminated
        Coordinates that linear constraints gave as functions of the others.
    integrated
        Constraints on velocities that turned out to hold positions, by themselves or together.
    on_surfaces
        Constraints on velocities that are integrable together, though their integrals are not known, so that all
        motions stay on surfaces.
    solved_speeds
        Rates of coordinates that constraints on velocities gave as functions of the speeds.
    idle_spins
        Slender bodies that could spin about their axis without inertia, and that nothing turns: they are left without
        that spin, which is no degree of freedom.
    dependent
        With loops: the coordinates that follow from the others at the start; of orientations, the speeds that do.
    bodies, massless
        What has mass and can move, and the names of what moves without mass.
    joints, ties
        Joints between bodies, and other parts that hold by a constraint.
    merged, dropped
        Parts that are one body with another, and parts that leave nothing in the equations.
    loops
        How many independent loops the joints make.
    constraints
        The scalar constraints of the dae form.
    redundant
        Those that follow from the others.
    not_unique
        The reactions that are then not unique.
    starts_singular
        Whether the start is a singular position, where constraints lose rank.
    free_coordinates, free_speeds
        What nothing fixes at the start; it keeps its guess as far as it can, or starts at zero.
    repeated
        Start values that follow from the others.
    initialization
        What the start moved from where it was guessed.
    immobile
        Why nothing can move, and what would have to let go; None if something can, or is driven.
    states
        Length of the solver's vector, by form.
    operations
        Operations of one residual, by form and kind.
    offers
        In space: the plane and the line that the motion stays in by symmetry, and what it would cost there.
    parameters
        All parameters.
    """

    scene: str
    space: str
    gravity: float
    degrees_of_freedom: int
    coordinates: tuple[str, ...]
    eliminated: tuple[str, ...]
    dependent: tuple[str, ...]
    bodies: tuple[BodyEntry, ...]
    massless: tuple[str, ...]
    joints: tuple[JointEntry, ...]
    ties: tuple[str, ...]
    merged: tuple[MergedPart, ...]
    dropped: tuple[DroppedPart, ...]
    loops: int
    constraints: tuple[str, ...]
    redundant: tuple[str, ...]
    not_unique: tuple[str, ...]
    starts_singular: bool
    free_coordinates: tuple[str, ...]
    free_speeds: tuple[str, ...]
    repeated: tuple[str, ...]
    integrated: tuple[str, ...]
    on_surfaces: tuple[str, ...]
    solved_speeds: tuple[str, ...]
    idle_spins: tuple[str, ...]
    initialization: InitializationReport
    immobile: Immobile | None
    states: Mapping[str, int]
    operations: Mapping[str, Mapping[str, int]]
    offers: tuple[Offer, ...]
    parameters: tuple[ParameterEntry, ...]

    def tables(self) -> tuple[Table, ...]:
        """Return what the mechanism is."""
        return (described(self),)

    def __str__(self) -> str:
        return described(self).text(_WIDTH)

    def __repr__(self) -> str:
        return fitted(f"<MechanismReport of {overview(self)}; print it to read all>")

    @property
    def loop_joints(self) -> tuple[str, ...]:
        """The joints that close loops."""
        return tuple(joint.path for joint in self.joints if joint.closes_loop)

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain data, with lists of paths."""
        return {
            **data_of(self, "scene", "space", "gravity", "degrees_of_freedom"),
            "constraints": len(self.constraints),
            "loops": self.loops,
            "bodies": [one.path for one in self.bodies],
            "massless": list(self.massless),
            "joints": [one.path for one in self.joints],
            **data_of(self, "ties", "redundant"),
            "merged": [one.path for one in self.merged],
            "dropped": [one.path for one in self.dropped],
            **data_of(self, "coordinates", "eliminated", "integrated", "on_surfaces", "solved_speeds", "idle_spins"),
            **data_of(self, "dependent", "loop_joints"),
            "constraint_labels": list(self.constraints),
            **data_of(self, "not_unique", "starts_singular"),
            "start": data_of(self, "free_coordinates", "free_speeds", "repeated"),
            "placement": self.initialization.to_dict(),
            **data_of(self, "immobile", "states", "operations", "offers"),
            "masses": {one.path: one.mass for one in self.bodies},
            "merged_into": {one.path: one.into for one in self.merged},
            "dropped_because": {one.path: one.why for one in self.dropped},
            "joint_kinds": {one.path: one.kind for one in self.joints},
            "parameters": plain(self.parameters),
        }


_WIDTH = 100
"""Columns of a printed report."""


@takes(scene=SCENE, name=NAME, orientation=optional(ORIENTATION))
def report(scene: Model | Assembly, name: str | None = None, *, orientation: str | None = None) -> MechanismReport:
    """Report what became of a scene: bodies, joints, degrees of freedom, constraints, and why.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    name
        What to call the scene.
    orientation
        In which coordinates the reduced form has orientations in space; see `atwood.assemble`. What
        contradicts an assembly is refused.

    Returns
    -------
    MechanismReport
        Everything that is known before a run; ``print`` it, or take `to_dict`.

    Raises
    ------
    AtwoodError
        If the scene cannot be simulated; the error says why and names the part.
    """
    given = assembly_of(scene, name, orientation=orientation)
    reduced = assemble_flat(given.flat, form="reduced", orientation=given.orientation.kind)
    dae = assemble_flat(given.flat, form="dae", level=given.level or "ggl")
    start = find_start(reduced)
    plans = {"reduced": _plan(reduced, start), "dae": _plan(dae, start)}
    finding, forest = plans["dae"].finding, reduced.reduced.forest
    labels = [one.label for one in dae.maximal.constraints]
    bodies, massless = list_bodies(reduced)
    dropped = tuple(list_dropped(reduced))
    gone = {one.path for one in dropped}
    names = [one.name for one in reduced.reduced.names]
    idle = tuple(reduced.mechanism.bodies.bodies[index].name for index in reduced.mechanism.idle_spins)
    return MechanismReport(
        scene=given.flat.name,
        space=given.flat.space.name,
        gravity=given.flat.gravity,
        degrees_of_freedom=len(reduced.reduced.speeds) - plans["reduced"].finding.rank,
        coordinates=tuple(names),
        eliminated=reduced.reduced.eliminated,
        dependent=tuple(motion_names(reduced.reduced)[i] for i in plans["reduced"].dependent),
        bodies=bodies,
        massless=massless,
        joints=list_joints(reduced),
        ties=list_ties(reduced),
        merged=tuple(one for one in list_merged(reduced) if one.path not in gone),
        dropped=dropped,
        loops=forest.loops,
        constraints=tuple(labels),
        redundant=tuple(labels[i] for i in finding.redundant),
        not_unique=_not_unique(dae, plans["dae"], start) if finding.redundant else (),
        starts_singular=any(plan.finding.starts_singular for plan in plans.values()),
        free_coordinates=start.free_coordinates,
        free_speeds=start.free_speeds,
        repeated=start.repeated,
        integrated=_integrated(reduced),
        on_surfaces=_on_surfaces(reduced),
        solved_speeds=tuple(
            one for one in reduced.reduced.solved_speeds if not one.startswith(tuple(f"{name}.spin." for name in idle))
        ),
        idle_spins=idle,
        initialization=report_initialization(reduced, start),
        immobile=find_immobile(reduced, len(reduced.reduced.speeds) - plans["reduced"].finding.rank, start),
        states={form: plan.program.size for form, plan in plans.items()},
        operations={form: plan.program.operations for form, plan in plans.items()},
        offers=find_offers(reduced, start),
        parameters=list_parameters(reduced, None if isinstance(scene, Assembly) else scene),
    )


def _integrated(reduced: Assembly) -> tuple[str, ...]:
    """Return the constraints on velocities that hold positions."""
    found = [one for one in reduced.reduced.integrals if one.on_velocities]
    return tuple(dict.fromkeys(f"{path}.{law}" for one in found for path, law, _ in one.keys))


def _on_surfaces(reduced: Assembly) -> tuple[str, ...]:
    """Return the constraints on velocities that are left, if they could be integrated together."""
    left = [one for one in reduced.reduced.constraints if one.value is None and one.key[1] != IDLE_SPIN.name]
    if not left or not integrable_together(reduced.mechanism, reduced.reduced):
        return ()
    return tuple(dict.fromkeys(f"{one.key[0]}.{one.key[1]}" for one in left))


def _plan(assembly: Assembly, start: Start) -> SceneProblem:
    span = max(assembly.flat.t_end - start.time, 1e-3)
    assembly, q, u = settle(assembly, start, assembly.other_mode)
    return make_problem(assembly, start.time, q, u, start.length, span)


def _not_unique(assembly: Assembly, plan: SceneProblem, start: Start) -> tuple[str, ...]:
    """Return the reactions that a stress without any force from outside could change."""
    q, u = own_state(assembly, start)
    constraint_jacobian = scaled(to_array(plan.balance.at(start.time, q, np.zeros_like(u)).jacobian), plan.sizes)
    rows = row_scales(constraint_jacobian, np.ones_like(u), plan.balance.errors.near(start.time, q, plan.sizes))
    balancing = null_space((constraint_jacobian / rows[:, None]).T, rank=plan.finding.rank)
    involved = np.max(np.abs(balancing), axis=1, initial=0.0) > tolerances.FREE
    constraints = assembly.maximal.constraints
    return tuple(
        dict.fromkeys(f"{one.key[0]}.{one.reaction}" for one, hit in zip(constraints, involved, strict=True) if hit)
    )
