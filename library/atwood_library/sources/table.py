"""Table: a function of time that goes through points."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from atwood import Component, ParameterError, Scalar, discrete_state, event, observable, parameter, update
from atwood_library.interfaces.table_rows import piece_at, pieces_of, read_table


class Table(Component):
    """A function of time that goes through points: straight from one to the next, or as a smooth curve.

    The table is rows of time and value: numbers, an array, a pandas series or frame, or the path of a CSV file, whose
    first two columns count. Rows of more columns are polynomials: a time, and the coefficients of falling powers of the
    time since then; a spline of `scipy` is taken as such. Where one piece ends and the next begins a run stops and goes
    on, so that no step is taken across, and each piece is a polynomial in the equations, whose rates are exact.

    Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("CombiTimeTable", "TimeTable", "Lookup table", "Spline", "Akima interpolation", "CSV file")

    table: Any = parameter(((0.0, 0.0), (1.0, 1.0)), array=read_table, doc="Its rows.")
    interpolation: str = parameter(
        "linear", choices=("linear", "akima", "cubic"), doc="How points are joined: Akima's or a cubic spline."
    )
    at_end: str = parameter(
        "refuse",
        choices=("refuse", "hold", "stop"),
        doc="What a run does that goes on beyond it: it is refused, keeps the last value, or stops.",
    )
    origin: Scalar = discrete_state(
        lambda known, t: piece_at(known, t)[:1], unit="s", doc="Where the present piece begins."
    )
    coefficients: Any = discrete_state(
        lambda known, t: piece_at(known, t)[1:],
        unit="any",
        count=lambda known: len(pieces_of(known["table"], known["interpolation"])[0]) - 1,
        doc="Coefficients of the present piece, of falling powers.",
    )

    def check_values(self) -> None:
        """Refuse rows that make no function."""
        rows, where = self.table, f"{self.path}.table"
        if not isinstance(rows[0], tuple) or len(rows[0]) < 2 or len(rows) < 2:
            raise ParameterError(
                "it needs two rows or more, of a time and a value",
                where=where,
                advice="Write them as [(0, 0), (1, 0.5)], or give the path of a CSV file.",
            )
        times = [row[0] for row in rows]
        if any(not a < b for a, b in pairwise(times)):
            raise ParameterError(
                "its times do not rise", where=where, advice="Sort its rows; each time stands there once."
            )

    def check_run(self, start: float, end: float) -> None:
        """Refuse a run that the table does not cover."""
        first, last = self.table[0][0], self.table[-1][0]
        if start < first:
            raise ParameterError(
                f"it begins at t = {first:g} s, and the run at t = {start:g} s",
                where=f"{self.path}.table",
                advice="Give a row at or before the start of the run.",
            )
        if self.at_end == "refuse" and end > last:
            raise ParameterError(
                f"it ends at t = {last:g} s, before the run, which ends at t = {end:g} s",
                where=f"{self.path}.table",
                advice="Give more rows, at_end='hold' or at_end='stop'.",
            )

    def breakpoints(self) -> list[float]:
        """Return where its pieces begin."""
        return [row[0] for row in pieces_of(self.table, self.interpolation)]

    @update(sets=("origin", "coefficients"), when="breakpoints", reads=(), pure=True)
    def enter(self) -> Sequence[float]:
        """Return the piece that begins now."""
        return piece_at({"table": self.table, "interpolation": self.interpolation}, float(self.time))

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        since, total = self.time - self.origin, self.coefficients[0]
        for coefficient in self.coefficients[1:]:
            total = total * since + coefficient
        return total

    @event(direction=1, unit="s", message="the table ends")
    def ends(self) -> Scalar:
        """Return the time since its end."""
        return self.time - self.table[-1][0] if self.at_end == "hold" else 1.0

    @event(direction=1, unit="s", target="stop", message="the table ends")
    def ends_the_run(self) -> Scalar:
        """Return the time since its end."""
        return self.time - self.table[-1][0] if self.at_end == "stop" else 1.0
