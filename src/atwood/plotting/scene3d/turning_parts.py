"""Bodies that turn about one place: tops, gimbals, and shafts whose joints all meet at a point.

Nothing says how large a gimbal or how long a shaft is: their joints only have axes. They are drawn as what anybody
would build them as: rings one within another, and shafts along their axes, with their bearings farther along.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.plotting.canvas import COLOURS, STEEL
from atwood.plotting.scene3d.body_shapes import BodyShape
from atwood.plotting.scene3d.pieces import Bench, Hinge, Tip
from atwood.plotting.shapes.meshes import cylinder, frame_along, revolved, ring

WHITE = "#ffffff"

FORK = 8.0
"""Half the width of a fork around a cross, in units."""


def pale(colour: str, share: float = 0.4) -> str:
    """Return a colour such as ``#2a6fbb`` mixed with a share of white."""
    parts = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return "#" + "".join(f"{round(part + share * (255 - part)):02x}" for part in parts)


# -- tops -----------------------------------------------------------------------------------------------------------


def add_tops(bench: Bench) -> None:
    """Draw as a top each round body that stands on a point of its axis, apart from its centre of mass."""
    for shape in bench.shapes:
        body = shape.lump.body
        if shape.kind != "round" or shape.is_long or body in bench.clad or len(bench.of_body(body)) > 1:
            continue
        joinings = bench.joinings(body)
        if len(joinings) != 1 or joinings[0].kind != "ball":
            continue
        node = next(one for one in joinings[0].nodes if bench.reading.body_of[one] == body)
        stand = bench.reading.offsets[node]
        arm = shape.center - stand
        height, radius = float(arm @ shape.axes[:, 2]), 0.5 * float(shape.sides[0])
        if np.linalg.norm(arm - height * shape.axes[:, 2]) > 1e-6 * radius or abs(height) < 0.15 * radius:
            continue
        up = shape.axes[:, 2] * np.sign(height)
        made = revolved(_top_profile(radius, abs(height)), around=40, marks=True)
        bench.surface(body, made.placed(stand, frame_along(up, shape.axes[:, 0])), _body_colour(bench, shape))
        top = abs(height) + max(0.62 * radius, 0.35 * abs(height))
        bench.tips.append(Tip(body, stand + up * top, stand))
        bench.clad.add(body)
        bench.drawn.add(joinings[0].part)


def _top_profile(radius: float, height: float) -> FloatArray:
    """Return the outline of a top on its tip, with its disc at the height of its centre of mass."""
    half, stem = 0.07 * radius, 0.055 * radius
    neck = max(0.0, height - 0.8 * radius)
    end = height + max(0.58 * radius, 0.32 * height)
    lower = [(0.0, 0.0), (stem, min(stem, 0.3 * height))]
    if neck > 0.0:
        lower += [(stem, z) for z in np.linspace(stem, neck, 6)[1:]]
    start = lower[-1]
    cone = [(radius * w, height - half + (start[1] - height + half) * (1.0 - w) ** 1.4) for w in (0.3, 0.55, 0.8, 1.0)]
    shoulder = [(radius * w, height + half + radius * z) for w, z in ((1.0, 0.0), (0.75, 0.05), (0.45, 0.085))]
    stalk = [(stem, height + half + 0.11 * radius)]
    stalk += [(stem, z) for z in np.linspace(height + half + 0.11 * radius, end, 5)[1:]]
    return np.array([*lower, *cone, *shoulder, *stalk, (0.0, end)])


def _body_colour(bench: Bench, shape: BodyShape) -> str:
    compact = [one for one in bench.shapes if not one.is_long]
    return pale(COLOURS[compact.index(shape) % len(COLOURS)], 0.25)


# -- gimbals --------------------------------------------------------------------------------------------------------


def add_gimbals(bench: Bench) -> None:
    """Draw as a ring each body whose hinges meet at a point at an angle, and what turns in it on an axle."""
    gimbals = [body for body in bench.depth if body != 0 and _is_gimbal(bench, body)]
    sizes: dict[int, float] = {}
    for body in sorted(gimbals, key=lambda one: -bench.depth[one]):
        inside = [one for one in bench.children(body) if bench.is_at_one_place(one)]
        content = [sizes.get(one) or max((s.radius for s in bench.of_body(one)), default=0.0) for one in inside]
        sizes[body] = 1.13 * max([*content, 10.0 * bench.unit]) + 2.2 * bench.unit
    for body in gimbals:
        _add_ring(bench, body, sizes)


def _is_gimbal(bench: Bench, body: int) -> bool:
    hinges = bench.hinges(body)
    if (
        len(hinges) < 2
        or bench.is_own(body)
        or not bench.is_at_one_place(body)
        or len(hinges) != len(bench.joinings(body))
    ):
        return False
    return bool(np.linalg.norm(np.cross(hinges[0].axis, hinges[1].axis)) > 0.3)


def _add_ring(bench: Bench, body: int, sizes: dict[int, float]) -> None:
    unit, hinges, radius = bench.unit, bench.hinges(body), sizes[body]
    middle = hinges[0].point
    thickness = max(1.1 * unit, 0.035 * radius)
    normal = np.cross(hinges[0].axis, hinges[1].axis)
    colour = pale(COLOURS[(2 + bench.depth[body]) % len(COLOURS)])
    bench.surface(body, ring(radius, thickness).placed(middle, frame_along(normal, hinges[0].axis)), colour)
    bench.clad.add(body)
    for hinge in hinges:
        bench.drawn.add(hinge.joining.part)
        if bench.depth.get(hinge.other, 0) < bench.depth[body]:
            _add_trunnions(bench, body, hinge, radius, sizes.get(hinge.other))
        elif hinge.other not in sizes:
            _add_axle(bench, hinge, radius)
    for shape in bench.of_body(body):
        aside = shape.center - middle
        if np.linalg.norm(aside) > 1e-6 * radius:  # its weight is not in the middle
            place = middle + aside * (radius / np.linalg.norm(aside))
            bench.ball(body, place, max(3.0 * unit, 2.0 * thickness), "#55606b")


def _add_trunnions(bench: Bench, body: int, hinge: Hinge, radius: float, outer: float | None) -> None:
    """Put short axles between a ring and what it turns in: a larger ring, or the world."""
    unit = bench.unit
    reach = outer if outer is not None else radius + 7.0 * unit
    for side in (-1.0, 1.0):
        near, far = hinge.point + side * radius * hinge.axis, hinge.point + side * reach * hinge.axis
        bench.tube(body, near, far, 0.8 * unit, STEEL)
        if hinge.other != 0:
            continue
        node = next(one for one in hinge.joining.nodes if bench.reading.body_of[one] == 0)
        place = bench.reading.offsets[node] + side * reach * hinge.other_axis
        feet = bench.feet.setdefault(node, [])
        if abs(hinge.other_axis[2]) < 0.5 or side * hinge.other_axis[2] < 0.0:
            feet.append(place)


def _add_axle(bench: Bench, hinge: Hinge, radius: float) -> None:
    """Put what turns in a ring on an axle, and draw it round where it is."""
    body, unit = hinge.other, bench.unit
    for shape in bench.of_body(body):
        marked = cylinder(0.5 * float(shape.sides[0]), max(float(shape.sides[2]), 5.0 * unit), around=40, marks=True)
        if shape.kind == "round" and not shape.is_long:
            bench.surface(body, marked.placed(shape.center, shape.axes), pale(COLOURS[0], 0.25))
            bench.clad.add(body)
    node = next(one for one in hinge.joining.nodes if bench.reading.body_of[one] == body)
    middle = bench.reading.offsets[node]
    bench.tube(body, middle - radius * hinge.other_axis, middle + radius * hinge.other_axis, 0.8 * unit, STEEL)
    if body in bench.clad:
        bench.tips.append(Tip(body, middle + 1.1 * radius * hinge.other_axis, middle))


# -- shafts ---------------------------------------------------------------------------------------------------------


def add_shafts(bench: Bench) -> None:
    """Draw as a shaft each body whose one hinge and whose other joints are all at one place, where its centre is too.

    A hinge is the same anywhere on its axis; so the shaft reaches from the other joint to a bearing farther along, and
    of two shafts that meet, each on its own side.
    """
    sides: dict[str, FloatArray] = {}
    for body in bench.depth:
        hinges = bench.hinges(body)
        others = [one for one in bench.joinings(body) if one.kind in ("cross", "ball")]
        is_one = len(hinges) == 1 and len(others) == 1 and len(bench.joinings(body)) == 2
        if body == 0 or not is_one or bench.is_own(body) or not bench.is_at_one_place(body) or body in bench.clad:
            continue
        axis = hinges[0].axis
        direction = bench.reading.poses[body].axes[0] @ axis
        taken = sides.get(others[0].part)
        side = -1.0 if taken is None or direction @ taken > 0.0 else 1.0
        sides.setdefault(others[0].part, side * direction)
        _add_shaft(bench, body, hinges[0], side)
        if others[0].kind == "cross":
            number = [bench.reading.body_of[node] for node in others[0].nodes].index(body)
            _add_fork(bench, body, hinges[0].point, side * axis, others[0].axes[number])


def _add_shaft(bench: Bench, body: int, hinge: Hinge, side: float) -> None:
    unit, along = bench.unit, side * hinge.axis
    reach = 2.2 * FORK * unit
    for shape in bench.of_body(body):
        radius, height = 0.5 * float(shape.sides[0]), max(float(shape.sides[2]), 3.0 * unit)
        start = max(reach, 1.3 * radius)
        if shape.kind == "round":
            made = cylinder(radius, height, around=40, marks=True)
            place = hinge.point + along * (start + 0.5 * height)
            bench.surface(body, made.placed(place, frame_along(along)), _body_colour(bench, shape))
            reach = start + height
    reach += 14.0 * unit
    bearing = reach - 5.0 * unit
    bench.tube(body, hinge.point + 1.15 * FORK * unit * along, hinge.point + reach * along, 1.5 * unit, STEEL)
    made = cylinder(2.4 * unit, 4.0 * unit, around=24)
    bench.surface(hinge.other, made.placed(*_beyond(bench, hinge, side * bearing)), WHITE)
    if hinge.other == 0:
        node = next(one for one in hinge.joining.nodes if bench.reading.body_of[one] == 0)
        bench.feet.setdefault(node, []).append(_beyond(bench, hinge, side * bearing)[0])
    bench.clad.add(body)
    bench.drawn.add(hinge.joining.part)


def _beyond(bench: Bench, hinge: Hinge, distance: float) -> tuple[FloatArray, FloatArray]:
    """Return a place along a hinge's axis, and axes there, in the body on its other side."""
    node = next(one for one in hinge.joining.nodes if bench.reading.body_of[one] == hinge.other)
    return bench.reading.offsets[node] + distance * hinge.other_axis, frame_along(hinge.other_axis)


def _add_fork(bench: Bench, body: int, place: FloatArray, along: FloatArray, arm: FloatArray) -> None:
    """Put a fork around a cross."""
    unit = bench.unit
    base = place + 1.15 * FORK * unit * along
    for side in (-1.0, 1.0):
        corner = side * FORK * unit * arm
        bench.tube(body, place + corner - 0.2 * FORK * unit * along, base + corner, 1.4 * unit, STEEL)
        bench.tube(body, base, base + 1.17 * corner, 1.4 * unit, STEEL)
