"""Rotations in angles: the matrix, angular velocities and rates belong together, and are those of runs."""

import numpy as np
import pytest
import sympy

import atwood
from atwood import UsageError, rotation_kinematics
from atwood.expr import OutputGroup, Program
from atwood.forms.program import state_groups
from atwood.theory.rigid.angles import SEQUENCES
from atwood_library.scenes import FreeBody

T = sympy.Symbol("t")
NAMES = ("phi", "theta", "psi")


def skew(w: sympy.Matrix) -> sympy.Matrix:
    return sympy.Matrix([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def at(value: sympy.Matrix, motion: dict) -> sympy.Matrix:
    """Return a matrix at t = 7/10 of a motion, to 50 digits."""
    return value.subs(motion).doit().subs(T, sympy.Rational(7, 10)).evalf(50)


def is_zero(value: sympy.Matrix) -> bool:
    return all(abs(one) < sympy.Float("1e-45", 50) for one in value)


@pytest.mark.sample(4)
@pytest.mark.parametrize("turns", ["moving", "fixed"])
@pytest.mark.parametrize("angles", SEQUENCES)
def test_matrix_angular_velocity_and_rates_belong_together(angles: str, turns: str) -> None:
    sheet = rotation_kinematics(angles, turns)
    motion = {sympy.Function(n)(T): f for n, f in zip(NAMES, (T**2 + 1, T / 3 + 1, 2 - T**3 / 5), strict=True)}
    r = at(sheet["R"], motion)
    assert is_zero(r.T * r - sympy.eye(3))
    assert is_zero(at(sheet["A"], motion) - r.T)
    rate = at(sheet["R"].diff(T), motion)
    body, space = at(sheet["omega_body"], motion), at(sheet["omega_space"], motion)
    assert is_zero(r.T * rate - skew(body))
    assert is_zero(rate * r.T - skew(space))
    for name, letters, spin in (("rates", "123", body), ("rates_from_space", "xyz", space)):
        values = {sympy.Symbol(f"omega_{one}"): w for one, w in zip(letters, spin, strict=True)}
        left = sympy.Matrix(list(next(s for s in sheet.statements if s.name == name).left))
        assert is_zero(at(sheet[name], motion).subs(values).evalf(50) - at(left, motion))
    wave = sympy.sin if angles[0] == angles[2] else sympy.cos
    assert sheet["singular"] == wave(sympy.Function("theta")(T))


@pytest.mark.parametrize("angles", SEQUENCES)
def test_fixed_axes_are_moving_ones_in_the_other_order(angles: str) -> None:
    own = [sympy.Function(name)(T) for name in NAMES]
    swapped = {own[0]: own[2], own[2]: own[0]}
    assert rotation_kinematics(angles, "fixed")["R"] == rotation_kinematics(angles[::-1])["R"].xreplace(swapped)


def test_goldstein_s_matrix_and_rates() -> None:
    phi, theta, psi = (sympy.Function(name)(T) for name in NAMES)
    (s1, c1), (s2, c2), (s3, c3) = ((sympy.sin(a), sympy.cos(a)) for a in (phi, theta, psi))
    book = sympy.Matrix(  # equation 4.46
        [
            [c3 * c1 - c2 * s1 * s3, c3 * s1 + c2 * c1 * s3, s3 * s2],
            [-s3 * c1 - c2 * s1 * c3, -s3 * s1 + c2 * c1 * c3, c3 * s2],
            [s2 * s1, -s2 * c1, c2],
        ]
    )
    sheet = rotation_kinematics("zxz")
    assert (sheet["A"] - book).expand() == sympy.zeros(3, 3)
    spin = sympy.Matrix(  # equation 4.87
        [
            phi.diff(T) * s2 * s3 + theta.diff(T) * c3,
            phi.diff(T) * s2 * c3 - theta.diff(T) * s3,
            phi.diff(T) * c2 + psi.diff(T),
        ]
    )
    assert (sheet["omega_body"] - spin).expand() == sympy.zeros(3, 1)


def test_quaternions() -> None:
    sheet = rotation_kinematics("quaternion")
    raw = [1 + T, T**2, sympy.Rational(1, 3) - T, 2 * T]
    size = sympy.sqrt(sum(one**2 for one in raw))
    motion = {sympy.Function(f"q_{k}")(T): one / size for k, one in enumerate(raw)}
    r, rate = at(sheet["R"], motion), at(sheet["R"].diff(T), motion)
    body, space = at(sheet["omega_body"], motion), at(sheet["omega_space"], motion)
    assert is_zero(r.T * r - sympy.eye(3))
    assert is_zero(r.T * rate - skew(body))
    assert is_zero(rate * r.T - skew(space))
    left = at(sympy.Matrix([one.diff(T) for one in motion]), motion)
    for name, letters, spin in (("rates", "123", body), ("rates_from_space", "xyz", space)):
        values = {sympy.Symbol(f"omega_{one}"): w for one, w in zip(letters, spin, strict=True)}
        assert is_zero(at(sheet[name], motion).subs(values).evalf(50) - left)


@pytest.mark.sample(13)
@pytest.mark.parametrize("kind", ["quaternion", *(f"euler-{one}" for one in SEQUENCES)])
def test_the_rates_are_those_of_a_scene(kind: str) -> None:
    assembly = atwood.assemble(FreeBody(), orientation=kind)
    e = assembly.reduced
    program = Program("rates", state_groups(e), assembly.parameters, (OutputGroup("rates", e.rates),))
    (orientation,) = e.orientation_coordinates
    rng = np.random.default_rng(3)
    q, u = rng.uniform(0.2, 1.2, len(e.coordinates)), rng.normal(size=len(e.speeds))
    own = list(orientation.coordinates)
    if kind == "quaternion":
        q[own] /= np.linalg.norm(q[own])
    found = np.asarray(assembly.kernel(program)([0.0], q, u)[0])[own]
    names = [f"q_{k}" for k in range(4)] if kind == "quaternion" else NAMES
    values = {sympy.Function(n)(T): v for n, v in zip(names, q[own], strict=True)}
    values |= {sympy.Symbol(f"omega_{k + 1}"): u[i] for k, i in enumerate(orientation.speeds)}
    expected = rotation_kinematics(kind.removeprefix("euler-"))["rates"].subs(values)
    assert found == pytest.approx(np.array(expected, dtype=float).ravel(), abs=1e-13)


def test_how_it_is_written() -> None:
    sheet = rotation_kinematics("zxz", symbols={"phi": "alpha", "theta": "beta"})
    assert "ω₃ = ψ̇ + α̇ cos β" in sheet.text()
    assert r"\omega_{3} &= \dot{\psi} + \dot{\alpha} \cos \beta" in sheet.latex()
    assert "Rates from the angular velocity along the axes of the body" in sheet.markdown()
    assert set(sheet.to_data()) == {*sheet}
    assert "beta" in sheet.to_data()["singular"]["formula"]
    assert sheet["singular"] == sympy.sin(sympy.Function("beta")(T))
    with pytest.raises(UsageError, match="no formula has this letter"):
        rotation_kinematics("zxz", symbols={"chi": "alpha"})
    with pytest.raises(UsageError, match="'zzx'"):
        rotation_kinematics("zzx")
    with pytest.raises(UsageError, match="there is no such formula"):
        sheet["omega"]
