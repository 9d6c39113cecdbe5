"""Scenes that a page computes itself, run in Node beside `simulate`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from atwood import simulate
from atwood.plotting.live import LiveProgram, engine_script, live_program
from atwood_library.scenes import SCENES

from ..helpers.node import run_node

SAMPLE = (
    ("double-pendulum", "reduced"),
    ("four-bar", "reduced"),
    ("four-bar", "dae"),
    ("lagrange-top", "dae"),
    ("rolling-disc", "reduced"),
    ("wilberforce-pendulum", "reduced"),
)
SPAN, RTOL = 2.0, 1e-11


def played(models: Mapping[str, LiveProgram], script: str, given: Any = None) -> Any:
    """Run a script in which ``models`` are scenes by name; ``start(name)`` makes an engine."""
    texts = ", ".join(f"{json.dumps(name)}: {one.model}" for name, one in models.items() if one.model)
    start = f"const start = (name, options = {{rtol: {RTOL}}}) => createEngine(models[name], options);"
    return run_node(f"{engine_script()}\nconst models = {{{texts}}};\n{start}\n{script}", given)


def state_at(scene: Any, t: float, **settings: Any) -> np.ndarray:
    """Return coordinates and speeds at a time."""
    run = simulate(scene, outputs=[0.0, t], t_end=t, **settings).run
    last = run.segments[-1]
    return np.concatenate([last.coordinates[:, -1], last.speeds[:, -1]])


RUN = """
print(Object.keys(models).map(name => {
  const engine = start(name), said = engine.advance(given);
  return [said.code, said.text, engine.time, Array.from(engine.state), engine.energy(), Array.from(engine.poses()),
          Array.from(engine.values(engine.model.data.quantities.map(one => one.path)))];
}));
"""


@pytest.fixture(scope="module")
def models() -> dict[str, LiveProgram]:
    return {f"{name} {form}": live_program(SCENES[name](), form) for name, form in SAMPLE}


def test_motions_are_those_of_simulate(models: dict[str, LiveProgram]) -> None:
    found = dict(zip(models, played(models, RUN, SPAN), strict=True))
    for name, form in SAMPLE:
        code, text, t, state, energy, _, values = found[f"{name} {form}"]
        assert (code, text, t) == ("reached", "", SPAN), name
        tight, loose = (state_at(SCENES[name](), SPAN, form=form, rtol=one, solver="explicit") for one in (1e-12, RTOL))
        bound = max(1e-8, 100.0 * float(np.max(np.abs(tight - loose))))
        np.testing.assert_allclose(state, tight, rtol=0.0, atol=bound, err_msg=name)
        result = simulate(SCENES[name](), form=form, rtol=1e-12, t_end=SPAN, outputs=[0.0, SPAN], solver="explicit")
        quantities = models[f"{name} {form}"].data["quantities"]
        assert len(quantities) > 10
        for one, value in zip(quantities, values, strict=True):
            if one["sharing"]:  # two angles at a pole
                continue
            there = float(result[one["path"]][-1])
            turns = round((there - value) / (2.0 * np.pi)) * 2.0 * np.pi if one["periodic"] else 0.0
            assert value + turns == pytest.approx(there, abs=1e-6, rel=1e-6), (name, one["path"])
        assert energy["total"] == pytest.approx(energy["kinetic"] + energy["potential"])


def test_steps_have_the_bits_of_machine_code() -> None:
    """Of a scene without functions of the C library."""
    live = {"kepler": live_program(SCENES["kepler"](), "reduced")}
    assert "Math.sin" not in live["kepler"].model
    [[code, _, _, state, *_]] = played(live, RUN, SPAN)
    assert code == "reached"
    assert state == state_at(SCENES["kepler"](), SPAN, form="reduced", rtol=RTOL, solver="explicit").tolist()


CHANGED: tuple[tuple[str, str, dict[str, float]], ...] = (
    ("double-pendulum", "reduced", {"rod1.length": 1.3, "rod2.angle": -0.4, "gravity": 3.7}),
    ("four-bar", "reduced", {"crank.length": 0.8, "crank.angle": 1.3}),
    ("four-bar", "dae", {"coupler.length": 2.7}),
    ("slider-crank", "dae", {"connecting_rod.length": 1.2, "crank.angular_velocity": -2.0}),
    ("spatial-slider-crank", "reduced", {}),
    ("lagrange-top", "dae", {"top.mass": 1.4}),
    ("double-pendulum-3d", "reduced", {"joint1.angle_a": 0.9, "rod1.mass": 2.0}),
    ("universal-shaft", "reduced", {"bearing1.angle": 0.7}),
    ("rolling-disc", "reduced", {}),
)


def test_changed_values_are_those_of_simulate() -> None:
    made, given = {}, []
    for name, form, values in CHANGED:
        live = made[f"{name} {form}"] = live_program(SCENES[name](), form)
        scalars = [one for one in live.data["parameters"] if "[" not in one["path"] and one["unit"] == "kg"]
        given.append([f"{name} {form}", values or {scalars[0]["path"]: 1.5 * scalars[0]["value"]}])
    script = """
    print(given.map(([name, values]) => {
      const engine = start(name), said = engine.set(values);
      return [said.code, said.text, engine.advance(1.0).code, Array.from(engine.state)];
    }));
    """
    for (key, values), (code, text, reached, state) in zip(given, played(made, script, given), strict=True):
        name, form = key.split()
        assert (code, text, reached) == ("ready", "", "reached"), key
        scene = SCENES[name]()
        for path, value in values.items():
            if path in scene.start:
                scene.start[path] = value
            elif path == "gravity":
                scene.gravity = value
            else:
                scene.set(path, value)
        expected = state_at(scene, 1.0, form=form, rtol=1e-12, solver="explicit")
        np.testing.assert_allclose(state, expected, rtol=0.0, atol=1e-8, err_msg=key)
