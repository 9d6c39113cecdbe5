"""A rigid body in its principal axes, of a scene or in letters: energy, angular momentum, Euler's equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from atwood.arguments import FLAG, TEXT, one_of, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError, UsageError, check_known
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import observer
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import sympy
from atwood.mechanics.dynamics.inertia import CarriedInertia
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.initialization.start import find_start, own_state
from atwood.solids.properties import MassProperties
from atwood.theory.dynamics.dynamics import dynamics
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.sheet import FormulaSheet, Statement, statements_of
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
        raise UsageError("principal axes are of motions in space", where=where)
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
    check_known(part, frames, "there is no such rigid body")
    ends = mechanism.graph, mechanism.bodies, mechanism.locals_, mechanism.space
    carried = CarriedInertia(*ends, part, frames[part])
    given = [carried.mass, *carried.center_of_mass, *(entry for row in carried.inertia for entry in row)]
    found = mechanism.values_at_start(given)
    moments, axes = MassProperties(found[0], found[1:4], found[4:].reshape(3, 3)).principal()
    order: list[int] = []
    for k in range(3):  # each axis has the number of the part's axis that it is nearest to
        order.append(max((i for i in range(3) if i not in order), key=lambda i: abs(float(axes[k, i]))))
    axes = axes[:, order] * np.where(np.diag(axes[:, order]) < 0.0, -1.0, 1.0)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    spin = axes.T @ _vector(assembly, f"{part}.spin", start.time, q, u)
    return PrincipalBody(part, float(found[0]), found[1:4], moments[order], axes, spin)


def check_free(assembly: Assembly, part: str) -> None:
    """Refuse a body that a torque about its centre of mass acts on, at its start or as it turns otherwise there."""
    found, t, rng = dynamics(assembly), find_start(assembly).time, np.random.default_rng(5)
    q, start = found.start()
    moving = kinematic_map_of(assembly, assembly.form)
    others = () if found.equations.constraints else rng.normal(size=(2, len(start)))
    for u in (start, *others):  # what is constrained cannot have any speeds
        dq, du = moving.rates(t, q, u), found.forward_dynamics(q, u, t=t)
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
        Whether I_1 and I_2 of a body in letters are equal; of a scene's body they must be.
    symbols
        Other letters, such as ``{"I_1": "A"}``.

    Returns
    -------
    FormulaSheet
        ``T``, ``L``, ``euler``: the rates of the angular velocity under a torque N; ``T_angles`` and ``momenta`` in
        angles; ``energy`` and ``total``: of the whole motion. `FormulaSheet.numbers` are those of the scene's body.
    """
    own = None if scene is None else principal_body(smooth_assembly_of(scene), body)
    if own is not None:
        are_equal = bool(abs(own.moments[0] - own.moments[1]) <= 1e-9 * max(own.moments))
        if symmetric and not are_equal:
            told = "its moments of inertia across the third axis are {:.6g} and {:.6g}".format(*own.moments)
            raise UsageError(f"{told}, not equal", where=own.part, advice="Leave out `symmetric`.")
        symmetric = are_equal
    t, letters = sympy.Symbol("t"), sympy.symbols("I_1 I_1 I_3" if symmetric else "I_1 I_2 I_3")
    spins = list(rotation_kinematics(angles)["omega_body"])
    rates = [sympy.Function(name)(t).diff(t) for name in ("phi", "theta", "psi")]
    if symmetric and angles.endswith("z"):  # along axes that do not turn with the body about the third
        held = {one: sympy.Dummy() for one in rates} | {sympy.Function("psi")(t): sympy.Integer(0)}
        spins = [one.xreplace(held).xreplace({held[rate]: rate for rate in rates}) for one in spins]
    derived = [sympy.Add(*(i * w * w.diff(one) for i, w in zip(letters, spins, strict=True))) for one in rates]
    momenta = sympy.Matrix(sympy.symbols("p_phi p_theta p_psi"))
    by = dict(zip(sympy.symbols("I_1:4"), letters, strict=True))
    found = [
        *statements_of(_BODY),
        Statement("T_angles", f"Energy of turning in angles {angles}", _kinetic(letters, spins), sympy.Symbol("T_S")),
        Statement("momenta", "Momenta of the angles", sympy.Matrix(derived), momenta),
        *statements_of(_WHOLE),
    ]
    found = [replace(one, value=one.value.xreplace(by), left=one.left and one.left.xreplace(by)) for one in found]
    values = (
        {} if own is None else {"m": own.mass, **dict(zip(map(str, letters), map(float, own.moments), strict=True))}
    )
    title = "Rigid body" if own is None else f"Rigid body: {own.part}"
    return FormulaSheet(title, found, values).in_letters(symbols)


_BODY = """
T | Energy of turning about the centre of mass | T_S | (I_1*omega_1(t)**2 + I_2*omega_2(t)**2 + I_3*omega_3(t)**2)/2
L | Angular momentum about it, along the principal axes | L_1; L_2; L_3 | I_1*omega_1(t); I_2*omega_2(t); I_3*omega_3(t)
euler | Euler's equations | I_1*omega_1'; I_2*omega_2'; I_3*omega_3' | (I_2 - I_3)*omega_2(t)*omega_3(t) + N_1; (I_3 - I_1)*omega_3(t)*omega_1(t) + N_2; (I_1 - I_2)*omega_1(t)*omega_2(t) + N_3
"""  # noqa: E501

_WHOLE = """
energy | Energy of the whole motion: of its centre of mass, and about it | T | m*(x'**2 + y'**2 + z'**2)/2 + T_S
total | Angular momentum of the whole: orbital, and internal | L_x; L_y; L_z | m*(y(t)*z' - z(t)*y') + L_Sx; m*(z(t)*x' - x(t)*z') + L_Sy; m*(x(t)*y' - y(t)*x') + L_Sz
"""  # noqa: E501


def _kinetic(moments: Sequence[Sympy], spins: Sequence[Sympy]) -> Sympy:
    """Return the energy of turning, with what goes with one moment in one bracket."""
    squares: dict[Sympy, Sympy] = {}
    for moment, spin in zip(moments, spins, strict=True):
        squares[moment] = squares.get(moment, sympy.Integer(0)) + spin**2
    return sympy.Add(*(moment * square / 2 for moment, square in squares.items()))
