"""Functions of state, inputs and time at many points, with their sparse first and second derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from atwood.arrays import FloatArray, IndexArray
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian, vjp
from atwood.forms.assembly import Assembly


class PointFunctions:
    """Functions of (t, q, u, inputs), each evaluated at many points at once.

    Parameters
    ----------
    assembly
        The scene.
    parameters, values
        Parameters of the functions, and their values.
    groups
        Symbols of time, coordinates, speeds and inputs.
    functions
        Expressions of these and of the parameters.
    """

    def __init__(
        self,
        assembly: Assembly,
        parameters: tuple[Expression, ...],
        values: FloatArray,
        groups: Sequence[Sequence[Expression]],
        functions: Sequence[Expression],
    ) -> None:
        time, q, u, inputs = groups
        graph = time[0].graph
        self.count, self.size = len(functions), len(q) + len(u) + len(inputs) + 1
        wrt = [*q, *u, *inputs, *time]
        weights = tuple(graph.symbol(f"weight {k} of a function") for k in range(len(functions)))
        slopes = jacobian(list(functions), wrt)
        bends = jacobian(vjp(functions, weights, wrt) if functions else [], wrt)
        inside = [InputGroup(name, tuple(one)) for name, one in zip(("t", "q", "u", "inputs"), groups, strict=True)]
        self._cuts = [len(q), len(q) + len(u), len(q) + len(u) + len(inputs)]

        def bound(name: str, more: Sequence[InputGroup], outputs: Sequence[Expression]) -> Any:
            if not outputs:
                return lambda *given: (np.zeros((0, 1)),)
            program = Program(name, (*inside, *more), parameters, (OutputGroup(name, tuple(outputs)),))
            return assembly.compiled(program, vectorized=True).bind(values)

        self._values = bound("functions at points", (), functions)
        self._slopes = bound("slopes at points", (), slopes.entries)
        self._bends = bound("second derivatives at points", [InputGroup("weights", weights)], bends.entries)
        self._places = [np.array([one.rows, one.columns], dtype=np.intp) for one in (slopes, bends)]

    def _split(self, points: FloatArray) -> list[FloatArray]:
        q, u, inputs, t = np.split(points.T, self._cuts)
        return [t, q, u, inputs]

    def values(self, points: FloatArray) -> FloatArray:
        """Return the functions, shape (points, functions), at states, inputs and times, shape (points, size)."""
        found = np.broadcast_to(self._values(*self._split(points))[0], (self.count, len(points)))
        return np.array(found.T)

    def slopes(self, points: FloatArray) -> csr_array[Any]:
        """Return the first derivatives, shape (points * functions, points * size)."""
        return self._spread(self._slopes(*self._split(points))[0], self._places[0], len(points), self.count)

    def bends(self, points: FloatArray, weights: FloatArray) -> csr_array[Any]:
        """Return the second derivatives of weighted sums at each point, shape (points * size, points * size)."""
        found = self._bends(*self._split(points), np.ascontiguousarray(weights.T))[0]
        return self._spread(found, self._places[1], len(points), self.size)

    def _spread(self, entries: FloatArray, places: IndexArray, points: int, height: int) -> csr_array[Any]:
        rows = (places[0][:, None] + height * np.arange(points)).ravel()
        columns = (places[1][:, None] + self.size * np.arange(points)).ravel()
        data = np.broadcast_to(entries, (places.shape[1], points)).ravel() if places.size else np.zeros(0)
        return csr_array((data, (rows, columns)), shape=(height * points, self.size * points))
