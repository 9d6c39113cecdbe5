"""Motions that are known to rounding: the scenes of the library with a closed form, and others that one would try."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import atwood_library.scenes
from atwood import Scene
from atwood.arrays import FloatArray
from atwood_library.scenes import FourBarRow, FreeBody, Kepler, LagrangeTop, SimplePendulum, SphericalPendulum

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.hard_cases import loops, switching
from tests.references import free_body, pendulum, spherical_pendulum, top

__all__ = ["Known", "known_motions"]


@dataclass(frozen=True)
class Known:
    """A scene and what it does, as functions of the times."""

    name: str
    scene: Scene
    exact: Callable[[FloatArray], Mapping[str, FloatArray]]


def known_motions(quick: bool = False) -> Iterator[Known]:
    """Give the scenes of the library that have a closed form, and then others."""
    for name in sorted(atwood_library.scenes.__all__):
        made = getattr(atwood_library.scenes, name)
        if isinstance(made, type) and callable(getattr(made, "closed_form", None)):
            yield Known(name, made(), made().closed_form)
            if quick:
                return
    yield from _pendulums()
    yield from _in_space()
    yield from _loops_and_drives()


def _pendulums() -> Iterator[Known]:
    for name, how, t_end in (
        ("from 3.1 rad", {"release_angle": 3.1}, 20.0),
        ("of a millimetre", {"length": 1e-3, "release_angle": 2.0}, 0.2),
        ("of a kilometre", {"length": 1e3, "release_angle": 2.0}, 200.0),
        ("for 100 s", {"release_angle": 1.0}, 100.0),
    ):
        scene = SimplePendulum(**how)
        scene.t_end = t_end
        yield Known(f"pendulum {name}", scene, scene.closed_form)
    for e in (0.5, 0.9):
        yield Known(f"Kepler, e = {e}", Kepler(eccentricity=e), lambda t, e=e: _ellipse(t, e))


def _ellipse(t: FloatArray, e: float) -> Mapping[str, FloatArray]:
    """Return the place on an ellipse whose semi-major axis and constant of gravity are one."""
    angle = t + e * np.sin(t)
    for _ in range(60):
        angle = angle - (angle - e * np.sin(angle) - t) / (1.0 - e * np.cos(angle))
    return {"body.position.x": np.cos(angle) - e, "body.position.z": math.sqrt(1.0 - e * e) * np.sin(angle)}


def _axes(name: str, vectors: FloatArray) -> dict[str, FloatArray]:
    return {f"{name}.{axis}": vectors[..., k] for k, axis in enumerate("xyz")}


def _in_space() -> Iterator[Known]:
    body = free_body.FreeBody((1.0, 2.0, 3.0), ("1", "0", "1"))
    yield Known("free body", FreeBody(), lambda t: _axes("body.z_axis", body.orientation(t)[..., 2]))
    spinning = top.LagrangeTop(0.025, 0.01, 9.81 * 0.1, (0.0, math.pi / 6.0, 0.0), (0.0, 0.0, 50.0))
    yield Known("heavy top", LagrangeTop(), lambda t: _axes("top.z_axis", spinning.orientation(t)[..., 2]))
    sine, cosine = math.sin(math.pi / 3.0), math.cos(math.pi / 3.0)
    bob = spherical_pendulum.SphericalPendulum(1.0, 9.81, (sine, 0.0, -cosine), (0.0, 2.0 * sine, 0.0))
    for kind in ("places", "angles"):
        scene = SphericalPendulum(coordinates=kind)
        yield Known(f"spherical pendulum, {kind}", scene, lambda t: _axes("bob.position", bob.position(t)))


def _loops_and_drives() -> Iterator[Known]:
    row = pendulum.FourBarRow(1)
    swing = FourBarRow(windows=1)
    swing.start["foot[0].angular_velocity"] = 0.0
    swing.start["foot[0].angle"] = -0.5 * math.pi + 1.0
    swing.guess.update({"left[0].angle": 0.5 * math.pi - 1.0, "right[0].angle": -0.5 * math.pi + 1.0})
    swing.guess["foot[1].angle"] = -0.5 * math.pi + 1.0
    hanging = pendulum.PlanePendulum(row.kappa, 1.0, 0.0)
    swing.t_end = 3.0
    yield Known("parallelogram", swing, lambda t: {"foot[0].angle": hanging.angle(t) - 0.5 * math.pi})
    turned = loops.turned_four_bar(loops.TURNS["askew"])
    yield Known("four-bar of spatial joints", turned, lambda t: {"pivot1.angle": loops.flat_four_bar(t)})
    for name, jumps, exact in (("jumps", True, switching.carried), ("resonance", False, switching.resonance)):
        scene = switching.driven_spring(jumps=jumps)
        yield Known(f"driven spring, {name}", scene, lambda t, exact=exact: {"mass.position.x": exact(t)})
    place: Any = switching.between_stops(1e4)
    yield Known("stops", switching.bouncing(1e4), lambda t: {"guide.displacement": place(t)})
