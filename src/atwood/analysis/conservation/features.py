"""Where laws act narrowly or briefly: places and times at which the arguments of their functions are small.

What a law does in a place of its own (a peak, a resonance, a switch) it does where the argument of a square, of an
exponential or of a comparison is zero or small. Newton's method leads there from anywhere, along the
derivatives of these arguments by displacements and by time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import compile_program
from atwood.expr import Expression, OutputGroup, Program, jvp, vjp
from atwood.expr.core.analysis import dependents, live
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.mechanics.dynamics.equations import Equations
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of

__all__ = ["Features"]

_MOST, _TOGETHER, _STEPS = 48, 3, 12
"""So many arguments at most are looked at, up to so many at once, in so many steps of Newton's method."""

_DECADES = 8.0
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

    Attributes
    ----------
    count
        How many arguments there are.
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
        self.count = min(len(found), _MOST)
        values = list(found)[: self.count]
        pure = {one for node in nodes if node.operation in _PURE for one in node.arguments}
        self._pure = np.array([one in pure for one in values], dtype=bool)
        along = jvp(values, dict(zip(e.coordinates, e.rates, strict=True))) if values else []
        slopes = [one for rate in along for one in vjp([rate], [e.graph.one], [*e.speeds])]
        times = [vjp([value], [e.graph.one], [e.time])[0] for value in values]
        outputs = OutputGroup("values", tuple(values)), OutputGroup("slopes", (*slopes, *times))
        program = Program(f"{assembly.flat.name} features", state_groups(e), assembly.parameters, outputs)
        self._kernel = compile_program(program).bind(assembly.parameter_values)
        self._map, self._speeds = kinematic_map_of(assembly, "reduced"), len(e.speeds)

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
        if not self.count:
            return t, q
        chosen = random.permutation(self.count)[: random.integers(1, 1 + min(_TOGETHER, self.count))]
        relative = (random.uniform(size=len(chosen)) < 0.5) | ~self._pure[chosen]
        shares = random.choice([-1.0, 1.0], len(chosen)) * 10.0 ** -random.uniform(
            0.0, np.where(relative, _DECADES, 1.0)
        )
        wanted: FloatArray | None = None
        still, scales = np.zeros(self._speeds), np.append(sizes, span)
        for _ in range(_STEPS):
            values, entries = (np.asarray(one, dtype=float) for one in self._kernel([t], q, still))
            slopes = entries[: self.count * self._speeds].reshape(self.count, self._speeds)
            wanted = np.where(relative, np.abs(values[chosen]), 1.0) * shares if wanted is None else wanted
            matrix = (np.column_stack([slopes, entries[slopes.size :]]) * scales)[chosen]
            missing = wanted - values[chosen]
            if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(missing))):
                break
            rows = np.maximum(np.max(np.abs(matrix), axis=1), 1e-300)
            step = np.linalg.lstsq(matrix / rows[:, None], missing / rows, rcond=1e-9)[0] * scales
            if not np.all(np.isfinite(step)) or np.max(np.abs(step) / scales) > 1e12:
                break
            t, q = t + float(step[-1]), self._map.moved(t, q, step[:-1])
        return t, q


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
