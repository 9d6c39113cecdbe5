"""Where laws act narrowly or briefly: places and times at which the arguments of their functions are small.

What a law does in a place of its own (a peak, a resonance, a switch) it does where the argument of a square, of an
exponential or of a comparison is zero or small. Newton's method leads there from anywhere, along the
derivatives of these arguments by displacements and by time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen import compile_program
from atwood.expr import Expression, OutputGroup, Program, jvp, vjp
from atwood.expr.core.analysis import dependents, live
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.solutions import least_norm
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of

__all__ = ["Features"]

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
        outputs = OutputGroup("values", tuple(values)), OutputGroup("slopes", (*slopes, *times))
        program = Program(f"{assembly.flat.name} features", state_groups(e), assembly.parameters, outputs)
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
        """Return a time and a place near by at which some arguments, chosen at random, are small; as they were if none.

        Parameters
        ----------
        t, q
            Where to begin.
        sizes, span
            Of displacements, and of time.
        random
            Where chances come from.
        """
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
        above_square = one.operation in ("add", "sub") and len(moving) == 1 and _is_square(moving[0])
        if not (_is_square(one) or above_square or (one.operation in ("mul", "div", "neg") and len(moving) == 1)):
            return False
        one = moving[0]
    return True


def _is_square(value: Expression) -> bool:
    return value.operation == "mul" and value.arguments[0] is value.arguments[1]


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
