"""Groups of discs in time stepping: beside declared contacts, at rest, on slopes, and what is refused."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

import atwood as aw
from atwood import Scene, simulate
from atwood.numerics.cone_impulses import Touches, impulses
from atwood.numerics.near_pairs import near_pairs
from atwood_library import BallContact, BallPairContact, Disc, DiscContacts, Force, Ground, PointContact, Spring

FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])
FLOOR = ((0.0, 0.0, 0.0, 1.0),)
STILL = dict.fromkeys(("velocity.x", "velocity.z", "angular_velocity.y", "angle"), 0.0)
Starts = list[dict[str, float]]


def group(starts: Starts, walls: object = FLOOR, **given: float) -> Scene:
    """Return discs of 1 kg and 2 kg in turn in one group."""
    scene = Scene()
    ends = scene.add("c", DiscContacts(count=len(starts), radius=0.1, walls=walls, **given)).disc
    for i, start in enumerate(starts):
        scene.connect(scene.add(f"d{i}", Disc(mass=1.0 + i % 2, radius=0.1)).frame, ends[i])
        scene.start.update({f"d{i}.{name}": value for name, value in {**STILL, **start}.items()})
    return scene


def place(x: float, z: float, **more: float) -> dict[str, float]:
    return {"position.x": x, "position.z": z, **more}


def run(scene: Scene, end: float, step: float, form: str = "reduced", **options: object) -> aw.Result:
    return simulate(scene, form=form, solver="moreau", step=step, t_end=end, **{"outputs": 3, "samples": 1, **options})


def state(result: aw.Result, count: int) -> np.ndarray:
    names = ("position.x", "position.z", "angle", "velocity.x", "velocity.z", "angular_velocity.y")
    return np.array([[float(result[f"d{i}.{name}"][-1]) for name in names] for i in range(count)])


@FORMS
def test_a_group_does_what_declared_contacts_do(form: str) -> None:
    starts = [place(0.0, 0.1), place(0.15, 0.4, **{"velocity.x": -0.4, "angular_velocity.y": 9.0})]
    together = group(starts, restitution=0.4, friction=0.3)
    apart = Scene()
    floor = apart.add("floor", Ground())
    discs = [apart.add(f"d{i}", Disc(mass=1.0 + i, radius=0.1)) for i in range(2)]
    for i, one in enumerate(discs):
        below = apart.add(f"below{i}", BallContact(radius=0.1, restitution=0.4, friction=0.3))
        apart.connect(floor.frame, below.plane)
        apart.connect(one.frame, below.ball)
        for j in range(i):
            touch = apart.add(f"touch{i}{j}", BallPairContact(restitution=0.4, friction=0.3))
            apart.connect(one.frame, touch.a)
            apart.connect(discs[j].frame, touch.b)
        apart.start.update({f"d{i}.{name}": value for name, value in {**STILL, **starts[i]}.items()})
    found, wanted = (state(run(one, 0.5, 0.01, form), 2) for one in (together, apart))
    assert found == pytest.approx(wanted, abs=2e-3)


@FORMS
def test_a_stack_rests_and_does_not_creep(form: str) -> None:
    scene = group([place(0.0, 0.1 + 0.2 * i) for i in range(50)], friction=0.5)
    result = run(scene, 1.0, 0.01, form, outputs=[0.0, 0.5, 1.0])
    for i in range(50):
        heights = result[f"d{i}.position.z"]
        assert abs(heights[-1] - heights[-2]) < 1e-12
        assert heights[-1] == pytest.approx(0.1 + 0.2 * i, abs=1e-6)
        assert abs(result[f"d{i}.position.x"][-1]) < 1e-12


def test_a_column_that_falls_is_of_order_one_beside_solvers_with_events() -> None:
    """Six discs with gaps of 1 cm fall on each other and stay: twelve events."""
    starts, end = [place(0.0, 0.15 + 0.21 * i) for i in range(6)], 0.6
    scene = group(starts)
    apart = Scene()
    floor, ground = apart.add("f", BallContact(radius=0.1)), apart.add("g", Ground())
    for i in range(6):
        apart.add(f"d{i}", Disc(mass=1.0 + i % 2, radius=0.1))
        touch = apart.add(f"t{i}", BallPairContact(radius_a=0.1, radius_b=0.1)) if i else floor
        apart.connect(apart[f"d{i - 1}"].frame if i else ground.frame, touch.a if i else touch.plane)
        apart.connect(apart[f"d{i}"].frame, touch.b if i else touch.ball)
    apart.start.update(scene.start)
    times = np.linspace(0.0, end, 13)

    def places(result: aw.Result) -> np.ndarray:
        return np.array([np.interp(times, result.time, result[f"d{i}.position.z"]) for i in range(6)])

    exact = simulate(apart, t_end=end, outputs=13, rtol=1e-9)
    assert len(exact.events) > 9
    steps = 8e-3 * 0.5 ** np.arange(4)
    errors = [np.mean(np.abs(places(run(scene, end, h, outputs=13)) - places(exact))) for h in steps]
    assert 0.7 < np.polyfit(np.log(steps), np.log(errors), 1)[0] < 1.4


def test_a_heap_of_three_holds_by_friction_and_slides_apart_without() -> None:
    starts = [place(-0.1, 0.1), place(0.1, 0.1), place(0.0, 0.1 + 0.1 * math.sqrt(3.0))]
    held = state(run(group(starts, friction=0.6), 1.0, 0.01), 3)
    assert held[:, :2] == pytest.approx(np.array([[-0.1, 0.1], [0.1, 0.1], [0.0, 0.2732]]), abs=1e-4)
    loose = state(run(group(starts), 1.0, 0.01), 3)
    assert loose[1, 0] - loose[0, 0] > 0.3
    assert loose[2, 1] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(("angle", "friction", "slips"), [(0.4, 0.2, False), (0.7, 0.2, True)])
def test_a_disc_rolls_on_a_slope_below_three_times_the_angle_of_friction(
    angle: float, friction: float, slips: bool
) -> None:
    """A disc needs tan(angle)/3 of friction to roll: then it gains 2/3 of g sin(angle)."""
    assert (math.tan(angle) / 3.0 > friction) == slips
    normal = -math.sin(angle), math.cos(angle)
    scene = group([place(0.1 * normal[0], 0.1 * normal[1])], ((0.0, 0.0, *normal),), friction=friction)
    speeds = state(run(scene, 1.0, 0.01), 1)[0, 3:]
    along = math.hypot(*speeds[:2])
    expected = 9.81 * (math.sin(angle) - friction * math.cos(angle) if slips else 2.0 / 3.0 * math.sin(angle))
    assert along == pytest.approx(expected, rel=1e-9)
    assert abs(abs(speeds[2]) * 0.1 - along) > 0.1 if slips else abs(speeds[2]) * 0.1 == pytest.approx(along, rel=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_energy_is_never_made_and_momentum_stays(friction: float) -> None:
    rng = np.random.default_rng(3)
    grid = [place(0.25 * i, 0.25 * j) for i in range(5) for j in range(5)]
    starts = [{**one, "velocity.x": float(rng.normal()), "velocity.z": float(rng.normal())} for one in grid]
    walls = ((-9.0, 0.0, 1.0, 0.0),)
    scene = group(starts, walls, restitution=0.5, friction=friction)
    scene.gravity = 0.0
    result = run(scene, 1.0, 0.01, outputs=51)
    assert np.all(np.diff(result.energy.kinetic) < 1e-9 * result.energy.kinetic[0])
    assert result.energy.kinetic[-1] < 0.7 * result.energy.kinetic[0]
    assert result.energy.max_drift < 1e-9  # the ledger has what contacts took
    for axis in "xz":
        momentum = sum((1.0 + i % 2) * result[f"d{i}.velocity.{axis}"] for i in range(25))
        assert np.ptp(momentum) < 1e-10


def test_discs_fall_into_a_box_and_stay_in_it() -> None:
    rng, walls = np.random.default_rng(1), (*FLOOR, (-0.5, 0.0, 1.0, 0.0), (0.5, 0.0, -1.0, 0.0))
    starts = [place(-0.35 + 0.23 * i + 0.02 * rng.random(), 0.2 + 0.23 * j) for i in range(4) for j in range(3)]
    found = state(run(group(starts, walls, restitution=0.2, friction=0.4), 2.0, 0.005), 12)
    places = found[:, :2]
    between = np.hypot(*(places[:, None] - places[None]).T) + np.eye(12)
    assert np.min(between) > 0.19
    assert np.min(places[:, 1]) > 0.09
    assert np.max(np.abs(places[:, 0])) < 0.41
    assert np.max(np.abs(found[:, 3:])) < 1e-6


def test_pairs_near_by_are_all_found_once() -> None:
    places = np.random.default_rng(2).uniform(-3.0, 3.0, (400, 2))
    pairs = near_pairs(places, 0.3)
    found = {tuple(sorted(one)) for one in pairs.tolist()}
    assert len(found) == len(pairs)
    distance = np.hypot(*(places[:, None] - places[None]).T)
    assert {(i, j) for i, j in zip(*np.nonzero(distance <= 0.3), strict=True) if i < j} <= found


def test_impulses_meet_the_laws() -> None:
    """Three discs in a row between two walls, pressed together: the forces go through."""
    bodies = np.array([[0, 0, 1, 2], [3, 1, 2, 3]])
    x, arm = np.array([-1.0, 1.0, 1.0, 1.0]), np.full(4, -0.1)
    one = np.moveaxis(np.array([[-x, 0.0 * x, 0.0 * x], [0.0 * x, -x, arm]]), -1, 0)
    other = np.moveaxis(np.array([[x, 0.0 * x, 0.0 * x], [0.0 * x, x, arm]]), -1, 0)
    inverse = np.array([np.diag([1.0, 1.0, 200.0])] * 3 + [np.zeros((3, 3))])
    touches = Touches(bodies, np.array([one, other]), inverse, 0.5)
    free = np.array([[2.0, 0.0, 0.0], [0.0, -0.5, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    v, p, missed = impulses(touches, free, np.zeros(4), np.zeros((2, 4)), 1e-12, 1e-9)
    assert missed < 1e-12
    rates = touches.rates(v)
    assert np.all(p[0] >= 0.0)
    assert np.all(rates[0] > -1e-11)
    assert np.all(np.abs(p[1]) <= 0.5 * p[0] + 1e-12)
    assert np.all((p[1] * rates[1] <= 1e-12) & (np.abs(p[0] * rates[0]) < 1e-11))


@pytest.mark.parametrize(("rows", "speeds"), [(2, 3), (3, 6)])
def test_what_is_missed_is_what_the_laws_say(rows: int, speeds: int) -> None:
    """Many contacts in any direction, left before they are solved to rounding."""
    chance = np.random.default_rng(rows)
    slopes = chance.normal(size=(2, 600, rows, speeds))
    if rows == 2:
        slopes[:, :, 0, 2] = 0.0  # normals of discs go through their centres
    bodies = np.array([chance.permutation(600) % 150, chance.permutation(600) % 150])
    inverse = np.array([*(np.eye(speeds) for _ in range(150)), np.zeros((speeds, speeds))])
    touches, least = Touches(bodies, slopes, inverse, 0.4), chance.uniform(size=600)
    v, p, missed = impulses(touches, chance.normal(size=(151, speeds)), least, np.zeros((rows, 600)), 1e9, 1e9)
    rates, own = touches.rates(v), touches.compliance(touches.moves)
    each = own[[0] + [1] * (rows - 1)]
    ahead = p - (rates - np.array([least, *(rows - 1) * [np.zeros(600)]])) / each
    normal, size = np.maximum(ahead[0], 0.0), np.linalg.norm(ahead[1:], axis=0)
    allowed = np.array([normal, *(ahead[1:] * np.minimum(1.0, 0.4 * normal / size))])
    expected = np.sqrt(np.mean(np.sum(((p - allowed) * each) ** 2, axis=0)))
    assert missed > 1e-9
    np.testing.assert_allclose(missed, expected, rtol=1e-6)


def test_what_a_group_cannot_be_is_named() -> None:
    scene = group([place(0.0, 0.1), place(0.0, 0.25)])
    with pytest.raises(aw.StartError, match=r"c: disc\[0\] starts inside disc\[1\], by 0\.05 m"):
        run(scene, 1.0, 0.01)
    scene = group([place(0.0, 0.1), place(0.0, 0.35)])
    asked = (aw.linearize, aw.conserved, aw.equations, aw.equilibria, aw.hamiltonian, aw.routhian, aw.tangent_flow)
    for ask in (lambda: simulate(scene, t_end=0.1), *(partial(one, scene) for one in asked)):
        with pytest.raises(aw.UnsupportedError, match="c: its contacts are sought in steps of equal length"):
            ask()
    held = group([place(0.0, 0.1), place(0.0, 0.35)])
    held.add("p", PointContact())
    held.connect(held.add("g", Ground()).frame, held["p"].plane)
    held.connect(held["d0"].frame, held["p"].point)
    with pytest.raises(aw.UnsupportedError, match="contacts of a group are solved by themselves"):
        run(held, 1.0, 0.01)


def test_forces_act_on_discs_of_a_group() -> None:
    scene = group([place(0.0, 0.1), place(0.5, 0.1)])
    spring = scene.add("s", Spring(stiffness=50.0, natural_length=0.15))
    scene.connect(scene["d0"].frame, spring.a)
    scene.connect(spring.b, scene["d1"].frame)
    result = run(scene, 2.0, 0.005)
    assert float(result["d1.position.x"][-1] - result["d0.position.x"][-1]) > 0.18
    assert float(result["d0.position.x"][-1] + 2.0 * result["d1.position.x"][-1]) == pytest.approx(1.0, abs=1e-9)


def test_a_force_that_switches_pushes_discs_that_are_a_little_inside_of_the_floor() -> None:
    scene = group([place(0.0, 0.3)], friction=0.0)
    push = scene.add("f", Force(value=lambda t: aw.select(t < 0.5, 0.0, 3.0)))
    scene.connect(push.point, scene["d0"].frame)
    result = run(scene, 1.0, 0.01)
    assert float(result["d0.velocity.x"][-1]) == pytest.approx(1.5, rel=1e-9)
    assert float(result["d0.position.z"][-1]) == pytest.approx(0.1, abs=0.02)
