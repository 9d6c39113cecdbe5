import contextlib
import copy
import json
import math
import sys

import pytest
from hypothesis import example, given, settings, strategies as st

import atwood as aw
from atwood.expr import Graph, evaluate, select
from atwood.model.declare.time_functions import StoredFunction, write_function
from atwood.model.local.flatten import flatten
from atwood_library.scenes import SCENES as LIBRARY_SCENES

from . import things
from .things import (
    Bar,
    Bob,
    Driven,
    Gauge,
    HeavyBob,
    Hook,
    Outer,
    Pendulum,
    Push,
    Row,
    RowScene,
    TwoPendulums,
    data_of,
    two_pendulums,
)


@pytest.fixture(autouse=True)
def _importable():
    """The classes of a test folder can be found by name only while it is known under that name."""
    before = sys.modules.get(things.__name__)
    sys.modules[things.__name__] = things
    yield
    if before is None:
        del sys.modules[things.__name__]


OWN = (things.__name__, __name__)
"""Modules whose classes may be used."""


def round_trip(scene: aw.Model) -> aw.Model:
    text = json.dumps(aw.to_data(scene), allow_nan=False)
    read = aw.from_data(json.loads(text), trust=OWN)
    assert json.dumps(aw.to_data(read), allow_nan=False) == text
    return read


def changed_class_scene() -> aw.Scene:
    scene = Outer(pair=[Pendulum(bob=HeavyBob()), Pendulum(length="30 cm")], t_end="1 min")
    scene.set("left.upper.bar.count", 2)
    scene.left.length = 0.9
    scene.pair[1].replace("bob", HeavyBob(mass=2.5))
    scene.replace("pair[0]", Pendulum(mass=6.0))
    extra = scene.add("extra", Driven(pull=lambda t: 3 * aw.sin(2 * t)))
    scene.left.add("row", Row(n=3))
    scene.set("left.row.bobs[1].mass", 0.5)
    scene.connect(extra.bob.point, scene.left.row.bobs[2].point)
    scene.left.connect(scene.left.row.bobs[0].point, scene.left.hook.frame)
    scene.start["left.upper.bar.angle"] = "12 deg"
    del scene.left.start["lower.bar.angle"]
    scene.left.guess["lower.bar.angle"] = 3
    return scene


def built_scene() -> aw.Scene:
    scene = RowScene(n=4)
    scene.set("row.bobs[2].mass", 3.0)
    scene.row.replace("bar1", Bar(length=4.0))
    scene.row.add("pushes", [Push(value=1.0), Push(value="2 kN")])
    scene.row.connect(scene.row.pushes[1].point, scene.row.bobs[3].point)
    scene.connect(scene.hook.frame, scene.row.bobs[0].point)
    return scene


def imperative_scene() -> aw.Scene:
    scene = two_pendulums()
    scene.space = "line"
    scene.add("bobs", [Bob(mass=i + 1.0) for i in range(3)])
    scene.connect(scene.bobs[2].point, scene.lower.bob.point)
    gauge, push = scene.add("gauge", Gauge()), scene.add("push", Push())
    scene.connect(gauge.output("value"), push.input("value"))
    scene.connect(gauge.point, push.point)
    inner = scene.add("inner", aw.Scene())
    inner.add("bar", Bar(length=1.0, direction=(0, 0, 1), kind="soft", limit="3 N"))
    inner.start["bar.angle"] = 1.0
    scene.add("row", Row(n=2)).n = 5
    return scene


def bound_scene() -> aw.Scene:
    scene = TwoPendulums()
    scene.add("bar", Bar(length=TwoPendulums.length * 2 - 0.1))
    scene.upper.add("bob2", Bob(mass=Pendulum.mass))
    scene.replace("lower", Pendulum(length=2 * TwoPendulums.length, mass=3.0))
    scene.start["bar.angle"] = -TwoPendulums.tilt
    return scene


SCENES = {
    "declared": TwoPendulums,
    "declared, with values": lambda: TwoPendulums(length="20 cm", gravity=0, space="line"),
    "nested": Outer,
    "changed": changed_class_scene,
    "built": built_scene,
    "imperative": imperative_scene,
    "bound": bound_scene,
    "a plain model": lambda: Pendulum(mass=3.0),
    "with an input": lambda: Driven(pull=lambda t: aw.select(t < 1, t, 2 - t)),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_reads_back_as_it_was(name):
    scene = SCENES[name]()
    read = round_trip(scene)
    assert type(read) is type(scene)
    assert data_of(read) == data_of(scene)


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_that_was_read_goes_on_like_the_first(name):
    scene = SCENES[name]()
    read = round_trip(scene)
    for one in (scene, read, scene_copy := scene.copy()):
        for field, value in (("n", 6), ("length", 2.0), ("tilt", 0.01), ("mass", 4.0)):
            if field in one.parameter_specs():
                one.set(field, value)
        if "row.n" in one or "row" in one:
            one.set("row.n", 7)
    assert data_of(read) == data_of(scene) == data_of(scene_copy)


def test_only_what_the_class_does_not_say_is_written():
    data = aw.to_data(TwoPendulums(tilt=0.2))
    assert data == {
        "format": "atwood scene",
        "version": 1,
        "scene": {"class": f"{things.__name__}:TwoPendulums", "values": {"tilt": 0.2}},
    }


def test_files(tmp_path):
    scene, file = changed_class_scene(), tmp_path / "scene.json"
    aw.save_scene(scene, file)
    assert data_of(aw.load_scene(str(file), trust=things.__name__)) == data_of(scene)
    scene.add("bad", Push(value=lambda t: aw.external(aw.ExternalFunction("wind", math.sin), t)))
    before = file.read_text()
    with pytest.raises(aw.ParameterError, match=r"bad\.value: .*cannot be stored"):
        aw.save_scene(scene, file)
    assert file.read_text() == before
    for content in ("{", "", '"text"', "[]", "3", '{"format": "something"}', '{"version": 1}', "\udcff"):
        file.write_bytes(content.encode("utf-8", "surrogateescape"))
        with pytest.raises(aw.UsageError):
            aw.load_scene(file)
    with pytest.raises(aw.UsageError, match="no such file"):
        aw.load_scene(tmp_path / "nothing.json")


def test_models_with_a_constructor_of_their_own():
    read = round_trip(WithConstructor(3))
    assert list(read.parts) == ["bob0", "bob1", "bob2"]


class WithConstructor(aw.Model):
    def __init__(self, count):
        super().__init__()
        for i in range(count):
            self.add(f"bob{i}", Bob(mass=float(i)))


class Namespace:
    class Inner(aw.Scene):
        bob: Bob = Bob()


def test_a_class_must_be_found_again_by_its_name():
    sys.modules.setdefault(__name__, sys.modules[WithConstructor.__module__])
    assert data_of(round_trip(Namespace.Inner())) == data_of(Namespace.Inner())

    class Local(aw.Scene):
        bob: Bob = Bob()

    with pytest.raises(aw.UsageError, match="outer level of a module"):
        aw.to_data(Local())
    with pytest.raises(aw.UsageError, match="scene cannot be"):
        aw.to_data(Bob())


# -- whose code is run ------------------------------------------------------------------------------------------------


@pytest.fixture
def stranger(tmp_path, monkeypatch):
    """Return a module that writes a file when it is imported, or one of its classes is made."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "stranger.py").write_text(
        "import atwood, pathlib\n"
        "pathlib.Path('ran').touch()\n"
        "class Own(atwood.Scene):\n"
        "    def build(self):\n"
        "        pathlib.Path('ran').touch()\n"
    )
    yield "stranger"
    sys.modules.pop("stranger", None)


@pytest.mark.parametrize("place", ["scene", "part", "list", "imported before"])
def test_a_module_is_imported_only_if_it_is_trusted(stranger, tmp_path, place):
    from pathlib import Path

    own = {"class": f"{stranger}:Own"}
    plain = {"class": "atwood:Scene", "changes": {"added": {"own": own if place != "list" else [own, own]}}}
    data = {"format": "atwood scene", "version": 1, "scene": own if place == "scene" else plain}
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(data))
    if place == "imported before":
        __import__(stranger)
        Path("ran").unlink()
    for read, written in ((aw.load_scene, file), (aw.from_data, data)):
        for trust in ((), ("stranger.inner", "strange", "anything")):
            with pytest.raises(aw.UsageError, match=r"'stranger:Own'.*not of an installed library.*trust='stranger'"):
                read(written, trust=trust)
            assert not Path("ran").exists()
            assert place == "imported before" or stranger not in sys.modules
    assert isinstance(aw.load_scene(file, trust=stranger), aw.Scene)
    assert Path("ran").exists()


@pytest.mark.parametrize("name", ["os:system", "subprocess:Popen", "atwood_library_:Rod", "", ".", "atwood.__main__:A"])
def test_modules_of_nobody_are_refused(name):
    before = set(sys.modules)
    with pytest.raises(aw.UsageError):
        aw.from_data({"format": "atwood scene", "version": 1, "scene": {"class": name}})
    assert not {one for one in set(sys.modules) - before if not one.startswith("importlib")}


def test_a_module_that_leaves_python_is_an_error(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "leaves_python.py").write_text("raise SystemExit(3)\n")
    with pytest.raises(aw.UsageError, match="SystemExit"):
        aw.from_data({"format": "atwood scene", "version": 1, "scene": {"class": "leaves_python:A"}}, "leaves_python")


# -- what is refused when read ----------------------------------------------------------------------------------------


def tampered(change) -> dict:
    data = copy.deepcopy(aw.to_data(changed_class_scene()))
    change(data)
    return data


def put(*path_and_value):
    *path, last, value = path_and_value

    def change(data):
        for step in path:
            data = data[step]
        data[last] = value

    return change


HERE = things.__name__
TAMPERED = {
    "version to come": (put("version", 2), aw.UsageError, "version 2 .* reads version 1"),
    "no version": (put("version", None), aw.UsageError, "version None"),
    "a truth value for a version": (put("version", True), aw.UsageError, "version True"),
    "another format": (put("format", "gltf"), aw.UsageError, "no scene of Atwood"),
    "no class": (put("scene", "class", 3), aw.UsageError, "does not name a class"),
    "no module": (put("scene", "class", "not_there_at_all:Scene"), aw.UsageError, "not_there_at_all.py"),
    "bad module name": (put("scene", "class", "..:Scene"), aw.UsageError, "cannot be imported"),
    "a script": (put("scene", "class", "__main__:NotThere"), aw.UsageError, "module of its own"),
    "no such class": (put("scene", "class", f"{HERE}:Outerr"), aw.UsageError, "Did you mean 'Outer'"),
    "no component": (put("scene", "class", "builtins:dict"), aw.UsageError, "is no component"),
    "a function": (put("scene", "class", f"{HERE}:two_pendulums"), aw.UsageError, "is no component"),
    "a leaf": (put("scene", {"class": f"{HERE}:Bob"}), aw.UsageError, "a Bob is no scene"),
    "a leaf with parts": (put("scene", {"class": f"{HERE}:Bob", "parts": {}}), aw.UsageError, "has no parts"),
    "no scene": (put("scene", None), aw.UsageError, "does not name a class"),
    "a list": (put("scene", []), aw.UsageError, "entries by name"),
    "unknown entry": (put("scene", "valus", {}), aw.UsageError, "Did you mean 'values'"),
    "unknown parameter": (put("scene", "values", "gravty", 1.0), aw.UsageError, "Did you mean 'gravity'"),
    "negative": (put("scene", "changes", "settings", "pair[1].bob", {"mass": -1.0}), aw.ParameterError, "mass"),
    "not finite": (put("scene", "values", "t_end", math.nan), aw.ParameterError, "finite"),
    "a word": (put("scene", "values", "space", "sphere"), aw.ParameterError, "sphere"),
    "odd value": (put("scene", "values", "gravity", {"lambda": 1}), aw.UsageError, "cannot be read"),
    "unknown part": (put("scene", "changes", "settings", "nobody", {"mass": 1.0}), aw.UsageError, "nobody"),
    "unknown replaced": (put("scene", "parts", "nobody", {"class": f"{HERE}:Bob"}), aw.UsageError, "no part 'nobody'"),
    "unlike part": (
        put("scene", "parts", "pair", 0, {"class": f"{HERE}:Bob"}),
        aw.DeclarationError,
        "no connector 'top'",
    ),
    "bad name": (put("scene", "changes", "added", "a b", {"class": f"{HERE}:Bob"}), aw.DeclarationError, "a b"),
    "one end": (put("scene", "changes", "connections", "", [["extra.bob.point"]]), aw.UsageError, "two ends"),
    "no end": (put("scene", "changes", "connections", "", [["a.b", "c.d"]]), aw.UsageError, "no connector"),
    "connections of a leaf": (
        put("scene", "changes", "connections", "extra.bob", [["point", "point"]]),
        aw.UsageError,
        "no parts",
    ),
    "start of nothing": (put("scene", "changes", "starts", "", {"begin": {}}), aw.UsageError, "begin"),
    "start of a leaf": (put("scene", "changes", "starts", "extra.bob", {"start": {}}), aw.UsageError, "no parts"),
    "bad start": (put("scene", "changes", "starts", "", {"start": {"x": [1]}}), aw.StartError, "x"),
    "unknown change": (put("scene", "changes", "removed", {}), aw.UsageError, "'removed'"),
    "bound to nothing known": (
        put("scene", "values", "gravity", {"bound": ["eval", "x"]}),
        aw.UsageError,
        "bound value",
    ),
    "bound to too little": (put("scene", "values", "gravity", {"bound": ["add", 1]}), aw.UsageError, "operands"),
}


@pytest.mark.parametrize("name", TAMPERED)
def test_tampered_data_are_refused(name):
    change, error, words = TAMPERED[name]
    with pytest.raises(error, match=words or None):
        aw.from_data(tampered(change), trust=(*OWN, "__main__", "builtins", "not_there_at_all", ".."))


SETTINGS = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=5) | st.sampled_from(["add", "t", "#0", "class"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["bound", "function", "start", "", "left"]), inner)
    ),
    max_leaves=6,
)


@settings(max_examples=300, deadline=None)
@given(
    st.sampled_from([
        ("scene", "values", "gravity"), ("scene", "values"), ("scene", "changes"), ("scene", "parts"), ("scene",),
        ("scene", "changes", "settings"), ("scene", "changes", "replaced"), ("scene", "changes", "added"),
        ("scene", "changes", "connections"), ("scene", "changes", "starts"), ("scene", "changes", "starts", "left"),
        ("scene", "changes", "added", "extra"), ("scene", "changes", "added", "extra", "values", "pull"),
    ]),
    SETTINGS,
)  # fmt: skip
@example(("scene", "values", "gravity"), {"bound": [[]]})
def test_whatever_is_written_there_the_answer_is_a_scene_or_an_error_of_ours(path, value):
    with contextlib.suppress(aw.AtwoodError):
        aw.from_data(tampered(put(*path, value)), trust=OWN)


# -- functions of time ------------------------------------------------------------------------------------------------

FUNCTIONS = {
    "constant": lambda t: 3.0,
    "time": lambda t: t,
    "line": lambda t: 1 + 2 * t,
    "wave": lambda t: aw.sin(2 * t) ** 2 + aw.cos(t) / (1 + t),
    "remainder": lambda t: t % 0.3 + aw.floor(t),
    "step": lambda t: aw.select((t > 1) & ~(t >= 2), t, -t),
    "either": lambda t: aw.select((t < 1) | (t <= 0.5), aw.exp(-t), aw.sqrt(t)),
    "bounds": lambda t: aw.maximum(aw.minimum(t, 1.5), 0.25) + aw.absolute(t - 1) + aw.sign(t - 1),
    "angles": lambda t: aw.atan2(t, 1 + t) + aw.atan(t) + aw.tanh(t) - aw.hypot(t, 2),
    "system": lambda t: aw.solve_linear([[2, t], [t, 3]], [1, t])[1],
    "shared": lambda t: doubled(t, 40),
}


def doubled(t, times):
    for _ in range(times):
        t = aw.sin(t) + aw.cos(t)
    return t


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_of_time_read_back_for_floats_and_expressions(name):
    function = FUNCTIONS[name]
    steps = json.loads(json.dumps(write_function(function, "x")))
    assert len(steps) < 200
    read = StoredFunction(steps)
    graph = Graph()
    t = graph.symbol("t")
    for value in (0.1, 0.7, 1.0, 1.3, 2.5):
        assert math.isclose(read(value), function(value), rel_tol=1e-14)
        assert math.isclose(evaluate([graph.convert(read(t))], {t: value})[0], function(value), rel_tol=1e-14)
    assert write_function(read, "x") == steps
    assert read == StoredFunction(steps)
    assert len({read, StoredFunction(steps)}) == 1
    assert str(steps[-1][0]) in repr(read)


@pytest.mark.parametrize(
    "steps",
    [
        [],
        None,
        "t",
        [[]],
        ["sin"],
        [["sin"]],
        [["sin", "t", "t"]],
        [["open", "t"]],
        [["__import__", "t"]],
        [["sin", "#0"]],
        [["sin", "#-1"]],
        [["sin", "x"]],
        [["sin", True]],
        [["sin", None]],
        [["sin", math.inf]],
        [["sin", ["t"]]],
        [[["sin"], "t"]],
        [["select", "t", "t"]],
        [["solve", 1, "t"]],
        [["solve", "t", "t", "t"]],
        [["component", 0, "t"]],
        [["solve", 1, 2.0, 3.0]],
        [["solve", 2, 1.0, 2.0, 2.0, 4.0, "t", "t"], ["component", 5, "#0"]],
        [["component", 0.5, "#0"]],
    ],
    ids=str,
)
def test_steps_that_make_no_sense_are_refused(steps):
    with pytest.raises(aw.ParameterError):
        StoredFunction(steps, "push.value")


def test_a_stored_function_is_stored_again():
    read = round_trip(Driven(pull=lambda t: select(t > 0, 1.0, 0.0)))
    again = round_trip(read)
    assert flatten(again).parts["push"].signals["value"] == read.pull
    assert read.pull(1.0) == 1.0


def test_hook_has_nothing_to_say():
    scene = aw.Scene()
    scene.add("hook", Hook())
    assert aw.to_data(scene)["scene"]["changes"]["added"] == {"hook": {"class": f"{HERE}:Hook"}}


# -- any scene --------------------------------------------------------------------------------------------------------

CHANGES = {
    "count": lambda s, k: s.set("row.n", k + 1),
    "count around": lambda s, k: s.set("n", k + 1),
    "mass": lambda s, k: s.set(f"row.bobs[{k}].mass", float(k)),
    "bar": lambda s, k: s.set(f"row.bar{k}.length", f"{k + 1} cm"),
    "pitch": lambda s, k: s.set("row.pitch", k + 1.0),
    "replaced": lambda s, k: s.row.replace(f"bobs[{k}]", HeavyBob(mass=10.0 + k)),
    "row replaced": lambda s, k: s.replace("row", Row(n=k + 1)),
    "added": lambda s, k: s.add(f"extra{k}", Pendulum(length=k + 1.0)),
    "changed extra": lambda s, k: s.set(f"extra{k}.bar.count", k),
    "added within": lambda s, k: s.row.add(f"push{k}", Push(value=float(k))),
    "an input": lambda s, k: s.set(f"row.push{k}.value", lambda t: k * t),
    "row added": lambda s, k: s.add(f"row{k}", Row(n=RowScene.n, pitch=k + 1.0)),
    "row changed": lambda s, k: s.set(f"row{k}.bobs[0].mass", 5.0),
    "row replaced, bound": lambda s, k: s.replace("row", Row(n=RowScene.n, pitch=k + 1.0)),
    "rows added": lambda s, k: s.add(f"rows{k}", [Row(n=RowScene.n), Row(n=k + 1)]),
    "rows changed": lambda s, k: s.set(f"rows{k}[0].bobs[0].mass", 6.0),
    "joined": lambda s, k: s.connect(s.hook.frame, s.row.bobs[k].point),
    "joined within": lambda s, k: s.row.connect(s.row[f"push{k}"].point, s.row.bobs[k].point),
    "start": lambda s, k: s.start.update({f"row.bobs[{k}].position.x": f"{k} cm"}),
    "start gone": lambda s, k: s.start.clear(),
}


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(sorted(CHANGES)), st.integers(0, 4)), max_size=12))
def test_whatever_was_changed_a_scene_reads_back_and_copies(steps):
    scene = RowScene()
    for name, k in steps:
        before = data_of(scene)
        try:
            CHANGES[name](scene, k)
        except (aw.AtwoodError, IndexError):
            assert data_of(scene) == before
    assert data_of(round_trip(scene)) == data_of(scene.copy()) == data_of(scene)
    assert all(scene[path].path == path for path in flatten(scene).parts)


@pytest.mark.parametrize("name", LIBRARY_SCENES)
def test_scenes_of_the_library_read_back(name):
    scene = LIBRARY_SCENES[name]()
    assert data_of(round_trip(scene)) == data_of(scene)
    assert data_of(scene.copy()) == data_of(scene)
