"""Thousands of bodies."""

from __future__ import annotations

import math

from atwood import Scene
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import Chain

from ..helpers.nets import spring_net
from .case import BOTH, REDUCED, Case
from .measures import ENERGY, energy


def tree(levels: int) -> Scene:
    """Return bobs on rods, two below each: 2^levels - 1 of them."""
    scene = Scene(t_end=0.5)
    above = [scene.add("ground", Ground()).frame]
    count = 0
    for level in range(levels):
        below = []
        for n in range(2**level):
            rod = scene.add(f"rod{count}", Rod(length=1.0 / (level + 1.0)))
            bob = scene.add(f"bob{count}", PointMass(mass=0.5**level))
            scene.connect(above[n // 2], rod.a)
            scene.connect(rod.b, bob.point)
            angle = (0.6 + 0.1 * level) * (-1.0) ** n + 0.3 * math.sin(count)
            scene.start.update({f"rod{count}.angle": angle, f"rod{count}.angular_velocity": 0.0})
            below.append(bob.point)
            count += 1
        above = below
    return scene


CASES = (
    *(
        Case(
            name=f"chain of {links:,} links",
            kind="large",
            hard="Thousands of unknowns; dense algebra would take their cube.",
            better="Reduced: accelerations in O(N).",
            source="energy balance",
            scene=lambda links=links: Chain(links=links, mass=1.0 / links),
            asked=(1e-4, ENERGY),
            error=energy,
            options={"t_end": t_end, "rtol": 1e-6, "outputs": 11, "samples": 10},
            ways=BOTH if links <= 1000 else REDUCED,
            quick=False,
        )
        for links, t_end in ((1000, 0.1), (10_000, 0.01))
    ),
    Case(
        name="net of 50 by 50 masses on springs",
        kind="large",
        hard="2,500 bodies in the plane that are not a tree: 5,000 coordinates.",
        better="Reduced: nothing is constrained, and explicit methods need no matrix.",
        source="energy balance",
        scene=lambda: spring_net(50, 50),
        asked=(1e-4, ENERGY),
        error=energy,
        options={"rtol": 1e-6, "outputs": 11, "samples": 10},
        ways=REDUCED,
        quick=False,
    ),
    Case(
        name="tree of 1,023 bodies",
        kind="large",
        hard="Ten levels of pendulums, two below each.",
        better="Reduced: elimination goes from the leaves to the root.",
        source="energy balance",
        scene=lambda: tree(10),
        asked=(1e-4, ENERGY),
        error=energy,
        options={"rtol": 1e-6, "outputs": 11, "samples": 10},
        ways=REDUCED,
        quick=False,
    ),
)
