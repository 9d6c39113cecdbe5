"""Every part of the library passes the conformance test: no false alarm."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

import atwood as aw
import atwood_library

ROOT = Path(atwood_library.__file__).parent
TETRAHEDRON = Path(__file__).parents[1] / "model" / "tetrahedron.stl"


def library_components() -> list[type[aw.Component]]:
    modules = [
        importlib.import_module(found.name)
        for found in pkgutil.walk_packages([str(ROOT)], "atwood_library.")
        if not found.ispkg and ".interfaces." not in found.name
    ]
    return [
        value
        for module in modules
        for value in vars(module).values()
        if inspect.isclass(value)
        and issubclass(value, aw.Component)
        and not issubclass(value, (aw.Model, aw.ContactGroup))  # a group has no law of its own
        and value.__module__ == module.__name__
    ]


COMPONENTS = library_components()
RUN = ("Spring", "SlideGear", "Mass1D")
"""Those that are run on the test bench as well; the command does so with all."""


@pytest.mark.parametrize("cls", COMPONENTS, ids=lambda cls: cls.__name__)
def test_no_false_alarm(cls: type[aw.Component]) -> None:
    given = cls(file=str(TETRAHEDRON)) if cls.__name__ == "MeshBody" else cls
    report = aw.check(given, run=cls.__name__ in RUN)
    assert report.ok, report
    assert report.tests["laws"] > 0
    assert sum(report.tests.values()) >= 6
    assert all(one.test in ("reactions", "both forms") for one in report.notes), report
