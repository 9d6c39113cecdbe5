"""The equations of motion: d'Alembert's principle, as one reverse sweep through the velocity program.

The generalized force on speed u_k is the sum over all nodes and bodies of ``(m a - F) . dv/du_k`` and
``(J alpha - tau) dw/du_k`` (Goldstein, section 1.4).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

from atwood.expr import Expression, Graph, InputGroup, Scalar, jvp, substitute, vjp
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.forces import Forces, Site, constraint_forces, part_forces, place_part
from atwood.mechanics.dynamics.inertia import Masses, tensor_of, turned_tensor
from atwood.mechanics.kinematics.mechanism import Constant, Decision
from atwood.mechanics.kinematics.orientation import inertial_torque, torque_components
from atwood.mechanics.kinematics.positions import BodyShape, Kinematics, body_point_of
from atwood.model.declare.contact_laws import Told
from atwood.model.declare.law_results import BodyInertia
from atwood.model.declare.laws import Law
from atwood.model.local.flatten import Part
from atwood.model.local.parts import LocalConstraint, LocalPart, LocalState
from atwood.model.values.space import cross
from atwood.topology.orientation_coordinates import OrientationCoordinates
from atwood.topology.spanning_forest import Coordinate, SpanningForest

Lifted = tuple[Mapping[int, tuple[Expression, ...]], Mapping[int, tuple[Expression, ...]]]
"""Accelerations less that of free fall, of nodes and of reference points."""


@dataclass(frozen=True)
class Constraint:
    """A constraint that is not solved by the coordinates.

    Attributes
    ----------
    key
        (part path, law, number within the law).
    reaction
        Name of the reaction that its multiplier is reported as.
    sign
        The reaction is `sign` times the multiplier.
    value, rate, second
        The residual and its first and second time derivatives; the rate is affine in the speeds. A constraint on
        velocities that is no derivative of one on positions has no value: then the rate is its residual.
    multiplier
        The symbol of the multiplier.
    holonomic
        Whether it holds positions, and not only velocities.
    stiffness
        Where it shares a load with others in a way that nothing else determines, as springs do; None if it is rigid.
    """

    key: tuple[str, str, int]
    reaction: str
    sign: float
    value: Expression | None
    rate: Expression
    second: Expression
    multiplier: Expression
    holonomic: bool = True
    stiffness: Expression | None = None

    @property
    def label(self) -> str:
        """Path of the constraint, for messages and reports."""
        path, law, number = self.key
        is_one_of_several = "." in self.reaction or self.reaction.endswith(f"_{number + 1}")
        return f"{path}.{law}" + (f"[{number}]" if is_one_of_several else "")


@dataclass(frozen=True)
class ContactRow:
    """A gap, or a slip, where its part is.

    Attributes
    ----------
    row
        What stays zero where the mask is one: the value of a gap with its derivatives, or a slip as a rate.
    read
        What stands for the multiplier in limits of friction.
    mask
        1 where the row holds, else 0.
    force
        The force along the gap or the slip, in terms of multipliers.
    law
        The law that declares it.
    direction
        The sign of a slip that goes on, else 0; None for a gap.
    limit, static_limit
        The largest force of friction, and that while it sticks; of a gap None, and what it bears that is pulled open.
    restitution
        Of a gap.
    is_poisson
        Whether its law of impact is Poisson's.
    """

    row: Constraint
    read: Expression
    mask: Expression
    force: Expression
    law: Law
    direction: Expression | None
    limit: Expression | None
    static_limit: Expression | None
    restitution: Expression | None
    is_poisson: bool = False

    @property
    def is_slip(self) -> bool:
        """Whether it is a slip, and not a gap."""
        return self.limit is not None

    @property
    def is_speed(self) -> bool:
        """Whether it is a gap at velocities, as a freewheel is."""
        return not self.is_slip and self.row.value is None

    def told(self, parts: Mapping[str, Part]) -> tuple[Told | None, Told | None]:
        """Return what is told where it closes and where it opens, with the words that its part has for it."""
        closes, opens = (None, None) if self.is_slip else (self.law.options.closes, self.law.options.opens)
        return closes, opens and opens._replace(target=opens.target_in(parts[self.row.key[0]].values))

    def is_closed_at_start(self, parts: Mapping[str, Part]) -> bool:
        """Return whether it is a gap that a start is to close."""
        return not self.is_slip and bool(self.law.options.is_closed_at_start(parts[self.row.key[0]].values))

    def towards(self, way: float) -> tuple[Expression, Expression]:
        """Return the limit and the static one of a slip that goes, or would go, in a direction; of a gap the second."""
        zero = self.mask.graph.zero
        limits = [zero if one is None else one for one in (self.limit, self.static_limit)]
        if self.direction is not None and len(self.law.options.reactions) == 1:
            limits = substitute(limits, {self.direction: way})
        return limits[0], limits[1]


@dataclass(frozen=True)
class Integral:
    """A constraint on positions that one on velocities, or several, turned out to be.

    Attributes
    ----------
    keys
        The constraints, as (part, law, number); it takes the place of the last one.
    value
        What stays zero, of time and coordinates.
    constant
        The constant that the start gives: a parameter, or zero.
    on_velocities
        Whether they are constraints on velocities, and not one on a single coordinate, which then stays where it is.
    """

    keys: tuple[tuple[str, str, int], ...]
    value: Expression
    constant: Expression
    on_velocities: bool = True


@dataclass(frozen=True)
class Equations:
    """The equations of motion of one form of a scene, with everything they were made of.

    Attributes
    ----------
    graph
        Where expressions live.
    forest
        How the configuration is computed.
    site
        Where parts are.
    locals_
        What the parts contribute.
    masses
        All inertia.
    shapes
        Shapes of the bodies.
    kinematics
        Positions, velocities, accelerations.
    time, coordinates, speeds, accelerations
        The symbols. There may be more coordinates than speeds; accelerations are the speeds' derivatives.
    names, speed_names
        Names and units of the coordinates and of the speeds.
    rates
        Derivatives of the coordinates, affine in the speeds; the speeds themselves without orientations in space.
    rows
        For each speed, inertial less applied generalized force; zero if there are no constraints.
    constraint_rows
        For each speed, the generalized force of the constraints; ``rows - constraint_rows = 0`` is the motion.
    constraints
        The constraints that are left.
    eliminated
        Coordinates that linear constraints gave as functions of the others, by name.
    prescribed
        Constraints that no coordinate can change and that depend on time, with their residuals.
    orientation_coordinates
        Groups of coordinates that stand for an orientation together.
    solved_speeds
        Speeds that constraints on velocities gave as functions of the others, by name.
    integrals
        Constraints on velocities that turned out to be ones on positions.
    read
        The multipliers that laws of force read, as functions of the state; `rows` has these in their place.
    states
        Continuous states of parts: the last of the coordinates, which no speed moves.
    rows_with_multipliers, rates_with_multipliers
        In maximal coordinates, rows and rates as they are: with the multipliers themselves; empty if none is read.
    decisions
        What was decided by the size of numbers on the way.
    constants
        Parameters that have their values from the start of the scene.
    contacts
        Gaps and slips; `read` gives the multipliers in them.
    """

    graph: Graph
    forest: SpanningForest
    site: Site
    locals_: Mapping[str, LocalPart]
    masses: Masses
    shapes: Mapping[int, BodyShape]
    kinematics: Kinematics
    time: Expression
    coordinates: tuple[Expression, ...]
    speeds: tuple[Expression, ...]
    accelerations: tuple[Expression, ...]
    names: tuple[Coordinate, ...]
    speed_names: tuple[Coordinate, ...]
    rates: tuple[Expression, ...]
    rows: tuple[Expression, ...]
    constraint_rows: tuple[Expression, ...]
    constraints: tuple[Constraint, ...]
    eliminated: tuple[str, ...]
    prescribed: tuple[tuple[tuple[str, str, int], Expression], ...]
    orientation_coordinates: tuple[OrientationCoordinates, ...] = ()
    solved_speeds: tuple[str, ...] = ()
    integrals: tuple[Integral, ...] = ()
    read: Mapping[Expression, Expression] = field(default_factory=dict)
    rows_with_multipliers: tuple[Expression, ...] = ()
    rates_with_multipliers: tuple[Expression, ...] = ()
    states: tuple[LocalState, ...] = ()
    decisions: tuple[Decision, ...] = ()
    constants: Mapping[Expression, Constant] = field(default_factory=dict)
    contacts: tuple[ContactRow, ...] = ()

    @property
    def placing(self) -> int:
        """Number of the coordinates that say where bodies are; those after them are states of parts."""
        return len(self.coordinates) - len(self.states)

    @property
    def multipliers(self) -> tuple[Expression, ...]:
        """The symbols of the multipliers."""
        return tuple(one.multiplier for one in self.constraints)

    @property
    def inputs(self) -> tuple[InputGroup, ...]:
        """The inputs (t, q, u, a, multipliers) of programs of a state and what follows from it."""
        return (
            InputGroup("t", (self.time,)),
            InputGroup("q", self.coordinates),
            InputGroup("u", self.speeds),
            InputGroup("a", self.accelerations),
            InputGroup("multipliers", self.multipliers),
        )

    @property
    def course(self) -> dict[Expression, Expression | float]:
        """The derivatives by time of time, coordinates and speeds, by symbol."""
        moving = zip((*self.coordinates, *self.speeds), (*self.rates, *self.accelerations), strict=True)
        return {self.time: 1.0, **dict(moving)}

    @property
    def contact_multipliers(self) -> tuple[Expression, ...]:
        """Of each gap and slip in turn the symbols of its multiplier: that of its row, and that which is read."""
        return tuple(symbol for one in self.contacts for symbol in (one.row.multiplier, one.read))

    @property
    def contact_forces(self) -> dict[Expression, Expression]:
        """What these are in terms of the state, where that is known."""
        return {symbol: self.read[symbol] for symbol in self.contact_multipliers if symbol in self.read}


def inertia_forces(
    site: Site,
    masses: Masses,
    kinematics: Kinematics,
    lifted: Lifted,
    forces: Forces,
) -> dict[int, list[Expression]]:
    """Return ``m (a - g)`` at the centre of mass of each body, and add the inertia of masses spread between nodes."""
    at_nodes, at_references = lifted
    at_centers: dict[int, list[Expression]] = {}
    for index, one in masses.bodies.items():
        at_centers[index] = [site.graph.convert(one.mass * a) for a in at_references[index]]
        if index in kinematics.angular_accelerations:
            spins = kinematics.angular_velocities[index], kinematics.angular_accelerations[index]
            forces.twist(index, [-c for c in inertial_torque(one.moment, *spins)])
    for spread in masses.coupled:
        for i, node in enumerate(spread.nodes):
            total: list[Scalar] = [0.0] * len(at_nodes[node])
            for j in range(len(spread.nodes)):
                total = [t + spread.masses[i][j] * a for t, a in zip(total, at_nodes[spread.nodes[j]], strict=True)]
            forces.push(node, [-t for t in total])
    for path, body in masses.varying:
        lifted_node = at_nodes[site.node(path, body.frame.name)]
        push_body(site, kinematics, forces, path, body, (lifted_node, (0.0,) * len(lifted_node)))
    return at_centers


def push_body(
    site: Site,
    kinematics: Kinematics,
    forces: Forces,
    path: str,
    body: BodyInertia,
    falling: tuple[Sequence[Scalar], Sequence[Scalar]],
) -> None:
    """Add the inertial force of a rigid body, taken to its frame's node."""
    space = site.space
    node = site.node(path, body.frame.name)
    index, turn = site.bodies.body_of[node], site.node_turns[node]
    arm = body_point_of(kinematics, index, turn, body.center_of_mass, space)
    parts = zip(falling[0], arm.acceleration, falling[1], strict=True)
    force = [site.graph.convert(-body.mass * (a + swing - g)) for a, swing, g in parts]
    forces.push(node, force)
    if not space.has_rotation:
        return
    about_node = torque_components(
        cross(space.vector(arm.position), space.vector(tuple(force))), kinematics.placements.axes.get(index), space
    )
    spins = kinematics.angular_velocities.get(index), kinematics.angular_accelerations.get(index)
    if spins[0] is None or spins[1] is None:
        forces.twist(index, about_node, node)
        return
    moment = turned_tensor(tensor_of(path, body), turn) if space.is_spatial else body.moment
    euler_torque = inertial_torque(moment, spins[0], spins[1])
    forces.twist(index, [t - i for t, i in zip(about_node, euler_torque, strict=True)], node)


def balance_rows(
    kinematics: Kinematics,
    at_centers: Mapping[int, Sequence[Expression]],
    forces: Forces,
    speeds: Sequence[Expression],
) -> list[Expression]:
    """Return, for each speed, the virtual power of inertial less other forces: one reverse sweep."""
    outputs: list[Expression] = []
    cotangents: list[Expression] = []
    for index, inertial in at_centers.items():
        outputs += kinematics.reference_velocities[index]
        cotangents += inertial
    for node, force in forces.on_nodes.items():
        outputs += kinematics.velocities[node]
        cotangents += [-f for f in force]
    for body, torque in forces.on_bodies.items():
        if body in kinematics.angular_velocities:
            outputs += kinematics.angular_velocities[body]
            cotangents += [-c for c in torque]
    for symbol, force_on_joint in forces.on_joints.items():
        outputs.append(kinematics.joint_rates[symbol])
        cotangents.append(-force_on_joint)
    kept = [(o, c) for o, c in zip(outputs, cotangents, strict=True) if not c.is_zero and not o.is_zero]
    if not kept:
        zero = forces.graph.constant(0.0)
        return [zero for _ in speeds]
    return vjp([o for o, _ in kept], [c for _, c in kept], list(speeds))


def motion_rows(
    site: Site,
    locals_: Mapping[str, LocalPart],
    masses: Masses,
    kinematics: Kinematics,
    lifted: Lifted,
    signals: Mapping[Expression, Expression],
    speeds: Sequence[Expression],
) -> list[Expression]:
    """Return, for each speed, inertial less applied generalized force."""
    forces = Forces(site.graph)
    at_centers = inertia_forces(site, masses, kinematics, lifted, forces)
    for local in locals_.values():
        part_forces(place_part(site, local, kinematics, signals), forces)
    return balance_rows(kinematics, at_centers, forces, speeds)


def force_rows(
    site: Site,
    locals_: Mapping[str, LocalPart],
    kinematics: Kinematics,
    chosen: Sequence[tuple[str, LocalConstraint, Expression]],
    signals: Mapping[Expression, Expression],
    speeds: Sequence[Expression],
) -> list[Expression]:
    """Return, for each speed, the generalized force of constraints with the given multipliers."""
    forces = Forces(site.graph)
    for path, constraint, multiplier in chosen:
        constraint_forces(place_part(site, locals_[path], kinematics, signals), constraint.value, multiplier, forces)
    return [-row for row in balance_rows(kinematics, {}, forces, speeds)]


def constraint_levels(
    values: Sequence[Expression],
    time: Expression,
    coordinates: Sequence[Expression],
    rates: Sequence[Expression],
    speeds: Sequence[Expression],
    accelerations: Sequence[Expression],
) -> tuple[list[Expression], list[Expression]]:
    """Return the first and second time derivatives of constraints on positions: one sweep for all of them."""
    first: dict[Expression, Expression | float] = {time: 1.0, **dict(zip(coordinates, rates, strict=True))}
    if not values:
        return [], []
    found = jvp(values, first)
    return found, jvp(found, {**first, **dict(zip(speeds, accelerations, strict=True))})
