"""`action_angle`: action and angle variables of a scene with one degree of freedom."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from atwood.arguments import instance, takes
from atwood.arrays import FloatArray
from atwood.display import data_of
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.simulation.initialization.start import find_start
from atwood.theory.action.quadrature import Level, level_through
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, hamiltonian


@dataclass(frozen=True, eq=False)
class ActionAngle:
    """Action and angle variables of one degree of freedom (Goldstein, section 10.6).

    The action variable J is the integral of p dq over one turn, the angle w rises by one in it: ``dH/dJ`` is the
    frequency with which it turns, and its inverse the period. J/2 pi and 2 pi w are those of Landau and Lifshitz.

    Attributes
    ----------
    coordinate
        Path of the coordinate.
    hamiltonian
        H.
    level
        The closed curve.
    """

    coordinate: str
    hamiltonian: Hamiltonian
    level: Level

    @property
    def kind(self) -> str:
        """``"libration"``, to and fro between two turning points, or ``"rotation"``."""
        return self.level.kind

    @property
    def energy(self) -> float:
        """H, J."""
        return self.level.energy

    @property
    def action(self) -> float:
        """J, the integral of p dq over one turn, J s."""
        return self.level.action

    @property
    def period(self) -> float:
        """``dJ/dH``, s: the integral of dp/dE over one turn."""
        return self.level.period

    @property
    def frequency(self) -> float:
        """``dH/dJ``, Hz."""
        return 1.0 / self.level.period

    @property
    def error(self) -> float:
        """The relative error of period and action, as estimated: amplitudes far below the scene's size lose digits."""
        return self.level.error

    @property
    def turning_points(self) -> tuple[float, float] | None:
        """Between which coordinates it swings; None where it goes round."""
        return self.level.ends if self.kind == "libration" else None

    def angle(self, q: float, p: float) -> float:
        """Return the angle variable w of a state on this level, between 0 and 1: the share of a turn since its begin.

        A turn begins at the lower turning point; where it goes round, at the start of the scene.

        Parameters
        ----------
        q, p
            A state of the same energy.

        Raises
        ------
        UsageError
            If its energy is another one.
        """
        there = float(self.hamiltonian([q], [p]))
        scale = max(abs(self.energy), abs(there), abs(p * self.frequency * (self.level.ends[1] - self.level.ends[0])))
        if abs(there - self.energy) > 1e-6 * scale:
            raise UsageError(
                f"its energy is {there:.9g} J, that of the level {self.energy:.9g} J", where=self.coordinate
            )
        falls = float(self.hamiltonian.velocities_at([q], [p])[0]) < 0.0
        if self.kind == "rotation":
            low, high = self.level.ends
            share = self.level.time_to(low + (q - low) % (high - low)) / self.period
            return share if not falls else (1.0 - share) % 1.0
        share = self.level.time_to(q) / self.period
        return 1.0 - share if falls else share

    def curve(self, count: int = 201) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and momenta along the closed curve, in the order in which it is gone through."""
        low, high = self.level.ends
        if self.kind == "rotation":
            q = np.linspace(low, high, count)
            return q, self.level.momentum(q)
        x = np.linspace(0.0, 2.0 * np.pi, count)
        q = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(x)
        p = np.where(x <= np.pi, self.level.momentum(q, 1.0), self.level.momentum(q, -1.0))
        still = self.hamiltonian.momenta_at(q[:, None], np.zeros((count, 1)))[:, 0]
        return q, np.where(np.isfinite(p), p, still)

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return data_of(self, "coordinate", "kind", "energy", "action", "period") | {"ends": list(self.level.ends)}

    def __repr__(self) -> str:
        return (
            f"<ActionAngle of {self.coordinate}: {self.kind}, J = {self.action:.9g} J s, dH/dJ = {self.frequency:.9g} "
            f"Hz, period {self.period:.9g} s>"
        )


@takes(scene=instance("a scene, an assembly of one, or a Hamiltonian", Model, Assembly, Hamiltonian))
def action_angle(scene: Model | Assembly | Hamiltonian) -> ActionAngle:
    """Return action and angle variables of a scene with one degree of freedom, on the level of H of its start.

    Parameters
    ----------
    scene
        The scene, or its Hamiltonian.

    Returns
    -------
    ActionAngle
        J, the frequency dH/dJ, the period, turning points, and the angle of states.

    Raises
    ------
    UsageError
        If it has more than one degree of freedom, or H changes.
    UnsupportedError
        If it has no Hamiltonian, or one that is not quadratic in the momentum.
    SolveError
        If its motion has no period: it is at rest, on a separatrix, or never comes back.
    """
    h = scene if isinstance(scene, Hamiltonian) else hamiltonian(scene)
    if len(h.paths) != 1:
        raise UsageError(
            f"it has {len(h.paths)} degrees of freedom",
            where=h.name,
            advice="`separation` has the action variables of coordinates that separate.",
        )
    if not h.is_conserved:
        raise UsageError(f"it has no level of H that it stays on: {h.sentence}", where=h.name)
    q, p = h.start()
    angle = h.assembly.reduced.names[0].unit == "rad"
    size = 1.0 if angle else find_start(h.assembly).length

    def energy(places: FloatArray, momenta: FloatArray) -> FloatArray:
        return h(places[:, None], momenta[:, None])

    level = level_through(energy, float(q[0]), float(p[0]), size, 2.0 * math.pi if angle else None, h.paths[0])
    return ActionAngle(h.paths[0], h, level)
