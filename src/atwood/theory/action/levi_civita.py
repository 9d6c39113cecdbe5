"""Levi-Civita's conditions at random states with many digits: by how much they are missed, beside what is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from atwood.errors import UnsupportedError
from atwood.theory.formulas.objects import Sympy

__all__ = ["DIGITS", "STATES", "ZERO", "worst_condition"]

STATES, _TRIALS = 6, 200
"""So many random states at which H is real are enough, among so many."""

DIGITS, ZERO, _UNKNOWN = 40, 1e-12, 30
"""Conditions are evaluated with so many digits, and hold where their terms cancel to the second.

Parameters are known to 16 digits: a condition holds too where what is left of it is at most so many times what other
last digits, and more digits, make of it.
"""


def worst_condition(
    h: Sympy, q: Sequence[Sympy], p: Sequence[Sympy], values: Mapping[Sympy, float], where: str
) -> tuple[str, str, float]:
    """Return by how much Levi-Civita's conditions are missed at random states, relative to their terms."""
    import sympy

    held = {symbol: float(value) for symbol, value in values.items()}
    by_q, by_p = [h.diff(one) for one in q], [h.diff(one) for one in p]
    worst = (str(q[0]), str(q[0]), 0.0)
    if len(q) == 1:
        return worst
    variables, variants = (*q, *p, *held), _variants([*held.values()])
    slopes = sympy.lambdify(variables, [h, *by_q, *by_p], "mpmath", cse=True)
    states = _states(lambda *state: slopes(*state, *variants[0][1]), len(q), where)
    first = [[_evaluated(slopes, state, *variant) for variant in variants] for state, _ in states]
    for i in range(len(q)):
        for j in range(i):
            seconds = [by_q[i].diff(q[j]), by_q[i].diff(p[j]), by_p[i].diff(q[j]), by_p[i].diff(p[j])]
            evaluate = sympy.lambdify(variables, seconds, "mpmath", cse=True)
            for (state, _), known in zip(states, first, strict=True):
                found = []
                for variant, own in zip(variants, known, strict=True):
                    qq, qp, pq, pp = _evaluated(evaluate, state, *variant) or [0] * 4
                    _, *slope = own or [0] * (2 * len(q) + 1)
                    hq, hp = slope[: len(q)], slope[len(q) :]
                    found.append((hp[i] * hp[j] * qq, -hp[i] * hq[j] * qp, -hq[i] * hp[j] * pq, hq[i] * hq[j] * pp))
                total, *others = [sum(one) for one in found]
                size = sum(abs(one) for one in found[0])
                # What other digits change is not known, however little there is beside it.
                known_to = _UNKNOWN * max(abs(one - total) for one in others)
                miss = float(abs(total) / size) if abs(total) > known_to else 0.0
                if miss > worst[2]:
                    worst = (str(q[j]), str(q[i]), miss)
            if worst[2] > ZERO:
                return worst
    return worst


def _variants(values: Sequence[float]) -> list[tuple[int, list[Any]]]:
    """Return numbers of digits, and parameters as they are and off by rounding, to see what is known of a condition."""
    import mpmath  # type: ignore[import-untyped]

    random = np.random.default_rng(5)
    exact = [mpmath.mpf(one) for one in values]
    made = [(DIGITS, exact), (DIGITS + 20, exact)]
    off = [random.uniform(-1.0, 1.0, len(values)) for _ in range(3)]
    return made + [(DIGITS, [x * (1 + mpmath.mpf(2.0**-52 * u)) for x, u in zip(exact, w, strict=True)]) for w in off]


def _states(evaluate: Any, n: int, where: str) -> list[tuple[list[Sympy], list[Any]]]:
    """Return random states at which H is real, with H and its derivatives there."""
    import sympy

    random = np.random.default_rng(3)
    found: list[tuple[list[Sympy], list[Any]]] = []
    for _ in range(_TRIALS):
        state = [sympy.Rational(int(k), 10**6) for k in random.integers(2 * 10**5, 18 * 10**5, 2 * n)]
        values = _evaluated(evaluate, state)
        if values is not None:
            found.append((state, values))
        if len(found) == STATES:
            return found
    raise UnsupportedError("H is real at too few random states to be looked at", where=where)


def _evaluated(
    evaluate: Any, state: Sequence[Sympy], digits: int = DIGITS, values: Sequence[Any] = ()
) -> list[Any] | None:
    """Return real values with many digits, None where there are none."""
    import mpmath

    with mpmath.workdps(digits):
        try:
            found = evaluate(*[mpmath.mpf(one.p) / one.q for one in state], *values)
        except (ZeroDivisionError, ValueError, TypeError, ArithmeticError):
            return None
        values = [one if isinstance(one, mpmath.mpf) else mpmath.mpmathify(one) for one in found]
        finite = all(isinstance(one, mpmath.mpf) and mpmath.isfinite(one) for one in values)
        return values if finite else None
