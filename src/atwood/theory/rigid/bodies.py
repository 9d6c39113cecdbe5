"""A rigid body in its principal axes, of a scene or in letters: energy, angular momentum, Euler's equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from atwood.arguments import FLAG, TEXT, one_of, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError, UsageError, suggestion
from atwood.expr import OutputGroup, Program, evaluate
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.forms.quantities import observer
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.mechanics.dynamics.inertia import CarriedInertia
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.simulation.initialization.start import find_start
from atwood.solids.properties import MassProperties
from atwood.theory.dynamics.dynamics import dynamics
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.sheet import FormulaSheet, Statement
from atwood.theory.rigid.angles import SEQUENCES, rotation_kinematics

_STILL = 1e-5
"""Relative to angular momentum times angular velocity: what a difference quotient leaves of no torque."""


@dataclass(frozen=True, eq=False)
class PrincipalBody:
    """A rigid body of a scene, with all that is fixed to it.

    Attributes
    ----------
    part
        Path of the part that its axes are of.
    mass
        kg.
    centre
        Centre of mass in the axes of the part, from its frame, m.
    moments
        Principal moments of inertia about the centre of mass, kg m^2: in the order of the part's axes that they are
        nearest to, so that of a symmetric body the third is the one that differs where its axis is z.
    axes
        Principal axes as columns, in the axes of the part: right-handed.
    spin
        Angular velocity at the start along them, rad/s.
    """

    part: str
    mass: float
    centre: FloatArray
    moments: FloatArray
    axes: FloatArray
    spin: FloatArray


def principal_body(assembly: Assembly, body: str | None = None) -> PrincipalBody:
    """Return a rigid body of a scene, the only one if it is not named."""
    where, mechanism = assembly.flat.name, assembly.mechanism
    if assembly.flat.space.name != "space":
        raise UsageError("principal axes are of bodies in space", where=where)
    frames = {
        path: one.frame.name
        for path, local in mechanism.locals_.items()
        for one in local.body_inertias
        if f"{path}.spin.x" in assembly.observables
        and not mechanism.bodies.bodies[
            mechanism.bodies.body_of[mechanism.graph.node_of[path, one.frame.name]]
        ].is_fixed
    }
    if body is None and len(frames) != 1:
        advice = f"Name one with body=: {', '.join([*frames][:6])}." if frames else "Add a RigidBody, or a Box."
        raise UsageError(f"it has {len(frames)} rigid bodies", where=where, advice=advice)
    part = next(iter(frames)) if body is None else body
    if part not in frames:
        raise UsageError("there is no such rigid body", where=part, advice=suggestion(part, frames))
    ends = mechanism.graph, mechanism.bodies, mechanism.locals_, mechanism.space
    carried, graph = CarriedInertia(*ends, part, frames[part]), mechanism.table.graph
    given = [carried.mass, *carried.center_of_mass, *(entry for row in carried.inertia for entry in row)]
    found = np.array(evaluate([graph.convert(one) for one in given], mechanism.known_at_start()))
    moments, axes = MassProperties(found[0], found[1:4], found[4:].reshape(3, 3)).principal()
    order: list[int] = []
    for k in range(3):  # each axis has the number of the part's axis that it is nearest to
        order.append(max((i for i in range(3) if i not in order), key=lambda i: abs(float(axes[k, i]))))
    axes = axes[:, order] * np.where(np.diag(axes[:, order]) < 0.0, -1.0, 1.0)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    q, u = dynamics(assembly).start()
    spin = axes.T @ _vector(assembly, f"{part}.spin", find_start(assembly).time, q, u)
    return PrincipalBody(part, float(found[0]), found[1:4], moments[order], axes, spin)


def check_free(assembly: Assembly, part: str) -> None:
    """Refuse a body that a torque about its centre of mass acts on, at its start or as it turns otherwise there."""
    found, t, rng = dynamics(assembly), find_start(assembly).time, np.random.default_rng(5)
    q, start = found.start()
    rates = OutputGroup("rates", found.equations.rates)
    program = Program(f"{part} rates", state_groups(found.equations), assembly.parameters, (rates,))
    others = () if found.equations.constraints else rng.normal(size=(2, len(start)))
    for u in (start, *others):  # what is constrained cannot have any speeds
        dq, du = np.asarray(assembly.kernel(program)([t], q, u)[0]), found.forward_dynamics(q, u, t=t)
        scale = 1e-5 / (1e-300 + float(np.max(np.abs(u))))
        before, after = (
            _vector(assembly, f"{part}.angular_momentum", t, q + step * dq, u + step * du) for step in (-scale, scale)
        )
        size = float(np.linalg.norm(before)) * float(np.max(np.abs(u)))
        if float(np.linalg.norm(after - before)) / (2.0 * scale) > _STILL * size:
            raise UnsupportedError(
                "a torque acts on it about its centre of mass, so that it does not turn freely",
                where=f"{assembly.flat.name}: {part}",
                advice="For a top on its tip there is `symmetric_top`.",
            )


def _vector(assembly: Assembly, path: str, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
    """Return a vector of a part at a state."""
    idle = np.zeros(len(assembly.own_equations.accelerations)), np.zeros(len(assembly.reactions))
    program = observer(assembly, tuple(f"{path}.{axis}" for axis in "xyz"))
    return np.asarray(assembly.kernel(program)([t], q, u, *idle)[0], dtype=float)


@takes(scene=optional(SCENE), body=optional(TEXT), angles=one_of(SEQUENCES), symmetric=FLAG, symbols=SYMBOLS)
def rigid_body(
    scene: Model | Assembly | None = None,
    body: str | None = None,
    *,
    angles: str = "zxz",
    symmetric: bool = False,
    symbols: Mapping[str, str] | None = None,
) -> FormulaSheet:
    """Return energy, angular momentum and Euler's equations of a rigid body, in its principal axes and in angles.

    The angular momentum is that of the centre of mass and that about it, ``L = m r x v + L_S``, and the energy
    likewise (Goldstein, sections 1.2, 5.1 and 5.5).

    Parameters
    ----------
    scene
        A scene whose body gives its values; a body in letters alone if not given.
    body
        Path of a part that is a rigid body, with all that is fixed to it; the only one if not given.
    angles
        Axes of three turns, see `rotation_kinematics`.
    symmetric
        Whether I_1 and I_2 are equal; so they are where those of the scene's body are.
    symbols
        Other letters, such as ``{"I_1": "A"}``.

    Returns
    -------
    FormulaSheet
        ``T``, ``L``, ``euler``: the rates of the angular velocity under a torque N; ``T_angles`` and ``momenta`` in
        angles; ``energy`` and ``total``: of the whole motion. `FormulaSheet.numbers` are those of the scene's body.
    """
    own = None if scene is None else principal_body(assembly_of(scene), body)
    symmetric = symmetric or (own is not None and bool(abs(own.moments[0] - own.moments[1]) <= 1e-9 * max(own.moments)))
    t, w, torque = sympy.Symbol("t"), spin_functions(), sympy.symbols("N_1:4")
    letters = moment_letters(symmetric)
    spins = list(rotation_kinematics(angles)["omega_body"])
    rates = [sympy.Function(name)(t).diff(t) for name in ("phi", "theta", "psi")]
    if symmetric and angles.endswith("z"):  # along axes that do not turn with the body about the third
        held = {one: sympy.Dummy() for one in rates}
        still = {sympy.Function("psi")(t): sympy.Integer(0)}
        spins = [one.xreplace(held).xreplace(still).xreplace({v: k for k, v in held.items()}) for one in spins]
    in_angles = kinetic(letters, spins)
    derived = [sympy.Add(*(i * w * w.diff(one) for i, w in zip(letters, spins, strict=True))) for one in rates]
    i1, i2, i3 = letters
    x, y, z = (sympy.Function(name)(t) for name in "xyz")
    m, place = sympy.Symbol("m"), sympy.Matrix([x, y, z])
    internal = sympy.Matrix(sympy.symbols("L_Sx L_Sy L_Sz"))
    euler = sympy.Matrix([(i2 - i3) * w[1] * w[2], (i3 - i1) * w[2] * w[0], (i1 - i2) * w[0] * w[1]])
    momenta = sympy.Matrix([sympy.Symbol(f"p_{name}") for name in ("phi", "theta", "psi")])
    own_axes = "along the principal axes"
    found = [
        Statement("T", "Energy of turning about the centre of mass", kinetic(letters, w), sympy.Symbol("T_S")),
        Statement(
            "L", f"Angular momentum about it, {own_axes}", _each(letters, w), sympy.Matrix(sympy.symbols("L_1:4"))
        ),
        Statement(
            "euler", "Euler's equations", euler + sympy.Matrix(torque), _each(letters, [one.diff(t) for one in w])
        ),
        Statement("T_angles", f"Energy of turning in angles {angles}", in_angles, sympy.Symbol("T_S")),
        Statement("momenta", "Momenta of the angles", sympy.Matrix(derived), momenta),
        Statement(
            "energy",
            "Energy of the whole motion: of its centre of mass, and about it",
            m * sum(one.diff(t) ** 2 for one in place) / 2 + sympy.Symbol("T_S"),
            sympy.Symbol("T"),
        ),
        Statement(
            "total",
            "Angular momentum of the whole motion: orbital, and internal",
            m * place.cross(place.diff(t)) + internal,
            sympy.Matrix(sympy.symbols("L_x L_y L_z")),
        ),
    ]
    values = (
        {} if own is None else {"m": own.mass, **dict(zip(map(str, letters), map(float, own.moments), strict=True))}
    )
    title = "Rigid body" if own is None else f"Rigid body: {own.part}"
    return FormulaSheet(title, found, values).in_letters(symbols)


def moment_letters(symmetric: bool = False) -> tuple[Sympy, Sympy, Sympy]:
    """Return the letters of the principal moments; of a symmetric body the first two are one."""
    one, two, three = sympy.symbols("I_1:4")
    return one, one if symmetric else two, three


def spin_functions() -> list[Sympy]:
    """Return the angular velocity along the principal axes, as functions of t."""
    return [sympy.Function(f"omega_{k}")(sympy.Symbol("t")) for k in (1, 2, 3)]


def kinetic(moments: Sequence[Sympy], spins: Sequence[Sympy]) -> Sympy:
    """Return the energy of turning, with what goes with one moment in one bracket."""
    squares: dict[Sympy, Sympy] = {}
    for moment, spin in zip(moments, spins, strict=True):
        squares[moment] = squares.get(moment, sympy.Integer(0)) + spin**2
    return sympy.Add(*(moment * square / 2 for moment, square in squares.items()))


def _each(moments: Sequence[Sympy], values: Sequence[Sympy]) -> Sympy:
    return sympy.Matrix([moment * one for moment, one in zip(moments, values, strict=True)])
