"""Rigid bodies in letters: energy, angular momentum and Euler's equations, against scenes."""

import numpy as np
import pytest
import sympy

import atwood
from atwood import UnsupportedError, UsageError, dynamics, rigid_body
from atwood.theory.rigid.bodies import check_free, principal_body
from atwood_library import Box, PointMass, Weld
from atwood_library.scenes import (
    DoublePendulum,
    FreeBody,
    FreeSymmetricBody,
    HeavyTop,
    IntermediateAxis,
    LagrangeTop,
)

T = sympy.Symbol("t")
I1, I2, I3 = sympy.symbols("I_1:4")
W = [sympy.Function(f"omega_{k}")(T) for k in (1, 2, 3)]


def test_euler_s_equations_are_those_of_a_scene() -> None:
    sheet, found = rigid_body(IntermediateAxis()), dynamics(IntermediateAxis())
    q, _ = found.start()
    u = np.random.default_rng(1).normal(size=6)
    own = [i for i, name in enumerate(found.speeds) if "spin" in name or "omega" in name or "angular" in name]
    assert len(own) == 3
    values = dict(zip(W, u[own], strict=True)) | {sympy.Symbol(k): v for k, v in sheet.numbers.items()}
    values |= dict.fromkeys(sympy.symbols("N_1:4"), 0)
    right = np.array(sheet["euler"].subs(values), dtype=float).ravel()
    assert found.forward_dynamics(q, u)[own] == pytest.approx(right / [1.0, 2.0, 3.0], abs=1e-13)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_energy_and_angular_momentum_along_a_run(form: str) -> None:
    result = atwood.simulate(FreeBody(), t_end=2.0, rtol=1e-10, form=form)
    sheet = rigid_body(FreeBody())
    numbers = {sympy.Symbol(k): v for k, v in sheet.numbers.items()}
    written = sympy.lambdify(W, [sheet["T"].subs(numbers), sheet["L"].subs(numbers).norm()])
    energy, size = written(*(result[f"body.spin.{axis}"] for axis in "xyz"))
    assert result["body.turning_energy"] == pytest.approx(energy, rel=1e-12)
    momentum = np.linalg.norm([result[f"body.angular_momentum.{axis}"] for axis in "xyz"], axis=0)
    assert momentum == pytest.approx(size, rel=1e-12)


@pytest.mark.parametrize("angles", ["zxz", "zyz", "xyz"])
@pytest.mark.parametrize("symmetric", [False, True])
def test_energy_and_momenta_in_angles(angles: str, symmetric: bool) -> None:
    sheet = rigid_body(angles=angles, symmetric=symmetric)
    spins = atwood.rotation_kinematics(angles)["omega_body"]
    letters = (I1, I1, I3) if symmetric else (I1, I2, I3)
    energy = sum(i * w**2 / 2 for i, w in zip(letters, spins, strict=True))
    assert sympy.simplify(sympy.expand(sheet["T_angles"] - energy)) == 0
    rates = [sympy.Function(name)(T).diff(T) for name in ("phi", "theta", "psi")]
    for momentum, rate in zip(sheet["momenta"], rates, strict=True):
        assert sympy.expand(momentum - sheet["T_angles"].diff(rate)) == 0


def test_the_symmetric_body_as_in_books() -> None:
    text = rigid_body(FreeSymmetricBody()).text()
    assert "T_S = ½ I₁ (θ̇² + φ̇² sin² θ) + ½ I₃ (ψ̇ + φ̇ cos θ)²" in text
    assert "p_φ = I₁ φ̇ sin² θ + I₃ cos θ (ψ̇ + φ̇ cos θ)" in text
    assert "I₁ ω̇₁ = (I₁ - I₃) ω₂ ω₃ + N₁" in text
    assert "I₃  1.6" in text


def test_orbital_and_internal_parts_make_the_whole() -> None:
    scene = IntermediateAxis()
    scene.start.update({"body.velocity.x": 0.4, "body.velocity.y": -0.3, "body.position.z": 1.5})
    result = atwood.simulate(scene, t_end=1.0, rtol=1e-10)
    sheet = rigid_body(scene)
    names = {sympy.Function(n)(T): result[f"body.position.{n}"][-1] for n in "xyz"}
    rates = {sympy.Function(n)(T).diff(T): result[f"body.velocity.{n}"][-1] for n in "xyz"}
    own = {sympy.Symbol(f"L_S{n}"): result[f"body.angular_momentum.{n}"][-1] for n in "xyz"}
    values = {sympy.Symbol("m"): sheet.numbers["m"], sympy.Symbol("T_S"): result["body.turning_energy"][-1], **own}
    whole = np.array(sheet["total"].subs(rates).subs(names).subs(values), dtype=float).ravel()
    assert whole == pytest.approx([result[f"angular_momentum.{n}"][-1] for n in "xyz"], abs=1e-9)
    energy = float(sheet["energy"].subs(rates).subs(values))
    assert energy == pytest.approx(result["body.kinetic_energy"][-1], rel=1e-9)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_principal_axes_are_near_those_of_the_part(form: str) -> None:
    top = principal_body(atwood.assemble(LagrangeTop(), form=form))
    assert top.moments == pytest.approx([0.015, 0.015, 0.01])
    assert top.axes == pytest.approx(np.eye(3))
    assert top.spin == pytest.approx([0.0, 0.0, 50.0], abs=1e-9)
    assert top.centre == pytest.approx([0.0, 0.0, 0.1])


def test_parts_that_are_fixed_to_it_count() -> None:
    scene = atwood.Scene()
    scene.gravity, scene.space = 0.0, "space"
    box = scene.add("box", Box(length_x=0.3, length_y=0.4, length_z=0.5, mass=1.0))
    lump, weld = scene.add("lump", PointMass(mass=0.5)), scene.add("weld", Weld(displacement=(0.1, 0.2, 0.05)))
    scene.connect(box.frame, weld.a)
    scene.connect(weld.b, lump.point)
    found = principal_body(atwood.assemble(scene))
    centre = np.array([0.1, 0.2, 0.05]) / 3.0
    away = np.array([0.1, 0.2, 0.05])
    tensor = np.diag([0.4**2 + 0.5**2, 0.3**2 + 0.5**2, 0.3**2 + 0.4**2]) / 12.0
    tensor += (1.0 / 3.0) * (away @ away * np.eye(3) - np.outer(away, away))
    assert found.mass == pytest.approx(1.5)
    assert found.centre == pytest.approx(centre)
    assert found.axes @ np.diag(found.moments) @ found.axes.T == pytest.approx(tensor, abs=1e-14)
    assert np.linalg.det(found.axes) == pytest.approx(1.0)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_only_bodies_without_torque_are_free(form: str) -> None:
    for scene in (IntermediateAxis(), FreeSymmetricBody(), FreeBody()):
        check_free(atwood.assemble(scene, form=form), "body")
    for scene in (LagrangeTop(), HeavyTop()):
        with pytest.raises(UnsupportedError, match="a torque acts on it"):
            check_free(atwood.assemble(scene, form=form), "top")


def test_what_is_refused() -> None:
    with pytest.raises(UsageError, match="of motions in space"):
        rigid_body(DoublePendulum())
    with pytest.raises(UsageError, match="topp: there is no such rigid body"):
        rigid_body(LagrangeTop(), "topp")


def test_a_body_is_symmetric_about_its_third_axis_or_not() -> None:
    assert "I_2" in rigid_body(IntermediateAxis()).numbers
    assert "I_2" not in rigid_body(FreeSymmetricBody(), symmetric=True).numbers
    with pytest.raises(UsageError, match="not equal"):
        rigid_body(IntermediateAxis(), symmetric=True)
