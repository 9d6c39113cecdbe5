"""Scenes that a page computes itself, run in Node beside `simulate`."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from atwood import Component, Scene, assemble, floor, sign, simulate
from atwood.errors import ParameterError
from atwood.integrators.methods import METHODS
from atwood.plotting.live import LiveProgram, engine_script, live_program
from atwood.plotting.live.pulls import Pull
from atwood_library import BallContact, Ground, PointMass, Rope, Sphere, Spring
from atwood_library.scenes import SCENES

from ..helpers.node import run_node
from ..helpers.tethers import Caught, Loose, Tether
from ..library.test_slack_ropes import thrown_up
from ..library.test_tables import hoisted
from ..machines.bits import task_of
from ..simulation.contacts.test_drive_trains import lossy_train
from ..simulation.contacts.test_known_answers import on_plane, start_at
from ..simulation.contacts.test_stiff_places import bar
from ..simulation.test_brief_laws import on_a_line
from ..simulation.test_sides import band, moving

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


TREES = ("kepler", "double-pendulum", "chain", "wilberforce-pendulum", "heavy-top", "rolling-disc", "furuta-pendulum")


def test_steps_have_the_bits_of_machine_code() -> None:
    """Of trees; where constraints stay, what lies between steps is put on them by NumPy in a result."""
    live = {name: live_program(SCENES[name](), "reduced") for name in TREES}
    for name, [code, _, _, state, *_] in zip(TREES, played(live, RUN, SPAN), strict=True):
        assert code == "reached"
        session = METHODS["explicit"].open(task_of(name, "explicit", math.inf, RTOL))
        assert state == session.advance(SPAN).y.tolist(), name


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


def slack_string(part: Component | None = None) -> Scene:
    """Return a bob on a string that goes slack and comes taut again."""
    scene = Scene(t_end=1.6)
    ground, rope = scene.add("ground", Ground()), scene.add("rope", part or Rope(length=1.0, when_slack="slack"))
    bob = scene.add("bob", PointMass(mass=1.0))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.velocity.x": 6.0})
    scene.guess["bob.position.z"] = -1.0
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_modes_are_entered_at_their_times(form: str) -> None:
    scenes = {"string": (slack_string, 2), "trebuchet": (SCENES["trebuchet"], 1), "wire": (SCENES["bead-on-wire"], 0)}
    scenes |= {"cart": (SCENES["cart-pole"], 0), "winch": (lambda: hoisted("plane"), 2)}
    scenes |= {"tether": (lambda: slack_string(Tether()), 2), "loose": (lambda: slack_string(Loose()), 3)}
    scenes["caught"] = lambda: slack_string(Caught()), 2
    made = {name: live_program(scene(), form) for name, (scene, _) in scenes.items()}
    script = """
    print(Object.keys(models).map(name => {
      const engine = start(name, {rtol: 1e-11}), said = engine.advance(1.6);
      const told = engine.events.map(one => [one.law, one.target]);
      return [said.code, engine.events.map(one => one.time), told, Array.from(engine.state), engine.mode];
    }));
    """
    for (scene, count), (code, times, told, state, modes) in zip(scenes.values(), played(made, script), strict=True):
        run = simulate(scene(), form=form, t_end=1.6, rtol=1e-12, outputs=[0.0, 1.6]).run
        assert (code, len(times), modes) == ("reached", count, dict(run.segments[-1].assembly.modes))
        assert times == pytest.approx([one.time for one in run.events], abs=1e-9)
        assert told == [[one.law, one.target] for one in run.events]
        last = run.segments[-1]
        np.testing.assert_allclose(state, [*last.coordinates[:, -1], *last.speeds[:, -1]], rtol=0.0, atol=2e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_rope_that_may_not_be_slack_again_stops_the_motion(form: str) -> None:
    script = 'const engine = start("up"), said = engine.advance(1.6); print([said, engine.events.map(one => one.law)]);'
    (said, laws) = played({"up": live_program(thrown_up(), form)}, script)
    assert (said["code"], said["text"]) == ("stopped", "at t = 0.199060013 s rope: the rope has gone slack")
    assert laws == ["comes_taut", "goes_slack"]


def test_what_is_wrong_is_said() -> None:
    made = {"row": live_program(SCENES["four-bar-row"](), "reduced"), "arm": live_program(SCENES["four-bar"](), "dae")}
    script = """
    const row = start("row"), arm = start("arm");
    const first = [row.advance(2.0), row.advance(2.0).code, row.reset().code, row.advance(0.1).code];
    const refused = [arm.set("crank.lengt", 1.0), arm.set("crank.length", -1.0), arm.set("coupler.length", 9.0),
                     arm.advance(NaN), arm.setState(0.0, [1.0])];
    const before = Array.from(arm.state);
    let said = "";
    try { arm.value("coupler.angel"); } catch (error) { said = error.message; }
    print([first, refused, before, arm.advance(1.0).code, arm.advance(0.5), said, arm.advance(2.0, {steps: 1}).code,
           arm.set("crank.length", 1.05).code, arm.advance(2.0).code, arm.setState(0.0, before.map(x => x + 1.0))]);
    """
    first, refused, before, reached, back, said, working, changed, on, off = played(made, script)
    assert first[0]["code"] == "singular"
    assert "right[1].coincidence[0] follows from the other constraints" in first[0]["text"]
    assert first[1:] == ["singular", "ready", "reached"]
    assert [one["code"] for one in refused] == ["refused"] * 5
    assert "perhaps crank.length" in refused[0]["text"]
    assert "cannot be met" in refused[2]["text"]
    np.testing.assert_allclose(before, made["arm"].model and live_state(made["arm"]), rtol=0.0, atol=1e-12)
    assert (reached, back["code"], working, changed, on) == ("reached", "refused", "working", "ready", "reached")
    assert "coupler.angel: there is no such quantity; perhaps" in said
    assert off["code"] in ("ready", "failed")


def live_state(live: LiveProgram) -> list[float]:
    found: list[float] = played({"x": live}, "print(Array.from(start('x').state));")
    return found


def test_parameters_that_are_zero_stay_where_they_have_a_slider() -> None:
    scene = Scene(t_end=1.0, gravity=0.0)
    ground, spring = scene.add("ground", Ground()), scene.add("spring", Spring(stiffness=3.0, natural_length=0.0))
    bob = scene.add("bob", PointMass(mass=1.0))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, bob.point)
    scene.start.update({"bob.position.x": 1.0, "bob.position.z": 0.5})
    plain, kept = live_program(scene), live_program(scene, sliders=["spring.natural_length"])
    script = """
    print(Object.keys(models).map(name => {
      const engine = start(name), first = engine.advance(1.0).code, state = Array.from(engine.state);
      const said = engine.set("spring.natural_length", 0.4);
      engine.reset();
      return [first, state, said.code, engine.advance(1.0).code, Array.from(engine.state)];
    }));
    """
    [_, state, said, _, _], [_, other, set_, code, changed] = played({"plain": plain, "kept": kept}, script)
    assert (said, set_, code) == ("refused", "ready", "reached")
    np.testing.assert_allclose(other, state, rtol=0.0, atol=1e-12)
    scene.set("spring.natural_length", 0.4)
    np.testing.assert_allclose(changed, state_at(scene, 1.0, rtol=1e-12, solver="explicit"), rtol=0.0, atol=1e-9)
    with pytest.raises(ParameterError, match="no such parameter"):
        live_program(scene, sliders=["spring.stifness"])


def test_scenes_that_are_not_live_say_why() -> None:
    assert live_program(lossy_train(bearing=True)).reason.startswith("the limit of gear.")
    hostile = live_program(assemble(SCENES["double-pendulum"](), name="</script><!-- "))
    assert hostile.data["name"] == "</script><!-- "
    assert "</script" not in hostile.model
    assert "<!--" not in hostile.model


def test_laws_that_switch_or_act_briefly_are_not_stepped_over() -> None:
    scenes = {
        "band": lambda: moving(band(1e-3)),
        "sign": lambda: moving(lambda x, v: -3.0 * sign(x - 0.5)),
        "floor": lambda: moving(lambda x, v: 0.1 * floor(3.0 * x)),
        "bell": lambda: on_a_line("0.4*exp(-((x-3)/0.001)^2)"),
        "friction": lambda: moving(lambda x, v: -0.3 * sign(v)),
    }
    made = {name: live_program(scene()) for name, scene in scenes.items()}
    script = """
    print(Object.keys(models).map(name => {
      const engine = start(name), said = engine.advance(5.0);
      return [said, Array.from(engine.state)];
    }));
    """
    found = dict(zip(scenes, played(made, script), strict=True))
    said, _ = found.pop("friction")
    assert (said["code"], "stays where a law switches" in said["text"]) == ("failed", True)
    for name, (said, state) in found.items():
        assert said["code"] == "reached", name
        expected = state_at(scenes[name](), 5.0, rtol=1e-12)
        np.testing.assert_allclose(state, expected, rtol=0.0, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_body_that_is_pulled_moves_as_on_a_damped_spring(form: str) -> None:
    live = live_program(SCENES["double-pendulum"](), form, drag=True)
    node = next(one["node"] for one in live.data["nodes"] if "bob2.point" in one["connectors"])
    assert not any("page pull" in path for one in live.data["nodes"] for path in one["connectors"])
    assert not any("page pull" in one["path"] for one in (*live.data["parameters"], *live.data["quantities"]))
    script = f"""
    const engine = start("x"), own = engine.model.modes[0].data;
    const first = [engine.advance(0.2).code, Array.from(engine.state)];
    const said = [engine.drag(99, [0, 0, 0]).code, engine.drag({node}, [0, 0]).code];
    engine.reset();
    said.push(engine.drag({node}, [0.5, 0.0, -1.0]).code, engine.advance(0.7).code);
    const pulled = Array.from(engine.state);
    said.push(engine.drag(null).code, engine.advance(1.0).code);
    print([first, said, pulled, own.stiffness, own.time]);
    """
    (code, free), said, pulled, stiffness, time = played({"x": live}, script)
    assert (code, said) == ("reached", ["refused", "refused", "ready", "reached", "ready", "reached"])
    expected = state_at(SCENES["double-pendulum"](), 0.2, form=form, rtol=1e-12, solver="explicit")
    np.testing.assert_allclose(free, expected, rtol=0.0, atol=1e-9)
    scene = SCENES["double-pendulum"]()
    values = {"stiffness": 10.0 * stiffness, "damping": math.sqrt(10.0) * stiffness * time, "target": (0.5, 0.0, -1.0)}
    hand = scene.add("hand", Pull(**values))
    scene.connect(scene.bob2.point, hand.point)
    expected = state_at(scene, 0.7, form=form, rtol=1e-12, solver="explicit")
    np.testing.assert_allclose(pulled, expected, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_at_rest_a_point_is_put_where_it_is_nearest_to_the_pointer(form: str) -> None:
    """What is out of reach is stretched to; a crank turns to the same side, and its loop stays closed."""
    names = {"double-pendulum": "bob2.point", "four-bar": "crank.b"}
    lives = {name: live_program(SCENES[name](), form) for name in names}
    script = """
    print(given.map(([name, node, place]) => {
      const engine = start(name), at = engine.model.data.nodes.findIndex(one => one.node === node);
      engine.advance(0.1);
      const said = engine.place(node, place), found = Array.from(engine.places().slice(3 * at, 3 * at + 3));
      const {kinetic} = engine.energy();
      return [said.code, found, kinetic, engine.place(node, [1, 2]).code, engine.advance(0.5).code];
    }));
    """
    node = {
        name: next(one["node"] for one in lives[name].data["nodes"] if path in one["connectors"])
        for name, path in names.items()
    }
    crank = SCENES["four-bar"]().crank.length
    far = np.array([math.cos(-1.2), 0.0, math.sin(-1.2)])
    given = [
        ("double-pendulum", [0.9, 0.0, -1.1], [0.9, 0.0, -1.1]),
        ("double-pendulum", [3.0, 0.0, -4.0], [1.2, 0.0, -1.6]),
        ("four-bar", (7.0 * far).tolist(), (crank * far).tolist()),
    ]
    found = played(lives, script, [[name, node[name], place] for name, place, _ in given])
    for (said, place, kinetic, wrong, after), (_, _, wanted) in zip(found, given, strict=True):
        assert (said, wrong, after) == ("ready", "refused", "reached")
        np.testing.assert_allclose(place, wanted, rtol=0.0, atol=1e-6)
        assert kinetic == pytest.approx(0.0, abs=1e-20)


def test_a_chaotic_motion_agrees_with_taylor_series_to_the_end() -> None:
    live = live_program(SCENES["double-pendulum"](), "reduced")
    script = 'const engine = start("x", {rtol: 1e-15}); print([engine.advance(10.0).code, Array.from(engine.state)]);'
    code, state = played({"x": live}, script)
    expected = state_at(SCENES["double-pendulum"](), 10.0, form="reduced", rtol=1e-15, solver="taylor")
    assert code == "reached"
    np.testing.assert_allclose(state, expected, rtol=0.0, atol=1e-12)


CONTACTS = (
    ("bouncing-ball", "dae", 2.5, {"floor.restitution": 0.6}),  # to its rest
    ("newtons-cradle", "reduced", 0.8, {"gravity": 5.0}),
    ("woodpecker", "dae", 0.2, {"lower.friction": 0.35}),
    ("clutches", "reduced", 1.2, {"rotor1.moment": 1.5}),
    ("stick-slip", "dae", 1.5, {"belt.friction": 0.3}),
    ("cue-ball", "reduced", 0.3, {"c.friction": 0.3}),
)
CONTACT_RUN = """
print(given.map(([name, span, values]) => {
  const engine = start(name), said = engine.advance(0.1 * span), changed = engine.set(values);
  engine.reset();
  return [said.code, changed.code, engine.advance(span), Array.from(engine.state), engine.events];
}));
"""


def test_contacts_are_those_of_simulate_in_events_and_states() -> None:
    def scene_of(name: str) -> Scene:
        return SCENES[name]() if name in SCENES else cue_ball()

    made = {f"{name} {form}": live_program(scene_of(name), form) for name, form, *_ in CONTACTS}
    given = [[f"{name} {form}", span, values] for name, form, span, values in CONTACTS]
    for (name, form, span, values), found in zip(CONTACTS, played(made, CONTACT_RUN, given), strict=True):
        *codes, said, state, events = found
        assert (*codes, said["code"]) == ("reached", "ready", "reached"), (name, said)
        scene = scene_of(name)
        for path, value in values.items():
            if path == "gravity":
                scene.gravity = value
            else:
                scene.set(path, value)
        run = simulate(scene, form=form, rtol=RTOL, outputs=[0.0, span], t_end=span, solver="explicit").run
        last = run.segments[-1]
        there = np.concatenate([last.coordinates[:, -1], last.speeds[:, -1]])
        np.testing.assert_allclose(state, there, rtol=0.0, atol=1e-9, err_msg=name)
        # Balls of the cradle that rest touch, and rounding decides which of them open.
        kinds = {"impact"} if name == "newtons-cradle" else {one.kind for one in run.events}
        theirs, ours = (
            [one for one in run.events if one.kind in kinds],
            [one for one in events if one["kind"] in kinds],
        )
        told = [(one.part, one.law, one.kind) for one in theirs]
        assert [(one["part"], one["law"], one["kind"]) for one in ours] == told, name
        np.testing.assert_allclose([one["time"] for one in ours], [one.time for one in theirs], rtol=0.0, atol=1e-9)
        assert len(ours) > 0


def test_a_page_stops_where_friction_depends_on_shares_that_nothing_determines() -> None:
    scenes = {"sound": bar((None,) * 3, (0.2, 0.2, 0.2), 0.5), "other": bar((None,) * 3, (0.1, 0.3, 0.2), 0.5)}
    found = played({name: live_program(one) for name, one in scenes.items()}, RUN, 0.6)
    assert [one[0] for one in found] == ["reached", "failed"]
    assert found[1][2] == pytest.approx(math.sqrt(1.0 / 9.81))
    assert "friction depends on how forces are shared, which nothing determines" in found[1][1]


def cue_ball() -> Scene:
    """Return a ball that slides with spin until it rolls."""
    scene = on_plane(Sphere(mass=1.0, radius=0.0286), BallContact(friction=0.25, radius=0.0286), space="space")
    start_at(scene, 0.0, 0.0286, 2.0, 0.0)
    scene.start.update({"m.position.y": 0.0, "m.velocity.y": 0.0})
    scene.start.update({f"m.angular_velocity.{axis}": value for axis, value in zip("xyz", (30, 40, 10), strict=True)})
    scene.t_end = 0.5
    return scene


def test_a_page_refuses_a_start_inside_with_the_part_and_lifts_what_rests() -> None:
    script = """
    const ball = start("ball"), path = ball.starts.find(one => one.path.endsWith("position.z")).path;
    const belt = start("belt"), {node} = belt.model.data.nodes.find(one => one.connectors.includes("body.point"));
    const put = to => [belt.place(node, to).code, ...belt.state.slice(0, 2)];
    print([ball.set(path, -0.5), ball.advance(1.0).code, put([0.1, 0, -0.2]), put([0.1, 0, 0.3])]);
    """
    made = {name: live_program(SCENES[key]()) for name, key in (("ball", "bouncing-ball"), ("belt", "stick-slip"))}
    said, code, below, above = played(made, script)
    assert (said["code"], code) == ("refused", "reached")
    assert "floor: it begins inside" in said["text"]
    assert below == ["ready", pytest.approx(0.1), pytest.approx(0.0, abs=1e-12)]
    assert above == ["ready", pytest.approx(0.1), pytest.approx(0.3)]
