"""Adiabatic invariants: the action variable along a motion whose parameters change slowly.

At each time J is that of the closed curve of H, as H is at that time, through the state. Where H changes by a small
share in a turn J stays nearly the same, while H and the frequency do not (Landau and Lifshitz, Mechanics, section 49;
Goldstein, section 12.7).
"""

from __future__ import annotations

import numpy as np

from atwood.arguments import takes, whole
from atwood.arrays import FloatArray
from atwood.errors import SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, simulate, smooth_assembly_of
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.arguments import RTOL, T_END
from atwood.theory.action.action_angle import curves_of, extents_of, level_through
from atwood.theory.formulas.described import Described
from atwood.theory.hamiltonian.hamiltonian import read_hamiltonian


@dataclass(frozen=True, eq=False)
class AdiabaticInvariant(Described):
    """Action variable, energy and frequency along a motion whose parameters change slowly.

    Attributes
    ----------
    scene
        Name of the scene.
    time
        s, shape (times,).
    action
        J of the curve on which H has its value at that time, J s.
    energy
        H, J.
    frequency
        ``dH/dJ`` at that time, Hz.
    crossings
        When the motion passed a separatrix, from libration to rotation or back: J is not kept there.
    slowness
        The largest share by which the frequency changes in a turn.
    """

    scene: str
    time: FloatArray
    action: FloatArray
    energy: FloatArray
    frequency: FloatArray
    crossings: tuple[float, ...]
    slowness: float

    @property
    def change(self) -> float:
        """The largest change of J, as a share of its mean."""
        return float(np.ptp(self.action) / abs(np.mean(self.action)))

    @property
    def energy_change(self) -> float:
        """The largest change of H, as a share of its largest size."""
        return float(np.ptp(self.energy) / np.max(np.abs(self.energy)))

    def __repr__(self) -> str:
        told = f", separatrix passed at {self.crossings[0]:.6g} s" if self.crossings else ""
        return (
            f"<AdiabaticInvariant of {self.scene}: J = {np.mean(self.action):.6g} J s changes by {self.change:.2g}, "
            f"H by {self.energy_change:.2g}{told}>"
        )


@takes(scene=SCENE, t_end=T_END, outputs=whole("a number of times, 3 or more", 3), rtol=RTOL)
def adiabatic_invariant(
    scene: Model | Assembly, *, t_end: float | str | None = None, outputs: int = 101, rtol: float = 1e-10
) -> AdiabaticInvariant:
    """Return the action variable along the motion of a scene of one coordinate whose H changes with time.

    Parameters
    ----------
    scene
        The scene, or an assembly of its reduced form.
    t_end, rtol
        See `atwood.simulate`.
    outputs
        At how many times.

    Raises
    ------
    UsageError
        If it has more than one degree of freedom, or forces act that do not follow from H.
    SolveError
        If at some time its curve is not closed, or it is on a separatrix.
    """
    assembly = smooth_assembly_of(scene)
    h, begun = read_hamiltonian(assembly), find_start(assembly)
    if len(h.paths) != 1 or h.other_forces:
        told = h.sentence if h.other_forces else f"it has {len(h.paths)} degrees of freedom"
        raise UsageError(f"its action variable is not kept by slow changes: {told}", where=h.name)
    run = simulate(assembly, t_end=t_end, outputs=outputs, rtol=rtol, samples=1)
    if run.status != "finished" or len(run.run.segments) != 1:
        raise SolveError("its motion does not go to the end without a jump", where=h.name)
    [segment] = run.run.segments
    at, curves, extents = np.searchsorted(segment.time, run.time), curves_of(h), extents_of(h, begun.length)
    levels = []
    for t, q, u in zip(run.time, segment.coordinates.T[at], segment.speeds.T[at], strict=True):
        [place] = from_regular(h.assembly, q)
        [momentum] = h.momenta_at([place], u, t)
        levels.append(level_through(curves(float(t)), place, momentum, *extents, f"{h.name} at {t:.6g} s"))
    time, kinds = run.time, [one.kind for one in levels]
    crossed = [float(t) for t, before, after in zip(time[1:], kinds, kinds[1:], strict=False) if before != after]
    frequency = 1.0 / np.array([one.period for one in levels])
    slowness = float(np.max(np.abs(np.diff(np.log(frequency)) / np.diff(time)) / frequency[1:]))
    values = np.array([[one.action, one.energy] for one in levels])
    return AdiabaticInvariant(h.name, time, values[:, 0], values[:, 1], frequency, tuple(crossed), slowness)
