"""Liouville's theorem and equation: a cloud of states that flows, and densities on phase space.

The edge of the cloud is a closed line of states. Along motions of any Hamiltonian the sum of the areas that its shadows
in the planes (q_i, p_i) go around is kept, ``sum of the integrals of p_i dq_i`` (Poincare's invariant; Arnold,
Mathematical Methods of Classical Mechanics, section 44); of one coordinate that is the area of the cloud (Goldstein,
section 9.9). A density moves with the states: ``drho/dt = {H, rho}`` at each place.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from atwood.arguments import TEXT, number, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.errors import SolveError, UnsupportedError, UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy, sympy
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.arguments import T_END, check_span
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.printers import Sympy
from atwood.theory.hamiltonian.flow import flow_of
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, read_hamiltonian
from atwood.theory.hamiltonian.phase_space import EXPRESSION, HAMILTONIAN, SYMBOLS, phase_space_of, short, vanishes
from atwood.theory.hamiltonian.transformations import bracket


@dataclass(frozen=True, eq=False)
class PhaseCloud(Described):
    """The edge of a cloud of states as it flows.

    Attributes
    ----------
    coordinate
        Path of the coordinate in whose plane the cloud begins as an ellipse about the start.
    time
        s, shape (times,).
    q, p
        Coordinates and momenta on the edge, shape (times, states, coordinates).
    scene
        Name of the scene.
    number
        Which of the coordinates that is.
    """

    coordinate: str
    time: FloatArray
    q: FloatArray
    p: FloatArray
    scene: str
    number: int

    @property
    def shadows(self) -> FloatArray:
        """Areas of the shadows in the planes of each coordinate and its momentum, shape (times, coordinates)."""
        count = self.q.shape[1]
        waves = np.fft.fftfreq(count, 1.0 / count)[:, None]
        slopes = np.fft.ifft(1j * waves * np.fft.fft(self.q, axis=1), axis=1).real
        return np.asarray(-2.0 * np.pi * np.mean(self.p * slopes, axis=1))

    @property
    def area(self) -> FloatArray:
        """The sum of these: kept by every Hamiltonian, shape (times,)."""
        return np.asarray(np.sum(self.shadows, axis=1))

    def __repr__(self) -> str:
        change = float(np.max(np.abs(self.area / self.area[0] - 1.0)))
        return f"<PhaseCloud of {self.scene}: {len(self.time)} times, area {self.area[0]:.6g}, changed by {change:.1g}>"


@takes(
    scene=SCENE,
    coordinate=optional(TEXT),
    size=number(above=0.0),
    t_end=T_END,
    outputs=whole("a number of times, 2 or more", 2),
    states=whole("a number of states, 16 or more", 16),
)
def phase_cloud(
    scene: Model | Assembly,
    coordinate: str | None = None,
    *,
    size: float = 0.2,
    t_end: float | str | None = None,
    outputs: int = 5,
    states: int = 256,
) -> PhaseCloud:
    """Return a cloud of states about a scene's start that flows by Hamilton's equations: Liouville's theorem.

    Parameters
    ----------
    scene
        The scene, or an assembly of its reduced form.
    coordinate
        Path of the coordinate in whose plane the cloud begins; the first if not given.
    size
        Half its width: of an angle rad, of other coordinates the share of the scene's extent.
    t_end
        Time of the end, s.
    outputs, states
        How many times, and how many states on the edge.

    Raises
    ------
    UsageError
        If there is no such coordinate.
    UnsupportedError
        If the scene has no Hamiltonian.
    SolveError
        If a motion does not get to its end.
    """
    assembly = smooth_assembly_of(scene)
    h = read_hamiltonian(assembly)
    if coordinate is not None and coordinate not in h.paths:
        raise UsageError("no coordinate has this path", where=coordinate, advice=suggestion(coordinate, h.paths))
    i, begun = h.paths.index(coordinate or h.paths[0]), find_start(assembly)
    end = assembly.flat.t_end if t_end is None else float(t_end)
    check_span(begun.time, end)
    (q, p), n = h.start(), len(h.paths)
    wide = size * (1.0 if h.assembly.reduced.names[i].unit == "rad" else begun.length)
    inertia = float(h.transform.mass_matrix(q, h.velocities_at(q, p))[i, i])
    ahead, behind = (h.gradient(q + sign * wide * np.eye(n)[i], p)[0][i] for sign in (1.0, -1.0))
    pace = max(float(np.sqrt(abs(ahead - behind) / (2.0 * wide * inertia))), 1.0 / (end - begun.time))
    turn = 2.0 * np.pi * np.arange(states) / states
    edge = np.zeros((2, states, n)) + np.stack([q, p])[:, None, :]
    edge[0, :, i] += wide * np.cos(turn)
    edge[1, :, i] += wide * inertia * pace * np.sin(turn)

    def rates(t: float, state: FloatArray) -> FloatArray:
        q, p = state.reshape(2, states, n)
        return np.stack(h.rates(q, p, t)).ravel()

    times, scale = np.linspace(begun.time, end, outputs), np.ones((2, states, n))
    scale[0] *= wide
    scale[1] *= wide * inertia * pace
    found = scipy.integrate.solve_ivp(
        rates, (begun.time, end), edge.ravel(), "DOP853", t_eval=times, rtol=1e-10, atol=1e-11 * scale.ravel()
    )
    if not found.success:
        raise SolveError(f"a motion of the cloud ends at {found.t[-1]:.6g} s", where=h.name)
    moved = found.y.T.reshape(outputs, 2, states, n)
    return PhaseCloud(h.paths[i], times, moved[:, 0], moved[:, 1], h.name, i)


@dataclass(frozen=True, eq=False)
class LiouvilleDensity(Described):
    """A density on phase space.

    Attributes
    ----------
    density
        At the time zero.
    rate
        ``drho/dt = {H, rho}`` at each place, then: Liouville's equation.
    is_stationary
        Whether it stays as it is, as every function of conserved quantities does.
    solution
        The density at the time t, which solves Liouville's equation; None where motions are not known as formulas.
    """

    density: Sympy
    rate: Sympy
    is_stationary: bool
    solution: Sympy | None


@takes(density=EXPRESSION, hamiltonian=HAMILTONIAN, constants=SYMBOLS)
def liouville_density(density: Any, hamiltonian: Hamiltonian, *, constants: Any = ()) -> LiouvilleDensity:
    """Return how a density on phase space changes, and what it is at later times.

    Parameters
    ----------
    density
        A function of coordinates and momenta.
    hamiltonian
        What `atwood.hamiltonian` returns.
    constants
        See `atwood.poisson_bracket`.

    Raises
    ------
    UnsupportedError
        If forces act that do not follow from H.
    """
    h = hamiltonian
    if h.other_forces:
        raise UnsupportedError(h.sentence, where=h.name, advice="Its states are not kept as dense as they are.")
    space, t = phase_space_of(h), sympy.Symbol("t")
    read, energy = space.declared(density, constants), space.read(h.expression)
    rate = short(bracket(energy, read, space))
    try:
        solution = None if h.depends_on_time else flow_of(h.expression, h, -t).of(space.shown(read))
    except UnsupportedError:
        solution = None
    if solution is not None:
        later = space.read(solution)
        assert vanishes([later.diff(t) - bracket(energy, later, space)]).holds
    return LiouvilleDensity(space.shown(read), space.shown(rate), vanishes([rate]).holds, solution)
