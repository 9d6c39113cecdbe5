"""Runs of scenes in other units of mass, length and time: powers of two, so that all steps have the same bits.

Whatever compares quantities of different units, or has a smallest time or length of its own, takes other steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from tests.contact_table import rows
from tests.contact_table.views import VIEWS

from atwood import Component, Scene, assemble, simulate
from atwood.model.values.units import parse_unit
from atwood_library.scenes import SCENES

Power = Callable[[str], float]
"""By what values of a unit are multiplied."""

UNITS = [(1.0, 1.0, 2.0**10), (2.0**10, 2.0**-10, 2.0**-10), (2.0**-20, 2.0**20, 1.0)]
"""Units of mass, length and time: of time alone, with which gravity and stiffnesses change, and of all."""

CONTACTS = ["ball", "spring", "belt", "rolling", "ladder", "bead", "housner", "cradle", "circle", "painleve"]

SMOOTH = [
    *("double-pendulum", "four-bar", "driven-pendulum", "heavy-top", "rolling-ball", "swinging-atwood", "car-axis"),
    *("chaplygin-sleigh", "trebuchet", "mass-spring-chain", "elastic-pendulum", "furuta-pendulum"),
]


def _changed(part: Component, power: Power, skipped: tuple[str, ...] = ()) -> dict[str, object]:
    """Return the parameters of a part that are numbers and have a unit, in other units."""
    found: dict[str, object] = {}
    for name, spec in part.parameter_specs().items():
        value, by = getattr(part, name), power(spec.unit.text)
        if by != 1.0 and value is not None and name not in skipped:
            found[name] = tuple(by * one for one in value) if isinstance(value, tuple) else by * value
    return found


def in_units(name: str, mass: float, length: float, time: float) -> Scene:
    """Return a scene of the library in which all that has a unit is another number."""

    def power(unit: str) -> float:
        masses, lengths, times, _ = parse_unit(unit).exponents
        return mass**masses * length**lengths * time**times

    kind = SCENES[name]
    usual = kind()
    assembly = assemble(usual)
    observables = assembly.start_observables
    scene = kind(**_changed(usual, power, ("gravity", "t_start", "t_end")))
    for path, part in usual.parts.items():
        for one, value in _changed(part, power).items():
            if getattr(scene[path], one) != value:  # some follow from parameters of the scene
                setattr(scene[path], one, value)
    scene.gravity, scene.t_end = usual.gravity * length / time**2, usual.t_end * time
    for given, values in ((scene.start, assembly.flat.start), (scene.guess, assembly.flat.guess)):
        given.update({path: power(observables[path].unit) * value for path, value in values.items()})
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", SMOOTH)
def test_steps_do_not_depend_on_units(name: str, form: str) -> None:
    usual = simulate(in_units(name, 1.0, 1.0, 1.0), form=form, solver="explicit", outputs=2, rtol=1e-8)
    for units in UNITS:
        other = simulate(in_units(name, *units), form=form, solver="explicit", outputs=2, rtol=1e-8)
        counts = usual.statistics, other.statistics
        assert counts[0].steps == counts[1].steps
        assert counts[0].residual_evaluations == counts[1].residual_evaluations


@pytest.mark.parametrize("level", ["ggl", "index1"])
@pytest.mark.parametrize("name", ["heavy-top", "four-bar", "slider-crank", "gyroscope", "spatial-slider-crank"])
def test_steps_of_ida_do_not_depend_on_units(name: str, level: str) -> None:
    counts = []
    for units in ((1.0, 1.0, 1.0), *UNITS, (2.0**20, 2.0**-20, 2.0**-20)):
        scene = in_units(name, *units)
        done = simulate(scene, form="dae", level=level, solver="ida", outputs=2, t_end=0.1 * scene.t_end).statistics
        counts.append((done.steps, done.residual_evaluations))
    assert counts[1:] == counts[:1] * 4


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("row", CONTACTS)
def test_steps_between_contacts_do_not_depend_on_the_size(row: str, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    counts: list[int] = []

    def run(*given: object, **options: object) -> object:
        result = simulate(*given, **options)
        counts.append(result.statistics.steps)
        return result

    monkeypatch.setattr(rows, "simulate", run)
    found = [rows.ROWS[row].check(replace(VIEWS["as it is"], size=size), form) for size in (1.0, 2.0**-10, 2.0**10)]
    assert found[0] == found[1] == found[2]
    assert counts[: len(counts) // 3] * 3 == counts
