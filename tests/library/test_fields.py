"""Fields and pairs: charges, potentials, interactions, laws of joint coordinates, gravity that varies."""

import math

import numpy as np
import pytest

import atwood as aw
import atwood_library as lib
from atwood import Component, ParameterError, Point, Scene, connector, parameter, potential, simulate

PARTS = [
    lib.Charge(scalar_potential="x**2 + z*t", vector_potential=("y*z", "x*z", "-x*x*t")),
    lib.LorentzForce(electric_field=("x", "z", 0), magnetic_field=(0, 1, "x")),
    lib.Potential(energy_function="x*z*z", energy_per_mass="x*t", seen_from="frame"),
    lib.PairPotential(law="function", energy_function="1/r + t*r"),
    lib.MutualPotential(count=3, law="coulomb"),
    lib.CoordinateLagrangian(slides=1, function="(2 + cos(angle_1))*rate_1**2 + angle_1*speed_1 + speed_1**2"),
    lib.Drag(linear=0.3, wind_field=("z", 0, "sin(t)")),
]


@pytest.mark.parametrize("part", PARTS, ids=lambda part: type(part).__name__)
def test_parts_with_functions_are_sound(part: aw.Component) -> None:
    report = aw.check(part, run=False)
    assert report.ok, report


class Field(Component):
    """A part with functions."""

    energy: object = parameter(0.0, unit="J", function_of={"x": "m", "t": "s"}, doc="An energy.")
    wind: object = parameter((0.0, 0.0, 0.0), unit="m/s", size=3, function_of={"x": "m", "t": "s"}, doc="A wind.")
    point: Point = connector(Point, "Where it acts.")

    @potential
    def law(self) -> object:
        """Return the energy."""
        return self.energy(self.point.position.x, self.time)  # type: ignore[operator]


def test_a_function_is_given_in_many_ways() -> None:
    import sympy

    x, t = sympy.symbols("x t")
    for given in ("x**2*sin(t)", "x^2 * sin(t)", lambda x, t: x**2 * aw.sin(t), x**2 * sympy.sin(t)):
        value = Field(energy=given).energy
        assert value(3.0, 0.5) == pytest.approx(9.0 * math.sin(0.5), rel=1e-15)  # type: ignore[operator]
        assert value.derivative("x")(3.0, 0.5) == pytest.approx(6.0 * math.sin(0.5), rel=1e-15)  # type: ignore[attr-defined]
    assert Field(energy="2 kJ").energy(1.0, 0.0) == 2000.0  # type: ignore[operator]
    assert Field(energy=lambda t: 2 * t).energy(1.0, 3.0) == 6.0  # type: ignore[operator]
    assert tuple(Field(wind=lambda x: (x, 0.0, 2.0)).wind(5.0, 0.0)) == (5.0, 0.0, 2.0)  # type: ignore[operator]
    assert tuple(Field(wind=("x", 1, lambda t: t)).wind(5.0, 7.0)) == (5.0, 1.0, 7.0)  # type: ignore[operator]
    assert Field(energy="x").energy == Field(energy=lambda x: x).energy != Field(energy="2*x").energy


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("x**", "no formula"),
        ("foo(x)", "reads 'foo'"),
        ("y", "reads 'y'"),
        ("__import__('os')", "reads '__import__'"),
        ("x.real", "no place in a formula"),
        ("3 m", "does not measure"),
        (lambda q: q, "takes q"),
        (lambda x: math.sin(x), "cannot be evaluated"),
        (math.nan, "cannot be evaluated"),
        ([1, 2], "cannot be evaluated"),
        (lambda x: (x, x), "2 numbers and not 1"),
    ],
)
def test_what_is_no_function_is_refused(given: object, said: str) -> None:
    with pytest.raises(ParameterError, match=r"Field\.energy") as found:
        Field(energy=given)
    assert said in str(found.value)


def test_functions_are_saved_and_read_back() -> None:
    scene = Scene()
    scene.add("field", Field(energy="x*exp(-t)", wind=("x", 0, lambda t: t**2)))
    again = aw.from_data(aw.to_data(scene), trust=__name__)["field"]
    assert again.energy == scene["field"].energy
    assert again.wind == scene["field"].wind


@pytest.mark.parametrize("space", ["plane", "space"])
def test_potentials_and_fields_say_the_same(space: str) -> None:
    # phi and A that depend on place and time, and E = -grad phi - dA/dt, B = curl A by hand
    gauge = ("0.3*z*t", 0, "-0.7*x + 0.2*x*z")
    e_field = ("-2*x*z - 0.3*z", 0, "-x**2")
    b_field = (0, "0.3*t + 0.7 - 0.2*z", 0)
    found = []
    for part in (
        lib.Charge(charge=1.3, scalar_potential="x**2*z", vector_potential=gauge),
        lib.LorentzForce(charge=1.3, electric_field=e_field, magnetic_field=b_field),
    ):
        scene = Scene(space=space, gravity=0.0)
        scene.connect(scene.add("part", part).point, scene.add("bob", lib.PointMass(mass=0.8)).point)  # type: ignore[union-attr]
        scene.start.update({"bob.position.x": 0.3, "bob.velocity.x": 1.0, "bob.velocity.z": -0.5})
        found.append(simulate(scene, t_end=2.0, rtol=1e-12))
    for path in ("bob.position.x", "bob.position.z", "part.force.x", "part.force.z"):
        assert np.max(np.abs(found[0].array(path) - found[1].array(path))) < 1e-9, path
    across = 0.3 * found[0].time + 0.7 - 0.2 * found[0].array("bob.position.z")
    assert np.max(np.abs(found[0].array("part.magnetic_field_y") - across)) < 1e-12


def test_coulomb_forces_of_both_signs() -> None:
    for sign in (1.0, -1.0):
        scene = Scene(gravity=0.0)
        pair = scene.add("pair", lib.PairPotential(law="coulomb", coulomb_constant=2.0, charge_a=3.0, charge_b=sign))
        for end in ("a", "b"):
            ball = scene.add(f"ball_{end}", lib.PointMass())
            scene.connect(getattr(pair, end), ball.point)
        scene.start.update({"ball_a.position.x": 0.0, "ball_b.position.x": 2.0})
        result = simulate(scene, t_end=0.01, outputs=2)
        assert result["pair.force.x"][0] == pytest.approx(sign * 2.0 * 3.0 / 4.0)
        assert result["pair.energy"][0] == pytest.approx(sign * 3.0)
        assert result["ball_b.acceleration.x"][0] == pytest.approx(sign * 1.5)


def test_all_pairs_are_the_pairs_one_by_one() -> None:
    places = [(0.0, 0.0), (1.0, 0.2), (-0.3, 1.1), (0.4, -0.9)]

    def scene(together: bool) -> Scene:
        made = Scene(gravity=0.0)
        balls = [made.add(f"ball{n}", lib.PointMass(mass=1.0 + n)) for n in range(4)]
        if together:
            force = made.add("force", lib.MutualPotential(count=4, gravitational_constant=0.3))
            for end, ball in zip(force.point, balls, strict=True):
                made.connect(end, ball.point)
        else:
            for i in range(4):
                for j in range(i):
                    force = made.add(f"force{i}{j}", lib.PairPotential(gravitational_constant=0.3))
                    made.connect(force.a, balls[i].point)
                    made.connect(force.b, balls[j].point)
        for n, (x, z) in enumerate(places):
            made.start.update({f"ball{n}.position.x": x, f"ball{n}.position.z": z})
        return made

    one, other = (simulate(scene(together), t_end=0.5, rtol=1e-11) for together in (True, False))
    for n in range(4):
        assert np.allclose(one.array(f"ball{n}.position.x"), other.array(f"ball{n}.position.x"), rtol=0, atol=1e-9)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_lagrangian_of_joint_coordinates(form: str) -> None:
    # L = rate^2 (2 + cos a) - 3 (1 - cos a): its energy is kept, and both forms agree with the first integral
    scene = Scene(gravity=0.0)
    ground, pivot = scene.add("ground", lib.Ground()), scene.add("pivot", lib.Pivot())
    link = scene.add("link", lib.Link())
    law = scene.add("law", lib.CoordinateLagrangian(function="(2 + cos(angle_1))*rate_1**2 - 3*(1 - cos(angle_1))"))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    scene.connect(pivot.shaft, law.shaft[0])
    scene.start.update({"pivot.angle": 1.0, "pivot.angular_velocity": 0.0})
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-11)
    a, rate = result.array("pivot.angle"), result.array("pivot.angular_velocity")
    link_inertia = 0.5 * link.parameters()["mass"] / 3.0
    energy = (2.0 + np.cos(a) + link_inertia) * rate**2 + 3.0 * (1.0 - np.cos(a))
    assert np.ptp(energy) < 1e-8
    assert np.ptp(a) > 0.5


def test_gravity_in_any_direction() -> None:
    scene = Scene(gravity_direction=(3.0, 0.0, -4.0))
    scene.add("ball", lib.PointMass())
    result = simulate(scene, t_end=1.0)
    assert result["ball.position.x"][-1] == pytest.approx(0.6 * 9.81 / 2.0)
    assert result["ball.position.z"][-1] == pytest.approx(-0.8 * 9.81 / 2.0)
    assert result.energy.max_drift < 1e-9


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_gravity_of_a_point_for_the_whole_scene(form: str) -> None:
    # a circular orbit of a body whose frame is not at its centre of mass, and of a point
    mu, r = 4.0, 2.0
    scene = Scene(space="space", gravity=0.0, gravity_potential=f"-{mu}/sqrt(x**2 + y**2 + z**2)")
    scene.add("ball", lib.PointMass(mass=3.0))
    scene.add("box", lib.RigidBody(mass=2.0, center=(0.1, 0.2, 0.3), moments=(1.0, 1.2, 1.4)))
    speed = math.sqrt(mu / r)
    scene.start.update({"ball.position.x": r, "ball.position.y": 0.0, "ball.position.z": 0.0})
    scene.start.update({"ball.velocity.x": 0.0, "ball.velocity.y": speed, "ball.velocity.z": 0.0})
    scene.start.update({"box.position.x": r, "box.position.y": 0.0, "box.position.z": 0.0})
    scene.start.update({"box.velocity.x": 0.0, "box.velocity.y": 0.0, "box.velocity.z": speed})
    scene.start.update({"box.phi": 0.0, "box.theta": 0.0, "box.psi": 0.0})
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-11)
    angle = speed / r * result.time
    assert np.max(np.abs(result.array("ball.position.x") - r * np.cos(angle))) < 1e-8
    assert np.max(np.abs(result.array("box.position.z") - r * np.sin(angle))) < 1e-8
    assert result.energy.max_drift < 1e-6


def test_a_wind_that_varies_in_place_and_time() -> None:
    # linear drag in the wind w = (k x, 0, s t): v' = -b/m (v - w); compare with the matrix exponential
    scipy_linalg = pytest.importorskip("scipy.linalg")
    b, m, k, s = 0.7, 0.5, -0.4, 0.3
    scene = Scene(gravity=0.0)
    drag = scene.add("drag", lib.Drag(linear=b, wind_field=(f"{k}*x", 0, f"{s}*t")))
    scene.connect(drag.point, scene.add("ball", lib.PointMass(mass=m)).point)
    scene.start.update({"ball.position.x": 1.0, "ball.position.z": 0.0, "ball.velocity.x": 2.0, "ball.velocity.z": 0.0})
    result = simulate(scene, t_end=2.0, rtol=1e-11)
    c = b / m
    matrix = np.array([[0.0, 1.0], [c * k, -c]])
    for t, x in zip(result.time, result.array("ball.position.x"), strict=True):
        assert x == pytest.approx((scipy_linalg.expm(matrix * t) @ [1.0, 2.0])[0], abs=1e-9)
    t = result.time
    assert np.max(np.abs(result.array("ball.velocity.z") - s * (t - (1.0 - np.exp(-c * t)) / c))) < 1e-9
