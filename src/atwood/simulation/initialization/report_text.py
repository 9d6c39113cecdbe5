"""What the start moved, as a line and as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.simulation.initialization.report import GuessMet, InitializationReport

__all__ = ["as_table", "in_a_line"]

_SHOWN = 3


def _how_far(distance: float, angle: float, length: float) -> str:
    """Return a movement in words; rounding is left out."""
    said = []
    if distance > tolerances.CLOSED * length:
        said.append(f"{distance:.3g} m")
    if angle > tolerances.CLOSED:
        said.append(f"{np.degrees(angle):.3g} deg")
    return " and ".join(said)


def _few(names: Sequence[str]) -> str:
    rest = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {rest} more" if rest > 0 else "")


def in_a_line(placement: InitializationReport) -> str:
    """Return what moved and what was placed in one line; empty if nothing was.

    Parameters
    ----------
    placement
        What the start moved.
    """
    length = placement.length
    moved = [(one, _how_far(*one.moved, length)) for one in placement.bodies]
    placed = [one.path for one in placement.bodies if _how_far(*one.placed, length)]
    text = []
    if any(far for _, far in moved):
        text.append("moved by the initialization: " + _few([f"{one.path} by {far}" for one, far in moved if far]))
    if placed:
        what = "it" if len(placed) == 1 else "them"
        text.append(f"placed by the solver, as not all was said of {what}: {_few(placed)}")
    if placement.opened and text:
        first = placement.opened[0]
        text.append(f"{first.part} was open by {first.describe(length)}")
    return "; ".join(text)


def as_table(placement: InitializationReport) -> str:
    """Return all that moved, all guesses, and what was open, as text.

    Parameters
    ----------
    placement
        What the start moved.
    """
    lines = list(_tables(placement))
    return "\n".join(lines) or "Nothing was moved: everything starts where it was said."


def _tables(placement: InitializationReport) -> Iterator[str]:
    length = placement.length
    rows = [
        (one.path, _how_far(*one.moved, length) or "-", _how_far(*one.placed, length) or "-", ", ".join(one.by))
        for one in placement.bodies
    ]
    if rows:
        yield from _table(("body", "moved", "placed", "by"), rows)
    guesses = [
        (one.path, f"{one.asked:.6g}", *_found(one, length), "" if one.unit == "1" else one.unit)
        for one in placement.guesses
    ]
    if guesses:
        yield from ([""] if rows else [])
        yield from _table(("guess", "asked", "found", "off by", "unit"), guesses)
    if placement.opened:
        yield ""
        yield from _table(("was open", "by"), [(one.part, one.describe(length)) for one in placement.opened])


def _found(guess: GuessMet, length: float) -> tuple[str, str]:
    """Return what became of a guess and the difference, without rounding."""
    size = length if guess.unit == "m" else max(1.0, abs(guess.asked))
    if abs(guess.off) <= tolerances.CLOSED * size:
        return f"{guess.asked:.6g}", "0"
    return f"{guess.found:.6g}", f"{guess.off:.3g}"


def _table(headings: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    for row in (headings, *rows):
        yield "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip()
