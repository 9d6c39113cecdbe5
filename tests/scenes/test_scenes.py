"""Every scene of the library: both forms agree, closed forms and reference values are met."""

import math

import numpy as np
import pytest

from atwood import Result, Scene
from atwood.pipeline import assemble, simulate
from atwood_library.scenes import SCENES, Chain, DoublePendulum, MassSpringChain, SimplePendulum

from ..helpers.runs import EVERYDAY, assert_agree, run_both

TIGHT = 1e-12
"""At this relative tolerance every scene is right to 1e-8 over its time in both forms."""


@pytest.fixture(scope="module")
def runs() -> dict[str, tuple[Result, Result]]:
    return {name: run_both(make, rtol=TIGHT, outputs=41) for name, make in SCENES.items() if name in EVERYDAY}


@pytest.mark.sample(5)
@pytest.mark.parametrize("name", EVERYDAY)
def test_both_forms_agree_at_every_quantity(runs: dict[str, tuple[Result, Result]], name: str) -> None:
    reduced, dae = runs[name]
    assert (reduced.form, dae.form) == ("reduced", "dae")
    assert reduced.status == dae.status == "finished"
    assert_agree(reduced, dae, 1e-7)


@pytest.mark.parametrize("name", EVERYDAY)
def test_outputs_keep_the_constraints(runs: dict[str, tuple[Result, Result]], name: str) -> None:
    for result in runs[name]:
        assert result.constraint_max["position"] < 1e-12
        assert result.constraint_max["velocity"] < 1e-12


@pytest.mark.parametrize("name", EVERYDAY)
def test_energy_balances(runs: dict[str, tuple[Result, Result]], name: str) -> None:
    for result in runs[name]:
        assert result.energy.max_drift < 3e-7


@pytest.mark.parametrize("name", [name for name in EVERYDAY if hasattr(SCENES[name], "closed_form")])
def test_closed_form_is_met(runs: dict[str, tuple[Result, Result]], name: str) -> None:
    expected = None
    for result in runs[name]:
        expected = SCENES[name]().closed_form(result.time)  # type: ignore[attr-defined]
        for path, values in expected.items():
            assert np.max(np.abs(result.array(path) - values)) < 1e-8, path
    assert expected


def test_forces_come_out_of_both_forms(runs: dict[str, tuple[Result, Result]]) -> None:
    wanted = {
        "simple-pendulum": ["rod.tension", "ground.force.x", "ground.force.z"],
        "pendulum-on-cart": ["rod.tension", "rail.side_force"],
        "four-bar": ["pivot1.force.x", "pivot3.force.z", "left.force.z"],
        "double-atwood": ["rope1.tension", "rope2.tension", "ground.force.z"],
        "driven-pendulum": ["drive.force.x", "drive.force.z", "rod.tension"],
    }
    for name, paths in wanted.items():
        for path in paths:
            for result in runs[name]:
                assert np.ptp(result.array(path)) > 0.0 or name == "double-atwood", (name, path)


def test_tension_of_the_pendulum(runs: dict[str, tuple[Result, Result]]) -> None:
    # m g cos(theta) + m l theta'^2, and the ground carries it
    for result in runs["simple-pendulum"]:
        angle, rate = result.array("rod.angle"), result.array("rod.angular_velocity")
        tension = 9.81 * np.cos(angle) + rate**2
        assert np.max(np.abs(result.array("rod.tension") - tension)) < 1e-9
        assert np.max(np.abs(result.array("ground.force.x") - -tension * np.sin(angle))) < 1e-9
        assert np.max(np.abs(result.array("ground.force.z") - tension * np.cos(angle))) < 1e-9


def test_accelerations_of_the_double_atwood_machine(runs: dict[str, tuple[Result, Result]]) -> None:
    m1, m2, m3, g = 4.0, 3.0, 1.0, 9.81
    whole = m1 * (m2 + m3) + 4.0 * m2 * m3
    down1 = (m1 * (m2 + m3) - 4.0 * m2 * m3) / whole * g
    down2 = 2.0 * m1 * (m2 - m3) / whole * g  # relative to the moving pulley
    for result in runs["double-atwood"]:
        assert np.max(np.abs(-result.array("m1.acceleration.z") - down1)) < 1e-8
        relative = result.array("m2.acceleration.z") + result.array("m1.acceleration.z")
        assert np.max(np.abs(-relative - down2)) < 1e-8
        # the same from positions, which are what the solver integrated
        t = result.time
        fall = -5.0 - result.array("m1.position.z")
        assert np.max(np.abs(fall - 0.5 * down1 * t**2)) < 1e-8


@pytest.mark.parametrize(("shape", "factor"), [((1.0, 1.0), 1.0), ((1.0, -1.0), math.sqrt(3.0))])
def test_frequencies_of_the_mass_spring_chain(shape: tuple[float, float], factor: float) -> None:
    # started in one mode, the time between zero crossings of the displacement says its frequency
    scene = MassSpringChain(mass=2.0, stiffness=50.0, t_end=10.0)
    scene.start["m1.displacement"] = 1.0 + 0.1 * shape[0]
    scene.start["m2.displacement"] = 2.0 + 0.1 * shape[1]
    result = simulate(scene, rtol=1e-11, outputs=4001)
    t, x = result.time, result.array("m1.displacement") - 1.0
    before = np.flatnonzero(x[:-1] * x[1:] < 0.0)
    v = result.array("m1.speed")
    crossings = []
    for i in before:  # a few Newton steps on the Hermite cubic of the two samples
        h = t[i + 1] - t[i]
        coefficients = np.polynomial.Polynomial(
            [
                x[i],
                h * v[i],
                -3 * x[i] + 3 * x[i + 1] - h * (2 * v[i] + v[i + 1]),
                2 * (x[i] - x[i + 1]) + h * (v[i] + v[i + 1]),
            ]
        )
        root = next(r.real for r in coefficients.roots() if abs(r.imag) < 1e-9 and -1e-9 <= r.real <= 1.0 + 1e-9)
        crossings.append(t[i] + h * root)
    half_periods = np.diff(crossings)
    assert len(half_periods) > 5
    frequency = math.pi * len(half_periods) / (crossings[-1] - crossings[0])
    assert frequency == pytest.approx(factor * math.sqrt(50.0 / 2.0), rel=1e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("angle", "rate", "expected"),
    [
        # Closed form by elliptic functions, evaluated with mpmath (shared/reference/pendulum_elliptic.json).
        (
            math.pi / 2.0,
            0.0,
            {1.0: (-1.405027311524799, -1.799309016907079), 5.0: (1.229451811485386, -2.562787568192629)},
        ),
        (0.0, 6.5, {1.0: (3.425682815305696, 1.948442254586227), 5.0: (18.487178646944435, 6.401235270608984)}),
        (3.0, 0.0, {1.0: (1.602248901927917, -4.336664040473031), 5.0: (2.982353102400168, 0.227776327108745)}),
    ],
)
def test_pendulum_at_large_angles(
    form: str, angle: float, rate: float, expected: dict[float, tuple[float, float]]
) -> None:
    scene = SimplePendulum()
    scene.start.update({"rod.angle": angle, "rod.angular_velocity": rate})
    result = simulate(scene, form=form, rtol=TIGHT, t_end=5.0, outputs=[0.0, *expected])
    # near the separatrix (3.0 rad), and in the phase of fast turns, errors grow within five seconds
    tolerance = 1e-8 if angle == math.pi / 2.0 else 1e-7
    for i, (theta, omega) in enumerate(expected.values(), start=1):
        assert result.array("rod.angle")[i] == pytest.approx(theta, abs=tolerance)
        assert result.array("rod.angular_velocity")[i] == pytest.approx(omega, abs=tolerance)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_double_pendulum_reference(form: str) -> None:
    # Own computation with 28 trusted digits (shared/reference/double_pendulum_chaotic.json, pi/2_pi/2).
    result = simulate(DoublePendulum(), form=form, rtol=TIGHT, t_end=2.0, outputs=[0.0, 1.0, 2.0])
    end = result.at(-1)
    assert end["rod1.angle"] == pytest.approx(-0.482971534251754, abs=1e-8)
    assert end["rod2.angle"] == pytest.approx(-1.324048712302363, abs=1e-8)
    assert end["rod1.angular_velocity"] == pytest.approx(3.065288192073401, abs=1e-8)
    assert end["rod2.angular_velocity"] == pytest.approx(2.949271547571682, abs=1e-8)
    middle = result.at(1)
    assert middle["bob2.position.x"] == pytest.approx(-1.444818849943476, abs=1e-8)
    assert middle["bob2.position.z"] == pytest.approx(-1.321794461384616, abs=1e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("links", "x", "z", "vx", "vz"),
    [
        # Own computation with 22 trusted digits, t = 0.5 s (shared/reference/nlink_chain.json).
        (5, -0.0566645412675083, -0.975802326580604, -6.29159550315385, 1.65288718036982),
        (10, -0.156401511293072, -0.915683201743766, -5.85770083415931, 2.99828577789448),
    ],
)
def test_chain_reference(form: str, links: int, x: float, z: float, vx: float, vz: float) -> None:
    result = simulate(Chain(links=links), form=form, rtol=1e-11, t_end=0.5, outputs=2)
    end = result.at(-1)
    tip = f"bob[{links - 1}]"
    found = [end[f"{tip}.position.x"], end[f"{tip}.position.z"], end[f"{tip}.velocity.x"], end[f"{tip}.velocity.z"]]
    assert found == pytest.approx([x, z, vx, vz], abs=2e-7)


def test_degrees_of_freedom_and_states() -> None:
    expected = {
        "simple-pendulum": (1, 2),
        "double-pendulum": (2, 4),
        "pendulum-on-cart": (2, 4),
        "mass-spring-chain": (2, 4),
        "atwood": (1, 2),
        "double-atwood": (2, 4),
        "slider-crank": (1, 4),
        "chain": (10, 20),
        "driven-pendulum": (1, 2),
        "four-bar": (1, 6),
    }
    for name in EVERYDAY:
        equations = assemble(SCENES[name]()).reduced
        freedom = len(equations.coordinates) - len(equations.constraints)
        assert (freedom, 2 * len(equations.coordinates)) == expected[name], name


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", EVERYDAY)
def test_every_scene_is_a_part_like_any_other(name: str) -> None:
    outer = Scene(space="line", line_axis=(0.0, 0.0, 1.0)) if "atwood" in name else Scene(space="line")
    if name not in ("atwood", "double-atwood", "mass-spring-chain"):
        outer = Scene(gravity=SCENES[name]().gravity)
    make = SCENES[name]
    outer.add("inner", make())
    alone = simulate(make(), rtol=1e-8, t_end=0.3, outputs=3)
    inside = simulate(outer, rtol=1e-8, t_end=0.3, outputs=3)
    for path in alone.paths:
        gap = np.max(np.abs(inside.array(f"inner.{path}") - alone.array(path)))
        assert gap <= 1e-6 * max(1.0, np.max(np.abs(alone.array(path)))), path
