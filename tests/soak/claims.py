"""Kind `claims`: what is said to be conserved of a mass in fields that depend on some of x, y, z, r and t.

A field may act narrowly, briefly or far away, so that random states near the start would not meet it. What each field
breaks is known from what it depends on; the axes are turned, and places, lengths and energies scaled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from atwood import Scene, conserved, exp, select, sin, sqrt, tanh
from atwood.errors import AtwoodError
from atwood_library import PointMass, Potential

from .trial import Finding, Trial

SHAPES: dict[str, Callable[[Any], Any]] = {
    "smooth": lambda s: s * s,
    "wave": lambda s: sin(s),
    "hill": lambda s: exp(-((s - 40.0) ** 2)),
    "narrow": lambda s: exp(-(((s - 3.0) / 0.01) ** 2)),
    "rational": lambda s: 1e-3 / (1.0 + ((s - 30.0) / 0.01) ** 2),
    "step": lambda s: tanh((s - 20.0) / 0.01),
    "band": lambda s: select((s > 60.0) & (s < 60.1), s, 0.0),
}


@dataclass(frozen=True)
class Field:
    """What one field depends on, its shape, and whether it acts in a while only."""

    reads: str
    shape: str
    timed: str

    def energy(self, x: Any, y: Any, z: Any, t: Any) -> Any:
        """Return its energy at a place in its own axes."""
        r = sqrt(x * x + y * y + z * z + 1e-4)
        s = {"x": x, "y": y, "z": z, "r": r, "rho": sqrt(x * x + y * y + 1e-4)}[self.reads]
        value = SHAPES[self.shape](s)
        if self.timed == "brief":
            return value * exp(-(((t - 50.0) / 0.01) ** 2))
        if self.timed == "late":
            return value * exp(-((t - 3000.0) ** 2))
        return value


KEPT = {
    "x": {"py", "pz", "Lx"},
    "y": {"px", "pz", "Ly"},
    "z": {"px", "py", "Lz"},
    "rho": {"pz", "Lz"},
    "r": {"Lx", "Ly", "Lz"},
}
"""What a field keeps, by what it reads: momenta along its axes and moments of momentum about its middle."""


def check(seed: int) -> Trial:
    """Make the trial of a seed."""
    random = np.random.default_rng(seed)
    fields = [
        Field(
            str(random.choice(list(KEPT))),
            str(random.choice(list(SHAPES))),
            str(random.choice(["always", "always", "brief", "late"])),
        )
        for _ in range(int(random.integers(1, 4)))
    ]
    kept = set.intersection(*(KEPT[one.reads] for one in fields))
    has_energy = all(one.timed == "always" for one in fields)
    turn = Rotation.random(rng=np.random.default_rng(seed)) if random.random() < 0.5 else Rotation.identity()
    axes = turn.as_matrix().tolist()
    length, energy = 10.0 ** random.uniform(-2.0, 2.0), 10.0 ** random.uniform(-2.0, 2.0)

    def potential(x: Any, y: Any, z: Any, t: Any) -> Any:
        place = [(row[0] * x + row[1] * y + row[2] * z) / length for row in axes]
        return energy * sum(one.energy(*place, t) for one in fields)

    scene = Scene(space="space", gravity=0.0, t_end=5.0)
    field, bob = scene.add("field", Potential(energy_function=potential)), scene.add("bob", PointMass(mass=1.0))
    scene.connect(field.point, bob.point)
    for axis, value in zip("xyz", (length * random.uniform(0.2, 1.0, 3)).tolist(), strict=True):
        scene.start[f"bob.position.{axis}"], scene.start[f"bob.velocity.{axis}"] = value, 0.0
    about = f"{fields}, turned {turn.as_rotvec().tolist()}, length {length:.3g}"
    tried = (*(f"{one.shape} of {one.reads}, {one.timed}" for one in fields), "compared")
    try:
        found = conserved(scene)
    except AtwoodError as error:
        return Trial(tried, (Finding("refused", "conserved: refused", f"{error}: {about}"),))
    names = set(found.names)
    findings = []
    if ("h" in names) != has_energy:
        what = "energy is claimed" if "h" in names else "energy is missed"
        findings.append(Finding("wrong" if "h" in names else "message", f"conserved: {what}", f"{names}: {about}"))
    # How many independent momenta and moments of momentum there are does not hang on how the axes are turned.
    told = sum(name.startswith(("p", "P", "L")) for name in names)
    if told != len(kept):
        gravity, what = ("wrong", "too much is claimed") if told > len(kept) else ("message", "something is missed")
        findings.append(Finding(gravity, f"conserved: {what}", f"{sorted(names)}, not {sorted(kept)}: {about}"))
    return Trial(tried, tuple(findings))
