"""What a run that was made before loads: a budget of modules, since each is time before the first result."""

import os
import subprocess
import sys

import pytest

BUDGET = 244
"""So many modules beside those of Python and NumPy may be loaded; the run below needs all of them."""

HEAVY = ("rich", "sympy", "networkx", "matplotlib", "scipy", "sksundae", "numpy.ma", "numpy.polynomial")
HEAVY += ("numpy.random", "subprocess")


def loaded(code: str, cache: str) -> set[str]:
    """Return the modules that a process loads."""
    return set(printed(code, cache)[-1].split()[1:])


def printed(code: str, cache: str) -> list[str]:
    """Return the lines that a process prints, and the modules that it loads as the last."""
    environment = {**os.environ, "ATWOOD_CACHE_DIR": cache}
    environment.pop("FORCE_COLOR", None)
    code = f"import sys\n{code}\nprint('loaded:', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    return done.stdout.splitlines()


RUN = """
from atwood.cli import main
from atwood import lazy_dataclasses as lazy
write, written = lazy._constructor, []
lazy._constructor = lambda cls, *given: written.append(cls.__qualname__) or write(cls, *given)
main(["run", "double-pendulum", "--t-end", "1"], standalone_mode=False)
print("written:", *written)
"""


def test_a_run_that_was_made_before_loads_what_it_needs(tmp_path) -> None:
    cache = str(tmp_path)
    loaded(RUN, cache)
    *_, written, names = printed(RUN, cache)
    warm = set(names.split()[1:])
    own = {name for name in warm if name.split(".")[0] in ("atwood", "atwood_library")}
    assert len(own) <= BUDGET, sorted(own)
    assert not [name for name in warm if name in HEAVY]
    for generator in ("atwood.reporting", "atwood.theory", "atwood.expr.sympy_bridge"):
        assert generator not in warm
    assert len(written.split()) - 1 <= 20, f"constructors of classes with few instances: {written}"


def test_the_last_look_for_garbage_finds_nothing_to_look_through(tmp_path) -> None:
    """What is frozen is not traversed when the process ends."""
    code = "import atexit, gc\natexit.register(lambda: print('frozen:', gc.get_freeze_count()))\nimport atwood.cli"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(done.stdout.split()[-1]) > 1000


@pytest.mark.parametrize(
    ("code", "most"), [("import atwood", 60), ("from atwood_library.scenes import DoublePendulum", 75)]
)
def test_to_declare_a_scene_loads_neither_mechanics_nor_solvers(code, most, tmp_path) -> None:
    found = loaded(code, str(tmp_path))
    own = {name for name in found if name.split(".")[0] in ("atwood", "atwood_library")}
    assert len(own) <= most, sorted(own)
    rooms = {name.split(".")[1] for name in own if name.startswith("atwood.")}
    assert not rooms & {"mechanics", "topology", "forms", "simulation", "integrators", "codegen", "result", "pipeline"}
    assert not [name for name in found if name in (*HEAVY, "llvmlite", "click")]
