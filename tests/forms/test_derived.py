"""Derivations that are kept on disk: what their names say, and that what they give is what would be derived."""

import gc
import os
import shutil
import subprocess
import sys
import weakref
from itertools import count
from pathlib import Path

import pytest

import atwood
from atwood import (
    Component,
    ExternalFunction,
    Point,
    Scene,
    assemble,
    connect,
    connector,
    external,
    parameter,
    potential,
    simulate,
)
from atwood.codegen.cache import Cache
from atwood.errors import UnsupportedError
from atwood.forms import accelerations, caches
from atwood.forms.accelerations import acceleration_program
from atwood.forms.caches import SOURCES, derivation_key, hash_of_sources
from atwood_library import PointMass
from atwood_library.scenes import SCENES

PACKAGE = Path(atwood.__file__).parent


@pytest.fixture
def own_cache(monkeypatch, tmp_path):
    monkeypatch.setattr(caches, "default_cache", lambda: Cache(tmp_path))
    return Cache(tmp_path)


def kept(cache):
    return len(list(cache.directory.glob("*.kernel")))


@pytest.mark.parametrize(
    "name", ["double-pendulum", "pendulum-on-cart", "chain", "heavy-top", "four-bar", "rolling-disc"]
)
def test_a_kept_derivation_leaves_the_graph_as_if_it_had_been_derived(own_cache, name):
    def made():
        assembly = assemble(SCENES[name]())
        rows, found = assembly.rows, acceleration_program(assembly)
        what = [row.index for row in rows], found and (found.program.digest, found.method)
        return assembly.reduced.graph, what

    first, expected = made()
    entries = kept(own_cache)
    assert entries
    second, found = made()
    assert kept(own_cache) == entries
    assert found == expected
    assert second.recorded(0) == first.recorded(0)
    for node, twin in zip(first.nodes, second.nodes, strict=True):  # and they are found again
        if node.operation not in ("constant", "symbol"):
            assert second.find(twin.operation, twin.arguments, twin.payload) is twin


def test_what_is_kept_is_read_and_not_derived(own_cache, monkeypatch):
    simulate(SCENES["double-pendulum"](), t_end=0.1)
    monkeypatch.setattr(accelerations, "_cheapest", None)
    result = simulate(SCENES["double-pendulum"](), t_end=0.1)
    assert result.status == "finished"


def test_a_damaged_entry_is_derived_anew(own_cache):
    acceleration_program(assemble(SCENES["double-pendulum"]()))
    for file in own_cache.directory.glob("*.kernel"):
        file.write_bytes(file.read_bytes()[:-3])
    assert acceleration_program(assemble(SCENES["double-pendulum"]())) is not None


def key(scene, what="rows"):
    equations = assemble(scene).reduced
    return derivation_key(what, equations.graph, tuple(equations.rows))


SLOPE = ExternalFunction("slope", lambda x: 3.0 * x * x)
CUBE = ExternalFunction("cube", lambda x: x**3, (SLOPE,))


def spring(law):
    """A mass on a line, held by a spring whose law is given as it would stand in a file."""

    class Own(Component):
        stiffness = parameter(2.0, doc="A constant.")
        a = connector(Point, "Where it pulls.")

        @potential
        def energy(self):
            return eval(law, {"x": self.a.position.x, "k": self.stiffness, "cube": CUBE, "external": external})

    class Held(Scene):
        space = "line"
        mass, spring = PointMass(mass=2.0), Own()
        connections = [connect(mass.point, spring.a)]
        start = {"mass.position.x": 0.1}

    return Held()


def test_the_key_changes_with_the_law_the_scene_and_what_is_asked():
    scene = SCENES["double-pendulum"]
    assert key(scene()) == key(scene())
    assert key(scene()) == key(scene(mass1=3.0))  # a value is an argument of what is derived
    assert key(scene()) != key(scene(), "accelerations")
    assert key(scene()) != key(SCENES["simple-pendulum"]())
    laws = ["0.5 * k * x**2", "0.7 * k * x**2", "0.5 * k * x**3", "0.5 * k * k * x**2"]
    assert len({key(spring(law)) for law in laws}) == len(laws)


def test_a_law_that_calls_python_is_not_kept():
    assert key(spring("0.5 * k * x**2")) is not None
    assert key(spring("k * external(cube, x)")) is None


def test_a_changed_byte_in_any_source_changes_the_key(tmp_path):
    for room in SOURCES:
        shutil.copytree(PACKAGE / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    whole = hash_of_sources.__wrapped__
    seen = {whole(tmp_path)}
    assert seen == {whole(PACKAGE)}
    files = [file for room in SOURCES for file in sorted((tmp_path / room).rglob("*.py"))]
    for file in files:
        data = file.read_bytes()
        file.write_bytes(data[:-1] + b" ")
        seen.add(whole(tmp_path))
        file.write_bytes(data)
    assert len(seen) == 1 + len(files)
    files[0].rename(files[0].with_name("renamed.py"))
    assert whole(tmp_path) not in seen
    shutil.rmtree(tmp_path / SOURCES[0])
    with pytest.raises(UnsupportedError, match="cannot be read"):
        whole(tmp_path)


@pytest.mark.parametrize("name", ["double-pendulum", "heavy-top", "rolling-disc", "chain"])
def test_what_derives_is_in_the_sources_that_the_key_covers(name, monkeypatch):
    assembly, ran = assemble(SCENES[name]()), set()

    def watched(what, graph, read, derive):
        def note(frame, event, _):
            ran.add(frame.f_code.co_filename)

        sys.setprofile(note)
        try:
            return derive()
        finally:
            sys.setprofile(None)

    monkeypatch.setattr(accelerations, "derive_once", watched)
    monkeypatch.setattr("atwood.forms.caches.derive_once", watched)
    _ = assembly.reduced, assembly.maximal, assembly.parameters
    acceleration_program(assembly)
    files = {Path(file) for file in ran if str(PACKAGE) in file}
    rooms = {file.relative_to(PACKAGE).parts[0] for file in files}
    assert rooms - {"clock.py", "lazy_dataclasses.py", "arrays.py", "stages.py"} <= set(SOURCES), rooms


@pytest.mark.parametrize("name", ["double-pendulum", "double-pendulum-3d", "rolling-ball"])
def test_other_processes_find_the_same_entries(name, tmp_path):
    code = (
        "from atwood.forms import caches; from atwood import assemble, simulate;"
        "from atwood_library.scenes import SCENES; make = caches.derivation_key;"
        "caches.derivation_key = lambda *a: print(make(*a)) or make(*a);"
        f"simulate(SCENES['{name}'](), t_end=0.01)"
    )
    outputs = set()
    for seed in ("1", "2"):
        # Of a derivation within another nothing is asked where that is kept already.
        environment = {**os.environ, "PYTHONHASHSEED": seed, "ATWOOD_CACHE_DIR": str(tmp_path / seed)}
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
        outputs.add(done.stdout)
    assert len(outputs) == 1
    assert all(len(line) == 64 for line in outputs.pop().split())


def test_the_key_changes_with_versions_and_code(monkeypatch):
    scene = SCENES["double-pendulum"]
    before = key(scene())
    for place, value in (("sys.version", "3.99"), ("sys.platform", "plan9")):
        with monkeypatch.context() as patch:
            patch.setattr(f"atwood.forms.caches.{place}", value)
            assert key(scene()) != before
    with monkeypatch.context() as patch:
        patch.setattr("atwood.forms.caches.platform.machine", lambda: "vax")
        assert key(scene()) != before
    with monkeypatch.context() as patch:
        patch.setattr(caches, "hash_of_sources", lambda: "other")
        assert key(scene()) != before
    assert key(scene()) == before


@pytest.mark.parametrize("enabled", [True, False])
def test_collecting_of_cycles_is_as_it_was_after_deriving(enabled):
    key, seen = caches.Key("a test"), []

    def fail():
        seen.append(gc.isenabled())
        raise UnsupportedError("what is derived fails")

    before = gc.isenabled()
    try:
        gc.enable() if enabled else gc.disable()
        for _ in range(2):
            with pytest.raises(UnsupportedError):
                caches.Shared().get(key, lambda: caches.Shared().get(key, fail))
            assert gc.isenabled() == enabled
    finally:
        gc.enable() if before else gc.disable()
    assert seen == [False, False]


class Ring:
    """What refers to itself."""

    def __init__(self):
        self.itself = self


def test_what_was_derived_counts_as_old_and_cycles_in_it_still_go(monkeypatch):
    monkeypatch.setattr(caches, "_MUCH", 100)
    monkeypatch.setattr(caches, "_AGED", count(1))  # else what came before tells
    before, seen = gc.isenabled(), []
    gc.enable()
    gc.callbacks.append(lambda phase, about: seen.append(about["generation"]))
    try:
        with caches.without_collection():
            gone = weakref.ref(Ring())
            made = [Ring() for _ in range(2 * gc.get_threshold()[0])]
        made.append(Ring())
        assert not seen
        gc.collect()
        assert gone() is None
    finally:
        gc.callbacks.pop()
        gc.enable() if before else gc.disable()


@pytest.mark.parametrize("much", [20, 20_000])
def test_cycles_of_who_derives_again_and_again_go(monkeypatch, much):
    """Counts of the collector that are taken back to zero each time never come to a collection."""
    monkeypatch.setattr(caches, "_MUCH", much)
    before, thresholds, rings = gc.isenabled(), gc.get_threshold(), []
    gc.enable()
    gc.set_threshold(700, 10, 10)
    try:
        for _ in range(2_000):
            rings.append(weakref.ref(Ring()))
            with caches.without_collection():
                pass
    finally:
        gc.set_threshold(*thresholds)
        gc.enable() if before else gc.disable()
    assert sum(one() is not None for one in rings) < len(rings) / 2
