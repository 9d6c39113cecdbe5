"""Claims of conservation where laws act far away, narrowly, briefly, or after a run; and at poles of angles."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from atwood import Scene, conserved, exp, reduced, select, simulate
from atwood.errors import StartError, UnsupportedError
from atwood_library import PointMass, Potential
from atwood_library.scenes import LagrangeTop


def particle(energy: Callable[..., Any]) -> Scene:
    scene = Scene(space="space", gravity=0.0, t_end=5.0)
    field, body = scene.add("field", Potential()), scene.add("body", PointMass(mass=1.0))
    scene.connect(field.point, body.point)
    scene.set("field.energy_function", energy)
    for axis, place in zip("xyz", (0.3, 0.2, 0.1), strict=True):
        scene.start[f"body.position.{axis}"], scene.start[f"body.velocity.{axis}"] = place, 0.0
    return scene


ACROSS = {"p:body.position.y", "p:body.position.z", "K.y", "K.z", "L.x"}

LAWS: dict[str, tuple[Callable[..., Any], set[str]]] = {
    "a push long after the run": (lambda x, y, z, t: x * exp(-((t - 20.0) ** 2)), ACROSS),
    "a tap at five hours": (lambda x, y, z, t: x * exp(-(((t - 2e4) / 0.01) ** 2)), ACROSS),
    "a rational push": (lambda x, y, z, t: 1e-3 * x / (1.0 + ((t - 300.0) / 0.01) ** 2), ACROSS),
    "a far hill": (lambda x, y, z: exp(-((x - 200.0) ** 2)), {"h", *ACROSS}),
    "a narrow hill": (lambda x, y, z: exp(-(((x - 2.0) / 0.01) ** 2)), {"h", *ACROSS}),
    "a narrow rational hill": (lambda x, y, z: 1e-3 / (1.0 + ((x - 300.0) / 0.01) ** 2), {"h", *ACROSS}),
    "a narrow post": (
        lambda x, y, z: 1e-3 / (1.0 + ((x - 300.0) / 0.01) ** 2 + ((y + 40.0) / 0.01) ** 2),
        {"h", "p:body.position.z", "K.z", "L.z"},
    ),
    "a band": (lambda x, y, z: select((x > 100.0) & (x < 100.1), x, 0.0), {"h", *ACROSS}),
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", LAWS)
def test_what_a_law_breaks_is_not_claimed_wherever_and_whenever_it_acts(name: str) -> None:
    law, expected = LAWS[name]
    assert set(conserved(particle(law)).names) == expected


def test_what_is_claimed_stays_along_a_run_through_the_push() -> None:
    scene = particle(LAWS["a push long after the run"][0])
    run = simulate(scene, t_end=40.0, rtol=1e-11, max_step=0.5, monitor=conserved(scene))
    assert abs(run["body.velocity.x"][-1] + math.sqrt(math.pi)) < 1e-6  # the momentum along x does not
    ledger = run.conserved
    for name in ACROSS:
        values = ledger[name].values
        assert abs(values - values[0]).max() < 1e-12


@pytest.mark.sample(2)
@pytest.mark.parametrize("inclination", [0.0, 1e-14, 1e-6, 1e-3, math.pi])
def test_a_top_keeps_three_in_euler_angles_wherever_it_starts(inclination: float) -> None:
    found = conserved(LagrangeTop(inclination=inclination), orientation="euler-zxz")
    assert found.names == ("h", "p:top.euler.phi", "p:top.euler.psi")
    if inclination in (0.0, math.pi):
        with pytest.raises((StartError, UnsupportedError), match=r"it starts where its coordinates .*are singular"):
            reduced(LagrangeTop(inclination=inclination))


def test_there_are_three_lists() -> None:
    found = conserved(particle(LAWS["a band"][0]))
    assert {*found.proven, *found.checked} == {*found}
    assert all(one.proven for one in found.proven)
    assert not any(one.proven for one in found.checked)
    data = found.to_dict()
    assert (data["proven"], data["checked"]) == ([x.name for x in found.proven], [x.name for x in found.checked])
    assert data["not_looked_for"]
    assert f"{len(found.proven)} proven" in str(found)
    assert "not looked for: " in str(found)
