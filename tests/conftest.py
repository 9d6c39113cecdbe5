"""Which variants of a test the everyday suite runs: a fixed sample where a test says so, every one with `--all`."""

from __future__ import annotations

import atexit
import gc
import hashlib
import os
import shutil
import sys
import tempfile
from collections import defaultdict

import pytest

# Workers share the cores already. Threads of BLAS that wait for each other make small stacked solves many times slower.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# Where no compiled modules may be written beside the sources, each process that a test starts would compile them all.
# They share a folder of them for as long as the tests run; workers of xdist have it from the process that starts them.
if os.environ.pop("PYTHONDONTWRITEBYTECODE", "") and "PYTHONPYCACHEPREFIX" not in os.environ:
    os.environ["PYTHONPYCACHEPREFIX"] = _compiled = tempfile.mkdtemp(prefix="atwood-modules-")
    atexit.register(shutil.rmtree, _compiled, ignore_errors=True)

# Expressions of all scenes so far are there: to look through them again and again for something to free takes time.
gc.set_threshold(100_000, 20, 100)


@pytest.fixture(autouse=True)
def _no_structures() -> None:
    """Let no test find equations that another one has left; `tests/forms/test_same_structure.py` is about these."""
    if reassembly := sys.modules.get("atwood.forms.reassembly"):
        reassembly.STRUCTURES.clear()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--all", action="store_true", help="run every variant of tests that are marked with sample")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "sample(count): of the variants of this test the everyday suite runs so many; --all runs every one",
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep a sample of the variants of each test, unless all are wanted or one was asked for by name.

    Of a test over several parameters each value of each one stays, with some of the others; a mark says of how many
    variants a sample is.
    """
    if config.getoption("--all") or any("::" in argument for argument in config.args):
        return
    variants: defaultdict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        variants[item.nodeid.partition("[")[0]].append(item)
    left_out: set[pytest.Item] = set()
    for found in variants.values():
        mark = found[0].get_closest_marker("sample")
        if mark is not None or len(found) > 1:
            ordered, needed = _spread(found)
            left_out.update(ordered[needed if mark is None else mark.args[0] :])
    if left_out:
        config.hook.pytest_deselected(items=[item for item in items if item in left_out])
        items[:] = [item for item in items if item not in left_out]


def _spread(items: list[pytest.Item]) -> tuple[list[pytest.Item], int]:
    """Return variants in the order in which they say most that is new, and how many have each value of each parameter.

    Among equals the order of hashes decides: it is the same in every process.
    """
    left = sorted(items, key=lambda item: hashlib.sha256(item.nodeid.encode()).digest())
    values = {item: _values(item) for item in items}
    seen: set[tuple[int, ...]] = set()
    ordered: list[pytest.Item] = []
    needed = 0
    while left:
        best = max(left, key=lambda item: len(values[item] - seen))
        if values[best] <= seen:
            needed = needed or len(ordered)
            break
        left.remove(best)
        ordered.append(best)
        seen |= values[best]
    return [*ordered, *left], len(ordered)


def _values(item: pytest.Item) -> set[tuple[int, ...]]:
    """Return what a variant is one of: what is said together counts as one value."""
    params = dict(item.callspec.params) if hasattr(item, "callspec") else {}
    said = [mark.kwargs.get("argnames") or mark.args[0] for mark in item.iter_markers("parametrize")]
    together = [one.replace(",", " ").split() if isinstance(one, str) else one for one in said]
    groups = [(number, [params.pop(name) for name in names if name in params]) for number, names in enumerate(together)]
    groups += [(number, [one]) for number, one in enumerate(params.values(), len(groups))]
    return {(number, *map(id, made)) for number, made in groups}
