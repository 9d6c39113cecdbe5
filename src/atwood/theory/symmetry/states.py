"""Quantities and their rates along the motion, at random consistent states of a scene.

States are all over the domain, and two of three are where laws act narrowly or briefly: where the argument of a square,
of an exponential or of a comparison is zero or small. Newton's method leads there from anywhere, along the derivatives
of these arguments by displacements and by time. Constraints hold on positions and velocities, and the balance of forces
gives the accelerations. What switches decide, and relations of time, is chosen at random, too (`generic`), so that a
push that comes later and a stop that nothing touches yet are not overlooked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen import compile_program
from atwood.codegen.rounding import ROUGHNESS
from atwood.errors import AtwoodError, SolveError
from atwood.expr import Expression, OutputGroup, Program, jvp, vjp
from atwood.expr.core.algebra import is_square
from atwood.expr.core.analysis import dependents, live
from atwood.expr.core.relations import Relation, TimeRelations
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.matrices import from_entries, least_norm, to_array
from atwood.numerics.rank import independent_rows
from atwood.simulation.dynamics.balance import BalanceValues, balance_of, mass_at, solve_balance
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import find_start
from atwood.theory.symmetry.generic import loosen

_SEED = 19180726
"""Of the random states: the same for every call, so that what is said of a scene does not change."""

_REACHES = (1.0, 0.3, 0.1)
"""How far states are from the start, in sizes of the scene and radians; nearer where constraints are not met there."""

_DECADES = 5.0
"""Every second state is nearer and slower by up to so many powers of ten."""

_FARTHEST = 1.0
"""Every third state is farther away and later by up to so many powers of ten."""

_POLE, _OFF_POLE = 1e3, 0.7
"""At a pole angles are so many times as fast as the body; states are so many radians away from a start there."""

_EACH = 3
"""For each relation so many states more."""

_PACED = 5
"""At so many places it is looked how fast things happen."""

_TRIALS = 9
"""For each state that is wanted, so many are tried."""

KEPT = 1e-9
"""Relative to its terms: how well the rate of a quantity must vanish at each state."""

_ROUGH = 0.1
"""A state says nothing where rounding changes what is left of a rate by this share of it."""

_MET = 1e-9
"""Relative to the sizes of the scene: how well constraints hold at a state."""


@dataclass(frozen=True, eq=False)
class State:
    """Quantities at one state.

    Attributes
    ----------
    t, q, u
        The state.
    values
        The quantities.
    rates
        Their derivatives by time along the motion.
    terms
        What these are sums of, in absolute value: rounding is relative to it.
    generators
        The displacements that they generate: speeds w with ``M w = dC/du`` that constraints let be, shape (quantities,
        speeds).
    """

    t: float
    q: FloatArray
    u: FloatArray
    values: FloatArray
    rates: FloatArray
    terms: FloatArray
    generators: FloatArray


class _Relations(TimeRelations):
    """Relations of time without time itself: its smooth functions are what they are at the time of a state."""

    def __init__(self, found: Sequence[Relation]) -> None:
        self.found = list(found)

    @property
    def roots(self) -> tuple[Expression, ...]:
        """The symbols of the relations."""
        return tuple(one.symbol for one in self.found)


class RandomStates:
    """Quantities of a scene at random states.

    Parameters
    ----------
    assembly
        The scene.
    quantities
        Expressions of time, generalized coordinates and speeds of the reduced form.
    """

    def __init__(self, assembly: Assembly, quantities: Sequence[Expression]) -> None:
        self.assembly, self._count = assembly, len(quantities)
        self._equations = e = assembly.reduced
        self._balance = balance_of(assembly, "reduced")
        by = [e.time, *e.coordinates, *e.speeds]
        slopes = [entry for one in quantities for entry in vjp([one], [e.graph.one], by)]
        own = self._balance.program
        outputs = (
            *own.program.outputs,
            OutputGroup("rates", e.rates),
            OutputGroup("quantities", tuple(quantities)),
            OutputGroup("derivatives", tuple(slopes)),
        )
        program = Program(f"{assembly.flat.name} conserved", own.program.inputs, assembly.parameters, outputs)
        moving = {*e.coordinates, *e.speeds}
        self._free = loosen(program, _Relations(assembly.relations), moving)
        self.reason = "constraints are not met near its start"
        self._features = Features(assembly, e, [*e.rows, *quantities])
        self._kernel = compile_program(self._free.program)
        self._probe = compile_program(self._free.probe)

    @property
    def is_plain(self) -> bool:
        """Whether neither a relation of time nor a switch decides anything."""
        return self._free.is_plain

    def draw(self, count: int, length: float) -> list[State]:
        """Return quantities at so many random states; none where constraints or laws allow too few."""
        plain = count
        count += self._features.visits + _EACH * sum(len(one) for _, one in self._free.probe.outputs)
        start = find_start(self.assembly)
        random = np.random.default_rng(_SEED)
        sizes = motion_scales(self._equations, length)
        q0 = from_regular(self.assembly, start.coordinates)
        for one in self._equations.orientation_coordinates if self._is_pole(start.time, q0) else ():
            q0[list(one.coordinates)] += _OFF_POLE
        least = self.assembly.flat.t_end - start.time
        pace = self._pace(start.time, q0, start.speeds, sizes, 1.0 / least if least > 0.0 else 1.0)
        span = max(least, 1.0 / pace)
        found: list[State] = []
        for trial in range(_TRIALS * count):
            reach = _REACHES[trial * len(_REACHES) // (_TRIALS * count)]
            # What a scene is far away from makes its size: some states are near by and slow beside that, some far away.
            near, slow = (10.0 ** -random.uniform(0.0, _DECADES, 2)) if trial % 2 else (1.0, 1.0)
            far, late = (10.0 ** random.uniform(0.0, _FARTHEST, 2)) if trial % 3 == 2 else (1.0, 1.0)
            t = start.time + late * span * float(random.uniform())
            step = near * far * reach * sizes * random.uniform(-1.0, 1.0, len(sizes))
            u = slow * pace * sizes * random.uniform(-1.0, 1.0, len(sizes))
            try:
                q = self._balance.kinematic_map.moved(t, q0, step)
                if len(found) >= plain or len(found) % 3:
                    t, q = self._features.towards(t, q, sizes, span, random)
                q, u = self._balance.project(t, q, u, sizes)
                if t >= start.time and not self._is_pole(t, q) and self._is_met(t, q, u, sizes, slow * pace):
                    found.append(self._at(t, q, u, sizes, random, len(found)))
            except (AtwoodError, ArithmeticError, np.linalg.LinAlgError) as error:
                self.reason = str(error)
                continue
            if len(found) == count:
                break
        return found if len(found) == count else []

    def _is_pole(self, t: float, q: FloatArray) -> bool:
        """Return whether angles are so near to where they have no rates that these are rounding."""
        try:
            rates = self._balance.kinematic_map.rates(t, q, np.ones(len(self._equations.speeds)))
        except (AtwoodError, ArithmeticError):
            return True
        turned = [rates[i] for one in self._equations.orientation_coordinates for i in one.coordinates]
        return bool(np.max(np.abs(turned), initial=0.0) > _POLE)

    def _pace(self, t: float, q: FloatArray, u: FloatArray, sizes: FloatArray, least: float) -> float:
        """Return how fast things happen, 1/s: at the start, and at the median of states beside it."""
        random = np.random.default_rng(_SEED)
        fast = []
        for number in range(_PACED):
            aside = sizes * random.uniform(-1.0, 1.0, len(sizes)) * bool(number)
            try:
                with np.errstate(all="ignore"):
                    there, still = self._balance.project(
                        t, self._balance.kinematic_map.moved(t, q, aside), np.zeros_like(u), sizes
                    )
                    a, _ = self._balance.accelerate(t, there, still, self._kept(t, there, still, sizes))
            except (AtwoodError, ArithmeticError, np.linalg.LinAlgError):
                continue
            if np.all(np.isfinite(a)):
                fast.append(float(np.max(np.sqrt(np.abs(a) / sizes), initial=0.0)))
        return max(float(np.max(np.abs(u) / sizes, initial=0.0)), float(np.median(fast)) if fast else 0.0, least)

    def _kept(self, t: float, q: FloatArray, u: FloatArray, sizes: FloatArray) -> np.ndarray | None:
        """Return which constraints are independent; None for all of none."""
        if not self._balance.constraints:
            return None
        jacobian = to_array(self._balance.constraints_at(t, q, u).jacobian)
        return np.asarray(independent_rows(jacobian * sizes, self._balance.errors.of_jacobian(t, q, sizes)), dtype=int)

    def _is_met(self, t: float, q: FloatArray, u: FloatArray, sizes: FloatArray, pace: float) -> bool:
        if not self._balance.constraints:
            return True
        now = self._balance.constraints_at(t, q, u)
        jacobian = to_array(now.jacobian)
        rows = np.maximum(np.abs(jacobian) @ sizes, 1e-300)
        rates = np.abs(jacobian @ u + now.explicit_rate)
        off = np.max(np.abs(now.value) / rows, initial=0.0), np.max(rates / rows / pace, initial=0.0)
        return bool(max(off) <= _MET)

    def _at(
        self, t: float, q: FloatArray, u: FloatArray, sizes: FloatArray, random: np.random.Generator, number: int
    ) -> State:
        known = self.assembly.parameter_values
        if not self._free.is_plain:
            probed = self._probe.bind(known)([t], q, u)
            known = np.concatenate([known, self._free.choose(probed, random, number)])
        here = self._with(known, t, q, u, sizes)
        # The rate of what is conserved is zero beside, too: what it changes by is rounding, as near poles of angles.
        aside = [ROUGHNESS * random.uniform(-1.0, 1.0, len(u)) for _ in range(2)]
        there = self._with(known, t, self._balance.kinematic_map.moved(t, q, sizes * aside[0]), u + u * aside[1], sizes)
        left = np.abs(here.rates) > KEPT * here.terms
        if np.any(np.abs(there.rates - here.rates)[left] > _ROUGH * np.abs(here.rates)[left]):
            raise SolveError("rates are rounding here", where=self.assembly.flat.name)
        return here

    def _with(self, known: FloatArray, t: float, q: FloatArray, u: FloatArray, sizes: FloatArray) -> State:
        n, own = len(u), self._balance.program
        values = [np.asarray(one, dtype=float) for one in self._kernel.bind(known)([t], q, u)]
        if not all(np.all(np.isfinite(one)) for one in values):
            raise SolveError("a law has no value here", where=self.assembly.flat.name)
        mass, bias, value, rate, gamma, entries, explicit_rate, rates, quantities, slopes = values
        if own.mass_product is None:
            matrix = from_entries(own.mass_rows, own.mass_columns, mass, (n, n), True)
        else:
            matrix = mass_at(self.assembly, "reduced", t, q, u)
        jacobian = from_entries(own.jacobian_rows, own.jacobian_columns, entries, (own.constraints, n), True)
        now = BalanceValues(matrix, bias, value, rate, gamma, jacobian, explicit_rate)
        kept = self._kept(t, q, u, sizes)
        a, _ = solve_balance(now, kept, t)
        along = np.concatenate([[1.0], rates, a])
        slopes = slopes.reshape(self._count, -1)
        still = np.zeros_like(gamma)
        flows = [solve_balance(replace(now, bias=-one, gamma=still), kept, t)[0] for one in slopes[:, -n:]]
        # Accelerations are known as well as the largest of them, each in its own size; and as squares of speeds,
        # which cancel where they are zero.
        pace, rate_of_pace = (float(np.max(np.abs(one) / sizes, initial=0.0)) for one in (u, a))
        fastest = sizes * max(rate_of_pace, pace**2)
        terms = np.abs(slopes) @ np.concatenate([[1.0], np.abs(rates), np.maximum(np.abs(a), fastest)])
        return State(t, q, u, quantities, slopes @ along, terms, np.reshape(flows, (self._count, n)))


_MOST, _TOGETHER, _STEPS = 48, 3, 12
"""So many arguments at most are looked at, up to so many at once, in so many steps of Newton's method."""

_EACH, _OFTEN = 3, 9
"""So many states for each argument; so many for one that others do not depend on: a rigid motion has six directions,
of which each state where a law acts rules out one."""

_JOINT = 0.75
"""So often arguments that act together are made small together."""

_SMALLEST = 8.0
"""Arguments become smaller by up to so many powers of ten: what is small for one says its law alone.

Those of functions that take pure numbers are brought to the order of one as well.
"""

_PURE = ("exp", "cosh", "sinh", "tanh", "atan")
_ONE = (*_PURE, "log", "sqrt", "pow", "sign", "absolute", "floor")
_TWO = ("less", "less_equal", "minimum", "maximum")


class Features:
    """The arguments of functions that can be narrow, of one scene.

    Parameters
    ----------
    assembly, equations
        The scene, and its equations in the reduced form.
    laws
        What is looked at.
    """

    def __init__(self, assembly: Assembly, equations: Equations, laws: Sequence[Expression]) -> None:
        e = equations
        nodes = live(laws)
        placed = dependents(nodes, [e.time, *e.coordinates])
        moving = dependents(nodes, [*e.speeds, *e.accelerations])
        found: dict[Expression, None] = {}
        for node in nodes:
            if node.index in placed:
                found |= {one: None for one in _arguments(node) if one.index in placed and one.index not in moving}
        values = [one for one in found if not _follows(one, found)][:_MOST]
        self._count = len(values)
        number = {one: i for i, one in enumerate(values)}
        inner = {one for value in values for one in live([value]) if one is not value}
        terms = (
            [number[one] for one in live([term]) if one in number and one not in inner] for term in _summands(laws)
        )
        self._groups = [list(one) for one in dict.fromkeys(tuple(sorted(one)) for one in terms) if len(one) > 1]
        often = [i for one, i in number.items() if one not in inner]
        self._turns = [*range(self._count)] * _EACH + often * (_OFTEN - _EACH)
        self._turn = 0
        pure = {one for node in nodes if node.operation in _PURE for one in node.arguments}
        self._pure = np.array([one in pure for one in values], dtype=bool)
        along = jvp(values, dict(zip(e.coordinates, e.rates, strict=True))) if values else []
        slopes = [one for rate in along for one in vjp([rate], [e.graph.one], [*e.speeds])]
        times = [vjp([value], [e.graph.one], [e.time])[0] for value in values]
        program = coordinate_program(assembly, "features", e, {"values": values, "slopes": [*slopes, *times]})
        self._kernel = compile_program(program).bind(assembly.parameter_values)
        self._map, self._speeds = kinematic_map_of(assembly, "reduced"), len(e.speeds)

    @property
    def visits(self) -> int:
        """How many states there should be where arguments are small."""
        return len(self._turns)

    def _choose(self, random: np.random.Generator) -> NDArray[np.intp]:
        """Return numbers of arguments: each in its turn, alone, with others at random, or with what acts with it."""
        first, self._turn = self._turns[self._turn % len(self._turns)], self._turn + 1
        together = [one for one in self._groups if first in one]
        group, most = list(range(self._count)), int(random.integers(1, 1 + _TOGETHER))
        if together and random.uniform() < _JOINT:
            group, most = together[int(random.integers(len(together)))], _TOGETHER
        others = [int(one) for one in random.permutation(group) if one != first]
        return np.array([first, *others[: most - 1]], dtype=np.intp)

    def towards(
        self, t: float, q: FloatArray, sizes: FloatArray, span: float, random: np.random.Generator
    ) -> tuple[float, FloatArray]:
        """Return a time and place nearby at which some arguments, chosen at random, are small; unchanged if none."""
        if not self._count:
            return t, q
        chosen = self._choose(random)
        relative = (random.uniform(size=len(chosen)) < 0.5) | ~self._pure[chosen]
        shares = random.choice([-1.0, 1.0], len(chosen)) * 10.0 ** -random.uniform(
            0.0, np.where(relative, _SMALLEST, 1.0)
        )
        wanted: FloatArray | None = None
        still, scales = np.zeros(self._speeds), np.append(sizes, span)
        for _ in range(_STEPS):
            values, entries = (np.asarray(one, dtype=float) for one in self._kernel([t], q, still))
            slopes = entries[: self._count * self._speeds].reshape(self._count, self._speeds)
            wanted = np.where(relative, np.abs(values[chosen]), 1.0) * shares if wanted is None else wanted
            matrix = (np.column_stack([slopes, entries[slopes.size :]]) * scales)[chosen]
            missing = wanted - values[chosen]
            if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(missing))):
                break
            rows = np.maximum(np.max(np.abs(matrix), axis=1), 1e-300)
            step = least_norm(matrix / rows[:, None], missing / rows) * scales
            if not np.all(np.isfinite(step)) or np.max(np.abs(step) / scales) > 1e12:
                break
            t, q = t + float(step[-1]), self._map.moved(t, q, step[:-1])
        return t, q


def _follows(value: Expression, found: Mapping[Expression, None]) -> bool:
    """Return whether an argument is a power of another, but for factors, or one more than its square."""
    one = value
    while one is value or one not in found:
        moving = [part for part in one.arguments if not part.is_parametric]
        above_square = one.operation in ("add", "sub") and len(moving) == 1 and is_square(moving[0])
        if not (is_square(one) or above_square or (one.operation in ("mul", "div", "neg") and len(moving) == 1)):
            return False
        one = moving[0]
    return True


def _summands(laws: Sequence[Expression]) -> list[Expression]:
    """Return what laws are sums of, but for constant factors: what acts in one of them acts together."""
    waiting, found = list(dict.fromkeys(laws)), dict[Expression, None]()
    while waiting:
        one = waiting.pop()
        if one.operation in ("add", "sub", "neg"):
            waiting += one.arguments
        elif one.operation in ("mul", "div") and any(factor.is_parametric for factor in one.arguments):
            waiting += [factor for factor in one.arguments if not factor.is_parametric]
        else:
            found[one] = None
    return list(found)


def _arguments(node: Expression) -> Sequence[Expression]:
    """Return what a node does something sudden with, if it does."""
    if node.operation in _ONE:
        return node.arguments[:1]
    if node.operation == "div":
        return node.arguments[1:]
    if node.operation == "mul" and node.arguments[0] is node.arguments[1]:
        return node.arguments[:1]
    if node.operation in _TWO:
        return (node.arguments[0] - node.arguments[1],)
    return ()
