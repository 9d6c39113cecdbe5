"""Scenes in other coordinates: chained, tidied, with what is ignorable; momenta of both, and frames that move."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy

from atwood import Scene, UnsupportedError, dynamics, equations, hamiltonian, point_transformation, reduced, simulate
from atwood.theory.hamiltonian.phase_space import vanishes
from atwood.theory.hamiltonian.point_transformations import PointTransformation
from atwood.theory.hamiltonian.tidied import tidied
from atwood_library import Damper, Drag, Force, Ground, PointMass, Potential
from atwood_library.scenes import SCENES

R, X, Z, phi, theta, t, w = sympy.symbols("r X Z phi theta t omega")
SPHERE = {"x": "r*sin(theta)*cos(phi)", "y": "r*sin(theta)*sin(phi)", "z": "r*cos(theta)"}


def same(a: Any, b: Any) -> bool:
    return vanishes([a - b]).proven


def relative(scene: Scene) -> PointTransformation:
    """Return two bodies in coordinates of the centre of mass, X, and of the way between them, x."""
    m1, m2 = (equations(scene).symbol(f"body{k}.mass") for k in (1, 2))
    axes = "xz" if scene.space == "plane" else "xyz"
    old = {}
    for x in axes:
        old[f"body1.position.{x}"] = sympy.Symbol(x.upper()) - m2 / (m1 + m2) * sympy.Symbol(x)
        old[f"body2.position.{x}"] = sympy.Symbol(x.upper()) + m1 / (m1 + m2) * sympy.Symbol(x)
    return point_transformation(scene, old, [*axes.upper(), *axes])


def agree(found: PointTransformation, count: int = 4, time: float = 0.0) -> float:
    """Return by how much K is off H of the scene in numbers, relative, where frames are at rest."""
    h, random, worst = found.source, np.random.default_rng(4), 0.0
    for _ in range(count):
        at = dict(zip((*found.coordinates, *found.momenta), random.uniform(0.3, 1.4, 2 * len(h.paths)), strict=True))
        at |= {t: time, **h.values}
        q, p = ([float(one.xreplace(at)) for one in held.values()] for held in (found.old, found.old_momenta))
        worst = max(worst, abs(float(found.hamiltonian.xreplace(at)) / float(h(q, p)) - 1.0))
    return worst


def test_a_body_seen_from_the_other() -> None:
    """All momenta are coupled: ``p_r^2/2 mu + p_X^2/2 m1 - p_X p_r cos(phi)/m1 + ...`` (Goldstein, section 3.1)."""
    scene = SCENES["two-body"](space="plane")
    old = {"body1.position.x": "X", "body1.position.z": "Z"}
    old |= {"body2.position.x": "X + r*cos(phi)", "body2.position.z": "Z + r*sin(phi)"}
    found = point_transformation(scene, old, ["X", "Z", "r", "phi"])
    eq = equations(scene)
    m1, m2, G = (eq.symbol(path) for path in ("body1.mass", "body2.mass", "force.gravitational_constant"))
    px, pz, pr, pp = found.momenta
    along, across = (pr * sympy.cos(phi) - pp * sympy.sin(phi) / R, pr * sympy.sin(phi) + pp * sympy.cos(phi) / R)
    expected = ((px - along) ** 2 + (pz - across) ** 2) / (2 * m1) + (along**2 + across**2) / (2 * m2) - G * m1 * m2 / R
    assert same(found.hamiltonian, expected)
    assert found.positive == (R,)
    assert same(found.accelerations[sympy.Symbol("X''")], G * m2 * sympy.cos(phi) / R**2)


@pytest.mark.sample(0)
def test_two_bodies_in_space_in_two_steps() -> None:
    """``P^2/2M + (p_r^2 + p_theta^2/r^2 + p_phi^2/(r^2 sin^2 theta))/2 mu - G m1 m2/r`` (Goldstein, section 3.1)."""
    scene = SCENES["two-body"]()
    found = point_transformation(relative(scene), SPHERE, ["r", "theta", "phi"])
    eq = equations(scene)
    m1, m2, G = (eq.symbol(path) for path in ("body1.mass", "body2.mass", "force.gravitational_constant"))
    mu = m1 * m2 / (m1 + m2)
    assert list(map(str, found.coordinates)) == ["X", "Y", "Z", "r", "theta", "phi"]
    *P, pr, pt, pp = found.momenta
    expected = sum(one**2 for one in P) / (2 * (m1 + m2)) - G * m1 * m2 / R
    expected += (pr**2 + pt**2 / R**2 + pp**2 / (R * sympy.sin(theta)) ** 2) / (2 * mu)
    assert same(found.hamiltonian, expected)
    assert found.hamiltonian.count_ops() <= expected.count_ops() + 20
    assert list(map(str, found.ignorable)) == ["X", "Y", "Z", "phi"]
    assert found.positive == (R, sympy.sin(theta))
    assert agree(found) < 1e-13
    printed = {sympy.Symbol(f"m_{k}"): sympy.Symbol(f"m{k}") for k in (1, 2)}  # as one writes what is printed
    whole = dict(zip(hamiltonian(scene).paths, (one.xreplace(printed) for one in found.old.values()), strict=True))
    assert same(point_transformation(scene, whole, found.coordinates).lagrangian, found.lagrangian)


def test_two_bodies_in_the_plane_are_reduced_to_the_distance() -> None:
    scene = SCENES["two-body"](space="plane", eccentricity=0.4, mass1=1.3, mass2=0.6)
    found = point_transformation(relative(scene), {"x": "r*cos(phi)", "z": "r*sin(phi)"}, ["r", "phi"])
    assert list(map(str, found.ignorable)) == ["X", "Z", "phi"]
    motion = reduced(found)
    assert motion.turning_points == pytest.approx((0.6, 1.4), rel=1e-10)
    assert motion.period == pytest.approx(2.0 * np.pi / np.sqrt(1.9), rel=1e-10)
    run = simulate(scene, t_end=2.0, rtol=1e-13, solver="taylor", outputs=9)
    apart = [run[f"body2.position.{x}"] - run[f"body1.position.{x}"] for x in "xz"]
    along = motion.at(run.time)
    assert along["r"] * np.exp(1j * along["phi"]) == pytest.approx(apart[0] + 1j * apart[1], abs=1e-9)


@pytest.mark.parametrize("offset", [0.0, 0.7])
def test_momenta_of_both_are_inverse_to_each_other(offset: float) -> None:
    """``p_phi = x p_z - z p_x``, whichever way the polar axes are turned."""
    scene = SCENES["kepler"](mass=1.7)
    polar = {"body.position.x": f"r*cos(phi + {offset})", "body.position.z": f"r*sin(phi + {offset})"}
    found = point_transformation(scene, polar, ["r", "phi"])
    pr, pphi = found.momenta
    x, z = found.old.values()
    px, pz = found.old_momenta
    assert same(found.new_momenta[pphi], x * pz - z * px)
    for new in (pr, pphi):
        back = found.new_momenta[new].xreplace(found.old_momenta)
        assert same(back, new)
    assert found.positive == (R,)
    assert agree(found) < 1e-13


@pytest.mark.sample(0)
def test_a_frame_that_turns_and_then_polar_coordinates() -> None:
    """``K = H - omega p_phi``, and the centrifugal energy in L (Goldstein, section 8.2)."""
    scene = SCENES["kepler"]()
    c, s = sympy.cos(w * t), sympy.sin(w * t)
    turning = point_transformation(scene, {"body.position.x": X * c - Z * s, "body.position.z": X * s + Z * c}, [X, Z])
    found = point_transformation(turning, {"X": "r*cos(phi)", "Z": "r*sin(phi)"}, ["r", "phi"])
    plain = point_transformation(
        scene, {"body.position.x": "r*cos(phi)", "body.position.z": "r*sin(phi)"}, ["r", "phi"]
    )
    assert same(found.hamiltonian, plain.hamiltonian - w * found.momenta[1])
    m = equations(scene).symbol("body.mass")
    still = dict.fromkeys(found.velocities, 0)
    assert same(found.lagrangian.xreplace(still) - plain.lagrangian.xreplace(still), m * w**2 * R**2 / 2)
    with pytest.raises(UnsupportedError, match="omega in its coordinates have no value"):
        reduced(found)
    with_number = found_with(scene, 0.3)
    run, motion = simulate(scene, t_end=3.0, rtol=1e-13, outputs=7), reduced(with_number)
    angle = np.arctan2(run["body.position.z"], run["body.position.x"])
    assert motion.at(run.time)["phi"] == pytest.approx(angle - 0.3 * run.time, abs=1e-9)


def found_with(scene: Scene, rate: float) -> PointTransformation:
    r = sympy.Symbol("r", positive=True)
    turn = phi + sympy.Float(rate) * t
    old = {"body.position.x": r * sympy.cos(turn), "body.position.z": r * sympy.sin(turn)}
    return point_transformation(scene, old, [r, phi])


@pytest.mark.sample(0)
def test_accelerations_in_a_frame_that_turns_unevenly() -> None:
    """``X'' = 2 w Z' + w^2 X + w' Z``: Coriolis, centrifugal and Euler's (Goldstein, section 4.10)."""
    scene = Scene(gravity=0.0)
    scene.add("body", PointMass(mass=1.3))
    a, angle = sympy.Symbol("a"), w * t + sympy.Symbol("a") * t**2 / 2
    c, s = sympy.cos(angle), sympy.sin(angle)
    found = point_transformation(scene, {"body.position.x": X * c - Z * s, "body.position.z": X * s + Z * c}, [X, Z])
    rate, (vx, vz) = w + a * t, found.velocities
    first, second = found.accelerations.values()
    assert same(first, 2 * rate * vz + rate**2 * X + a * Z)
    assert same(second, -2 * rate * vx + rate**2 * Z - a * X)


@pytest.mark.sample(0)
@pytest.mark.parametrize("turning", [0.0, 0.7])
def test_accelerations_have_the_forces_of_dampers_and_loads(turning: float) -> None:
    """Of a polar chain of transformations, beside the accelerations of the scene itself."""
    scene = Scene()
    ground, body = scene.add("ground", Ground()), scene.add("body", PointMass(mass=1.3))
    damper = scene.add("damper", Damper(damping=0.4))
    pull, air = scene.add("pull", Force(direction=(1.0, 0.0, 1.0), value=0.7)), scene.add("air", Drag(linear=0.3))
    for one, other in ((ground.frame, damper.a), (damper.b, body.point), (pull.point, body.point)):
        scene.connect(one, other)
    scene.connect(air.point, body.point)
    place, speed = {"x": 0.6, "z": 0.3}, {"x": -0.4, "z": 1.1}
    scene.start.update({f"body.position.{axis}": one for axis, one in place.items()})
    scene.start.update({f"body.velocity.{axis}": one for axis, one in speed.items()})
    first = point_transformation(
        scene,
        {
            "body.position.x": X * sympy.cos(turning * t) - Z * sympy.sin(turning * t),
            "body.position.z": X * sympy.sin(turning * t) + Z * sympy.cos(turning * t),
        },
        [X, Z],
    )
    found = point_transformation(first, {"X": R * sympy.cos(phi), "Z": R * sympy.sin(phi)}, [R, phi])
    (x, z), (vx, vz) = place.values(), speed.values()
    size = np.hypot(x, z)
    along, around = (x * vx + z * vz) / size, (x * vz - z * vx) / size**2 - turning
    at = dict(zip((*found.coordinates, *found.velocities), (size, np.arctan2(z, x), along, around), strict=True))
    second, turned = (float(one.xreplace(at | {t: 0} | found.source.values)) for one in found.accelerations.values())
    model = dynamics(scene)
    ax, az = model.forward_dynamics(*model.start())
    assert second - size * (around + turning) ** 2 == pytest.approx((x * ax + z * az) / size, rel=1e-12)
    assert size * turned + 2 * along * (around + turning) == pytest.approx((x * az - z * ax) / size, rel=1e-12)


def test_a_frame_that_accelerates() -> None:
    """``L = m (X' + a t)^2/2``: the momentum is that seen from outside, and K has ``-a t P``."""
    scene = Scene(gravity=0.0, space="line")
    scene.add("body", PointMass(mass=1.3))
    a, m = sympy.Symbol("a"), equations(scene).symbol("body.mass")
    found = point_transformation(scene, {"body.position.x": X + a * t**2 / 2}, [X])
    [rate], [momentum] = found.velocities, found.momenta
    assert same(found.lagrangian, m * (rate + a * t) ** 2 / 2)
    assert same(found.hamiltonian, momentum**2 / (2 * m) - a * t * momentum)


@pytest.mark.sample(1)
@pytest.mark.parametrize("law", ["(x**2 + z**2)**2/3 + x*z", "exp(-x**2)/(1 + z**2)"])
@pytest.mark.parametrize(
    "new",
    [
        {"x": "r*cos(phi)", "z": "r*sin(phi)"},
        {"x": "xi*eta", "z": "(xi**2 - eta**2)/2"},
        {"x": "cosh(u)*cos(v)", "z": "sinh(u)*sin(v)"},
        {"x": "a + b", "z": "a*b"},
    ],
)
def test_any_coordinates_of_any_field(law: str, new: dict[str, str]) -> None:
    scene = Scene(gravity=0.4)
    field, body = scene.add("field", Potential(energy_function=law)), scene.add("body", PointMass(mass=1.2))
    scene.connect(field.point, body.point)
    names = sorted({str(one) for whole in new.values() for one in sympy.sympify(whole).free_symbols})
    found = point_transformation(scene, {f"body.position.{axis}": one for axis, one in new.items()}, names)
    assert agree(found) < 1e-12


def test_roots_of_squares_keep_their_sign() -> None:
    a, b, u, v = sympy.symbols("a b u v")
    assert tidied(sympy.sqrt((a - b) ** 2)) == sympy.Abs(a - b)
    assert tidied(sympy.sqrt((a - b) ** 2), [a - b]) == a - b
    assert tidied(sympy.sqrt(sympy.sin(u) ** 2)) == sympy.Abs(sympy.sin(u))
    whole = (sympy.cosh(u) * sympy.cos(v) - 1) ** 2 + sympy.sinh(u) ** 2 * sympy.sin(v) ** 2
    assert tidied(sympy.sqrt(whole)) == sympy.cosh(u) - sympy.cos(v)
    for place in ((0.3, 2.0), (-1.2, 0.4), (2.0, -3.0)):
        at = dict(zip((u, v), map(sympy.Float, place), strict=True))
        assert float(tidied(1 / sympy.sqrt(whole)).xreplace(at)) == pytest.approx(float(whole.xreplace(at)) ** -0.5)
