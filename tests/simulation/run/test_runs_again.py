"""What assemblies and runs keep is never stale: any run of an assembly is that of one assembled for it alone."""

from __future__ import annotations

import pickle
from collections.abc import Hashable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tests.calls import calls

from atwood import Model, Result, assemble, simulate
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Kept, Key
from atwood.simulation.problem import projection
from atwood_library.scenes import (
    BouncingBall,
    CartPole,
    DoublePendulum,
    FourBar,
    FourBarRow,
    SimplePendulum,
    SliderCrank,
    StickSlip,
    Trebuchet,
)

SCENES: dict[str, tuple[type[Model], str, tuple[float, float, float], str]] = {
    "double-pendulum": (DoublePendulum, "mass2", (1.0, 2.0, 0.5), "rod1.angle"),
    "four-bar": (FourBar, "coupler_length", (2.5, 2.45, 2.55), "crank.angle"),
    "slider-crank": (SliderCrank, "rod_length", (1.5, 1.4, 1.2), "crank.angle"),
    "cart-pole": (CartPole, "lean", (0.2, 0.1, 0.15), "hinge.angle"),
    "stick-slip": (StickSlip, "friction", (0.4, 0.3, 0.5), "body.position.x"),
    "bouncing-ball": (BouncingBall, "height", (0.3, 0.2, 0.4), "ball.position.z"),
    "trebuchet": (Trebuchet, "release", (1.396, -0.6, -0.7), "arm.angle"),
}
"""Each with a parameter, three of its values, and a quantity to compare."""

OPTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"rtol": 1e-5},
    {"outputs": 7},
    {"t_end": 0.25},
    {"max_step": 0.01},
    {"max_steps": 20},
    {"solver": "ida"},
    {"atol": 1e-4},
    {"samples": 50},
    {"outputs": [0.0, 0.1, 0.3]},
    {"outputs": [0.0, 0.2, 0.3]},
    {"first_step": 1e-4},
)


def steps(count: int) -> Iterator[tuple[int, dict[str, Any]]]:
    """Give values and options in an order of no order."""
    random = np.random.default_rng(20)
    for _ in range(count):
        yield int(random.integers(3)), OPTIONS[random.integers(len(OPTIONS))]


def ran(assembly: Assembly, options: dict[str, Any]) -> Result:
    return simulate(assembly, **({"t_end": 0.4} | options))


def same(one: Result, other: Result, path: str) -> None:
    assert_array_equal(one.time, other.time)
    assert_array_equal(one[path], other[path])
    assert (one.status, one.statistics.steps) == (other.status, other.statistics.steps)
    # Where it was pickled, what is worked out from the states may be added up in another order.
    assert_allclose(one.energy.total, other.energy.total, rtol=0.0, atol=1e-11)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SCENES)
def test_runs_with_other_options_and_values_are_those_of_new_assemblies(name: str) -> None:
    make, parameter, values, path = SCENES[name]
    first = assemble(make())
    varied = [first.with_values({parameter: value}) for value in values]
    fresh = [assemble(make(**{parameter: value})) for value in values]
    alone: dict[tuple[int, str], Result] = {}
    for k, options in steps(12):
        key = k, repr(options)
        if key not in alone:  # on an assembly that nothing was run with
            alone[key] = ran(pickle.loads(pickle.dumps(fresh[k])), options)
        same(ran(varied[k], options), alone[key], path)


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SCENES)
def test_a_run_that_was_broken_off_leaves_nothing_behind(name: str) -> None:
    make, _, _, path = SCENES[name]
    assembly = assemble(make())
    expected = ran(assembly, {})

    def stop(t: float) -> None:
        if t > 0.2:
            raise RuntimeError("enough")

    def interrupt(t: float) -> None:
        if t > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(RuntimeError, match="enough"):
        ran(assembly, {"progress": stop})
    assert ran(assembly, {"progress": interrupt}).status == "interrupted"
    same(ran(assembly, {}), expected, path)


def test_runs_of_several_scenes_at_the_same_time() -> None:
    made = [(assemble(make()), path) for make, _, _, path in SCENES.values()]
    expected = [ran(one, {})[path] for one, path in made]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: ran(made[k % 4][0], {})[made[k % 4][1]], range(16)))
    for k, values in enumerate(found):
        assert_array_equal(values, expected[k % 4])


@pytest.mark.parametrize(
    ("make", "options", "most"),
    [
        (SimplePendulum, {"t_end": 2.0}, 305),
        (StickSlip, {"t_end": 3.0, "rtol": 1e-10}, 445),
        (DoublePendulum, {"t_end": 2.0, "form": "dae"}, 400),
        (CartPole, {"t_end": 2.0}, 590),
        (Trebuchet, {"t_end": 2.0}, 850),
        (FourBarRow, {"t_end": 2.0}, 1270),
    ],
    ids=["pendulum", "stick-slip", "dae", "cart-pole", "trebuchet", "four-bar-row"],
)
def test_a_run_again_makes_few_calls_whatever_happens_in_it(
    make: type[Model], options: dict[str, Any], most: int
) -> None:
    assembly = assemble(make(), form=options.get("form", "reduced"))
    options = {name: one for name, one in options.items() if name != "form"}
    for _ in range(30):  # classes have their constructors, and what pays is compiled
        simulate(assembly, **options)
    with calls() as made:
        simulate(assembly, **options)
    assert made.count < most


def test_states_that_formulas_give_are_compared_with_the_constraints_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last was compared by itself, though none of them is changed; where it is matters to what follows alone."""
    assembly, looked = assemble(FourBar()), list[int]()
    ran(assembly, {})
    miss = projection.misses_of

    def note(plan: Any, t: np.ndarray, *more: Any) -> np.ndarray:
        looked.append(len(t))
        return miss(plan, t, *more)

    monkeypatch.setattr(projection, "misses_of", note)
    ends = [ran(assembly, {"outputs": outputs}).run.segments[-1] for outputs in (2, 30)]
    assert len(looked) == 2
    assert_array_equal(ends[0].coordinates[:, -1], ends[1].coordinates[:, -1])


def test_what_is_recalled_is_what_was_made_last() -> None:
    """As many values as are remembered are made once; the oldest goes first, and none before there is no room."""
    kept, key, made = Kept(), Key[dict[tuple[Hashable, ...], int]]("squares"), list[int]()

    def recalled(number: int) -> int:
        def make() -> int:
            made.append(number)
            return number**2

        return kept.recall(key, make, number)

    for number in (*range(60), *range(60), *range(60, 100), 99, 0):
        assert recalled(number) == number**2
    assert made == [*range(100), 0]
