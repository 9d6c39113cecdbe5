"""Rows of tables from anything that holds them, and the polynomials between them."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from atwood import ParameterError

__all__ = ["piece_at", "pieces_of", "read_table"]


_FILE = "Give a CSV file with a time and a value in each line, under a line of names if there is one."


def read_table(value: Any, where: str) -> Any:
    """Return the rows of a table from anything that holds one.

    Parameters
    ----------
    value
        Rows, an array, a data frame or a series of pandas, a spline of scipy, or the path of a CSV file.
    where
        The path of the parameter.
    """
    if isinstance(value, (str, Path)):
        return _read_csv(Path(value), where)
    if hasattr(value, "index") and hasattr(value, "to_numpy"):  # a series, or a frame of pandas
        values = value.to_numpy()
        return np.column_stack([value.index.to_numpy(), values]) if values.ndim == 1 or values.shape[1] == 1 else values
    if callable(getattr(value, "antiderivative", None)):
        return _polynomials(value, where)
    return value


def _read_csv(file: Path, where: str) -> list[list[float]]:
    """Return the first two columns of a file; beside semicolons, tabs or spaces a comma is before decimals."""
    import csv

    if file.exists() and not file.is_file():  # a pipe would be waited for
        raise ParameterError(f"{str(file)!r} is no file", where=where)
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise ParameterError(
            f"the file {str(file)!r} cannot be read ({error.strerror})", where=where, advice="Look at its path."
        ) from None
    except UnicodeDecodeError:
        raise ParameterError(f"the file {str(file)!r} is no text", where=where, advice=_FILE) from None
    kept = [(number, line) for number, line in enumerate(lines, start=1) if line.strip() and line.lstrip()[0] != "#"]
    mark = next((one for one in ";\t," if any(one in line for _, line in kept)), " ")
    rows: list[list[float]] = []
    width = 0
    for number, line in kept:
        try:
            (cells,) = csv.reader([line.strip(" ")], delimiter=mark, skipinitialspace=True)
        except csv.Error as error:
            raise ParameterError(f"line {number} of {str(file)!r} cannot be read ({error})", where=where) from None
        try:
            row = [float(text if mark == "," else text.replace(",", ".")) for text in cells[:2]]
        except ValueError:
            if rows or any(cell[:1].isdigit() for cell in cells[:2]):
                raise ParameterError(
                    f"line {number} of {str(file)!r} is no row of numbers", where=where, advice=_FILE
                ) from None
            width = 2 * len(cells)  # of a row in which each number has a comma
            continue
        if len(cells) == width if not rows else len(cells) != width:
            raise ParameterError(
                f"line {number} of {str(file)!r} has {len(cells)} cells, unlike those before it",
                where=where,
                advice="Where a comma is before decimals, separate cells by semicolons.",
            )
        rows.append(row)
        width = len(cells)
    if not rows:
        raise ParameterError(f"{str(file)!r} has no rows of numbers", where=where, advice=_FILE)
    return rows


def _polynomials(spline: Any, where: str) -> list[list[float]]:
    """Return the pieces of a spline of scipy, and a last row with its end."""
    from scipy.interpolate import BSpline, PPoly

    pieces: Any = PPoly.from_spline(spline) if isinstance(spline, BSpline) else spline  # type: ignore[arg-type]
    if not isinstance(pieces, PPoly) or pieces.c.ndim != 2:
        raise ParameterError(
            f"{type(spline).__name__} is no spline with one value", where=where, advice="Give a PPoly, or a BSpline."
        )
    spans = zip(pairwise(pieces.x.tolist()), pieces.c.T.tolist(), strict=True)
    rows = [[begin, *coefficients] for (begin, end), coefficients in spans if end > begin]
    last = float(pieces.x[-1])
    return [*rows, [last, *[0.0] * (len(pieces.c) - 1), float(pieces(last))]]


@lru_cache(maxsize=64)
def pieces_of(table: tuple[tuple[float, ...], ...], interpolation: str) -> tuple[tuple[float, ...], ...]:
    """Return its polynomials: when each begins, and its coefficients of falling powers; the last one is constant."""
    if len(table[0]) > 2:
        return table
    if interpolation == "linear" or len(table) < 3:
        rows = [(a, (y - x) / (b - a), x) for (a, x), (b, y) in pairwise(table)]
        return (*rows, (table[-1][0], 0.0, table[-1][1]))
    from scipy.interpolate import Akima1DInterpolator, CubicSpline

    kind: Any = Akima1DInterpolator if interpolation == "akima" else CubicSpline
    times, values = np.array(table).T
    return tuple(tuple(row) for row in _polynomials(kind(times, values), "table"))


def piece_at(known: Any, t: float) -> tuple[float, ...]:
    """Return the piece at a time; at its very beginning, the one that begins."""
    pieces = pieces_of(known["table"], known["interpolation"])
    begins = [row[0] for row in pieces]
    number = int(np.searchsorted(begins, t + 32.0 * float(np.spacing(abs(t))), side="right"))
    return pieces[max(number, 1) - 1]
