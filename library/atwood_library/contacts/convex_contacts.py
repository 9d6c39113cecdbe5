"""ConvexContacts: many convex bodies in space of which any two may touch."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, ClassVar

from atwood import ContactGroup, Frame, ParameterError, connector, parameter

__all__ = ["ConvexContacts"]

_KINDS = {
    "ball": "its radius",
    "box": "its lengths along x, y and z",
    "capsule": "its radius, and its length along z without the ends",
    "ellipsoid": "its half axes along x, y and z",
    "hull": "its corners",
}


def _read(value: Any, where: str) -> Any:
    """Return shapes as rows: the number of the shape, its radius, and a point; of an ellipsoid its half axes."""
    given = (value,) if isinstance(value, (list, tuple)) and value and isinstance(value[0], str) else value
    if not isinstance(given, (list, tuple)) or not given or not isinstance(given[0], (list, tuple)):
        raise _none(value, where)
    if not any(isinstance(one, (list, tuple)) and one and isinstance(one[0], str) for one in given):
        if not all(isinstance(one, (list, tuple)) and len(one) == 5 for one in given):
            raise _none(value, where)
        return value  # rows that have been read
    return tuple((float(i), *row) for i, one in enumerate(given) for row in _rows(one, where))


def _rows(one: Any, where: str) -> list[tuple[float, ...]]:
    kind, *sizes = one if isinstance(one, (list, tuple)) and one else (None,)
    if not isinstance(kind, str):
        raise _none(one, where)
    try:
        if kind == "hull":
            (corners,) = sizes
            points = [tuple(float(x) for x in corner) for corner in corners]
            if len(points) > 3 and all(len(point) == 3 for point in points):
                return [(0.0, *point) for point in points]
        numbers = [float(one) for one in sizes] if kind in _KINDS and kind != "hull" else []
    except Exception:  # a value of somebody else's class may raise anything
        raise _none(one, where) from None
    if not numbers or not all(number > 0.0 for number in numbers):
        raise _none(one, where)
    if kind == "ball" and len(numbers) == 1:
        return [(numbers[0], 0.0, 0.0, 0.0)]
    if kind == "capsule" and len(numbers) == 2:
        return [(numbers[0], 0.0, 0.0, sign * 0.5 * numbers[1]) for sign in (-1.0, 1.0)]
    if kind == "ellipsoid" and len(numbers) == 3:
        return [(-1.0, *numbers)]
    if kind == "box" and len(numbers) == 3:
        return [(0.0, *corner) for corner in product(*((-0.5 * x, 0.5 * x) for x in numbers))]
    raise _none(one, where)


def _none(one: Any, where: str) -> ParameterError:
    kinds = "; ".join(f"({kind!r}, {what})" for kind, what in _KINDS.items())
    said = f"{one!r} is" if isinstance(one, (str, int, float)) else "that is"
    return ParameterError(f"{said} no shape", where=where, advice=f"A shape is one of {kinds}.")


class ConvexContacts(ContactGroup):
    """Convex bodies in space of which any two may touch, and walls that none may pass; for time stepping.

    Connect `body[0]`, `body[1]` and so on to the frames of bodies at their centres of mass, and simulate with
    ``solver="moreau"``. Pairs that are not both balls need the library coal (``pip install 'atwood[coal]'``).
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Balls in a box", "Stacked boxes", "Granular material in space", "Collision")
    spaces: ClassVar[tuple[str, ...]] = ("space",)
    member: ClassVar[str] = "body"
    axes: ClassVar[int] = 3

    shapes: Any = parameter(
        ("ball", 0.1),
        array=_read,
        doc="One for all bodies, or one for each, such as ('ball', 0.1), ('box', 1, 1, 0.5) or ('hull', corners).",
    )
    walls: Any = parameter(
        None,
        array=True,
        doc="Walls in the world: rows of a point x, y, z and of the normal into the room; none if not given.",
    )
    body: Sequence[Frame] = connector(Frame, "The bodies, each at its centre.", count="count")
