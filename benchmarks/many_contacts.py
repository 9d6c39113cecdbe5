"""A step of 1,000 and of 4,000 discs in a box, by time stepping, side by side in one run.

Discs on a slightly irregular lattice fall into a heap in a box that is as wide as they are high. What is told, in time
of the processor: seconds until a run can begin, and milliseconds of a step while they fall, collide and settle.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from timing import options, print_table, ratio, save

from atwood import Scene, assemble, simulate
from atwood_library import Disc, DiscContacts

RADIUS, STEP = 0.05, 0.005


def heap(count: int, end: float) -> Scene:
    """Return discs above the floor of a box."""
    rng, wide, apart = np.random.default_rng(0), math.ceil(math.sqrt(count)), 2.2 * RADIUS
    scene, width = Scene(t_end=end), wide * apart
    walls = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0), (width, 0.0, -1.0, 0.0))
    given = {"count": count, "radius": RADIUS, "walls": walls, "restitution": 0.2, "friction": 0.3}
    ends = scene.add("contacts", DiscContacts(**given)).disc
    for i in range(count):
        body = scene.add(f"d{i}", Disc(mass=1.0, radius=RADIUS))
        scene.connect(body.frame, ends[i])
        x, z = (np.array([i % wide, i // wide]) + 0.5) * apart + rng.uniform(-0.09, 0.09, 2) * RADIUS
        still = dict.fromkeys(("angle", "velocity.x", "velocity.z", "angular_velocity.y"), 0.0)
        scene.start.update(
            {f"d{i}.{name}": value for name, value in {"position.x": x, "position.z": z, **still}.items()}
        )
    return scene


def measured(count: int, ends: tuple[float, ...]) -> list[float]:
    """Return seconds of assembly and until the first step is done, and milliseconds of a step until each later end."""
    began = time.process_time()
    assembly = assemble(heap(count, ends[-1]))
    made = time.process_time()
    marks: list[tuple[float, float]] = []
    given = {"step": STEP, "t_end": ends[-1], "outputs": [0.0, *ends], "samples": 1}
    simulate(assembly, solver="moreau", progress=lambda t: marks.append((t, time.process_time())), **given)
    done = dict(marks)
    steps = [1e3 * (done[b] - done[a]) / round((b - a) / STEP) for a, b in pairwise(ends)]
    return [made - began, done[ends[0]] - made, *steps]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    chosen = options(__doc__, arguments)
    few, ends = (50, (STEP, 0.05)) if chosen.quick else (1000, (STEP, 0.1, 0.2, 0.3, 0.4, 0.6))
    one, other = measured(few, ends), measured(4 * few, ends)
    names = ("assembly, s", "until the first step is done, s", *(f"a step until {end:g} s, ms" for end in ends[1:]))
    rows = [(name, a, b, ratio(b, a)) for name, a, b in zip(names, one, other, strict=True)]
    print_table("many contacts", ("what", f"{few} discs", f"{4 * few} discs", "ratio"), rows)
    save(chosen.json, {"many_contacts": rows})


if __name__ == "__main__":
    main()
