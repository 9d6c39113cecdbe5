"""Runs made anew from arcs of polynomials, to rounding: what every other way to solve a scene is compared with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from atwood import Result
from atwood.simulation.problem.projection import project_safely
from atwood.simulation.run.recorder import Stretch
from atwood.simulation.singular.collocation import find_arc

__all__ = ["by_arcs"]

ERROR = 1e-11
"""Of each arc, relative to the scene's sizes; the difference of orders 20 and 24, mostly that of the lower one."""


def by_arcs(result: Result) -> Result:
    """Return a result with its samples worked out anew from the start of each of its segments.

    Nothing of the solver that made it is used but the start and the sample times.
    """
    return Result(replace(result.run, stretches=tuple(_anew(one) for one in result.run.stretches)))


def _anew(segment: Stretch) -> Stretch:
    plan, kinematic_map = segment.plan, segment.plan.balance.kinematic_map
    places, speeds = segment.coordinates.copy(), segment.speeds.copy()
    t, q, u = float(segment.time[0]), places[:, 0], speeds[:, 0]
    end = float(segment.time[-1])
    h = 0.05 * (end - t)
    while t < end:
        h = min(h, end - t)
        arc = find_arc(plan, t, q, u, t + h)
        if arc is None or arc.error > ERROR:
            h *= 0.5
            assert h > 1e-8 * end, f"no arc goes on from t = {t}"
            continue
        inside = (segment.time > t) & (segment.time <= arc.end)
        found = arc.at(segment.time[inside])
        places[:, inside], speeds[:, inside] = kinematic_map.normalized(found[0]), found[1]
        q, u, _ = (one[:, 0] for one in arc.at(np.array([arc.end])))
        q = kinematic_map.normalized(q)
        if plan.balance.constraints:
            q, u = project_safely(plan, arc.end, q, u)
        t, h = arc.end, 1.3 * h
    return replace(segment, coordinates=places, speeds=speeds)
