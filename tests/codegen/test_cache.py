import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from atwood import expr as ex
from atwood.codegen import cache as disk, compile_native
from atwood.codegen.llvm.own import own_functions


def small(name="demo"):
    graph = ex.Graph()
    x, p = graph.symbol("x"), graph.symbol("p")
    return ex.Program(
        name, (ex.InputGroup("x", (x,)),), (p,), (ex.OutputGroup("out", (ex.sin(x) * ex.sqrt(p), x + ex.cos(p))),)
    )


@pytest.fixture
def directory(tmp_path, monkeypatch):
    own_functions()  # an entry of its own in another place
    monkeypatch.setenv("ATWOOD_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.delenv("ATWOOD_CACHE", raising=False)
    return tmp_path / "kernels"


def entries(directory):
    return sorted(directory.glob("*"))


def check(compiled):
    [found] = compiled.bind([2.0])([0.5])
    np.testing.assert_allclose(found, [np.sin(0.5) * np.sqrt(2.0), 0.5 + np.cos(2.0)], rtol=1e-15)


def test_the_second_compilation_comes_from_the_cache(directory):
    first = compile_native(small())
    assert not first.from_cache
    assert len(entries(directory)) == 1
    second = compile_native(small())
    assert second.from_cache
    check(first)
    check(second)
    assert not compile_native(small("another")).from_cache
    assert not compile_native(small(), cache=False).from_cache


def _truncate(data):
    return data[: len(data) // 2]


def _flip(data):
    return data[:-9] + bytes([data[-9] ^ 1]) + data[-8:]


def _of_another_version(data):
    return b"atwood cache 0\n" + data[len(b"atwood cache 1\n") :]


@pytest.mark.parametrize(
    "damage",
    [lambda d: b"", _truncate, _flip, _of_another_version, lambda d: b"something else", lambda d: d + b"\0"],
)
def test_a_damaged_entry_is_ignored_and_rebuilt(directory, damage):
    compile_native(small())
    [path] = entries(directory)
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    rebuilt = compile_native(small())
    assert not rebuilt.from_cache
    check(rebuilt)
    assert len(path.read_bytes()) == len(whole)
    assert compile_native(small()).from_cache


def test_an_entry_under_a_foreign_name_is_ignored(directory):
    compile_native(small())
    [first] = entries(directory)
    compile_native(small("another"))
    [second] = set(entries(directory)) - {first}
    second.write_bytes(first.read_bytes())
    assert not compile_native(small("another")).from_cache


def test_whole_entries_that_hold_no_code_are_rebuilt(directory):
    compile_native(small())
    [path] = entries(directory)
    for content in (b"", b"{}\n", b'{"scratch": 0, "library": []}\nno code', b'{"scratch": 0, "library": ["none"]}\n'):
        assert disk.Cache(directory).write(path.stem, content)
        rebuilt = compile_native(small())
        assert not rebuilt.from_cache
        check(rebuilt)


@pytest.mark.parametrize("value", ["0", "off", " False "])
def test_the_cache_can_be_switched_off(directory, monkeypatch, value):
    monkeypatch.setenv("ATWOOD_CACHE", value)
    check(compile_native(small()))
    assert not directory.exists()


def test_a_directory_that_cannot_be_written_is_no_error(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ATWOOD_CACHE_DIR", str(tmp_path / "file" / "kernels"))
    for _ in range(2):
        compiled = compile_native(small())
        assert not compiled.from_cache
        check(compiled)


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    store = disk.Cache(tmp_path, limit=1000)
    for position, key in enumerate(("a", "b", "c")):
        assert store.write(key, bytes(250))
        os.utime(tmp_path / f"{key}.kernel", (position, position))
    assert store.read("a") == bytes(250)
    (tmp_path / "note.txt").write_text("not an entry")
    store.write("00d", bytes(250))
    assert [store.read(key) is not None for key in ("a", "b", "c", "00d")] == [True, False, True, True]
    assert (tmp_path / "note.txt").exists()


def test_room_is_not_made_at_every_entry(tmp_path, monkeypatch):
    """To look at all entries takes longer than to write one, where there are many."""
    looked = []
    scandir = os.scandir
    monkeypatch.setattr(disk.os, "scandir", lambda path: looked.append(path) or scandir(path))
    store = disk.Cache(tmp_path, limit=20_000)
    keys = [disk.make_key([i]) for i in range(1280)]
    for key in keys:
        assert store.write(key, bytes(250))
    after = [k for k, key in enumerate(keys) if key[:2] in ("00", "40", "80", "c0")]
    assert 10 < len(looked) == len(after) < 40
    entry = (tmp_path / f"{keys[-1]}.kernel").stat().st_size
    later = (len(keys) - 1 - after[-1]) * entry
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 20_000 + later


def test_the_place_follows_the_system(monkeypatch):
    monkeypatch.delenv("ATWOOD_CACHE_DIR", raising=False)
    home = Path.home()
    monkeypatch.setattr(disk.sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", os.path.abspath("cached"))
    assert disk.cache_directory() == Path("cached").absolute() / "atwood"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert disk.cache_directory() == home / ".cache" / "atwood"
    monkeypatch.setattr(disk.sys, "platform", "darwin")
    assert disk.cache_directory() == home / "Library" / "Caches" / "atwood"
    monkeypatch.setattr(disk.sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", "local")
    assert disk.cache_directory() == Path("local") / "atwood" / "Cache"


_WRITER = """
import sys
from atwood.codegen.cache import Cache
store = Cache(__import__("pathlib").Path(sys.argv[1]))
content = bytes([int(sys.argv[2])]) * 200_000
for _ in range(100):
    assert store.write("shared", content)
    found = store.read("shared")
    assert found is not None and len(found) == 200_000 and len(set(found)) == 1
"""


def test_processes_that_write_at_once_leave_whole_entries(tmp_path):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, sys.path))}
    command = [sys.executable, "-c", _WRITER, str(tmp_path)]
    running = [subprocess.Popen([*command, str(number)], env=environment) for number in (1, 2, 3)]
    assert [process.wait() for process in running] == [0, 0, 0]
    assert [path.name for path in tmp_path.iterdir()] == ["shared.kernel"]


def test_importing_kernels_imports_no_llvm():
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, sys.path))}
    code = "import sys, atwood.codegen; assert not any(name.startswith('llvmlite') for name in sys.modules)"
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
