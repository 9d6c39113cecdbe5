"""Bodies placed roughly are brought together: where they come to, what moved, and what is said if they cannot."""

import math
import re
from collections.abc import Callable

import numpy as np
import pytest

from atwood import Component, Scene
from atwood.errors import StartError
from atwood.pipeline import assemble, simulate
from atwood.simulation.initialization.closure_error import find_closure_errors, wrongly_turned
from atwood.simulation.initialization.report import report_initialization
from atwood.simulation.initialization.start import find_start
from atwood_library import (
    Cylindrical,
    Ground,
    Link,
    Pivot,
    Planar,
    PointMass,
    RigidBody,
    Rod,
    Rope,
    Screw,
    Slider,
    Spherical,
    Universal,
    Weld,
)
from atwood_library.scenes import Bricard, DoublePendulum, FourBar, SpatialSliderCrank, StewartPlatform

FORMS = ("reduced", "dae")


# -- loops that cannot close ----------------------------------------------------------------------------------------


def open_four_bar(gap: float, scale: float = 1.0) -> FourBar:
    links = {"crank_length": 1.0, "coupler_length": 2.5, "rocker_length": 2.0, "frame_length": 5.5 + gap}
    scene = FourBar(**{name: scale * length for name, length in links.items()})
    scene.start.clear()
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_the_gap_of_a_four_bar_is_what_its_links_lack(form: str) -> None:
    with pytest.raises(StartError, match=r"the loop cannot be closed.* is 0\.1 m") as caught:
        simulate(open_four_bar(0.1), form=form)
    assert caught.value.where == "pivot3"
    assert "coupler.length = 2.6 m (it is 2.5 m)" in caught.value.advice
    assert "right.position.x = 5.5 m (it is 5.6 m)" in caught.value.advice


@pytest.mark.sample(1)
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_gaps_are_of_the_size_of_the_scene(scale: float) -> None:
    with pytest.raises(StartError, match=f"found is {0.1 * scale:.4g} m"):
        find_start(assemble(open_four_bar(0.1, scale)))


def test_a_loop_that_closes_just_so_or_just_not() -> None:
    with pytest.raises(StartError, match="found is 1e-06 m"):
        find_start(assemble(open_four_bar(1e-6)))
    start = find_start(assemble(open_four_bar(-1e-6)))
    assert np.all(np.isfinite(start.coordinates))


def test_the_least_gap_of_a_crank_and_slider_in_space() -> None:
    # the pin is nearest to the slider's line at the distance of the bearing less the crank
    scene = SpatialSliderCrank(rod_length=0.05)
    scene.start.clear()
    least = math.hypot(0.1, 0.12) - 0.08 - 0.05
    with pytest.raises(StartError, match=f"found is {least:.4g} m") as caught:
        find_start(assemble(scene))
    assert caught.value.where == "ball"


def test_fixed_values_that_keep_a_loop_open_say_by_how_much() -> None:
    # with the crank at 0 the pin is at (0, 0.18, 0.12)
    least = math.hypot(0.18, 0.12) - 0.1
    with pytest.raises(StartError, match=rf"bearing\.angle = 0 cannot all hold.*ball stays open by {least:.4g} m"):
        find_start(assemble(SpatialSliderCrank(rod_length=0.1)))


@pytest.mark.sample(2)
@pytest.mark.parametrize("space", ["plane", "space"])
@pytest.mark.parametrize(("apart", "miss"), [(3.1, 0.1), (0.9, 0.1)])
def test_rods_that_do_not_meet(space: str, apart: float, miss: float) -> None:
    scene = Scene(space=space)
    bob = scene.add("bob", PointMass())
    for name, place, length in (("left", 0.0, 1.0), ("right", apart, 2.0)):
        ground = scene.add(f"{name}_ground", Ground(position=(place, 0.0, 0.0)))
        rod = scene.add(name, Rod(length=length))
        scene.connect(ground.frame, rod.a)
        scene.connect(rod.b, bob.point)
    scene.guess.update({"bob.position.x": 0.4, "bob.position.z": -0.3})
    with pytest.raises(StartError, match=f"found is {miss:.4g} m") as caught:
        find_start(assemble(scene))
    assert caught.value.where in ("left", "right")


def hinged_askew(askew: float) -> Scene:
    """Return a bar between two hinges, the second with its ground turned about the bar."""
    scene = Scene(space="space")
    near, low = scene.add("near", Ground()), scene.add("low", Pivot())
    bar = scene.add("bar", Link())
    high, turned = scene.add("high", Pivot()), scene.add("turned", Weld(angle=askew, axis=(1.0, 0.0, 0.0)))
    far = scene.add("far", Ground(position=(1.0, 0.0, 0.0)))
    scene.connect(near.frame, low.a)
    scene.connect(low.b, bar.a)
    scene.connect(bar.b, high.a)
    scene.connect(high.b, turned.b)
    scene.connect(turned.a, far.frame)
    return scene


def test_a_gap_of_an_axis_is_an_angle() -> None:
    with pytest.raises(StartError, match="found is 3 deg") as caught:
        find_start(assemble(hinged_askew(math.radians(3.0))))
    assert caught.value.where in ("low", "high")
    find_start(assemble(hinged_askew(0.0)))


def test_hinges_are_not_put_in_the_wrong_way_round() -> None:
    # with its ground turned by half a turn the axes are parallel, and point opposite ways
    with pytest.raises(StartError, match="the wrong way round") as caught:
        find_start(assemble(hinged_askew(math.pi)))
    assert caught.value.where in ("low", "high")


def test_a_loop_that_closes_only_far_from_the_guess_says_where() -> None:
    scene = Bricard()
    scene.start["hinge1.angle"] = 0.5
    scene.guess.update({"hinge2.angle": 0.67, "hinge3.angle": 1.44, "hinge5.angle": 0.27, "hinge6.angle": 2.73})
    with pytest.raises(StartError, match="near the guess only with this joint the wrong way round") as caught:
        find_start(assemble(scene))
    advised = dict(re.findall(r"(hinge\d\.angle) = (-?[\d.]+\d)", caught.value.advice))
    assert set(advised) == set(scene.guess)
    scene.guess.update({path: float(value) for path, value in advised.items()})
    assembly = assemble(scene)
    found = report_initialization(assembly, find_start(assembly))
    assert all(abs(one.off) < 1e-3 for one in found.guesses)  # the advice is good


@pytest.mark.parametrize("kind", [Pivot, Slider, Cylindrical, Universal, Screw, Planar])
@pytest.mark.parametrize("is_turned", [False, True])
def test_which_way_round_is_known_of_every_joint(kind: type[Component], is_turned: bool) -> None:
    """A second joint like the first, beside it: right at every place; its base turned over, wrong at every place."""
    scene = Scene(space="space")
    ground, body = scene.add("ground", Ground()), scene.add("body", RigidBody(moments=(1.0, 1.0, 1.0)))
    first, second = scene.add("first", kind()), scene.add("second", kind())
    names = ("axis", "normal", "axis_a")
    axis = next(first.parameter_specs()[name].default for name in names if name in first.parameter_specs())
    square = (axis[1], axis[2], axis[0])
    over = scene.add("over", Weld(angle=math.pi if is_turned else 0.0, axis=square))
    scene.connect(ground.frame, first.a)
    scene.connect(first.b, body.frame)
    scene.connect(ground.frame, over.a)
    scene.connect(over.b, second.a)
    scene.connect(second.b, body.frame)
    assembly = assemble(scene)
    random = np.random.default_rng(0)
    for _ in range(20):
        q = random.uniform(-3.0, 3.0, len(assembly.reduced.coordinates))
        wrong = wrongly_turned(assembly, assembly.reduced, 0.0, q)
        if not is_turned:
            assert wrong == []
        elif kind is not Universal:  # its cross fits either way round
            assert wrong == ["second"]


@pytest.mark.sample(1)
@pytest.mark.parametrize("size", [1e-9, 1e6])
def test_gaps_are_seen_in_scenes_of_any_size(size: float) -> None:
    scene = Scene()
    ends = scene.add("left", Ground()), scene.add("right", Ground(position=(4.0 * size, 0.0, 0.0)))
    place = ends[0].frame
    for number, length in enumerate((1.0, 1.0, 1.9)):
        pivot, link = scene.add(f"pivot{number}", Pivot()), scene.add(f"link{number}", Link(length=length * size))
        scene.connect(place, pivot.a)
        scene.connect(pivot.b, link.a)
        place = link.b
    last = scene.add("last", Pivot())
    scene.connect(place, last.a)
    scene.connect(last.b, ends[1].frame)
    with pytest.raises(StartError, match=re.escape(f"found is {0.1 * size:.4g} m (the loop")):
        find_start(assemble(scene))


def test_gaps_of_joints_are_distances_and_angles() -> None:
    assembly = assemble(hinged_askew(0.0))
    equations = assembly.reduced
    (gap,) = find_closure_errors(assembly, equations, 0.0, np.array([0.3]), 1.0)
    assert gap.distance == pytest.approx(2.0 * math.sin(0.15), rel=1e-12)  # the chord that the bar's end went
    assert gap.angle < 1e-12


# -- what the start moved -------------------------------------------------------------------------------------------


def test_what_was_guessed_is_moved_and_what_was_not_is_placed() -> None:
    scene = FourBar()
    assembly = assemble(scene)
    start = find_start(assembly)
    found = report_initialization(assembly, start)
    at = dict(zip([one.name for one in assembly.reduced.names], start.coordinates.tolist(), strict=True))
    bodies = {one.path: one for one in found.bodies}
    assert set(bodies) == {"rocker", "coupler"}  # the crank's angle is fixed
    for name in bodies:
        asked = scene.guess[f"{name}.angle"]
        assert bodies[name].angle == pytest.approx(abs(at[f"{name}.angle"] - asked), rel=1e-12)
        assert bodies[name].moved == (bodies[name].distance, bodies[name].angle)
        assert bodies[name].placed == (0.0, 0.0)
        assert bodies[name].by[0] == "pivot3"
    half = 2.5 * math.sin(0.5 * bodies["coupler"].angle)  # the chord of its middle, which turns about the crank's end
    assert bodies["coupler"].distance == pytest.approx(half, rel=1e-12)
    assert [one.path for one in found.guesses] == ["rocker.angle", "coupler.angle"]  # the largest first
    assert found.opened[0].part == "pivot3"
    tip = [math.cos(1.0) + 2.5 * math.cos(0.3) - 2.5 - 2.0 * math.cos(1.9), math.sin(1.0) + 2.5 * math.sin(0.3)]
    assert found.opened[0].distance == pytest.approx(math.hypot(tip[0], tip[1] - 2.0 * math.sin(1.9)), rel=1e-12)
    assert "moved by the initialization: rocker by 0.458 m and 26.5 deg" in found.summary
    scene.guess.clear()
    assembly = assemble(scene)
    found = report_initialization(assembly, find_start(assembly))
    assert found.summary.startswith("placed by the solver, as not all was said of them")
    assert all(one.moved == (0.0, 0.0) for one in found.bodies)


def test_nothing_moves_where_all_fits() -> None:
    for scene in (DoublePendulum(), Bricard()):
        assembly = assemble(scene)
        found = report_initialization(assembly, find_start(assembly))
        assert found.bodies == found.opened == ()
        assert found.summary == ""
        assert "Nothing was moved" in str(found)


def test_a_guess_that_a_fixed_value_contradicts_is_said() -> None:
    scene = DoublePendulum()
    scene.start.clear()
    scene.start.update({"rod1.angle": 0.3, "bob2.position.x": 0.5})
    scene.guess.update({"rod1.angle": 0.5, "rod2.angle": 0.4})
    assembly = assemble(scene)
    found = report_initialization(assembly, find_start(assembly))
    off = {one.path: one.off for one in found.guesses}
    assert off["rod1.angle"] == pytest.approx(-0.2, abs=1e-9)
    assert off["rod2.angle"] == pytest.approx(math.asin(0.5 - math.sin(0.3)) - 0.4, abs=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_results_know_what_was_moved_in_both_forms(form: str) -> None:
    result = simulate(StewartPlatform(), form=form, t_end=1e-3, outputs=2, rtol=1e-6)
    found = result.initialization
    assert {one.path for one in found.bodies} >= {"upper3", "lower3"}
    leg = next(one for one in found.guesses if one.path == "leg2.displacement")
    assert leg.found == pytest.approx(result.array("leg2.displacement")[0], abs=1e-9)
    data = found.to_dict()
    assert data["bodies"][0]["by"]
    assert {one["part"] for one in data["opened"]} == {f"ball{i}" for i in range(1, 6)}


# -- assembly modes -------------------------------------------------------------------------------------------------


def perturbed(make: Callable[[], Scene], names: list[str], trials: int, size: float = math.radians(30.0)) -> None:
    """Check that guesses that are off by up to 30 degrees, or 0.3 of the scene's size, lead to where they are from."""
    assembly = assemble(make())
    home = find_start(assembly)
    units = {one.name: one.unit for one in assembly.reduced.names}
    at = dict(zip(units, home.coordinates.tolist(), strict=True))
    random = np.random.default_rng(7)
    for _ in range(trials):
        off = {
            name: (size if units[name] == "rad" else 0.3 * home.length) * random.uniform(-1.0, 1.0) for name in names
        }
        start = find_start(assembly.with_values(guess={name: at[name] + off[name] for name in names}))
        assert start.coordinates == pytest.approx(home.coordinates, abs=1e-8)


@pytest.mark.parametrize(("coupler", "rocker"), [(0.47, 1.44), (-1.29, -2.25)])
def test_both_modes_of_the_four_bar(coupler: float, rocker: float) -> None:
    def make() -> Scene:
        scene = FourBar()
        scene.guess.update({"coupler.angle": coupler, "rocker.angle": rocker})
        return scene

    perturbed(make, ["coupler.angle", "rocker.angle"], 30)


def test_near_the_fold_the_nearer_mode_is_taken() -> None:
    # coupler and rocker nearly in line: the two modes are 0.36 rad apart
    assembly = assemble(FourBar(coupler_length=1.2, rocker_length=0.95))
    modes = []
    for guess in ((0.1, 2.4), (-0.8, -3.1)):
        named = {"coupler.angle": guess[0], "rocker.angle": guess[1]}
        modes.append(find_start(assembly.with_values(guess=named)).coordinates)
    gap = float(np.linalg.norm(_turns(modes[0] - modes[1])))
    assert 0.3 < gap < 0.4
    random = np.random.default_rng(3)
    names = [one.name for one in assembly.reduced.names]
    for trial in range(60):
        mode = modes[trial % 2]
        way = random.normal(size=3)
        rough = mode + 0.45 * gap * way / np.linalg.norm(way)
        guess = {name: value for name, value in zip(names, rough.tolist(), strict=True) if name != "crank.angle"}
        found = find_start(assembly.with_values(guess=guess)).coordinates
        assert np.max(np.abs(_turns(found - mode))) < 1e-6


def _turns(angles: np.ndarray) -> np.ndarray:
    return np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_both_sides_of_the_crank_and_slider_in_space(side: float) -> None:
    def make() -> Scene:
        scene = SpatialSliderCrank()
        scene.guess["guide.displacement"] = 0.2 * side
        if side < 0.0:
            scene.guess.update({"cross.angle_a": -0.5, "cross.angle_b": -2.5})
        return scene

    assembly = assemble(make())
    start = find_start(assembly)
    slide = [one.name for one in assembly.reduced.names].index("guide.displacement")
    assert start.coordinates[slide] == pytest.approx(side * math.sqrt(0.09 - 0.18**2 - 0.12**2), abs=1e-11)
    perturbed(make, ["guide.displacement", "cross.angle_a", "cross.angle_b"], 30)


_LEG = (("universal", "angle_a"), ("universal", "angle_b"), ("leg", "displacement"))


def test_modes_of_the_stewart_platform() -> None:
    legs = [f"{name}{i}.{what}" for i in range(6) for name, what in _LEG]
    perturbed(StewartPlatform, legs, 4)
    # One leg the other way round: it points away from its ball and stretches backwards.
    scene = StewartPlatform()
    first, length = scene.guess["universal2.angle_a"], scene.guess["leg2.displacement"]
    scene.guess["universal2.angle_a"] = first - math.pi
    scene.guess["universal2.angle_b"] = -scene.guess["universal2.angle_b"]
    scene.guess["leg2.displacement"] = -3.0 * length
    assembly = assemble(scene)
    start = find_start(assembly)
    at = dict(zip([one.name for one in assembly.reduced.names], start.coordinates.tolist(), strict=True))
    assert at["leg2.displacement"] < -length
    assert at["leg3.displacement"] > 0.0


@pytest.mark.parametrize("branch", [0, 1])
def test_both_branches_of_bricards_loop(branch: int) -> None:
    # with hinge angles a, b, a, b, a, b it closes where (1 + sin a)(1 + sin b) = 1
    a = 0.5
    b = math.asin(1.0 / (1.0 + math.sin(a)) - 1.0)
    b = math.pi - b if branch else b

    def make() -> Scene:
        scene = Bricard()
        scene.start["hinge1.angle"] = a
        scene.guess.update({f"hinge{i}.angle": (a, b)[(i + 1) % 2] for i in (2, 3, 5, 6)})
        return scene

    assembly = assemble(make())
    start = find_start(assembly)
    at = dict(zip([one.name for one in assembly.reduced.names], start.coordinates.tolist(), strict=True))
    assert at["hinge2.angle"] == pytest.approx(b, abs=1e-9)
    assert at["hinge3.angle"] == pytest.approx(a, abs=1e-9)
    perturbed(make, [f"hinge{i}.angle" for i in (2, 3, 5, 6)], 20)


def test_bodies_placed_roughly_by_position_and_orientation() -> None:
    """Positions and orientations of bodies need not fit together: they are brought together all the same."""
    exact = simulate(_arm(), t_end=1e-3, outputs=2)
    scene = _arm()
    scene.start.clear()
    random = np.random.default_rng(1)
    for body in ("upper", "fore"):
        for path in (f"{body}.position.{axis}" for axis in "xyz"):
            scene.guess[path] = float(exact.array(path)[0]) + 0.1 * random.uniform(-1.0, 1.0)
        for path in (f"{body}.{one}_axis.{axis}" for one in "xz" for axis in "xyz"):
            scene.guess[path] = float(exact.array(path)[0]) + 0.1 * random.uniform(-1.0, 1.0)
    result = simulate(scene, t_end=1e-3, outputs=2)
    for path in ("fore.position.x", "fore.position.y", "fore.position.z", "upper.z_axis.x"):
        assert result.array(path)[0] == pytest.approx(exact.array(path)[0], abs=0.15)
    assert result.constraint_max["position"] < 1e-10
    assert len(result.initialization.guesses) == 18


def _arm() -> Scene:
    scene = Scene(space="space")
    ground, shoulder, elbow = (
        scene.add("ground", Ground()),
        scene.add("shoulder", Spherical()),
        scene.add("elbow", Pivot()),
    )
    upper = scene.add("upper", RigidBody(moments=(0.1, 0.1, 0.1), center=(0.5, 0.0, 0.0)))
    end = scene.add("end", Weld(displacement=(1.0, 0.0, 0.0)))
    fore = scene.add("fore", RigidBody(moments=(0.1, 0.1, 0.1), center=(0.4, 0.0, 0.0)))
    scene.connect(ground.frame, shoulder.a)
    scene.connect(shoulder.b, upper.frame)
    scene.connect(upper.frame, end.a)
    scene.connect(end.b, elbow.a)
    scene.connect(elbow.b, fore.frame)
    scene.start.update({"upper.phi": 0.4, "upper.theta": 0.8, "upper.psi": -0.3, "elbow.angle": 0.7})
    return scene


def test_a_guide_in_a_loop_is_the_right_way_round() -> None:
    """A guide's conditions hold after half a turn too; such a place is not one."""
    scene = Scene(space="space")
    ground, low, high = scene.add("ground", Ground()), scene.add("low", Slider()), scene.add("high", Slider())
    body = scene.add("body", RigidBody(moments=(1.0, 1.0, 1.0)))
    scene.connect(ground.frame, low.a)
    scene.connect(low.b, body.frame)
    turned = scene.add("turned", Weld(angle=math.pi, axis=(1.0, 0.0, 0.0)))
    scene.connect(ground.frame, turned.a)
    scene.connect(turned.b, high.a)
    scene.connect(high.b, body.frame)
    with pytest.raises(StartError, match="the wrong way round"):
        find_start(assemble(scene))


def test_what_nothing_holds_up_hangs() -> None:
    scene = Scene(space="space")
    below = scene.add("ground", Ground()).frame
    for i in range(3):
        rod, bob = scene.add(f"rod{i}", Rod(length=1.0)), scene.add(f"bob{i}", PointMass())
        scene.connect(below, rod.a)
        scene.connect(rod.b, bob.point)
        scene.start[f"bob{i}.position.x"] = 0.5 * (i + 1)
        below = bob.point
    result = simulate(scene, t_end=0.01, outputs=2)
    for i in range(3):
        assert result[f"bob{i}.position.y"][0] == pytest.approx(0.0, abs=1e-12)
        assert result[f"bob{i}.position.z"][0] == pytest.approx(-math.sqrt(0.75) * (i + 1), rel=1e-12)


def test_a_rope_that_cannot_be_taut_could_start_slack() -> None:
    scene = Scene(space="space")
    ground, rope, bob = (
        scene.add("ground", Ground()),
        scene.add("rope", Rope(length=1.0)),
        scene.add("bob", PointMass()),
    )
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start.update({f"bob.position.{axis}": 0.4 for axis in "xyz"})
    with pytest.raises(
        StartError, match=r"rope stays open by 0\.307\d* m .*can also start slack or released: starts='slack'"
    ):
        simulate(scene)
    scene.set("rope.starts", "slack")
    assert simulate(scene, t_end=0.1).status == "finished"
