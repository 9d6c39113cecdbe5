"""Scenes as FMUs, called through their functions; `python -m tests.exported_scenes --fmu` asks fmpy about all."""

import ctypes
import json
import re
import zipfile
from collections.abc import Callable
from ctypes import byref, c_bool, c_char_p, c_double, c_size_t, c_uint, c_void_p
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from atwood import Component, export_fmu, simulate
from atwood.cli import main
from atwood.errors import UsageError
from atwood.exchange.fmi import build
from atwood_library import Rope
from atwood_library.scenes import SCENES

from ..helpers.tethers import Tether
from ..plotting.test_live import slack_string

needs_a_compiler = pytest.mark.skipif(build.find_compiler() is None, reason="there is no C compiler")


class Unit:
    """An instance of an FMU 3.0, with its variables by name."""

    def __init__(self, file: Path, kind: str, rtol: float = 1e-9) -> None:
        folder = file.with_suffix("")
        if not folder.exists():
            with zipfile.ZipFile(file) as archive:
                archive.extractall(folder)
        self.description = ElementTree.parse(folder / "modelDescription.xml").getroot()
        variables = self.description.find("ModelVariables")
        assert variables is not None
        self.references = {one.get("name"): int(one.get("valueReference", "")) for one in variables}
        (binary,) = (folder / "binaries").glob("*/*")
        self.library = ctypes.CDLL(str(binary))
        make = self.library[f"fmi3Instantiate{kind}"]
        make.restype, make.argtypes = c_void_p, [c_char_p] * 3 + [c_bool] * 2 + [c_void_p] * 2
        more: tuple[object, ...] = (None, None)
        if kind == "CoSimulation":
            make.argtypes = [c_char_p] * 3 + [c_bool] * 4 + [c_void_p, c_size_t] + [c_void_p] * 3
            more = (False, False, None, 0, None, None, None)
        token = self.description.get("instantiationToken", "").encode()
        assert make(b"one", b"another", None, False, False, *more) is None
        self.handle = make(b"one", token, None, False, False, *more)
        assert self.handle
        self.call("EnterInitializationMode", c_bool(True), c_double(rtol), c_double(0.0), c_bool(False), c_double(0.0))
        self.call("ExitInitializationMode")

    def call(self, name: str, *given: object) -> None:
        assert self.library[f"fmi3{name}"](c_void_p(self.handle), *given) == 0, name

    def get(self, *names: str) -> list[float]:
        values = (c_double * len(names))()
        self.call("GetFloat64", self.of(names), c_size_t(len(names)), values, c_size_t(len(names)))
        return list(values)

    def set(self, name: str, value: float) -> None:
        self.call("SetFloat64", self.of([name]), c_size_t(1), byref(c_double(value)), c_size_t(1))

    def of(self, names: list[str] | tuple[str, ...]) -> ctypes.Array[c_uint]:
        return (c_uint * len(names))(*(self.references[one] for one in names))

    def step(self, time: float, length: float) -> None:
        flags, last = [c_bool() for _ in range(3)], c_double()
        self.call("DoStep", c_double(time), c_double(length), c_bool(True), *map(byref, flags), byref(last))
        assert last.value == time + length

    def slopes(self, name: str, unknowns: list[str], knowns: list[str], seed: list[float]) -> list[float]:
        n, m = len(unknowns), len(knowns)
        size = m if name == "Adjoint" else n
        found = (c_double * size)()
        given = self.of(unknowns), c_size_t(n), self.of(knowns), c_size_t(m)
        seeds = (c_double * len(seed))(*seed), c_size_t(len(seed))
        self.call(f"Get{name}Derivative", *given, *seeds, found, c_size_t(size))
        return list(found)


@pytest.fixture(scope="module")
def double_pendulum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if build.find_compiler() is None:
        pytest.skip("there is no C compiler")
    file = tmp_path_factory.mktemp("fmu") / "double.fmu"
    made = export_fmu(SCENES["double-pendulum"](), file)
    assert made.kinds == ("model exchange", "co-simulation")
    assert made.platforms == (build.own_platform(),)
    return file


def test_co_simulation_is_the_motion_and_states_are_kept(double_pendulum: Path) -> None:
    unit = Unit(double_pendulum, "CoSimulation")
    for k in range(10):
        unit.step(0.1 * k, 0.1 * (k + 1) - 0.1 * k)
    known = simulate(SCENES["double-pendulum"](), rtol=1e-12, t_end=2.0, outputs=[0.0, 1.0, 2.0])
    assert unit.get("rod1.angle")[0] == pytest.approx(known["rod1.angle"][1], abs=1e-7)
    kept, size = c_void_p(), c_size_t()
    unit.call("GetFMUState", byref(kept))
    unit.call("SerializedFMUStateSize", kept, byref(size))
    written = (ctypes.c_uint8 * size.value)()
    unit.call("SerializeFMUState", kept, written, size)
    unit.call("FreeFMUState", byref(kept))
    unit.step(1.0, 1.0)
    there = unit.get("rod1.angle", "rod2.angle'", "bob2.position.x")
    assert there[0] == pytest.approx(known["rod1.angle"][2], abs=1e-7)
    other = Unit(double_pendulum, "CoSimulation")
    other.call("DeserializeFMUState", written, size, byref(kept))
    other.call("SetFMUState", kept)
    other.call("FreeFMUState", byref(kept))
    other.step(1.0, 1.0)
    assert other.get("rod1.angle", "rod2.angle'", "bob2.position.x") == there


def test_parameters_are_tunable(double_pendulum: Path) -> None:
    unit = Unit(double_pendulum, "CoSimulation")
    unit.set("bob1.mass", 2.5)
    unit.step(0.0, 1.0)
    scene = SCENES["double-pendulum"]()
    scene.set("bob1.mass", 2.5)
    known = simulate(scene, rtol=1e-12, t_end=1.0, outputs=[0.0, 1.0])["rod1.angle"][-1]
    assert unit.get("rod1.angle", "bob1.mass") == [pytest.approx(known, abs=1e-7), 2.5]
    for name, value in (("bob1.mass", -1.0), ("rod1.angle", float("nan")), ("bob1.position.x", 1.0)):
        assert unit.library.fmi3SetFloat64(
            c_void_p(unit.handle), unit.of([name]), c_size_t(1), byref(c_double(value)), c_size_t(1)
        ), name


def test_derivatives_are_those_of_differences(double_pendulum: Path) -> None:
    unit = Unit(double_pendulum, "ModelExchange")
    knowns = ["rod1.angle", "rod2.angle", "rod1.angle'", "rod2.angle'"]
    unknowns = [f"der({one})" for one in knowns] + ["bob2.acceleration.x", "rod1.tension"]
    seed = [0.3, -0.2, 0.5, 0.7]
    start, step = unit.get(*knowns), 1e-6
    found = unit.slopes("Directional", unknowns, knowns, seed)
    ends = []
    for sign in (1.0, -1.0):
        for name, x, v in zip(knowns, start, seed, strict=True):
            unit.set(name, x + sign * step * v)
        ends.append(np.array(unit.get(*unknowns)))
    np.testing.assert_allclose(found, (ends[0] - ends[1]) / (2 * step), rtol=1e-6, atol=1e-6)
    for name, x in zip(knowns, start, strict=True):
        unit.set(name, x)
    weights = [1.0, -2.0, 0.5, 0.25, 3.0, -1.0]
    back = unit.slopes("Adjoint", unknowns, knowns, weights)
    assert np.dot(back, seed) == pytest.approx(np.dot(weights, found), rel=1e-12)


def test_the_structure_is_that_of_the_equations(double_pendulum: Path) -> None:
    unit = Unit(double_pendulum, "ModelExchange")
    names = {reference: name for name, reference in unit.references.items()}
    structure = unit.description.find("ModelStructure")
    assert structure is not None
    found = {
        names[int(one.get("valueReference", ""))]: {names[int(k)] for k in one.get("dependencies", "").split()}
        for one in structure
        if one.get("dependencies") is not None
    }
    assert found["bob1.position.x"] == {"rod1.angle"}
    assert found["bob2.position.x"] == {"rod1.angle", "rod2.angle"}
    assert {"rod1.angle", "rod2.angle"} <= found["bob1.acceleration.x"]


def test_many_instances_are_made_and_freed(double_pendulum: Path) -> None:
    unit = Unit(double_pendulum, "ModelExchange")
    make, free = unit.library.fmi3InstantiateModelExchange, unit.library.fmi3FreeInstance
    make.restype, free.restype, free.argtypes = c_void_p, None, [c_void_p]
    token = unit.description.get("instantiationToken", "").encode()
    for _ in range(10_000):
        free(make(b"", token, None, False, False, None, None))


@needs_a_compiler
def test_states_that_depend_on_each_other_are_for_co_simulation_alone(tmp_path: Path) -> None:
    made = export_fmu(SCENES["four-bar"](), tmp_path / "bar.fmu", fmi=2, output=["crank.angle"], platform=())
    assert (made.kinds, made.platforms) == (("co-simulation",), ())
    assert "depend on each other" in made.reason
    with zipfile.ZipFile(made.file) as archive:
        names, text = archive.namelist(), archive.read("modelDescription.xml").decode()
    assert {"sources/fmi2.c", "sources/fmu.c", "sources/four_bar.c"} <= set(names)
    assert "<ModelExchange" not in text
    outputs = re.findall(r'name="([^"]+)"[^>]*causality="output"', text)
    assert outputs == ["crank.angle"]


def test_without_a_compiler_there_are_sources_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "find_compiler", lambda: None)
    monkeypatch.setattr(build, "has_zig", lambda: False)
    with pytest.warns(UserWarning, match="sources alone"):
        made = export_fmu(SCENES["simple-pendulum"](), tmp_path / "a.fmu")
    assert made.platforms == ()
    with pytest.raises(UsageError, match="no compiler"):
        export_fmu(SCENES["simple-pendulum"](), tmp_path / "a.fmu", platform=["aarch64-darwin"])


def test_a_scene_makes_one_file_always(tmp_path: Path) -> None:
    files = [export_fmu(SCENES["simple-pendulum"](), tmp_path / f"{k}.fmu", platform=()).file for k in range(2)]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    scene = SCENES["simple-pendulum"]()
    with pytest.raises(UsageError, match="suffix"):
        export_fmu(scene, tmp_path / "a.zip")
    with pytest.raises(UsageError, match="FMI 2"):
        export_fmu(scene, tmp_path / "a.fmu", fmi=2, platform=["aarch64-linux"])
    with pytest.raises(UsageError, match="fmi cannot be 4"):
        export_fmu(scene, tmp_path / "a.fmu", fmi=4)


@needs_a_compiler
@pytest.mark.parametrize(
    ("part", "reason"),
    [
        (Tether, "each of its modes has states of its own"),
        (lambda: Rope(when_slack="slack"), "its states depend on each other, which steps keep so"),
    ],
    ids=["modes", "gap"],
)
def test_a_scene_with_modes_is_for_co_simulation_and_its_states_are_kept(
    part: Callable[[], Component], reason: str, tmp_path: Path
) -> None:
    made = export_fmu(slack_string(part()), tmp_path / "a.fmu", output=["bob.position.x", "rope.tension"])
    assert (made.kinds, made.reason) == (("co-simulation",), reason)
    unit = Unit(made.file, "CoSimulation")
    unit.step(0.0, 0.7)
    kept = c_void_p()
    unit.call("GetFMUState", byref(kept))
    unit.step(0.7, 0.9)
    there = unit.get("bob.position.x", "rope.tension")
    unit.call("SetFMUState", kept)
    unit.call("FreeFMUState", byref(kept))
    unit.step(0.7, 0.9)
    assert unit.get("bob.position.x", "rope.tension") == there
    known = simulate(slack_string(part()), rtol=1e-12, t_end=1.6, outputs=[0.0, 1.6], solver="explicit")
    assert len(known.events) == 2
    assert there == [pytest.approx(known[one][-1], abs=1e-6) for one in ("bob.position.x", "rope.tension")]


@needs_a_compiler
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_finds_no_problem(fmi: int, tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    file = export_fmu(SCENES["driven-pendulum"](), tmp_path / "a.fmu", fmi=fmi).file
    assert validate_fmu(str(file)) == []
    found = fmpy.simulate_fmu(str(file), stop_time=1.0, output_interval=0.5, relative_tolerance=1e-9)
    known = simulate(SCENES["driven-pendulum"](), rtol=1e-12, t_end=1.0, outputs=[0.0, 1.0])
    assert found["rod.angle"][-1] == pytest.approx(known["rod.angle"][-1], abs=1e-7)


def test_the_command_writes_one(tmp_path: Path) -> None:
    from click.testing import CliRunner

    given = ["export", "simple-pendulum", "--fmu", str(tmp_path / "a.fmu"), "--fmi", "2", "--output", "rod.angle"]
    done = CliRunner().invoke(main, [*given, "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["kinds"] == ["model exchange", "co-simulation"]
