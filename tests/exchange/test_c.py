"""Scenes as C: compiled without warnings, and beside `simulate`."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from atwood import Component, Scene, assemble, export_c, export_fmu, floor, sign, simulate
from atwood.cli import main
from atwood.errors import ParameterError, UnsupportedError, UsageError
from atwood.exchange.c.tables import quoted
from atwood.exchange.c.text import c_name
from atwood.functions import select
from atwood_library import Drive, Ground, Link, PointMass, RigidBody, Rod, Rope
from atwood_library.scenes import SCENES

from ..exported_scenes import FLAGS, apart, built, compiler, happened, printed
from ..helpers.tethers import Caught, Loose, Tether
from ..library.test_slack_ropes import swung, thrown_up
from ..library.test_tables import hoisted
from ..simulation.contacts.test_bounces import tilted_box
from ..simulation.contacts.test_drive_trains import lossy_train
from ..simulation.test_sides import band, moving

needs_a_compiler = pytest.mark.skipif(compiler() is None, reason="there is no C compiler")
SAMPLE = ("double-pendulum", "reduced"), ("four-bar", "dae"), ("rolling-disc", "reduced")
QUICK = ["-O0", *FLAGS[1:]]


@needs_a_compiler
@pytest.mark.parametrize(("name", "form"), SAMPLE)
def test_motions_are_those_of_simulate(name: str, form: str, tmp_path: Path) -> None:
    found = printed(built(SCENES[name](), tmp_path, form, QUICK), 2.0, 1e-11, 5)
    result = simulate(
        SCENES[name](), form=form, rtol=1e-11, t_end=2.0, outputs=np.linspace(0.0, 2.0, 5), solver="explicit"
    )
    worst, where, equal = apart(found, result, assemble(SCENES[name](), form=form))
    assert worst <= 1e-9, where
    if name == "double-pendulum":
        states = equal.split()
        assert states[0] == states[2] != "0", equal


def body_on_a_string(part: Component) -> Scene:
    """Return a body in space whose string goes slack and comes taut again."""
    scene = Scene(space="space", t_end=1.5)
    ground, rope = scene.add("ground", Ground()), scene.add("rope", part)
    arm, body = scene.add("arm", Link(length=0.3)), scene.add("body", RigidBody(mass=1.0, moments=(0.1, 0.2, 0.25)))
    for a, b in ((ground.frame, rope.a), (rope.b, arm.a), (arm.b, body.frame)):
        scene.connect(a, b)
    scene.start.update({"body.position.x": 0.0, "body.position.y": 0.1, "body.velocity.x": 5.0, "body.velocity.y": 0.5})
    scene.start.update({f"body.spin.{axis}": one for axis, one in zip("xyz", (1.0, 0.3, 0.2), strict=True)})
    scene.guess["body.position.z"] = -1.2
    return scene


HAPPENING: dict[str, tuple[Callable[[], Scene], str, int]] = {
    "contacts": (SCENES["clutches"], "reduced", 8),
    "updates": (SCENES["cart-pole"], "reduced", 0),
    "modes of a body that turns": (lambda: body_on_a_string(Tether()), "reduced", 2),
    "a gap of a body that turns": (lambda: body_on_a_string(Rope(when_slack="slack")), "reduced", 2),
    "an update that strikes, and a mode": (lambda: hoisted("plane", part=Tether(length=2.0)), "reduced", 2),
    "an update that strikes, and a gap": (lambda: hoisted("plane"), "reduced", 2),
    "a gap that is told of where it opens": (lambda: swung(Loose()), "reduced", 3),
    "a gap that is told of where it closes": (lambda: swung(Caught()), "dae", 2),
    "a side": (lambda: moving(band(1e-3)), "reduced", 0),
    "floors": (lambda: moving(lambda x, v: 0.1 * floor(3.0 * x)), "dae", 0),
}


@needs_a_compiler
@pytest.mark.parametrize("name", HAPPENING)
def test_what_happens_in_c_is_what_happens_in_runs(name: str, tmp_path: Path) -> None:
    scene, form, count = HAPPENING[name]
    span = 4.0 if form == "dae" and name == "floors" else 1.6
    program = built(scene(), tmp_path, form, QUICK)
    outputs = np.linspace(0.0, span, 6)
    result = simulate(scene(), form=form, rtol=1e-11, t_end=span, outputs=outputs, solver="explicit")
    worst, where, _ = apart(printed(program, span, 1e-11, 6), result, assemble(scene(), form=form))
    assert worst <= 1e-9, where
    known = sorted((one.kind, f"{one.part}.{one.law}", one.time) for one in result.events)
    found = sorted(happened(program, span, 1e-11))
    assert [one[:2] for one in found] == [one[:2] for one in known]
    assert [one[2] for one in found] == pytest.approx([one[2] for one in known], abs=1e-12)
    assert len(found) == count


@needs_a_compiler
def test_a_rest_that_is_known_ahead_is_told_in_the_order_of_time(tmp_path: Path) -> None:
    """It came before what happens until then; now it does also where rows are printed in between."""
    program = built(tilted_box(), tmp_path, "reduced", QUICK)
    known = [one.kind for one in simulate(tilted_box(), t_end=0.5, rtol=1e-9).events]
    for outputs in (2, 20_001):
        found = happened(program, 0.5, 1e-9, outputs)
        assert [one[0] for one in found] == known
        assert [one[2] for one in found] == sorted(one[2] for one in found)


@needs_a_compiler
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_rope_that_may_not_be_slack_again_stops_the_motion(form: str, tmp_path: Path) -> None:
    scene = thrown_up()
    known = simulate(scene, form=form, rtol=1e-11, solver="explicit")
    done = subprocess.run(
        [built(scene, tmp_path, form, QUICK), "2", "1e-11", "3", "--events"], capture_output=True, text=True
    )
    assert done.returncode == 1
    assert done.stderr == f"at t = {known.time[-1]:.9g} s rope: the rope has gone slack\n"
    assert known.status == "stopped"


@needs_a_compiler
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_the_start_is_found_for_other_values(form: str, tmp_path: Path) -> None:
    scene = SCENES["four-bar"]()
    program = built(scene, tmp_path, form, QUICK)
    scene.set("coupler.length", 2.4)
    scene.set("rocker.length", 2.1)
    result = simulate(scene, form=form, rtol=1e-11, t_end=0.5, outputs=[0.0, 0.5], solver="explicit")
    found = printed(program, 0.5, 1e-11, 2, "--set", "coupler.length=2.4", "--set", "rocker.length=2.1")
    worst, where, _ = apart(found, result, assemble(scene, form=form))
    assert worst <= 1e-9, where
    for text, why in (("coupler.length=9", "the start cannot be met"), ("coupler.lenght=2", "no such parameter")):
        done = subprocess.run([program, "1", "1e-9", "2", "--set", text], capture_output=True, text=True)
        assert done.returncode != 0
        assert why in done.stderr


@needs_a_compiler
def test_a_motion_that_stays_on_a_switch_ends_with_a_word(tmp_path: Path) -> None:
    program = built(moving(lambda x, v: -0.3 * sign(v)), tmp_path, "reduced", QUICK)
    done = subprocess.run([program, "5", "1e-9", "2"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "stays where a law switches" in done.stderr


@needs_a_compiler
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_prescribed_speed_that_jumps_strikes(form: str, tmp_path: Path) -> None:
    scene = Scene(t_end=1.0)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    drive = scene.add("drive", Drive(motion=lambda t: select(t < 0.5, t, 0.5)))
    for a, b in ((ground.frame, drive.a), (drive.b, rod.a), (rod.b, bob.point)):
        scene.connect(a, b)
    scene.start.update({"rod.angle": 0.7, "rod.angular_velocity": 0.0})
    program = built(scene, tmp_path, form, QUICK)
    result = simulate(scene, form=form, rtol=1e-11, t_end=1.0, outputs=np.linspace(0.0, 1.0, 6), solver="explicit")
    worst, where, _ = apart(printed(program, 1.0, 1e-11, 6), result, assemble(scene, form=form))
    assert worst <= 1e-9, where
    ((kind, law, time),) = happened(program, 1.0, 1e-11)
    assert (kind, law.split(".")[0], time) == ("impact", "drive", 0.5)
    assert [one.time for one in result.events] == [0.5]


@needs_a_compiler
def test_steps_of_one_length_have_the_order_of_the_method(tmp_path: Path) -> None:
    program = built(SCENES["double-pendulum"](), tmp_path, flags=QUICK)
    known = simulate(SCENES["double-pendulum"](), rtol=1e-13, t_end=1.0, outputs=[0.0, 1.0], solver="explicit")
    errors = []
    for step in ("0.05", "0.025"):
        found = printed(program, 1.0, 1e-9, 2, "--step", step, "--output", "rod1.angle")
        assert list(found) == ["time", "rod1.angle"]
        errors.append(abs(found["rod1.angle"][-1] - known["rod1.angle"][-1]))
    assert errors[1] < errors[0] / 2**6
    assert errors[0] > 1e-13


@needs_a_compiler
def test_an_instance_is_copied_and_takes_parameters(tmp_path: Path) -> None:
    export_c(SCENES["double-pendulum"](), tmp_path, output=["rod1.angle"])
    (tmp_path / "main.c").write_text(
        """#include "double_pendulum.h"
#include <stdio.h>
#include <string.h>
static double_pendulum s, other;
int main(void)
{
    double a, b, c;
    int k = 0;
    double_pendulum_default(&s);
    s.rtol = 1e-11;
    while (strcmp(double_pendulum_parameters[k].path, "bob1.mass") != 0) k++;
    if (double_pendulum_set_parameter(&s, k, -1.0) != double_pendulum_REFUSED) return 2;
    double_pendulum_set_parameter(&s, k, 2.5);
    double_pendulum_begin(&s);
    double_pendulum_advance(&s, 0.5);
    double_pendulum_copy(&other, &s);
    double_pendulum_advance(&s, 1.0);
    double_pendulum_evaluate(&s, &a);
    memset(&s, 0, sizeof s);
    double_pendulum_advance(&other, 1.0);
    double_pendulum_evaluate(&other, &b);
    c = double_pendulum_advance(&other, 0.5);
    printf("[%.17g, %.17g, %g]", a, b, c);
    return 0;
}
"""
    )
    command = f"{compiler()} -O1 -std=c99 -Wall -Wextra -Werror {tmp_path}/double_pendulum.c {tmp_path}/main.c -lm"
    subprocess.run([*command.split(), "-o", str(tmp_path / "a")], check=True)
    a, b, code = json.loads(subprocess.run([tmp_path / "a"], capture_output=True, text=True, check=True).stdout)
    scene = SCENES["double-pendulum"]()
    scene.set("bob1.mass", 2.5)
    assert a == b
    assert code == 2
    assert a == pytest.approx(simulate(scene, rtol=1e-12, t_end=1.0, outputs=[0.0, 1.0])["rod1.angle"][-1], abs=1e-9)


def test_what_has_no_counterpart_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match=r"it is not exported: the limit of gear\."):
        export_c(lossy_train(bearing=True), tmp_path)
    with pytest.raises(UnsupportedError, match="not exported"):
        export_fmu(lossy_train(bearing=True), tmp_path / "a.fmu")


def test_wrong_paths_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"rod1\.angel"):
        export_c(SCENES["double-pendulum"](), tmp_path, output=["rod1.angel"])
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot be made"):
        export_c(SCENES["double-pendulum"](), tmp_path / "file")


def test_names_are_those_of_c() -> None:
    assert [c_name(one) for one in ("DoublePendulum", "double", "3 bodies", "ü/-", "a.b")] == [
        *("double_pendulum", "double_model", "model_3_bodies", "model_model", "a_b")
    ]
    assert quoted('a"\\?ü') == '"a\\042\\134\\077\\303\\274"'


def test_the_command_says_what_it_wrote(tmp_path: Path) -> None:
    from click.testing import CliRunner

    done = CliRunner().invoke(main, ["export", "double-pendulum", "--c", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    assert len(json.loads(done.output)["files"]) == 3
    done = CliRunner().invoke(main, ["export", "double-pendulum"])
    assert done.exit_code == 1
    assert "--c" in done.output
