"""Where a session of a method of Gauss keeps its numbers: what the compiled code and Python agree on."""

from __future__ import annotations

from itertools import accumulate

from atwood.late import dataclass

__all__ = ["COUNTS", "NUMBERS", "POINTERS", "Layout"]

POINTERS = ("derived", "scratch", "rates", "rates_data", "derived_2")
NUMBERS = ("t", "t_old", "stop", "step", "origin")
COUNTS = ("limit", "steps", "failures", "evaluations", "undefined", "filled", "since")


@dataclass(frozen=True)
class Layout:
    """Where a session keeps its numbers, in one array of doubles.

    Attributes
    ----------
    coordinates, speeds, stages
        Their numbers.
    has_speeds
        Whether the equations give speeds besides the rates of the coordinates.
    takes_speeds
        Whether they take an approximation to them.
    """

    coordinates: int
    speeds: int
    stages: int
    has_speeds: bool
    takes_speeds: bool

    @property
    def size(self) -> int:
        """The number of coordinates and momenta."""
        return 2 * self.coordinates

    @property
    def places(self) -> dict[str, int]:
        """Where each group begins; ``end`` is the length of the whole."""
        n, m, s = self.size, max(self.speeds, 1), self.stages
        sizes = {"pointers": len(POINTERS), "numbers": len(NUMBERS), "counts": len(COUNTS)}
        sizes |= {"y": n, "y_old": n, "rest": n, "per_size": n}
        work = {"L": s * n, "G": s * n, "Y": n, "F": n, "V": m, "U": s * m, "scale": n}
        for name in ("main", "aside"):
            sizes |= {f"{name}.{key}": size for key, size in work.items()}
        starts = [0, *accumulate(sizes.values())]
        return dict(zip((*sizes, "end"), starts, strict=True))

    def within(self, key: str) -> int:
        """Return where a group of a work area begins in it."""
        places = self.places
        return places[f"main.{key}"] - places["main.L"]
