"""Why there is no start: a loop that cannot close, or values that contradict each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from atwood.errors import StartError
from atwood.expr import evaluate
from atwood.forms.assembly import Assembly
from atwood.mechanics.equations import Equations
from atwood.solve.start_system import MET, System, newton
from atwood.solve.start_targets import Level, Target

__all__ = ["explain_positions", "raise_contradiction"]

FloatArray = NDArray[np.float64]


def explain_positions(
    assembly: Assembly,
    equations: Equations,
    level: Level,
    scales: FloatArray,
    t: float,
    q: FloatArray,
    missing: FloatArray,
) -> None:
    """Raise the error that says whether a loop cannot close or the start contradicts itself."""
    if any(one.holonomic for one in equations.constraints):
        system = System(assembly, equations, [], True)
        nearest, alone, _ = newton(system, scales, t, q)
        if not float(np.max(np.abs(alone))) <= MET:
            _raise_open_loop(assembly, equations, t, nearest, alone)
    raise_contradiction(level.fixed, missing[len(missing) - len(level.fixed) :], equations)


def _raise_open_loop(
    assembly: Assembly, equations: Equations, t: float, nearest: FloatArray, missing: FloatArray
) -> None:
    """Raise the error that names the loop that cannot close."""
    holding = [one for one in equations.constraints if one.value is not None]
    worst = holding[int(np.argmax(np.abs(missing)))]
    values = [one.value for one in holding if one.key[0] == worst.key[0] and one.value is not None]
    place = {equations.time: t, **dict(zip(equations.coordinates, nearest.tolist(), strict=True))}
    miss = max(abs(v) for v in evaluate(values, {**assembly.mechanism.table.values, **place}))
    loop = _loop_through(assembly, worst.key[0])
    raise StartError(
        f"the loop cannot close here: the nearest position found misses by {miss:.3g}"
        + (f" (the loop of {', '.join(loop)})" if loop else ""),
        where=worst.key[0],
        advice="Check the lengths of the loop, or guess a start nearer to a position in which it closes.",
    )


def _loop_through(assembly: Assembly, part: str) -> list[str]:
    """Return the parts of the shortest loop through a joint, in order, with the bodies between them."""
    import networkx as nx

    graph, bodies = assembly.mechanism.graph, assembly.mechanism.bodies
    others: nx.Graph[int] = nx.Graph()
    ends: tuple[int, int] | None = None
    for joint in graph.joints:
        pair = (bodies.body_of[joint.a], bodies.body_of[joint.b])
        if joint.part == part:
            ends = pair
        elif not joint.is_rigid:
            others.add_edge(*pair, part=joint.part)
    if ends is None or not all(end in others for end in ends) or not nx.has_path(others, *ends):
        return []
    way = nx.shortest_path(others, *ends)
    found = [part]
    for here, there in pairwise(way):
        found += [*([bodies.bodies[here].name] if here else []), others.edges[here, there]["part"]]
    return [*found, *([bodies.bodies[way[-1]].name] if way[-1] else [])]


def raise_contradiction(fixed: Sequence[Target], missing: FloatArray, equations: Equations) -> None:
    """Raise the error that says which fixed values cannot all hold.

    Parameters
    ----------
    fixed
        What is fixed.
    missing
        What each value misses, scaled.
    equations
        The scene's.
    """
    failing = [
        f"{target.path} = {target.value:g}" for target, miss in zip(fixed, missing, strict=True) if abs(miss) > MET
    ]
    names = failing or [f"{target.path} = {target.value:g}" for target in fixed]
    freedom = len(equations.speeds) - len(equations.constraints)
    where = next((t.path for t, m in zip(fixed, missing, strict=True) if abs(m) > MET), fixed[0].path if fixed else "")
    raise StartError(
        f"the start values contradict each other or the constraints: {', '.join(names)} cannot all hold",
        where=where,
        advice=f"The mechanism has {freedom} free coordinate{'s' if freedom != 1 else ''}; "
        "fix fewer values, or give some as guesses (on the command line: --start PATH=free).",
    )
