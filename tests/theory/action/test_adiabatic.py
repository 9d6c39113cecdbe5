"""Action variables along motions whose parameters change slowly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from atwood import Scene, UsageError, action_angle, adiabatic_invariant
from atwood_library import PointMass, Potential
from atwood_library.scenes import DoublePendulum, Oscillators, SimplePendulum


def spring(rate: float) -> Scene:
    """Return 1 kg on a spring with the frequency ``1 + rate t``, rad/s."""
    scene = Scene(gravity=0.0, space="line")
    field, body = scene.add("field", Potential()), scene.add("body", PointMass(mass=1.0))
    scene.connect(field.point, body.point)

    def energy(x: Any, t: Any) -> Any:
        return 0.5 * (1.0 + rate * t) ** 2 * x**2

    scene.set("field.energy_function", energy)
    scene.start.update({"body.position.x": 1.0, "body.velocity.x": 0.0})
    return scene


def test_energy_over_frequency_is_kept_where_the_frequency_doubles_slowly() -> None:
    """``J = H/f`` (Landau and Lifshitz, Mechanics, section 49); what is left falls with the slowness."""
    changes = []
    for rate in (0.1, 0.02):
        found = adiabatic_invariant(spring(rate), t_end=1.0 / rate, outputs=41)
        assert found.frequency == pytest.approx((1.0 + rate * found.time) / (2.0 * np.pi), rel=1e-9)
        assert found.action == pytest.approx(found.energy / found.frequency, rel=1e-9)
        assert found.energy_change == pytest.approx(0.5, abs=0.05)
        assert found.slowness == pytest.approx(rate * 2.0 * np.pi, rel=0.1)
        assert not found.crossings
        changes.append(found.change)
    assert changes[1] < 0.3 * changes[0] < 0.03


def test_nothing_changes_where_nothing_is_driven() -> None:
    found = adiabatic_invariant(SimplePendulum(), t_end=1.0, outputs=5)
    assert found.action == pytest.approx(np.full(5, action_angle(SimplePendulum()).action), rel=1e-8)


def test_a_separatrix_on_the_way_is_told() -> None:
    """In ``V = k(t) (1 - cos x)`` that grows, what goes round is caught: the curves are others from then on."""
    scene = Oscillators(kind="pendulum")
    scene.set("field.energy_function", _deepening)
    scene.start.update({"track.rate": 2.5, "track.parameter": 0.0})
    found = adiabatic_invariant(scene, t_end=20.0, outputs=60)
    assert len(found.crossings) == 1
    before = found.action[found.time < found.crossings[0] - 1.0]
    assert float(np.ptp(before)) < 0.1 * float(np.mean(before))
    assert "separatrix passed" in repr(found)


def _deepening(z: Any, t: Any) -> Any:
    return (1.0 + 0.2 * t) * z


def test_several_coordinates_are_refused() -> None:
    with pytest.raises(UsageError, match="2 degrees of freedom"):
        adiabatic_invariant(DoublePendulum())
