"""Elementary functions against 150 bits and more: `check(seed)` looks at some thousand arguments of each."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np

from atwood.expr.core.elementary import ON_ARRAYS

from .trial import Finding, Trial

COUNT = 300
"""Arguments of each kind and function."""

Draw = Callable[[random.Random], Any]


def _between(low: float, high: float) -> Draw:
    return lambda chance: chance.uniform(low, high)


def _sized(low: float, high: float) -> Draw:
    return lambda chance: math.exp(chance.uniform(math.log(low), math.log(high))) * chance.choice((1.0, -1.0))


def _any(chance: random.Random) -> float:
    while True:
        [found] = struct.unpack("d", struct.pack("Q", chance.getrandbits(64)))
        if math.isfinite(found):
            return float(found)


def _quarter_turn(chance: random.Random) -> float:
    """Return what is next to a whole number of quarter turns: little is left of it."""
    turns = chance.randrange(1, 1 << chance.randrange(1, 20)) if chance.random() < 0.8 else chance.getrandbits(60)
    return float(mpmath.mpf(turns) * mpmath.pi / 2) * (1.0 + chance.choice((-1, 0, 0, 1)) * 2.0**-52)


def _next_to_one(chance: random.Random) -> float:
    return 1.0 + _sized(1e-16, 0.1)(chance)


ANGLES = (_between(-1, 1), _between(-10, 10), _between(-1e6, 1e6), _sized(1e6, 1e308), _quarter_turn, _any)
SINES = (_between(-1, 1), _sized(1e-10, 1), lambda chance: 1 - abs(_sized(1e-16, 0.1)(chance)), _between(-0.55, -0.45))
WIDE = (_between(-1, 1), _between(-5, 5), _any, _sized(1e-3, 1e3))
EXPONENTS = (_between(-1, 1), _between(-745, 709.7), _sized(1e-20, 1), _between(-745, -700))
TURNS = (_between(-1.2, 1.2), _between(-5, 5), _between(-710.4, 710.4), _sized(1e-20, 1))

ARGUMENTS: dict[str, tuple[Draw, ...]] = {
    **dict.fromkeys(("sin", "cos", "tan"), ANGLES),
    **dict.fromkeys(("asin", "acos"), SINES),
    "atan": WIDE,
    "exp": EXPONENTS,
    "log": tuple(
        lambda chance, one=one: abs(one(chance)) or 1.0 for one in (_between(0.5, 2), _next_to_one, _any, WIDE[3])
    ),
    **dict.fromkeys(("sinh", "cosh", "tanh"), TURNS),
    "atan2": tuple(lambda chance, one=one: (one(chance), one(chance)) for one in WIDE),
    "pow": (
        lambda chance: (chance.uniform(0, 10), chance.uniform(-10, 10)),
        lambda chance: (chance.uniform(0.9, 1.1), chance.uniform(-6000, 6000)),
        lambda chance: (abs(_any(chance)), chance.uniform(-1, 1)),
        lambda chance: (abs(_next_to_one(chance)), _sized(1e-3, 1e5)(chance)),
        lambda chance: (-chance.uniform(0, 10), float(chance.randrange(-20, 20))),
    ),
}
"""Arguments of each function."""

_TRUE: dict[str, Callable[..., Any]] = {"pow": mpmath.power}


def drawn(name: str, chance: random.Random, count: int) -> list[tuple[float, ...]]:
    """Return arguments of a function, so many of each kind."""
    found = [one(chance) for one in ARGUMENTS[name] for _ in range(count)]
    return [one if isinstance(one, tuple) else (one,) for one in found]


def units_off(name: str, arguments: Sequence[tuple[float, ...]], values: Sequence[float]) -> list[float]:
    """Return by how many units in the last place values are off."""
    true = _TRUE.get(name) or getattr(mpmath, name)
    found = []
    for given, value in zip(arguments, values, strict=True):
        with mpmath.workprec(1400 if name in ("sin", "cos", "tan") and abs(given[0]) > 1e6 else 200):
            exact = true(*map(mpmath.mpf, given))
            nearest = float(exact)
            if math.isinf(nearest) or not math.isfinite(value):
                found.append(0.0 if value == nearest else math.inf)
            else:
                found.append(float(abs(mpmath.mpf(value) - exact) / math.ulp(nearest)))
    return found


def check(seed: int) -> Trial:
    """Compare every function with many digits."""
    chance, findings, said = random.Random(seed), [], []
    for name in ARGUMENTS:
        arguments = drawn(name, chance, COUNT)
        values = ON_ARRAYS[name](*map(np.array, zip(*arguments, strict=True)))
        off = units_off(name, arguments, values.tolist())
        worst = max(range(len(off)), key=off.__getitem__)
        said.append(f"{name}: below {math.ceil(20 * off[worst]) / 20:.2f} units")
        if off[worst] > 1.0:
            findings.append(Finding("wrong", f"{name}{arguments[worst]} is {off[worst]:.2f} units off"))
    return Trial(tuple(said), tuple(findings))
