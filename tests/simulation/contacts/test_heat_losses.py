"""Modelica's HeatLosses: drive trains with every loss there is. The ledger of energy has them; heat is left out."""

from __future__ import annotations

import math

import pytest

import atwood as aw
from atwood import Component, Scene, simulate
from atwood_library import (
    Inertia,
    LossyGear,
    Mass1D,
    OneWayClutch,
    RotationalFriction,
    RotationalGap,
    RotationalSource,
    RotationalSpringDamper,
    TranslationalFriction,
    TranslationalGap,
    TranslationalSource,
    TranslationalSpringDamper,
    TranslationalStop,
)

TURN = 2.0 * math.pi


def train(bodies: dict[str, Component], ties: dict[str, tuple[Component, str, str]]) -> Scene:
    """Return bodies at rest at zero, and what lies between two of them, or between the ground and one."""
    scene = Scene()
    for name, body in bodies.items():
        made = scene.add(name, body)
        place, rate = ("displacement", "speed") if isinstance(made, Mass1D) else ("angle", "angular_velocity")
        if not (isinstance(made, Inertia) and made.moment == 0.0):
            scene.start.update({f"{name}.{place}": 0.0, f"{name}.{rate}": 0.0})

    def end(name: str) -> object:
        return getattr(getattr(scene, name), "slide" if isinstance(bodies[name], Mass1D) else "flange")

    for name, (tie, a, b) in ties.items():
        made = scene.add(name, tie)
        if a:
            scene.connect(end(a), made.a)
        if b:
            scene.connect(end(b), made.b)
    return scene


def rotational() -> Scene:
    """Modelica.Mechanics.Rotational.Examples.HeatLosses."""
    level = lambda t: aw.sin(0.2 * TURN * t)  # noqa: E731
    rubs = {"efficiency_a": "0.8 - 0.1*v", "efficiency_b": "0.8 - 0.1*v", "bearing_a": "1 + v", "bearing_b": "1 + v"}
    return train(
        {f"J{i}": Inertia(moment=2.0) for i in range(1, 7)} | {"hub": Inertia(moment=0.0)},
        {
            "drive": (RotationalSource(value=lambda t: 20.0 * aw.sin(5.0 * TURN * t), against="ground"), "", "J1"),
            "damper": (RotationalSpringDamper(damping=10.0, against="ground"), "", "J1"),
            "shaft": (RotationalSpringDamper(stiffness=1e4, damping=20.0), "J1", "J2"),
            "play": (RotationalGap(stiffness=1e5, damping=100.0, lower=-5e-4, upper=5e-4), "J2", "J3"),
            "bearing": (RotationalFriction(sliding="1", against="ground"), "", "J3"),
            "spring": (RotationalSpringDamper(stiffness=1e4), "J3", "J4"),
            "gear": (LossyGear(ratio=2.0, **rubs), "J4", "hub"),
            "clutch": (RotationalFriction(sliding="5", level=level), "hub", "J5"),
            "free": (OneWayClutch(sliding="0.5", level=level), "J5", "J6"),
            "brake": (RotationalFriction(sliding="1", against="ground", level=level), "", "J6"),
        },
    )


def translational() -> Scene:
    """Modelica.Mechanics.Translational.Examples.HeatLosses."""
    level = lambda t: 10.0 * aw.sin(2.0 * TURN * t)  # noqa: E731
    return train(
        {f"m{i}": Mass1D(mass=1.0) for i in range(1, 5)},
        {
            "drive": (TranslationalSource(value=lambda t: 20.0 * aw.sin(TURN * t), against="ground"), "", "m1"),
            "damper": (TranslationalSpringDamper(damping=10.0, against="ground"), "", "m1"),
            "gap": (
                TranslationalGap(stiffness=100.0, damping=20.0, ends="lower", lower=0.03, against="ground"),
                "",
                "m1",
            ),
            "tie": (TranslationalSpringDamper(stiffness=100.0, damping=10.0), "m1", "m2"),
            "support": (TranslationalFriction(sliding="1", against="ground"), "", "m2"),
            "spring": (TranslationalSpringDamper(stiffness=100.0), "m2", "m3"),
            "brake": (TranslationalFriction(sliding="5", against="ground", level=level), "", "m3"),
            "stiff": (TranslationalSpringDamper(stiffness=1e4, damping=1000.0), "m3", "m4"),
            "rub": (TranslationalFriction(sliding="1 + 0.5*v + 2*exp(-2*v)", against="ground"), "", "m4"),
            "stop": (TranslationalStop(lower=-0.25, upper=0.05, against="ground"), "", "m4"),
        },
    )


@pytest.mark.parametrize(
    ("make", "end", "quantity"), [(rotational, 1.0, "J{}.angle"), (translational, 2.0, "m{}.displacement")]
)
def test_both_forms_agree_and_lose_what_the_ledger_says(make, end: float, quantity: str) -> None:
    results = [simulate(make(), form=form, t_end=end, rtol=1e-10, outputs=201) for form in ("reduced", "dae")]
    first, second = results
    assert [(one.kind, one.part) for one in first.events] == [(one.kind, one.part) for one in second.events]
    assert len(first.events) > 35
    for i in range(1, 5):
        path = quantity.format(i)
        assert first[path][-1] == pytest.approx(second[path][-1], abs=1e-9)
    for result in results:
        assert result.energy.max_drift < 1e-7 + result.energy.uncertainty


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_modelica_s_published_motion_is_met_up_to_its_stop(form: str) -> None:
    """Its results are right to some 1e-6.

    At the stop Modelica sets the speed of the mass to zero and keeps those of springs, which are states: the mass
    behind the spring at the stop stops, too, without a force, and from there on the published motion is another one.
    """
    result = simulate(translational(), form=form, t_end=0.45, rtol=1e-10, outputs=[0.03, 0.428])
    m1, m2, m3, m4 = (result[f"m{i}.displacement"] for i in range(1, 5))
    assert 0.05 - m1 == pytest.approx([0.0486477536238969, -0.212967006814552], abs=3e-7)
    assert m2 - m1 == pytest.approx([-0.0013522422412779, -0.0951753986604853], abs=3e-7)
    assert m4 - m3 == pytest.approx([0.0, -0.000544394328865126], abs=1e-9)
    assert 0.3 + m4 == pytest.approx([0.3, 0.349628596894102], abs=3e-7)
    stop = next(one for one in result.events if one.kind == "impact")
    assert stop.time == pytest.approx(0.42854941954175, abs=1e-6)
    assert stop.struck is not None
    assert -stop.struck.before == pytest.approx(0.677354036856754, abs=2e-6)
