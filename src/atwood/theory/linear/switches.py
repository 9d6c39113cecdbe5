"""Switches at a state: where a law changes from one side to the other, there is no linear model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.errors import AtwoodError, UsageError
from atwood.expr import Expression, OutputGroup, Program, live
from atwood.theory.linear.variations import Flow, LinearScene

__all__ = ["refuse_switches"]


_SWITCHES = ("less", "less_equal", "sign", "absolute", "minimum", "maximum", "floor")

_ASIDE = 1e-7
"""How far from the state both sides are looked at, relative to the scene's sizes."""

_JUMP = 1e-3
"""Relative to their terms: derivatives that differ by more on two sides so near to each other jump."""

_SIDES = 4


def refuse_switches(scene: LinearScene, flow: Flow, kept: Sequence[int]) -> None:
    """Refuse a state at which the derivatives of the equations jump.

    Parameters
    ----------
    scene, flow
        The scene, and its flow at the state.
    kept
        Independent constraints.

    Raises
    ------
    UsageError
        If a switch is there; it names the speed whose acceleration has two derivatives.
    """
    margins = _margins(scene)
    if not margins:
        return
    program = Program(
        f"{scene.assembly.flat.name} switches", scene.groups, scene.assembly.parameters, (OutputGroup("at", margins),)
    )
    kernel, now = scene.assembly.kernel(program), flow.variation
    random = np.random.default_rng(5)
    with np.errstate(all="ignore"):
        here = np.asarray(kernel(np.array([now.t]), now.q, now.u, now.a, now.multipliers)[0])
    pace = float(np.max(np.abs(now.u) / scene.sizes, initial=0.0)) or 1.0
    for _ in range(_SIDES):
        by = _ASIDE * scene.displacement_sizes * random.uniform(-1.0, 1.0, len(scene.tangents))
        faster = _ASIDE * pace * scene.sizes * random.uniform(-1.0, 1.0, len(now.u))
        sides = []
        try:
            for sign in (1.0, -1.0):
                q, u = scene.tangents.moved(now.q, sign * by), now.u + sign * faster
                there = np.asarray(kernel(np.array([now.t + sign * _ASIDE / pace]), q, u, now.a, now.multipliers)[0])
                sides.append((there, scene.flow(now.t + sign * _ASIDE / pace, q, u, kept)))
        except (AtwoodError, ArithmeticError):
            continue
        (first, left), (second, right) = sides
        crossed = (first * second <= 0.0) | (here == 0.0)
        if not np.any(crossed):
            continue
        both = np.abs(left.acceleration) + np.abs(right.acceleration)
        jump = np.abs(left.acceleration - right.acceleration) - _JUMP * np.max(both, axis=1, initial=0.0)[:, None]
        worst = int(np.argmax(np.max(jump, axis=1, initial=-1.0)))
        if jump.size and np.max(jump) > 0.0:
            raise UsageError(
                f"a law switches here: {scene.equations.speed_names[worst].name} has another rate on each side",
                where=scene.assembly.flat.name,
                advice="Look at a state beside it, where one side holds.",
            )


def _margins(scene: LinearScene) -> tuple[Expression, ...]:
    """Return what changes its sign where laws switch."""
    e = scene.equations
    moving = {*e.coordinates, *e.speeds, e.time}
    nodes = live([*e.rows, *e.constraint_rows])
    reached = {symbol.index for symbol in moving}
    found: dict[Expression, None] = {}
    for node in nodes:
        if any(argument.index in reached for argument in node.arguments):
            reached.add(node.index)
            if node.operation in _SWITCHES:
                first = node.arguments[0]
                found[first if len(node.arguments) == 1 else first - node.arguments[1]] = None
    return tuple(found)
