"""Hamilton's equations of a scene as a program, in coordinates that may be of any kind.

Let the rates of the coordinates be ``q' = f(q, u, t)``, affine in the speeds u. With a momentum P for each coordinate,
``H(q, P, t) = max_u [P f(q, u, t) - L(q, u, t)]`` has the equations

    q' = f,    P' = dL/dq - d(P f)/dq,    with u from  d(P f)/du = dL/du

(Pontryagin's form of the Legendre transform). Where rates are speeds, that is Goldstein's equation 8.18. For a
quaternion there are four momenta for three speeds: H on the larger space has the scene's motions as solutions, with the
size of the quaternion and its product with the momentum constant. Both are quadratic, so that methods of Gauss keep
them exactly (Hairer, Lubich and Wanner, Geometric Numerical Integration, theorem IV.2.1). Nothing is singular, and no
forces of constraints are needed. H itself is never written out: only L is differentiated.
"""

from __future__ import annotations

from atwood.errors import UnsupportedError, UsageError
from atwood.expr import (
    Expression,
    InputGroup,
    OutputGroup,
    Program,
    depends_on,
    jacobian,
    jacobian_by_rows,
    substitute,
    vjp,
)
from atwood.forms.accelerations import solve_symmetric
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key, as_by_hand
from atwood.forms.lagrangian import Lagrangian, lagrangian_along_speeds
from atwood.forms.loops.closed_form import ClosedForm, in_terms_of_independent
from atwood.forms.program import rates_are_speeds
from atwood.integrators.methods import EXPLICIT, IDA, advise
from atwood.lazy_dataclasses import dataclass, replace

_CANONICAL: Key[CanonicalPrograms] = Key("canonical equations")
_CLOSED: Key[CanonicalPrograms] = Key("canonical equations with solved loops")
_SEPARABLE: Key[SeparablePrograms | None] = Key("separable equations")


@dataclass(frozen=True, eq=False)
class CanonicalPrograms:
    """Hamilton's equations of a scene.

    Attributes
    ----------
    equations
        Program of (t, q, P), and of speeds if `moving_mass`, with q', P' and the speeds; these are left out where they
        are q'. With a moving mass the speeds are those after a step of Newton's method from those that were given.
    momenta
        Program of (t, q, u) with dL/du, and the derivatives of the rates by the speeds, row by row.
    moving_mass
        Whether the second derivatives of L by the speeds depend on these.
    plain
        Whether rates are speeds, so that P is dL/du.
    """

    equations: Program
    momenta: Program
    moving_mass: bool
    plain: bool


def canonical_programs(assembly: Assembly) -> CanonicalPrograms:
    """Return Hamilton's equations of a scene in the reduced form."""
    return assembly.shared.get(_CANONICAL, lambda: _make(assembly))


def closed_canonical_programs(assembly: Assembly, form: ClosedForm) -> CanonicalPrograms:
    """Return Hamilton's equations of a mechanism whose loops are solved by formulas.

    L is that of all coordinates with the formulas put in: holonomic constraints leave Lagrange's equations of the
    independent coordinates as they are (Goldstein, section 1.4). Branches are parameters after all others.
    """
    return assembly.shared.get(_CLOSED, lambda: _make_closed(assembly, form), form)


def is_canonical(assembly: Assembly) -> bool:
    """Return whether a scene is a Hamiltonian system in its coordinates, and no law calls a function in Python."""
    if assembly.reduced.constraints or not assembly.reduced.coordinates:
        return False
    try:
        found = canonical_programs(assembly)
    except (UnsupportedError, UsageError):
        return False
    return not found.equations.calls_python


@dataclass(frozen=True, eq=False)
class SeparablePrograms:
    """Hamilton's equations of a scene with ``H = T(p) + V(q, t)``.

    Attributes
    ----------
    forces
        Program of (t, q) with p'.
    velocities
        Program of p with q'.
    """

    forces: Program
    velocities: Program


def separable_programs(assembly: Assembly) -> SeparablePrograms | None:
    """Return Hamilton's equations of a scene whose H is the sum of a function of p and one of q, else None."""
    return assembly.shared.get(_SEPARABLE, lambda: _separate(assembly))


def _separate(assembly: Assembly) -> SeparablePrograms | None:
    found = canonical_programs(assembly)
    (time,), q, p = (group.symbols for group in found.equations.inputs[:3])
    if not found.plain or found.moving_mass:
        return None
    rates, pushes = (group.expressions for group in found.equations.outputs[:2])
    if any(depends_on(one, [time, *q]) for one in rates) or any(depends_on(one, p) for one in pushes):
        return None
    name, parameters = assembly.flat.name, assembly.parameters
    forces = Program(f"{name} (forces)", found.equations.inputs[:2], parameters, (OutputGroup("forces", pushes),))
    along = Program(f"{name} (velocities)", (found.equations.inputs[2],), parameters, (OutputGroup("rates", rates),))
    return SeparablePrograms(forces, along)


def _refuse(assembly: Assembly, found: Lagrangian, loops_are_solved: bool = False) -> None:
    """Refuse a scene that is no Hamiltonian system."""
    equations, name = assembly.reduced, assembly.flat.name
    advice = advise(EXPLICIT, IDA)
    if equations.solved_speeds or any(not one.holonomic for one in equations.constraints):
        raise UnsupportedError("it rolls, and its flow is not canonical", where=name, advice=advice)
    if equations.constraints and not loops_are_solved:
        what = "closed loops leave constraints among its coordinates, whose momenta are not free"
        raise UnsupportedError(what, where=equations.constraints[0].key[0], advice=advice)
    if equations.states:
        raise UnsupportedError("parts have states of their own, which have no momenta", where=name, advice=advice)
    for part in found.parts:
        if not part.rayleigh.is_zero or any(not force.is_zero for force in part.forces):
            raise UnsupportedError(
                "its forces do not follow from a Hamiltonian, and its flow is not canonical",
                where=part.path,
                advice=advice,
            )


def _make(assembly: Assembly) -> CanonicalPrograms:
    equations = assembly.reduced
    found = lagrangian_along_speeds(assembly, equations)
    _refuse(assembly, found)
    (lagrangian,) = as_by_hand(equations, assembly.parameters, _in_pieces(assembly, found.lagrangian))
    plain = rates_are_speeds(equations)
    return _hamilton(found, lagrangian, plain, assembly.flat.name, assembly.parameters)


def _in_pieces(assembly: Assembly, lagrangian: Expression) -> list[Expression]:
    return [lagrangian] if assembly.sides is None else assembly.sides.taken_out([lagrangian])


def _make_closed(assembly: Assembly, form: ClosedForm) -> CanonicalPrograms:
    found, free = lagrangian_along_speeds(assembly, assembly.reduced), form.loops.independent
    _refuse(assembly, found, loops_are_solved=True)
    if not form.loops.rates_are_speeds:
        what = "its loops leave orientations free"
        raise UnsupportedError(what, where=assembly.flat.name, advice=advise(EXPLICIT, IDA))
    q, u = found.coordinates, found.velocities
    dependent = [one for values in (q, u) for i, one in enumerate(values) if i not in free]
    (lagrangian,) = in_terms_of_independent(form, _in_pieces(assembly, found.lagrangian))
    if depends_on(lagrangian, dependent):
        what = "an energy reads an angle of its loops otherwise than by sine and cosine"
        raise UnsupportedError(what, where=assembly.flat.name, advice=advise(EXPLICIT, IDA))
    own = tuple(u[i] for i in free)
    solved = replace(
        found,
        coordinates=tuple(q[i] for i in free),
        names=tuple(found.names[i] for i in free),
        velocities=own,
        velocity_names=tuple(found.velocity_names[i] for i in free),
        rates=own,
    )
    name, parameters = f"{assembly.flat.name} (closed form)", (*assembly.parameters, *form.loops.branches)
    return _hamilton(solved, lagrangian, True, name, parameters)


def _hamilton(
    found: Lagrangian, lagrangian: Expression, plain: bool, name: str, parameters: tuple[Expression, ...]
) -> CanonicalPrograms:
    graph, q, u, rates = lagrangian.graph, list(found.coordinates), list(found.velocities), list(found.rates)
    p = [graph.symbol(f"P:{one.name}") for one in found.names]
    momenta = vjp([lagrangian], [graph.one], u)
    mass = jacobian(momenta, u)
    entries = mass.by_place
    entries = {place: one for place, one in entries.items() if place[0] <= place[1] and not one.is_zero}
    idle = [one.name for i, one in enumerate(found.velocity_names) if (i, i) not in entries]
    if idle:
        raise UnsupportedError(
            "it has no inertia, so that momenta do not determine velocities and there is no Hamiltonian",
            where=idle[0],
            advice=advise(EXPLICIT, IDA),
        )
    moving = any(depends_on(one, u) for one in entries.values())
    wanted = p if plain else vjp(rates, p, u)
    if moving:
        gaps = [a - b for a, b in zip(wanted, momenta, strict=True)]
        solution = [v + step for v, step in zip(u, solve_symmetric(entries, gaps), strict=True)]
    else:
        still = dict.fromkeys(u, 0.0)
        gaps = [a - b for a, b in zip(wanted, substitute(momenta, still), strict=True)]
        solution = solve_symmetric(entries, gaps)
    pushes = vjp([lagrangian], [graph.one], q)
    if not plain:
        pushes = [one - other for one, other in zip(pushes, vjp(rates, p, q), strict=True)]
    there = dict(zip(u, solution, strict=True))
    outputs = substitute([*rates, *pushes], there)
    n = len(q)
    groups = [InputGroup("t", (found.time,)), InputGroup("q", tuple(q)), InputGroup("p", tuple(p))]
    given = [OutputGroup("rates", tuple(outputs[:n])), OutputGroup("pushes", tuple(outputs[n:]))]
    if moving:
        groups.append(InputGroup("u", tuple(u)))
    if moving or not plain:
        given.append(OutputGroup("speeds", tuple(solution)))
    return CanonicalPrograms(
        Program(f"{name} (Hamilton's equations)", tuple(groups), parameters, tuple(given)),
        _momenta_program(found, plain, momenta, f"{name} (momenta)", parameters),
        moving,
        plain,
    )


def _momenta_program(
    found: Lagrangian, plain: bool, momenta: list[Expression], name: str, parameters: tuple[Expression, ...]
) -> Program:
    """Return the program of (t, q, u) with the momenta along the speeds, and how rates follow from speeds."""
    outputs = [OutputGroup("momenta", tuple(momenta))]
    if not plain:
        outputs.append(OutputGroup("rates by speeds", tuple(jacobian_by_rows(found.rates, found.velocities))))
    groups = (
        InputGroup("t", (found.time,)),
        InputGroup("q", found.coordinates),
        InputGroup("u", found.velocities),
    )
    return Program(name, groups, parameters, tuple(outputs))
