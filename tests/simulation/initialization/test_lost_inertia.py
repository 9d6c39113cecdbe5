"""Masses of which a sum keeps nothing of the light ones: refused in the reduced form for what it is."""

import numpy as np
import pytest

from atwood import Scene, StartError, simulate
from atwood.simulation.dynamics import balance
from atwood_library import Ground, PointMass, Rod


def chain(lightest: float, heaviest: float, count: int = 10) -> Scene:
    """Return a chain of masses, the lightest at its top."""
    scene = Scene()
    last = scene.add("ground", Ground()).frame
    for i, mass in enumerate(np.geomspace(lightest, heaviest, count).tolist()):
        rod, bob = scene.add(f"rod{i}", Rod()), scene.add(f"bob{i}", PointMass(mass=mass))
        scene.connect(last, rod.a)
        scene.connect(rod.b, bob.point)
        last = bob.point
        scene.start[f"rod{i}.angle"] = 0.3 * (i + 1)
    return scene


def test_the_reason_is_rounding_and_no_lack_of_inertia() -> None:
    """The error said that something without inertia is free to move, and asked for a moment of inertia."""
    with pytest.raises(StartError, match=r"lost to rounding.*bob0 has 1e-09 kg and bob9 has 1e\+09 kg") as caught:
        simulate(chain(1e-9, 1e9), t_end=0.1)
    assert "form='dae'" in str(caught.value)
    assert simulate(chain(1e-9, 1e9), form="dae", t_end=0.1).energy.max_drift < 1e-4


def test_it_is_said_of_more_masses_than_a_matrix_is_made_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(balance, "LARGEST_FULL", 50)
    with pytest.raises(StartError, match=r"lost to rounding.*bob0 has 1e-09 kg and bob89 has 1e\+09 kg"):
        simulate(chain(1e-9, 1e9, 90), t_end=1e-3)


def test_what_has_no_inertia_is_still_said_so() -> None:
    scene = chain(1.0, 2.0, 2)
    scene["bob1"].mass = 0.0
    with pytest.raises(StartError, match="without inertia"):
        simulate(scene, t_end=0.1)
