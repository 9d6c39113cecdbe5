"""Which variants of a test the everyday suite runs: a fixed sample where a test says so, every one with `--all`."""

from __future__ import annotations

import atexit
import gc
import hashlib
import os
import shutil
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


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--all", action="store_true", help="run every variant of tests that are marked with sample")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "sample(count): of the variants of this test the everyday suite runs so many; --all runs every one",
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep a sample of the variants of each test with the mark, unless all are wanted or one was asked for by name.

    The order of hashes decides: it picks from all parameters of a test alike, and is the same in every process.
    """
    if config.getoption("--all") or any("::" in argument for argument in config.args):
        return
    variants: defaultdict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        if item.get_closest_marker("sample"):
            variants[item.nodeid.partition("[")[0]].append(item)
    left_out: set[pytest.Item] = set()
    for found in variants.values():
        mark = found[0].get_closest_marker("sample")
        assert mark is not None
        ordered = sorted(found, key=lambda item: hashlib.sha256(item.nodeid.encode()).digest())
        left_out.update(ordered[mark.args[0] :])
    if left_out:
        config.hook.pytest_deselected(items=[item for item in items if item in left_out])
        items[:] = [item for item in items if item not in left_out]
