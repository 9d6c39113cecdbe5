"""Quantities of components by path, as expressions of the state, made when somebody asks for them.

A large scene has ten thousands of quantities, of which a run needs a few.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any

from atwood.display import count_of
from atwood.errors import AtwoodError, MissingNameError
from atwood.expr import Expression, Scalar, is_zero, jvp, live, substitute
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import PlacedPart, in_joint_coordinates, place_part
from atwood.mechanics.dynamics.inertia import CarriedInertia
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.kinematics.orientation import node_axes, spin_in_world
from atwood.mechanics.outputs.reactions import Reaction
from atwood.mechanics.outputs.totals import Totals, add_totals, add_up, energy_rate, of_mass, part_energies, part_totals
from atwood.model.declare.component import Binding, bind
from atwood.model.declare.connectors import Frame, JointCoordinate, Motion
from atwood.model.declare.law_results import call_law, law_value, not_evaluated, one_scalar
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import to_axes
from atwood.model.values.space import FIXED_AXES, ZERO, Vector


@dataclass(frozen=True)
class Observable:
    """A scalar quantity of a component.

    Attributes
    ----------
    path
        Its dotted path, such as ``rod1.tension``.
    unit
        SI unit.
    doc
        One line of meaning.
    periodic
        Whether it comes out within one turn and must be unwrapped.
    value
        The expression, of time, coordinates, speeds, accelerations and reactions.
    rate
        Path of its rate, for a periodic one; empty if none is said.
    sharing
        Of two angles that share a value at a pole: their paths, and that of the sign with which the second is added.
    """

    path: str
    unit: str
    doc: str
    periodic: bool
    value: Expression
    rate: str = ""
    sharing: tuple[str, ...] = ()


def take(
    mechanism: Mechanism,
    found: dict[str, Observable],
    path: str,
    value: Scalar | Vector,
    unit: str,
    doc: str,
    periodic: bool,
    rate: str = "",
) -> None:
    """Add a quantity to those found, component by component if it is a vector."""
    graph = mechanism.table.graph
    if isinstance(value, Vector):
        for axis in mechanism.space.reported(value, unit):
            name = f"{path}.{'xyz'[axis]}"
            found[name] = Observable(name, unit, doc, periodic, graph.convert(value[axis]))
    else:
        expression = graph.convert(value)
        found[path] = Observable(path, unit, doc, periodic and not _counts_turns(expression), expression, rate)


def _counts_turns(angle: Expression) -> bool:
    """Return whether an angle counts its turns by itself: it is a sum of coordinates, each with its own turns."""
    return all(node.is_parametric or node.is_symbol or node.operation in _SUMS for node in live([angle]))


_SUMS = frozenset(("add", "sub", "neg"))


def make_binding(
    mechanism: Mechanism,
    equations: Equations,
    local: LocalPart,
    reactions: Mapping[str, Expression],
    known: Mapping[str, Expression],
    energies: Mapping[str, Any],
    signals: Mapping[Expression, Expression],
) -> Binding:
    """Return what the laws of a part read when they may read everything."""
    path, site, kinematics, space = local.part.path, equations.site, equations.kinematics, mechanism.space
    motions = {}
    part = place_part(site, local, kinematics) if local.borrowed else PlacedPart(site, local, kinematics, {})
    for name, one in local.part.component.connectors().items():
        if isinstance(one, JointCoordinate):
            motions[name] = _joint_reference_in_place(equations, part, local.binding.motions.get(name))
            continue
        node = site.node(path, name)
        body = site.bodies.body_of[node]
        motion = Motion(
            position=space.vector(world_position(mechanism, kinematics.placements, node)),
            velocity=space.vector(kinematics.velocities[node]),
            acceleration=space.vector(kinematics.accelerations[node]),
        )
        if isinstance(one, Frame):
            motion = _turned(mechanism, equations, motion, node, body)
        carried = CarriedInertia(mechanism.graph, mechanism.bodies, mechanism.locals_, space, path, name)
        motions[name] = replace(motion, body=carried)
    values = dict(local.binding.values)
    for name, symbol in local.signal_symbols.items():
        values[name] = signals[symbol]
    return Binding(
        values=values,
        motions=motions,
        time=mechanism.time,
        space=space.name,
        line=space.line,
        line_signs=local.binding.line_signs,
        known=known,
        reactions=reactions,
        energies=energies,
    )


def _joint_reference_in_place(equations: Equations, part: PlacedPart, joint_reference: Motion | None) -> Motion:
    """Return a joint coordinate that a part takes hold of, in terms of the state; nothing at the joint itself."""
    if joint_reference is None:
        return Motion()
    found = [joint_reference.value, *(() if joint_reference.rate is None else (joint_reference.rate,))]
    value, *rates = part.put(in_joint_coordinates(part.local, part.kinematics, found)[0])
    if not rates:
        return Motion(value=value)
    return Motion(value=value, rate=rates[0], second_rate=lambda: jvp(rates, equations.course)[0])


def _turned(mechanism: Mechanism, equations: Equations, motion: Motion, node: int, body: int) -> Motion:
    kinematics = equations.kinematics
    if not mechanism.space.has_rotation:
        still = Vector(0.0, 0.0, 0.0)
        return Motion(motion.position, motion.velocity, motion.acceleration, FIXED_AXES, 0.0, still, still)
    placements = kinematics.placements
    turn, angle = equations.site.node_turns[node], placements.angles.get(body)
    axes = node_axes(angle, placements.axes.get(body), turn)
    if axes is None:
        return motion
    body_axes = placements.axes.get(body)
    return Motion(
        motion.position,
        motion.velocity,
        motion.acceleration,
        axes,
        None if angle is None else angle + turn,
        spin_in_world(kinematics.angular_velocities[body], body_axes),
        spin_in_world(kinematics.angular_accelerations[body], body_axes),
        to_axes(turn, Vector(*kinematics.angular_velocities[body])) if isinstance(turn, tuple) else None,
    )


MOMENTUM = "p:"
"""What the path of a momentum begins with, before that of its coordinate."""


def observe(
    mechanism: Mechanism,
    equations: Equations,
    reactions: Sequence[Reaction],
    lock: AbstractContextManager[Any] | None = None,
    momenta: Callable[[], Mapping[str, Observable]] | None = None,
) -> Mapping[str, Observable]:
    """Return every observable of every component, by path."""
    return Observables(mechanism, equations, reactions, lock or nullcontext(), momenta)


class Observables(Mapping[str, Observable]):
    """Every observable of a scene by path; those of a component are made when one of them is first asked for.

    Energies of a component are made by themselves, since starts and coordinates read all else.

    Parameters
    ----------
    mechanism, equations, reactions, lock, momenta
        See `observe`.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        equations: Equations,
        reactions: Sequence[Reaction],
        lock: AbstractContextManager[Any],
        momenta: Callable[[], Mapping[str, Observable]] | None = None,
    ) -> None:
        self._mechanism, self._lock, self._momenta = mechanism, lock, momenta
        self._reader = Reader(mechanism, equations, reactions)
        self._reactions = {one.path: one for one in reactions}
        self._of_laws: dict[str, dict[str, Observable]] = {}
        self._made: dict[str, dict[str, Observable]] = {}
        self._wholes: dict[str, Mapping[str, Observable]] = {}
        self._all: dict[str, Observable] | None = None

    def __repr__(self) -> str:
        # To count them would make them all.
        return f"<Observables of {count_of(len(self._mechanism.locals_), 'part')}, by path>"

    def __getitem__(self, path: str) -> Observable:
        if self._all is not None and path in self._all:
            return self._all[path]
        one = self._reactions.get(path)
        if one is not None:
            return Observable(one.path, one.unit, one.doc, False, one.symbol)
        if path.startswith(MOMENTUM) and self._momenta is not None:
            return self._momenta()[path]
        part = self._part_of(path)
        if part is None:
            return self._whole(path)[path]
        found = self._by_laws(part)
        return found[path] if path in found and not path.endswith(_ENERGY) else self._of(part)[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._everything())

    def __len__(self) -> int:
        return len(self._everything())

    def beside(self, path: str) -> Mapping[str, Observable]:
        """Return what laws say of the part that a path is of, without its energies; nothing where it is of none."""
        part = self._part_of(path)
        return {} if part is None else self._by_laws(part)

    def _part_of(self, path: str) -> str | None:
        part = path.rpartition(".")[0]
        while part and part not in self._mechanism.locals_:
            part = part.rpartition(".")[0]
        return part or None

    def _whole(self, path: str) -> Mapping[str, Observable]:
        """Return the quantities of the model, or the scene, that a path may be one of; they are not listed."""
        *steps, last = path.split(".")
        model = steps if last not in ("x", "y", "z") else steps[:-1]
        prefix = ".".join((*model, "")) if model else ""
        if not any(one.startswith(prefix) for one in self._mechanism.locals_):
            return {}
        if prefix not in self._wholes:
            with self._lock:
                self._wholes[prefix] = observe_totals(self._mechanism, prefix, self._reader.inside(prefix))
        return self._wholes[prefix]

    def _everything(self) -> dict[str, Observable]:
        if self._all is None:
            found = {path: one for part in self._mechanism.locals_ for path, one in self._of(part).items()}
            found.update({path: self[path] for path in self._reactions})
            self._all = found
        return self._all

    def _of(self, part: str) -> dict[str, Observable]:
        if part not in self._made:
            laws = self._by_laws(part)
            with self._lock:
                self._made[part] = {**laws, **_energies_of(self._mechanism, self._reader, part)}
        return self._made[part]

    def _by_laws(self, part: str) -> dict[str, Observable]:
        if part not in self._of_laws:
            with self._lock:
                self._of_laws[part] = _observe_part(self._mechanism, self._reader, part)
        return self._of_laws[part]


def beside(observables: Mapping[str, Observable], path: str) -> Mapping[str, Observable]:
    """Return those of the observables of a scene that are of the same part as a path, without its energies."""
    return observables.beside(path) if isinstance(observables, Observables) else observables


_ENERGY = "_energy"
"""What the paths of energies end with."""


def _energies_of(mechanism: Mechanism, reader: Reader, path: str) -> dict[str, Observable]:
    """Return the energies of one component; none where nothing of it has any."""
    found: dict[str, Observable] = {}
    local = mechanism.locals_[path]
    has_inertia = any(local.part.component.laws(kind) for kind in ("inertia", "lagrangian"))
    if has_inertia or local.potentials:
        kinetic, potential = reader.energies(path)
        if has_inertia:
            take(mechanism, found, f"{path}.kinetic_energy", kinetic, "J", "Kinetic energy.", False)
        take(mechanism, found, f"{path}.potential_energy", potential, "J", "Potential energy.", False)
    return found


def _observe_part(mechanism: Mechanism, reader: Reader, path: str) -> dict[str, Observable]:
    """Return every observable of one component that laws say, without its reactions and energies."""
    found: dict[str, Observable] = {}
    local = mechanism.locals_[path]
    bound = bind(local.part.component, reader.binding(local, with_energies=True))
    for law in local.part.component.laws("observable"):
        if not law.holds_in(mechanism.space.name):
            continue
        try:
            value = law_value(bound, law.name)
        except MissingNameError as error:  # a name that is misspelt
            raise not_evaluated(path, law, error) from error
        except (AtwoodError, ArithmeticError):
            continue  # it asks for an orientation that nothing determines, or for what never leaves a pole
        except Exception as error:  # whatever a law of somebody's own can raise
            raise not_evaluated(path, law, error) from error
        component = local.part.component
        if value is None and (law.name in component.contact_laws() or law.name in component.state_specs()):
            continue  # of a gap that the component does not have
        if isinstance(value, tuple) and law.name in component.state_specs():
            for i, one in enumerate(value):
                take(mechanism, found, f"{path}.{law.name}[{i}]", one, law.options.unit, law.options.doc, False)
            continue
        if not isinstance(value, Vector):
            value = call_law(path, law, partial(one_scalar, mechanism.table.graph, value))
        options = law.options
        rate = f"{path}.{options.rate}" if options.rate else ""
        take(mechanism, found, f"{path}.{law.name}", value, options.unit, options.doc, options.periodic, rate)
    # A rate that has no value tells no turns.
    found = {name: one if one.rate in found else replace(one, rate="") for name, one in found.items()}
    sharing: dict[str, list[str]] = {}
    for law in local.part.component.laws("observable"):
        if law.options.pole and f"{path}.{law.name}" in found:
            sharing.setdefault(f"{path}.{law.options.pole}", []).append(f"{path}.{law.name}")
    for pole, angles in sharing.items():
        if pole in found and len(angles) == 2:
            shared = (*angles, pole)  # also where it is a sum of coordinates by itself, as it is at a pole for ever
            found.update({angle: replace(found[angle], periodic=True, sharing=shared) for angle in angles})
    return found


class Reader:
    """What the laws of parts read when they may read everything.

    Parameters
    ----------
    mechanism, equations, reactions
        See `observe`.
    """

    def __init__(self, mechanism: Mechanism, equations: Equations, reactions: Sequence[Reaction]) -> None:
        self._mechanism, self._equations = mechanism, equations
        self._signals = resolve_signals(mechanism, equations.site, equations.kinematics, equations.read)
        self._energies: dict[str, tuple[Expression, Expression]] = {}
        self._around: dict[str, _Around] = {}
        self._totals: dict[str, Totals] = {}
        self._reactions: dict[str, dict[str, Expression]] = {}
        for one in reactions:
            self._reactions.setdefault(one.key[0], {})[one.path[len(one.key[0]) + 1 :]] = one.symbol
        self._known: dict[str, dict[str, Expression]] = {}
        for symbol, value in equations.kinematics.placements.joint_coordinates.items():
            part, _, name = symbol.name.rpartition(".")
            self._known.setdefault(part, {})[name] = value

    def energies(self, path: str) -> tuple[Expression, Expression]:
        """Return kinetic and potential energy of one part."""
        if path not in self._energies:
            self._energies[path] = part_energies(self._mechanism, self._equations, path, self._signals)
        return self._energies[path]

    def totals(self, path: str) -> Totals:
        """Return mass, momentum and inertia of one part."""
        if path not in self._totals:
            self._totals[path] = part_totals(self._mechanism, self._equations, path)
        return self._totals[path]

    def rate_of(self, energy: Expression) -> Expression:
        """Return how fast an energy changes along the motion."""
        return energy_rate(self._equations, energy)

    def binding(self, local: LocalPart, with_energies: bool = False) -> Binding:
        """Return what the laws of a part read."""
        path = local.part.path
        known, zero = self._known.get(path, {}), self._mechanism.table.graph.zero
        across = {name: zero for name, value in local.binding.reactions.items() if is_zero(value)}  # of a plane
        own = {**across, **self._reactions.get(path, {}), **self._pressing(path)}
        energies: Mapping[str, Any] = self._around_part(local) if with_energies else {}
        return make_binding(self._mechanism, self._equations, local, own, known, energies, self._signals)

    def _pressing(self, path: str) -> Mapping[str, Expression]:
        """Return the forces of gaps and slips of a part, by the name of the reaction."""
        rows = [one for one in self._equations.contacts if one.row.key[0] == path]
        forces = substitute([one.force for one in rows], dict(self._equations.read)) if rows else []
        found = dict(zip((one.row.reaction for one in rows), forces, strict=True))
        local, kinematics = self._mechanism.locals_[path], self._equations.kinematics
        if local.rubs:
            forces, _ = in_joint_coordinates(local, kinematics, list(local.rubs.values()))
            placed = place_part(self._equations.site, local, kinematics, self._signals).put(forces)
            found |= dict(zip(local.rubs, placed, strict=True))
        return found

    def _around_part(self, local: LocalPart) -> Mapping[str, Any]:
        owner = local.part.component._parent
        return self.inside(f"{owner.path}." if owner is not None and owner.path else "")

    def inside(self, prefix: str) -> Mapping[str, Any]:
        """Return energies and totals of all parts whose paths begin alike; of the scene, with no beginning."""
        if prefix not in self._around:
            self._around[prefix] = _Around(self, [p for p in self._mechanism.locals_ if p.startswith(prefix)])
        return self._around[prefix]


class _Around(Mapping[str, Any]):
    """Energies and totals of some parts together, added up when they are asked for."""

    def __init__(self, reader: Reader, parts: Sequence[str]) -> None:
        self._reader, self._parts = reader, parts
        self._made: dict[str, Any] = {}

    def __getitem__(self, kind: str) -> Any:
        if kind not in self._made:
            if kind in _ENERGIES:
                number = _ENERGIES.index(kind)
                self._made[kind] = add_up([self._reader.energies(path)[number] for path in self._parts])
            elif kind == "power":
                self._made[kind] = self._reader.rate_of(self["kinetic"] + self["potential"])
            elif kind in _TOTALS:
                whole = add_totals([self._reader.totals(path) for path in self._parts])
                self._made.update({name: getattr(whole, name) for name in _TOTALS})
            else:
                raise KeyError(kind)
        return self._made[kind]

    def __contains__(self, kind: object) -> bool:
        return kind in (*_ENERGIES, "power", *_TOTALS)

    def __iter__(self) -> Iterator[str]:
        return iter((*_ENERGIES, "power", *_TOTALS))

    def __len__(self) -> int:
        return len(_ENERGIES) + 1 + len(_TOTALS)


_ENERGIES = ("kinetic", "potential")
_TOTALS = ("mass", "first_moment", "momentum", "angular_momentum", "moments", "products")


def observe_totals(mechanism: Mechanism, prefix: str, around: Mapping[str, object]) -> dict[str, Observable]:
    """Return the quantities of a model as a whole, by path."""
    found: dict[str, Observable] = {}
    for name, value, unit, doc in _quantities(mechanism.space.name, around):
        take(mechanism, found, f"{prefix}{name}", value, unit, doc, False)
    return found


def _quantities(space: str, around: Mapping[str, object]) -> Iterator[tuple[str, Scalar, str, str]]:
    read: Mapping[str, Scalar] = around
    mass, first = read["mass"], read["first_moment"]
    yield "mass", mass, "kg", "Mass of all parts."
    has_mass = not is_zero(mass)  # else nothing has a centre
    if has_mass:
        yield "center_of_mass", first / mass, "m", "Centre of mass in world axes."
    yield "momentum", read["momentum"], "kg*m/s", "Momentum in world axes."
    yield "kinetic_energy", read["kinetic"], "J", "Kinetic energy of all parts."
    yield "potential_energy", read["potential"], "J", "Potential energy of all parts."
    yield "total_energy", read["kinetic"] + read["potential"], "J", "Kinetic and potential energy of all parts."
    yield "power", read["power"], "W", "Rate of the kinetic and potential energy of all parts."
    # about the centre of mass, by the parallel-axis theorem
    own = of_mass(-1.0 / mass if has_mass else 0.0, first, first, ZERO)
    moments = read["moments"] + own.moments
    if space == "space":
        yield "angular_momentum", read["angular_momentum"], "kg*m^2/s", "Angular momentum about the world's origin."
        yield "moments", moments, "kg*m^2", "Entries Jxx, Jyy, Jzz about the centre of mass, in world axes."
        yield "products", read["products"] + own.products, "kg*m^2", "Entries Jxy, Jxz, Jyz, likewise."
    elif space == "plane":
        turning = read["angular_momentum"].y * -1.0
        yield "angular_momentum", turning, "kg*m^2/s", "Angular momentum about the origin, counter-clockwise."
        yield "moment", moments.y, "kg*m^2", "Moment of inertia about the centre of mass."
