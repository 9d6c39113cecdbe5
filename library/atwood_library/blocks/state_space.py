"""StateSpace: a linear system by its matrices."""

from __future__ import annotations

from typing import Any

from atwood import Component, Number, ParameterError, Scalar, derivative, observable, parameter, signal, state


class StateSpace(Component):
    """A linear system with one input and one output, ``x' = A x + B u``, ``y = C x + D u``."""

    synonyms = ("Continuous.StateSpace", "Linear system", "State-space model")

    a: Any = parameter(((-1.0,),), array=True, doc="Matrix A, row by row.")
    b: Any = parameter((1.0,), array=True, doc="Column B.")
    c: Any = parameter((1.0,), array=True, doc="Row C.")
    d: Number = parameter(0.0, unit="any", doc="Share D of the input that passes through.")
    u: Number = signal(0.0, unit="any", doc="Input.")
    x: Any = state(0.0, unit="any", count=lambda known: len(known["a"]), doc="States.")

    def check_values(self) -> None:
        """Refuse matrices that do not fit together."""
        n = len(self.a)
        if not isinstance(self.a[0], tuple) or len(self.a[0]) != n:
            raise ParameterError("it is no square matrix", where=f"{self.path}.a", advice="Give rows in brackets.")
        for name in ("b", "c"):
            if len(_row(getattr(self, name))) != n:
                raise ParameterError(
                    f"it has {len(_row(getattr(self, name)))} numbers, and the system {n} states",
                    where=f"{self.path}.{name}",
                )

    @derivative("x")
    def rates(self) -> list[Scalar]:
        """Return the rates."""
        return [
            sum((a * x for a, x in zip(row, self.x, strict=True)), b * self.u)
            for row, b in zip(self.a, _row(self.b), strict=True)
        ]

    @observable(unit="any", doc="Output.")
    def y(self) -> Scalar:
        """Return the output."""
        return sum((c * x for c, x in zip(_row(self.c), self.x, strict=True)), self.d * self.u)


def _row(matrix: Any) -> list[float]:
    """Return a row or a column as a list."""
    return [one for row in matrix for one in (row if isinstance(row, tuple) else (row,))]
