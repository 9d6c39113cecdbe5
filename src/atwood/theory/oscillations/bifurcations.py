"""Bifurcations: where in the parameters states of rest meet, appear, or begin to oscillate.

Each is on the boundary of where a state exists or is stable. Which kind it is follows from what is on both sides of it
(Guckenheimer and Holmes, Nonlinear Oscillations, chapter 3; Strogatz, Nonlinear Dynamics and Chaos, chapters 3 and 8):
of states that meet, two that go on are transcritical, two on one side alone a saddle-node, and two on one side with one
that goes on a pitchfork. Where none meets, two rates of small deviations become imaginary.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy
from atwood.theory.oscillations.conditions import balanced
from atwood.theory.oscillations.rest import Expansion, PlainEquations
from atwood.theory.oscillations.stability import characteristic

_DRAWS, _SPREAD = 4, 0.4
"""A kind is one with so many values of the parameters: those of the scene, and others so far away, as logarithms."""

_ASIDE, _MET = 1e-3, 1e-9
"""Relative: how far from a bifurcation it is looked at both sides of it; how near to each other states meet."""

_DIGITS = 40


@dataclass(frozen=True, eq=False)
class Bifurcation:
    """A place in the parameters at which states of rest change.

    Attributes
    ----------
    kind
        ``"pitchfork"``, ``"saddle-node"`` or ``"transcritical"``; ``"Hopf"`` where a state begins to oscillate, and
        ``"Hamiltonian Hopf"`` where without damping two of its frequencies meet.
    condition
        An equality between parameters.
    states
        Numbers of the states that meet there, or of the one that begins to oscillate; the first is 0.
    sense
        Of a pitchfork ``"supercritical"`` if those that branch off are stable, else ``"subcritical"``.
    """

    kind: str
    condition: Sympy
    states: tuple[int, ...]
    sense: str = ""


class State(NamedTuple):
    """A state of rest in plain symbols: coordinates, where it exists and is stable, and the equations near it."""

    values: tuple[Sympy | None, ...]
    exists: Sympy
    stable: Sympy | None
    expansion: Expansion | None


def find_bifurcations(plain: PlainEquations, states: Sequence[State]) -> Iterator[Bifurcation]:
    """Yield the bifurcations of states of rest whose kind is the same whatever the other parameters are."""
    boundaries = dict.fromkeys(one for state in states for one in _boundaries(state.exists, state.stable))
    random = np.random.default_rng(1883)
    draws = [
        {one: sympy.Float(value * math.exp(k and random.uniform(-_SPREAD, _SPREAD)), _DIGITS) for one, value in given}
        for k, given in enumerate([list(plain.values.items())] * _DRAWS)
    ]
    for boundary in boundaries:
        found = [set(_kinds(plain, states, boundary, draw)) for draw in draws]
        for kind, sense, members in sorted(set.intersection(*found)):
            yield Bifurcation(kind, plain.told(sympy.Eq(*balanced(boundary).args)), members, sense)


def _boundaries(*conditions: Sympy | None) -> Iterator[Sympy]:
    """Yield what is zero where a condition begins to hold: factors that may have either sign."""
    for one in {r for c in conditions if c is not None for r in c.atoms(sympy.core.relational.Relational)}:
        power = 2 if one.has(sympy.Abs) else 1
        for factor in sympy.Mul.make_args(sympy.factor(sympy.together(one.lhs**power - one.rhs**power))):
            base, _ = factor.as_base_exp()
            if not (base.is_positive or base.is_negative or sympy.expand(base).is_positive):
                yield -base if base.could_extract_minus_sign() else base


def _kinds(
    plain: PlainEquations, states: Sequence[State], boundary: Sympy, values: Mapping[Sympy, Sympy]
) -> Iterator[tuple[str, str, tuple[int, ...]]]:
    """Yield kinds, senses and members of the bifurcations on a boundary near given values of the parameters."""
    crossing = next(_crossings(boundary, values), None)
    if crossing is None:
        return
    letter, place = crossing
    there, *sides = ({**values, letter: place * (1 + step)} for step in (0, -_ASIDE, _ASIDE))
    present = [tuple(bool(one.exists.xreplace(side)) for side in sides) for one in states]
    exact = [[None if x is None else x.xreplace(there).evalf(_DIGITS) for x in one.values] for one in states]
    left = {k for k, x in enumerate(exact) if any(present[k]) and all(y is None or y.is_finite for y in x)}
    at = {k: [None if x is None else complex(x) for x in exact[k]] for k in left}
    while left:
        first = min(left)
        group = tuple(sorted(k for k in left if _alike(plain, at[first], at[k])))
        left -= {first, *group}
        through = [k for k in group if all(present[k])]
        begun = [present[k] for k in group if k not in through]
        kind = _MEETINGS.get((len(through), len(begun))) if len(set(begun)) < 2 else None
        found = [_rates(states[k].expansion, side) for k in through[:1] for side in sides]
        if len(through) != 1 or None in found:
            if kind:
                yield kind, "", group
            continue
        less, more = sorted(([one for one in rates or () if one.real > 0.0] for rates in found), key=len)
        if kind:
            with_others = found[begun[0].index(True)] or ()
            is_below = sum(one.real > 0.0 for one in with_others) > len(less)
            yield kind, "supercritical" if is_below else "subcritical", group
        elif len(group) == 1 and len(more) == len(less) + 2 and more[0].imag:
            is_even = all(abs(sum(rates or ()).real) <= _MET * abs(more[0]) for rates in found)
            yield "Hamiltonian Hopf" if is_even else "Hopf", "", group


_MEETINGS = {(1, 2): "pitchfork", (0, 2): "saddle-node", (2, 0): "transcritical"}
"""Kinds by how many states go on, and how many are on one side alone."""


def _crossings(boundary: Sympy, values: Mapping[Sympy, Sympy]) -> Iterator[tuple[Sympy, Sympy]]:
    """Yield parameters with the value of their sign nearest to theirs at which a boundary is met."""
    for letter in sorted(boundary.free_symbols, key=str):
        left = sympy.numer(sympy.together(boundary.xreplace({k: v for k, v in values.items() if k != letter})))
        if left.is_polynomial(letter):
            roots = sympy.Poly(left, letter).nroots(n=_DIGITS, maxsteps=200)
            own = [one for one in roots if one.is_real and one * values[letter] > 0]
            if own:
                yield letter, min(own, key=lambda one: abs(math.log(float(one / values[letter]))))


def _alike(plain: PlainEquations, one: Sequence[complex | None], other: Sequence[complex | None]) -> bool:
    """Return whether two states are in one place, angles up to whole turns."""
    for x, y, is_angle in zip(one, other, plain.is_angle, strict=True):
        if (x is None) is not (y is None):
            return False
        if x is not None and y is not None:
            apart = math.remainder((x - y).real, 2.0 * math.pi) if is_angle else (x - y).real
            if max(abs(apart), abs(x.imag), abs(y.imag)) > _MET * (1.0 + abs(x)):
                return False
    return True


def _rates(one: Expansion | None, values: Mapping[Sympy, Sympy]) -> list[complex] | None:
    """Return the rates of small deviations, the fastest growing first, without rounding; None where there are none."""
    if one is None:
        return None
    mass, damping, stiffness = (m.xreplace(dict(values)) for m in (one.mass, one.damping, one.stiffness))
    polynomial = characteristic(mass, damping, stiffness, sympy.Symbol("s"))
    if not all(x.is_finite for x in polynomial.all_coeffs()):
        return None
    found = [complex(x) for x in polynomial.nroots(n=_DIGITS // 2, maxsteps=500)]
    least = _MET * max(map(abs, found), default=0.0)
    rates = [complex(*(0.0 if abs(part) <= least else part for part in (x.real, x.imag))) for x in found]
    return sorted(rates, key=lambda x: -x.real)
