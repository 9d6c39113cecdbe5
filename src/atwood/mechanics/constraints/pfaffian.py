"""Constraints on velocities as Pfaffian forms, and which of them can be integrated, alone or together.

A constraint ``sum c_i(q, t) u_i + c_0(q, t) = 0`` is a constraint on positions in disguise if a multiple of it, or a
combination of several, is the differential of a function (Neimark and Fufaev, Dynamics of Nonholonomic Systems, chapter
1). Here that function is sought among those that are linear in the coordinates, as for a wheel on a line: a combination
with constant coefficients must be in the span of the forms at every place. Whether it is, is asked at places that
nothing singles out.

Forms ``w_k`` that vanish on some directions of motion are integrable together if and only if their derivatives
``dw_k(X, Y)`` vanish for all pairs of these directions (the theorem of Frobenius): then the motions stay on surfaces,
even where nobody can write down which. Directions are taken along the speeds, which need not be rates of coordinates:
``dw(X, Y) = X(w(Y)) - Y(w(X)) - w([X, Y])``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, uneven
from atwood.errors import AtwoodError
from atwood.expr import Expression, evaluate, jacobian, jvp, live, substitute
from atwood.expr.core.operations import PIECEWISE_CONSTANT
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.constraints.elimination import rounds_to_zero
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide, extent
from atwood.mechanics.kinematics.motion import Movement
from atwood.model.local.parts import LocalConstraint
from atwood.numerics.matrices import least_squares
from atwood.numerics.rank import null_space
from atwood.tolerances import tolerances

_ASKED, NEEDED = 7, 4
"""At so many places coefficients are looked at, and at so many they must have values."""

SWITCHING = PIECEWISE_CONSTANT | {"absolute", "minimum", "maximum", "select", "external"}


@dataclass(frozen=True)
class Form:
    """A constraint on velocities as a Pfaffian form.

    Attributes
    ----------
    path, constraint
        The part and its constraint.
    rate
        What stays zero, in terms of coordinates and speeds.
    coefficients
        The coefficient of each speed.
    explicit_rate
        What does not depend on speeds.
    terms
        What the coefficients are sums of, each with the number of its speed: slope by a connector's velocity times what
        the speed does to that. A coefficient that is zero but for rounding is small beside its terms.
    """

    path: str
    constraint: LocalConstraint
    rate: Expression
    coefficients: tuple[Expression, ...]
    explicit_rate: Expression
    terms: tuple[tuple[int, Expression], ...] = ()

    @property
    def switches(self) -> bool:
        """Whether a coefficient switches with the motion or the clock, so that some places say nothing of others."""
        return switches((*self.coefficients, self.explicit_rate))


def switches(expressions: Sequence[Expression]) -> bool:
    """Return whether expressions have kinks or jumps, or come from a function that nobody can look into."""
    nodes = live(expressions)
    known = nodes[0].graph.relations if nodes else None
    relations = () if known is None else known.symbols
    return any((node.operation in SWITCHING or node in relations) and not node.is_parametric for node in nodes)


def pfaffian_forms(state: Movement | Equations, rates: Sequence[tuple[str, LocalConstraint, Expression]]) -> list[Form]:
    """Return constraints on velocities as forms."""
    still = dict.fromkeys(state.speeds, 0.0)
    found = []
    for path, one, rate in rates:
        entries = jacobian([rate], list(state.speeds))
        coefficients = [rate.graph.zero] * len(state.speeds)
        for column, entry in zip(entries.columns, entries.entries, strict=True):
            coefficients[column] = entry
        found.append(Form(path, one, rate, tuple(coefficients), substitute([rate], still)[0]))
    return found


@dataclass(frozen=True)
class Places:
    """Places at which coefficients are looked at: any that nothing singles out, in the coordinates of a movement.

    Attributes
    ----------
    state
        The coordinates and speeds.
    time
        The symbol of time.
    """

    state: Movement | Equations
    time: Expression

    def sizes(self, mechanism: Mechanism) -> FloatArray:
        """Return the size of each speed, and of time last: a length, a radian, a second."""
        length = extent(mechanism) or 1.0
        return np.array([*(length if one.unit == "m/s" else 1.0 for one in self.state.speed_names), 1.0])

    def values(self, mechanism: Mechanism, expressions: Sequence[Expression]) -> FloatArray:
        """Return expressions at the places where all have values, one row each."""
        found, nodes = [], live(expressions)
        for place in self._places(mechanism):
            try:
                numbers = evaluate(expressions, {**mechanism.table.values, **place}, nodes)
            except (AtwoodError, ArithmeticError):
                continue
            if np.all(np.isfinite(numbers)):
                found.append(numbers)
        return np.array(found).reshape(len(found), len(expressions))

    def certain(self, mechanism: Mechanism, expressions: Sequence[Expression]) -> NDArray[np.bool_]:
        """Return whether expressions are more than rounding at the places where all have values, one row each."""
        found, symbols = [], [*self.state.coordinates, self.time]
        for place in self._places(mechanism):
            try:
                numbers = evaluate(expressions, {**mechanism.table.values, **place})
            except (AtwoodError, ArithmeticError):
                continue
            if np.all(np.isfinite(numbers)):
                at = {one: place[one] for one in symbols}
                found.append(~rounds_to_zero(expressions, mechanism.table.values, at))
        return np.array(found, dtype=bool).reshape(len(found), len(expressions))

    def some(self, mechanism: Mechanism) -> dict[Expression, float]:
        """Return one of the places."""
        return next(self._places(mechanism))

    def _places(self, mechanism: Mechanism) -> Iterator[dict[Expression, float]]:
        state, length = self.state, extent(mechanism) or 1.0
        for attempt in range(1, _ASKED + 1):
            numbers = uneven(len(state.coordinates), attempt, 0.7 * attempt)
            numbers *= (1.0, 0.3, 0.1)[attempt % 3]  # far away and near, since some things end somewhere
            for i, one in enumerate(state.names):
                numbers[i] *= length if one.unit == "m" else 2.0 if one.unit == "rad" else 1.0
            for orientation in state.orientation_coordinates:
                own = list(orientation.coordinates)
                numbers[own] /= np.linalg.norm(numbers[own]) or 1.0
            yield {**dict(zip(state.coordinates, numbers.tolist(), strict=True)), self.time: 0.3 * attempt}

    def reference(self) -> dict[Expression, float]:
        """Return a place without turns and displacements."""
        place = dict.fromkeys((*self.state.coordinates, self.time), 0.0)
        for orientation in self.state.orientation_coordinates:
            place |= {
                self.state.coordinates[i]: x
                for i, x in zip(orientation.coordinates, orientation.reference, strict=True)
            }
        return place


def is_idle(derivation: Derivation, places: Places, form: Form) -> bool:
    """Return whether a form is zero everywhere, so that nothing can violate it."""

    def how(mechanism: Mechanism) -> bool:
        values = _scaled(places, form, mechanism)
        terms = places.values(mechanism, [term for _, term in form.terms])
        if len(values) < NEEDED or len(terms) < NEEDED:
            return False
        sizes = places.sizes(mechanism)[[number for number, _ in form.terms]]
        return bool(np.max(np.abs(values)) <= tolerances.SAME * np.max(np.abs(terms * sizes), initial=0.0))

    return all(c.is_zero for c in (*form.coefficients, form.explicit_rate)) or (
        not form.switches and decide(derivation, how)
    )


def _scaled(places: Places, form: Form, mechanism: Mechanism) -> FloatArray:
    return places.values(mechanism, [*form.coefficients, form.explicit_rate]) * places.sizes(mechanism)


def constant_pivot(
    derivation: Derivation, places: Places, form: Form, allowed: Sequence[int]
) -> tuple[int, Expression] | None:
    """Return the speed with the largest coefficient of those that are the same everywhere, and its coefficient."""

    def how(mechanism: Mechanism) -> int | None:
        values = _scaled(places, form, mechanism)
        if len(values) < NEEDED:
            return None
        largest = float(np.max(np.abs(values)))
        even = np.max(values, axis=0) - np.min(values, axis=0) <= tolerances.SAME * largest
        sizes = np.where(even, np.min(np.abs(values), axis=0), 0.0)
        chosen = max(allowed, key=lambda i: float(sizes[i]), default=None)
        return chosen if chosen is not None and sizes[chosen] >= 0.1 * largest > 0.0 else None

    pivot = decide(derivation, how)
    if pivot is None:
        return None
    (coefficient,) = _at_reference(derivation, places, [form.coefficients[pivot]])
    return pivot, coefficient


def _at_reference(derivation: Derivation, places: Places, constants: Sequence[Expression]) -> list[Expression]:
    """Return expressions that are the same everywhere, but for a common factor, in terms of parameters alone."""
    found = substitute(list(constants), places.reference())
    numbers = decide(derivation, partial(_away_from_reference, places, tuple(constants), tuple(found)))
    return found if numbers is None else [one.graph.constant(x) for one, x in zip(found, numbers, strict=True)]


def _away_from_reference(
    places: Places, constants: Sequence[Expression], found: Sequence[Expression], mechanism: Mechanism
) -> tuple[float, ...] | None:
    """Return the values elsewhere of what has none, or others, at the reference; None where these are alike."""
    numbers = places.values(mechanism, constants)[0]
    try:
        values = np.array(evaluate(found, mechanism.table.values))
    except (AtwoodError, ArithmeticError):
        values = np.full(len(found), np.nan)
    largest = int(np.argmax(np.abs(numbers)))
    off = values * numbers[largest] - numbers * values[largest]
    size = abs(numbers[largest] * values[largest])
    if size > 0.0 and np.max(np.abs(off)) <= 1e-9 * size:  # False where there is no value
        return None
    return tuple(numbers.tolist())


Integral = tuple[tuple[int, ...], dict[int, Expression]]
"""Numbers of the forms that an integral comes from, of which it takes the place of the last; its coefficients by speed.

Time has the number after the last speed.
"""


def linear_integrals(derivation: Derivation, places: Places, forms: Sequence[Form], together: bool) -> list[Integral]:
    """Return functions, linear in the coordinates, whose constancy says as much as forms do."""
    own = _integrable_speeds(places.state)
    found: list[Integral] = []
    for number, form in enumerate(forms):
        if form.switches or not decide(derivation, partial(_is_constant, places, form, own)):
            continue
        entries = [*form.coefficients, form.explicit_rate]
        coefficients = _at_reference(derivation, places, entries)
        kept = {i: c for i, c in enumerate(coefficients) if (i in own or i == len(form.coefficients)) and not c.is_zero}
        found.append(((number,), kept))
    if found or not together or len(forms) < 2:
        return found
    graph = derivation.table.graph
    combined = decide(derivation, partial(_combinations, places, tuple(forms), own))
    return [(members, {i: graph.constant(c) for i, c in entries}) for members, entries in combined]


def _integrable_speeds(state: Movement | Equations) -> tuple[int, ...]:
    """Return the numbers of the speeds that are the rates of coordinates."""
    rates = set(state.rates)
    return tuple(i for i, speed in enumerate(state.speeds) if speed in rates)


def _is_constant(places: Places, form: Form, own: Sequence[int], mechanism: Mechanism) -> bool:
    """Return whether the coefficients of a form are in the same ratios everywhere."""
    values = _scaled(places, form, mechanism)
    if len(values) < NEEDED:
        return False
    least = np.min(np.abs(values), axis=0)
    pivot = max(own, key=lambda i: float(least[i]), default=None)
    if pivot is None or not least[pivot] > 1e-6 * float(np.max(np.abs(values))):
        return False
    ratios = values / values[:, pivot : pivot + 1]
    others = [i for i in range(len(form.coefficients)) if i not in set(own)]
    size = float(np.max(np.abs(ratios)))
    return bool(
        np.max(np.ptp(ratios, axis=0)) <= tolerances.SAME * size
        and not np.any(np.abs(ratios[:, others]) > tolerances.SAME * size)
    )


def _combinations(
    places: Places, forms: Sequence[Form], own: Sequence[int], mechanism: Mechanism
) -> tuple[tuple[tuple[int, ...], tuple[tuple[int, float], ...]], ...]:
    """Return the combinations of forms that are the same everywhere.

    They are what the spans of the forms at all places have in common: square to the kernel at every place.
    """
    at_places = [_scaled(places, form, mechanism) for form in forms]
    sizes = places.sizes(mechanism)
    if min(len(values) for values in at_places) < _ASKED:
        return ()
    spans = np.stack(at_places, axis=1)
    spans = spans / np.max(np.abs(spans), axis=2, keepdims=True, initial=1e-300)
    kernels = [null_space(span).T for span in spans]
    alone = [np.eye(len(sizes))[i] for i in range(len(sizes) - 1) if i not in set(own)]
    common = null_space(np.vstack([*kernels, *(row[None] for row in alone)])).T
    found: list[tuple[tuple[int, ...], tuple[tuple[int, float], ...]]] = []
    for row in _reduced(common):
        weights = least_squares(spans[0].T, row)
        members = tuple(int(i) for i in np.argsort(np.abs(weights), kind="stable") if abs(weights[i]) > tolerances.RANK)
        if not members or any(set(members) & set(others) for others, _ in found):
            continue  # the next round finds it
        found.append((members, tuple((i, float(c / sizes[i])) for i, c in enumerate(row) if c != 0.0)))
    return tuple(found)


def _reduced(rows: FloatArray) -> FloatArray:
    """Return rows of the same span with as many zeros as elimination gives, and exact zeros and ones."""
    left = rows.copy()
    for k in range(len(left)):
        _, column = np.unravel_index(int(np.argmax(np.abs(left[k:]))), left[k:].shape)
        best = k + int(np.argmax(np.abs(left[k:, column])))
        left[[k, best]] = left[[best, k]]
        left[k] /= left[k, column]
        others = [i for i in range(len(left)) if i != k]
        left[others] -= np.outer(left[others, column], left[k])
    left[np.abs(left) < 1e-10] = 0.0
    return left


_LARGEST = 12
"""Up to so many speeds it is asked."""


def integrable_together(mechanism: Mechanism, equations: Equations) -> bool | None:
    """Return whether the constraints of a scene, all together, could be written as ones on positions."""
    n, m = len(equations.speeds), len(equations.constraints)
    if not m or n > _LARGEST:
        return None
    graph, still = equations.graph, dict.fromkeys(equations.speeds, 0.0)
    fields = _fields(equations)
    forms = np.full((m, n + 1), graph.zero, dtype=object)
    velocity_jacobian = jacobian([one.rate for one in equations.constraints], list(equations.speeds))
    for row, column, entry in velocity_jacobian.triples:
        forms[row, column] = entry
    forms[:, n] = substitute([one.rate for one in equations.constraints], still)
    # How forms and fields change along each field, one sweep each.
    moving = [*forms.ravel(), *(component for field in fields for component in field[1])]
    changes = [jvp(moving, field[0]) for field in fields]
    places = Places(equations, equations.time)
    numbers = places.values(mechanism, [*moving, *(entry for change in changes for entry in change)])
    if len(numbers) < NEEDED:
        return None
    sizes, q = places.sizes(mechanism), len(equations.coordinates)
    return all(_vanishes(row, sizes, m, q) for row in numbers)


def _fields(equations: Equations) -> list[tuple[dict[Expression, Expression | float], list[Expression]]]:
    """Return, for each speed and for time, the direction in which coordinates move with it, and its components."""
    graph = equations.graph
    found = []
    for speed in (*equations.speeds, None):
        others: dict[Expression, Expression | float] = dict.fromkeys(equations.speeds, 0.0)
        components = (
            substitute(list(equations.rates), others) if speed is None else jvp(list(equations.rates), {speed: 1.0})
        )
        components = [graph.convert(c) for c in components]
        direction: dict[Expression, Expression | float] = dict(zip(equations.coordinates, components, strict=True))
        if speed is None:
            direction[equations.time] = 1.0
        found.append((direction, components))
    return found


def _vanishes(numbers: FloatArray, sizes: FloatArray, m: int, q: int) -> bool:
    """Return whether the derivatives of forms vanish on the directions that the forms leave, at one place.

    Displacements along the fields are counted in their sizes, and each form in that of its largest coefficient.
    """
    fields = len(sizes)
    moving, changes = numbers[: m * fields + fields * q], numbers[m * fields + fields * q :]
    changes = changes.reshape(fields, len(moving))
    forms, components = moving[: m * fields].reshape(m, fields), moving[m * fields :].reshape(fields, q)
    of_forms = changes[:, : m * fields].reshape(fields, m, fields)  # [i, k, j]: X_i(w_k(X_j))
    of_fields = changes[:, m * fields :].reshape(fields, fields, q)  # [i, j]: X_i(X_j)
    brackets = of_fields - of_fields.transpose(1, 0, 2)
    # A bracket has no part along time, and is a sum of the other fields.
    weights = least_squares(components[:-1].T, brackets.reshape(fields * fields, q).T)
    along = weights.T.reshape(fields, fields, fields - 1)
    left = of_forms.transpose(1, 0, 2)
    derivatives = left - left.transpose(0, 2, 1) - np.einsum("kl,ijl->kij", forms[:, :-1], along)
    forms, both = forms * sizes, np.outer(sizes, sizes)
    units = np.maximum(np.max(np.abs(forms), axis=1), 1e-300)
    left, derivatives = (one * both / units[:, None, None] for one in (left, derivatives))
    free = null_space(forms / units[:, None])
    rest = np.einsum("ia,kij,jb->kab", free, derivatives, free)
    largest = max(float(np.max(np.abs(left), initial=0.0)), 1.0)
    return bool(np.max(np.abs(rest), initial=0.0) <= tolerances.RANK * largest)
