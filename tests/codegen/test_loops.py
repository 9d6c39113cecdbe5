"""Operations that repeat are loops, in code that does not grow with their number, with the bits of straight code."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest

from atwood import expr as ex
from atwood.codegen.llvm.module import CodeOptions, Part, write_module
from atwood.expr.core.program import Program

from .test_lanes import values
from .test_llvm_backend import _OPERATIONS

_NEVER = 10**9


def row(count: int, seed: int, *, odd: int | None = None, has_systems: bool = False) -> Program:
    """Return sweeps over a row of equal things, to and fro, each from random operations; `odd` is unlike the others."""
    dice, graph = random.Random(seed), ex.Graph()
    names = [f"{name}{k}" for name in "xy" for k in range(count)]
    x = [graph.symbol(name) for name in names]
    p, q = graph.symbol("p"), [graph.symbol(f"q{k}") for k in range(count)]
    operations = _OPERATIONS[:-1] if has_systems else _OPERATIONS[:-4]
    recipe = [(dice.choice(operations), dice.randrange(9), dice.randrange(9)) for _ in range(12)]
    carried, kept = [p, p * 0.5, graph.constant(0.25)], [p] * count
    results = x[count:] + x[:count]
    for sweep in range(2):
        for k in range(count) if sweep == 0 else reversed(range(count)):
            pool = [*carried, x[k], x[count + k], q[k], kept[k], p, ex.sin(x[k])]
            for operation, i, j in recipe[: 10 if k == odd else None]:
                pool.append(0.5 * ex.sin(operation(pool[i], pool[j])))
                pool[dice.randrange(9) if k == odd else (3 * i + j) % 9] = pool[-1]
            carried, kept[k] = pool[-3:], pool[-2]
            results += [pool[-1]] if sweep else [pool[-1] * q[k], kept[k]]
    groups = (ex.InputGroup("x", tuple(x)),)
    return Program("row", groups, (p, *q), (ex.OutputGroup("r", tuple(results)),))


def given(made: Program, runs: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    sizes = len(made.inputs[0].symbols), len(made.parameters)
    return rng.uniform(-1.0, 1.0, (runs, sizes[0])), rng.uniform(0.5, 1.5, (runs, sizes[1]))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("odd", [None, 0, 7])
def test_loops_have_the_bits_of_straight_code(seed: int, odd: int | None) -> None:
    made = row(16, seed, odd=odd, has_systems=seed == 3)
    x, p = given(made, 4)
    if seed < 3:
        assert "br label" in write_module([Part("one", made)], CodeOptions(least_in_loops=0)).text
    for runs in (1,) if seed == 3 else (1, 4):
        straight, looped = (values(made, runs, x[:runs], p[:runs], 60, least)[0] for least in (_NEVER, 0))
        assert np.isfinite(straight).all()
        assert straight.tobytes() == looped.tobytes()


def test_code_does_not_grow_with_the_number() -> None:
    lengths = [
        len(re.sub(r"constant \[.*", "", write_module([Part("one", row(count, 1))], CodeOptions()).text))
        for count in (200, 2_000)
    ]
    assert lengths[1] < 1.3 * lengths[0]


def test_a_result_that_is_not_finite_is_seen_in_a_loop() -> None:
    made = row(16, 2)
    x, p = given(made, 1)
    assert values(made, 1, x, p, 60, 0)[1] == [False]
    x[0, 9] = np.nan
    assert values(made, 1, x, p, 60, 0)[1] == [True]
