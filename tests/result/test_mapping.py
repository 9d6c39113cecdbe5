"""Results are mappings from paths to arrays; groups of quantities are kept apart from them."""

from collections.abc import Mapping

import numpy as np
import pytest

from atwood import ResultError, Scene, load_result, simulate
from atwood.result.segment_quantities import SegmentQuantities, quantities_of, values_along
from atwood.result.trajectories import Trajectories
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import BouncingBall, DoublePendulum, StickSlip


@pytest.fixture(scope="module")
def scene() -> Scene:
    return DoublePendulum()


@pytest.fixture(scope="module")
def run(scene) -> Trajectories:
    return simulate(scene, t_end=0.5, outputs=11)


@pytest.fixture(scope="module", params=["run", "saved"])
def result(request, run, tmp_path_factory) -> Trajectories:
    if request.param == "run":
        return run
    return load_result(run.save(tmp_path_factory.mktemp("mapping") / "run.nc"))


def test_it_is_a_mapping_of_arrays(result):
    assert isinstance(result, Mapping)
    assert len(result) == len(result.paths) == len(list(result)) > 20
    assert dict(result).keys() == set(result.paths)
    for path, values in result.items():
        assert values.shape == (11,)
        assert np.array_equal(values, result[path])
    assert [one.shape for one in result.values()] == [(11,)] * len(result)
    assert {**result}["rod1.angle"] is not None


def test_quantities_of_the_scene_are_keys(result, scene):
    assert np.array_equal(result[scene["bob2"].position.x], result["bob2.position.x"])
    assert scene["bob2"].position.x in result


def test_what_is_not_there_is_a_key_error_of_a_result(result):
    assert "rod1.angel" not in result
    assert 3 not in result
    assert result.get("rod1.angel") is None
    assert result.get("rod1.angle") is not None
    with pytest.raises(KeyError) as caught:
        result["rod1.angel"]
    assert isinstance(caught.value, ResultError)
    assert "Did you mean" in str(caught.value)
    with pytest.raises(ResultError, match=r'group\("?\'?rod1'):
        result["rod1"]


def test_a_result_is_equal_to_itself_alone_and_can_be_a_key(run):
    other = simulate(DoublePendulum(), t_end=0.5, outputs=11)
    assert run == run
    assert run != other
    assert {run: 1, other: 2}[run] == 1


def test_groups_by_path_and_by_attribute(result):
    by_path, by_name = result.group("bob2"), result.parts.bob2
    assert list(by_path) == list(by_name)
    assert np.array_equal(by_name.position["x"], result["bob2.position.x"])
    assert np.array_equal(by_path["position.x"], result["bob2.position.x"])
    assert by_path.table().keys() == by_path.keys()
    assert np.array_equal(by_path.table()["position.z"], result["bob2.position.z"])
    assert "position" in dir(by_name)
    assert "bob2" in dir(result.parts)
    assert len(result.parts) == len(result)


def test_groups_say_what_there_is(result):
    with pytest.raises(AttributeError, match=r'write \["angle"\]'):
        _ = result.parts.rod1.angle
    with pytest.raises(ResultError, match="Did you mean 'bob2'"):
        _ = result.parts.bob3
    with pytest.raises(ResultError, match="one quantity and no group"):
        result.group("rod1.angle")
    with pytest.raises(ResultError, match="Did you mean"):
        result.group("rod3")
    assert not hasattr(result.parts, "_no_such_thing")
    assert "bob2" in repr(result.parts.bob2)


def test_elements_of_arrays_are_groups():
    scene = Scene(t_end=0.1)
    ground, rods = scene.add("ground", Ground()), scene.add("rod", [Rod(length=1.0)])
    bob = scene.add("bob", PointMass())
    scene.connect(ground.frame, rods[0].a)
    scene.connect(rods[0].b, bob.point)
    result = simulate(scene, outputs=3)
    assert np.array_equal(result.group("rod[0]")["angle"], result["rod[0].angle"])


def test_a_part_with_the_name_of_a_method_is_reached_by_its_path():
    scene = Scene(t_end=0.1)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("items", Rod(length=1.0)), scene.add("bob", PointMass())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    result = simulate(scene, outputs=3)
    assert np.array_equal(result.group("items")["angle"], result["items.angle"])
    assert callable(result.parts.items)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("scene", [BouncingBall, StickSlip])
def test_segments_that_are_alike_are_read_as_one_and_give_what_each_gives(scene: type[Scene], form: str) -> None:
    result = simulate(scene(), form=form, t_end=8.0, outputs=41)
    segments = result.run.segments
    readings = quantities_of(segments)
    assert len(segments) > 8
    assert len(readings) <= len(segments) // 2
    numbers = sorted(number for one in readings for number in one.parts)
    assert numbers == list(range(len(segments)))
    paths = tuple(result.paths)
    alone = [SegmentQuantities({number: one}).values(paths) for number, one in enumerate(segments)]
    np.testing.assert_allclose(values_along(readings, paths), np.concatenate(alone, axis=1), rtol=1e-12, atol=1e-12)
