"""What equations that are too long to read are like: how many there are, and which depends on what, as a picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from atwood.arrays import BoolArray
from atwood.expr import dependencies
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian
from atwood.late import dataclass
from atwood.showing import count_of

__all__ = ["Structure", "structure_of"]

_COLUMNS = 64
"""Of a picture in text, at most."""


@dataclass(frozen=True)
class Structure:
    """Counts of a scene's equations, and where their matrices have entries.

    Attributes
    ----------
    name, form
        The scene, and the form of its equations.
    coordinates, speeds, constraints
        How many there are.
    operations
        That one evaluation of the equations of motion takes.
    pattern
        Where the matrix ``[[M, G^T], [G, 0]]`` of accelerations and multipliers has entries, shape
        (speeds + constraints, speeds + constraints).
    """

    name: str
    form: str
    coordinates: int
    speeds: int
    constraints: int
    operations: int
    pattern: BoolArray

    @property
    def sentence(self) -> str:
        """The counts as a sentence."""
        n, m = self.speeds, self.constraints
        filled = int(np.count_nonzero(self.pattern[:n, :n]))
        held = f" and {count_of(m, 'constraint')} with {np.count_nonzero(self.pattern[n:, :n])} slopes" if m else ""
        return (
            f"{self.name} has {count_of(self.coordinates, 'coordinate')} and {count_of(n, 'velocity', 'velocities')}; "
            f"its equations of motion take {self.operations} operations, with {filled} of {n * n} entries in the mass "
            f"matrix{held}."
        )

    def picture(self) -> str:
        """Return the pattern as text: a block where there are entries."""
        cells = _coarse(self.pattern, _COLUMNS)
        return "\n".join("".join("█" if one else "·" for one in row) for row in cells)

    def svg(self, size: int = 320) -> str:
        """Return the pattern as a picture in SVG: M above, G below and beside it.

        Parameters
        ----------
        size
            Width and height, pixels.
        """
        cells = _coarse(self.pattern, 160)
        n = max(len(cells), 1)
        side = self.speeds * n / max(len(self.pattern), 1)
        squares = "".join(f'<rect x="{j}" y="{i}" width="1" height="1"/>' for i, j in np.argwhere(cells))
        frame = f'<path d="M0 {side:.3g}H{n}M{side:.3g} 0V{n}" stroke="#888" stroke-width="{n / 300:.3g}"/>'
        box = f'<rect width="{n}" height="{n}" fill="#fff" stroke="#444" stroke-width="{n / 200:.3g}"/>'
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{size}" height="{size}" viewBox="0 0 {n} {n}">'
            f'{box}{frame}<g fill="#1f4e79">{squares}</g></svg>'
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "coordinates": self.coordinates,
            "speeds": self.speeds,
            "constraints": self.constraints,
            "operations": self.operations,
            "entries": [[int(i), int(j)] for i, j in np.argwhere(self.pattern)],
        }


def _coarse(pattern: BoolArray, most: int) -> BoolArray:
    """Return a pattern with at most so many rows, several of them together where there are more."""
    n = len(pattern)
    by = max(1, -(-n // most))
    m = -(-n // by)
    padded = np.zeros((m * by, m * by), dtype=bool)
    padded[:n, :n] = pattern
    return np.asarray(padded.reshape(m, by, m, by).any(axis=(1, 3)), dtype=bool)


def structure_of(assembly: Assembly, found: Lagrangian, operations: int) -> Structure:
    """Return what the equations of a scene are like.

    Parameters
    ----------
    assembly, found
        The scene.
    operations
        That one evaluation of its rows takes.
    """
    n, m = len(found.velocities), len(found.constraints)
    pattern = np.zeros((n + m, n + m), dtype=bool)
    by_acceleration = {a: j for j, a in enumerate(found.accelerations)}
    by_velocity = {u: j for j, u in enumerate(found.velocities)}
    for i, needed in enumerate(dependencies(list(found.inertial), list(by_acceleration))):
        pattern[i, [by_acceleration[a] for a in needed]] = True
    for i, needed in enumerate(dependencies([one.rate for one in found.constraints], list(by_velocity))):
        columns = [by_velocity[u] for u in needed]
        pattern[n + i, columns] = pattern[columns, n + i] = True
    return Structure(assembly.flat.name, assembly.form, len(found.coordinates), n, m, operations, pattern)
