"""Small oscillations of a scene about rest, and eigenvalues while one value changes.

Without velocity terms ``M z'' + K z = 0`` with M symmetric and positive and K symmetric: the generalized eigenvalue
problem ``K v = omega^2 M v`` (Goldstein, section 6.2). With damping or gyroscopic terms the eigenvalues are those of
``x' = A x``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import partial
from typing import Any, Literal, overload

import numpy as np

from atwood.arguments import FLAG, TEXT, Kind, check, command, number, takes, whole
from atwood.arrays import ComplexArray, FloatArray
from atwood.display import count_of, data_of, fitted, plain
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import scipy
from atwood.model.compose.composite import Model
from atwood.numerics.rank import null_space
from atwood.pipeline import SCENE, assembly_of, smooth_assembly_of
from atwood.ranges import values_of
from atwood.result.result import Result
from atwood.simulation.contacts.chosen import words_text
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.initialization.start import Start
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.run import run
from atwood.table import Shown, Table, table
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.linear.linear_model import find_spectrum, rounding
from atwood.theory.linear.linearize import StateSpace, find_state_space, linearize, not_steady, refuse_switches
from atwood.theory.linear.operating_point import AT, At, OperatingPoint, find_operating_point, values_at
from atwood.theory.linear.steady import find_steady, still
from atwood.theory.linear.variations import Flow
from atwood.theory.oscillations.modes import SymbolicModes, symbolic_modes

_AMPLITUDE = number("a number above 0, in radians or in extents of the scene", above=0.0)


@dataclass(frozen=True, eq=False)
class NormalModes(Shown):
    """Modes of a scene about a state of rest or a steady motion.

    Attributes
    ----------
    angular_frequencies
        rad/s, ascending; zero for modes that do not oscillate: free ones, unstable ones, overdamped ones.
    growth_rates
        1/s: zero without damping, positive for unstable modes, negative for damped ones.
    eigenvalues
        ``growth_rates + i angular_frequencies``.
    shapes
        For each mode the amplitude of every coordinate, by path; the largest is 1 m or 1 rad. They are complex where
        velocity terms shift phases.
    spaces
        Numbers of the modes whose eigenvalues are equal: any combination of their shapes is one too.
    values
        The state that they are about, by path.
    scene
        Name of the scene.
    """

    angular_frequencies: FloatArray
    growth_rates: FloatArray
    eigenvalues: ComplexArray
    shapes: tuple[Mapping[str, complex], ...]
    spaces: tuple[tuple[int, ...], ...]
    values: Mapping[str, float]
    scene: str
    point: OperatingPoint = field(repr=False)
    displacements: ComplexArray = field(repr=False)

    def __len__(self) -> int:
        return len(self.angular_frequencies)

    @property
    def contacts(self) -> Mapping[str, str]:
        """The set of contacts that they hold in: what each gap and slip does, by path."""
        return self.point.contacts

    @property
    def frequencies(self) -> FloatArray:
        """Frequencies, Hz."""
        return self.angular_frequencies / (2.0 * np.pi)

    @property
    def periods(self) -> FloatArray:
        """Periods, s; infinite for modes that do not oscillate."""
        found: FloatArray = np.full(len(self), np.inf)
        return np.divide(1.0, self.frequencies, out=found, where=self.frequencies > 0.0)

    @property
    def damping_ratios(self) -> FloatArray:
        """Shares of the critical damping; negative for modes that grow, not a number for free ones."""
        size = np.abs(self.eigenvalues)
        found: FloatArray = np.full(len(self), np.nan)
        return np.divide(0.0 - self.growth_rates, size, out=found, where=size > 0.0)

    @property
    def is_stable(self) -> bool:
        """Whether no mode grows."""
        return bool(np.all(self.growth_rates <= 1e-9 * np.max(np.abs(self.eigenvalues), initial=0.0)))

    def matrix(self) -> ComplexArray:
        """Return the shapes as columns, rows in the order of the paths in `shapes`."""
        if not self.shapes:
            return np.zeros((0, 0), dtype=complex)
        return np.array([list(shape.values()) for shape in self.shapes]).T

    def motion(self, mode: int, amplitude: float = 0.2, frames: int = 25) -> Result:
        """Return one period of a mode as a motion of the mechanism, to be drawn and animated.

        Parameters
        ----------
        mode
            Number of the mode.
        amplitude
            Of the largest displacement, in radians or in extents of the scene.
        frames
            Number of times.

        Returns
        -------
        Result
            As `simulate` returns it; closed loops are met. A mode that does not oscillate is shown swinging too.
        """
        index = check(whole(f"the number of a mode, 0 to {len(self) - 1}", 0, len(self) - 1), mode, "mode", "motion")
        amplitude = check(_AMPLITUDE, amplitude, "amplitude", "motion")
        frames = check(whole("a number of times, 2 to 100,000", 2, 100_000), frames, "frames", "motion")
        return mode_motion(
            self.point, self.displacements[:, index], float(self.angular_frequencies[index]), amplitude, frames
        )

    def to_data(self) -> dict[str, Any]:
        """Return them as plain data, for JSON."""
        shapes = [{path: _number(value) for path, value in shape.items()} for shape in self.shapes]
        told = data_of(
            self, "scene", "contacts", "values", "angular_frequencies", "growth_rates", "periods", "damping_ratios"
        )
        return {**told, "shapes": shapes, "spaces": plain(self.spaces)}

    def tables(self) -> tuple[Table, ...]:
        """Return frequencies, growth and shape of each mode."""
        numbers = self.angular_frequencies, self.frequencies, self.periods, self.growth_rates, self.damping_ratios
        rows = [
            (str(k), f"{omega:.9g}", *(f"{one:.6g}" for one in others), shape_text(shape))
            for k, (omega, *others, shape) in enumerate(zip(*numbers, self.shapes, strict=True))
        ]
        notes = [
            f"Modes {', '.join(map(str, group))} have equal eigenvalues: any combination of them is a mode."
            for group in self.spaces
            if len(group) > 1
        ]
        notes += [f"Contacts: {words_text(self.contacts)}."] if self.contacts else []
        title = f"{self.scene}: {count_of(len(self), 'mode')} about {values_text(self.values)}"
        return (
            table(
                ("mode", "rad/s>", "Hz>", "period, s>", "growth, 1/s>", "damping ratio>", "shape"), rows, title, notes
            ),
        )

    __str__ = Shown.as_text


def values_text(values: Mapping[str, float], most: int = 6) -> str:
    """Return values by path in a line."""
    shown = [f"{path} = {value:.6g}" for path, value in list(values.items())[:most]]
    return ", ".join(shown) + (", ..." if len(values) > most else "")


def shape_text(shape: Mapping[str, complex], most: int = 4) -> str:
    """Return the amplitudes of a mode in a line."""
    parts = [f"{path} {_short(value)}" for path, value in shape.items() if abs(value) > 1e-6]
    return ", ".join(parts[:most]) + (", ..." if len(parts) > most else "")


def _short(value: complex) -> str:
    if abs(value.imag) < 1e-9 * abs(value):
        return f"{value.real:.4g}"
    return f"{abs(value):.4g} at {np.degrees(np.angle(value)):.0f} deg"


def _number(value: complex) -> float | list[float]:
    return value.real if value.imag == 0.0 else [value.real, value.imag]


@overload
def normal_modes(scene: Model | Assembly, *, at: At = ..., symbolic: Literal[False] = ...) -> NormalModes: ...


@overload
def normal_modes(
    scene: Model | Assembly,
    *,
    at: Mapping[str, Any] | None = ...,
    symbolic: Literal[True],
    symbols: Mapping[str, str] | None = ...,
) -> SymbolicModes: ...


@command("modes")
@takes(scene=SCENE, at=AT, symbolic=FLAG, symbols=SYMBOLS)
def normal_modes(
    scene: Model | Assembly, *, at: At = None, symbolic: bool = False, symbols: Mapping[str, str] | None = None
) -> NormalModes | SymbolicModes:
    """Find the frequencies and shapes of small oscillations, in numbers or as formulas.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    at
        The state of rest or the steady motion, as for `linearize`. The scene's start if not given. If ``symbolic`` it
        is a state of rest: the start if that is one, else the only stable one.
    symbolic
        Whether to give formulas: energies to second order, omega^2 and shapes in closed form where symmetry or degree
        lets them be, and normal coordinates. An assembly says in which form.
    symbols
        See `equations`: letters of formulas by path. Two parameters that have one letter are equal.

    Returns
    -------
    NormalModes, SymbolicModes
        One for each degree of freedom without velocity terms; with damping or gyroscopic terms one for each pair of
        conjugate eigenvalues and for each real one.

    Raises
    ------
    UsageError
        If the state is neither at rest nor a steady motion, or a law switches there.
    UnsupportedError
        If ``symbolic``, and rest has no closed form that one would find by hand.
    """
    if symbolic:
        if isinstance(at, tuple):
            raise UsageError("formulas are about states of rest", where="normal_modes", advice="Give values by path.")
        return symbolic_modes(smooth_assembly_of(scene, form=None, orientation=None), at, symbols)
    if symbols is not None:
        raise UsageError("numbers have no letters", where="normal_modes", advice="Give symbolic=True.")
    point = find_operating_point(scene, at, ())
    return modes_of(point)


def modes_of(point: OperatingPoint, is_steady: bool = False) -> NormalModes:
    """Return the modes about an operating point."""
    flow = point.scene.flow(point.t, point.q, point.u, point.kept)
    if not is_steady:
        refuse_switches(point.scene, flow, point.kept)
    steady = still(flow) if point.is_from_result else find_steady(point.scene, flow, point.kept)
    if not steady.is_steady:
        if not is_steady:
            raise not_steady(point, flow, steady)
        steady = still(flow)  # it keeps still in a scene that changes, as a load that is hoisted
    space = find_state_space(point.scene, flow, steady, point.kept)
    values, displacements = find_modes(flow, space)
    names = point.scene.tangents.names
    shapes = tuple(dict(zip(names, map(complex, column), strict=True)) for column in displacements.T)
    about = values_at(point), point.assembly.flat.name, point, displacements
    return NormalModes(values.imag, values.real, values, shapes, _spaces(values), *about)


_NO_VELOCITY = 1e-11
"""Relative to the accelerations that it belongs to: a velocity term that is smaller is rounding."""

_LIKE = 1e-9
"""Relative: eigenvalues that differ by less belong to one space of shapes."""


Modes = tuple[ComplexArray, ComplexArray]
"""Of each mode the eigenvalue with the positive imaginary part, in the order of these; and the displacements of all
coordinates, shape (displacements, modes), complex where velocity terms shift phases."""


def find_modes(flow: Flow, space: StateSpace) -> Modes:
    """Return the modes about a state."""
    minimal = space.minimal
    n, m = len(minimal.displacements), len(minimal.speeds)
    a, error = space.matrix[:, : n + m], space.error[:, : n + m]
    by_speed = a[n:, n:]
    # What a speed does in the time in which a displacement does as much as it: both in units of accelerations.
    rows = np.sqrt(np.abs(np.diag(a[n:, :n]))) if n == m else np.zeros(m)
    bound = np.maximum(error[n:, n:], _NO_VELOCITY * np.sqrt(np.outer(rows, rows)))
    plain = n == m and np.array_equal(a[:n, n:], np.eye(n)) and not np.any(a[:n, :n])
    if plain and np.all(np.abs(by_speed) <= bound):
        found = _undamped(flow, space)
        if found is not None:
            return found
    return _damped(space, n)


def _undamped(flow: Flow, space: StateSpace) -> Modes | None:
    """Return modes of a symmetric stiffness; None if it is not symmetric, as with follower forces."""
    minimal = space.minimal
    n = len(minimal.displacements)
    u = minimal.speed[:, n : 2 * n]
    mass = u.T @ flow.variation.by["force", "a"] @ u
    mass = 0.5 * (mass + mass.T)
    stiffness = -mass @ space.matrix[n:, :n]
    size = np.sqrt(np.outer(np.diag(mass), np.diag(mass)))
    error = np.abs(mass) @ space.error[n:, :n] + 1e-12 * np.max(np.abs(stiffness / size), initial=0.0) * size
    if np.any(np.abs(stiffness - stiffness.T) > error + error.T):
        return None
    try:
        squares, vectors = scipy.linalg.eigh(0.5 * (stiffness + stiffness.T), mass)
    except np.linalg.LinAlgError:  # the mass matrix is not positive: something without mass is free
        return None
    noise = np.sqrt(np.sum((error / size) ** 2))
    squares = np.where(np.abs(squares) <= noise, 0.0, squares)
    frequencies = np.sqrt(np.maximum(squares, 0.0))
    growth = np.sqrt(np.maximum(-squares, 0.0))
    order = np.argsort(frequencies, kind="stable")
    shapes = (minimal.shift[:, :n] @ vectors)[:, order]
    return growth[order] + 1j * frequencies[order], _scaled(shapes)


def _damped(space: StateSpace, n: int) -> Modes:
    minimal = space.minimal
    matrix, error = space.matrix[:, : minimal.states], space.error[:, : minimal.states]
    spectrum = find_spectrum(matrix, error, space.sizes)
    size = float(np.max(np.abs(spectrum.others), initial=0.0))
    upper = [k for k, value in enumerate(spectrum.others) if value.imag >= -1e-9 * size]
    values = spectrum.others[upper]
    values = np.where(np.abs(values.imag) <= 1e-9 * np.abs(values), values.real + 0j, values)
    values = np.where(np.abs(values.real) <= 1e-13 * size, 1j * values.imag, values)
    shapes = minimal.shift[:, :n] @ spectrum.vectors[:n, upper]
    # A coordinate that nothing depends on, with its speed: one mode with a double zero.
    zeros = (spectrum.zeros + 1) // 2
    free = np.zeros((len(shapes), zeros), dtype=complex)
    null = null_space(matrix, rounding(matrix, error))
    count = min(zeros, null.shape[1])
    free[:, :count] = minimal.shift[:, :n] @ null[:n, :count]
    values = np.concatenate([np.zeros(zeros, dtype=complex), values])
    shapes = np.hstack([free, shapes])
    order = np.lexsort((-values.real, np.round(values.imag, 12)))
    return values[order], _scaled(shapes[:, order])


def _scaled(shapes: FloatArray | ComplexArray) -> ComplexArray:
    """Return shapes whose largest displacement is one, and real and positive."""
    found = np.array(shapes, dtype=complex)
    for k in range(found.shape[1]):
        sizes = np.abs(found[:, k])
        if np.max(sizes, initial=0.0) > 0.0:
            # The first of those that are nearly the largest, so that rounding does not choose the sign.
            found[:, k] /= found[int(np.argmax(sizes > 0.999 * np.max(sizes))), k]
    return found


def _spaces(values: ComplexArray) -> tuple[tuple[int, ...], ...]:
    groups: list[list[int]] = []
    size = float(np.max(np.abs(values), initial=0.0))
    for k, value in enumerate(values):
        if groups and abs(value - values[groups[-1][0]]) <= _LIKE * max(abs(value), 1e-3 * size):
            groups[-1].append(k)
        else:
            groups.append([k])
    return tuple(tuple(one) for one in groups)


def mode_motion(
    point: OperatingPoint, shape: ComplexArray, angular_frequency: float, amplitude: float, frames: int
) -> Result:
    """Return one period of an oscillation about an operating point."""
    linear, balance = point.scene, balance_of(point.assembly, "reduced")
    period = 2.0 * np.pi / angular_frequency if angular_frequency else 1.0
    times = point.t + np.linspace(0.0, period, frames)
    size = float(np.max(np.abs(shape) / linear.displacement_sizes, initial=0.0)) or 1.0
    rows = []
    still = np.zeros(len(linear.sizes))
    for time in times:
        turned = shape * np.exp(2j * np.pi * (time - point.t) / period)
        q = linear.tangents.moved(point.q, turned.real * (amplitude / size))
        rows.append(balance.project(point.t, q, still, linear.sizes)[0])
    coordinates = np.array(rows).T
    start = Start(point.t, point.q, point.u, linear.length, (), (), (), point.q)
    options = RunOptions(t_end=point.t + 1e-6 * period, outputs=2, samples=1)
    begun = run(point.assembly, start, options, point.assembly.other_mode)
    first = begun.stretches[0]
    segment = replace(
        first,
        time=times,
        coordinates=coordinates,
        speeds=np.gradient(coordinates, times, axis=1) if linear.equations.rates == linear.equations.speeds
        else np.zeros((len(still), frames)),
        shown=np.ones(frames, dtype=bool),
        misses=partial(np.zeros, (2, frames)),
    )  # fmt: skip
    return Result(replace(begun, stretches=(segment,)))


@dataclass(frozen=True, eq=False)
class RootLocus:
    """Eigenvalues over a value that changes.

    Attributes
    ----------
    path
        What changes.
    values
        Its values, shape (values,).
    eigenvalues
        1/s, shape (values, states); each column follows one eigenvalue as far as they can be told apart.
    scene
        Name of the scene.
    """

    path: str
    values: FloatArray
    eigenvalues: ComplexArray
    scene: str

    def crossings(self) -> list[float]:
        """Return values at which the real part of an eigenvalue changes sign, by linear interpolation."""
        real = self.eigenvalues.real
        found = []
        for k in range(real.shape[1]):
            for i in np.flatnonzero(real[:-1, k] * real[1:, k] < 0.0):
                share = real[i, k] / (real[i, k] - real[i + 1, k])
                found.append(float(self.values[i] + share * (self.values[i + 1] - self.values[i])))
        return sorted(set(found))

    def __str__(self) -> str:
        low, high = float(np.min(self.values)), float(np.max(self.values))
        lines = [f"{self.scene}: {self.eigenvalues.shape[1]} eigenvalues over {self.path} from {low:g} to {high:g}"]
        lines += [f"  stability changes near {self.path} = {value:.6g}" for value in self.crossings()[:6]]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return fitted(str(self))


def _read_values(value: Any) -> FloatArray:
    if isinstance(value, (str, bytes, set, frozenset)):
        raise ValueError
    found = np.array([float(one) for one in value])
    if found.ndim != 1 or len(found) < 2 or not np.all(np.isfinite(found)):
        raise ValueError
    return found


@takes(scene=SCENE, path=TEXT, values=Kind("at least two numbers", _read_values, "VALUES", values_of), at=AT)
def root_locus(
    scene: Model | Assembly, path: str, values: Iterable[float], *, at: Mapping[str, Any] | None = None
) -> RootLocus:
    """Return the eigenvalues of a scene while a parameter, or a value of the state, changes.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    path
        A parameter by path, or a quantity of the state such as the speed of a wheel.
    values
        Its values, SI units.
    at
        What else is said of the state; see `linearize`.

    Returns
    -------
    RootLocus
        The eigenvalues.

    Raises
    ------
    AtwoodError
        As `linearize` does.
    """
    base = assembly_of(scene)
    numbers = np.asarray(values, dtype=float)
    is_state = path in base.start_observables
    rows: list[ComplexArray] = []
    contacts: Mapping[str, str] | None = None
    for value in numbers:
        if is_state:
            model = linearize(base, at={**(at or {}), path: float(value)})
        else:
            model = linearize(base.with_values({path: float(value)}), at=at)
        rows.append(model.eigenvalues)
        if len(rows[-1]) != len(rows[0]):
            raise UsageError(f"at {value:g} the scene has another number of states", where=path)
        contacts = model.contacts if contacts is None else contacts
        if model.contacts != contacts:
            raise UsageError(f"at {value:g} it is in another set of contacts: {words_text(model.contacts)}", where=path)
    return RootLocus(path, numbers, _followed(rows), base.flat.name)


def _followed(rows: list[ComplexArray]) -> ComplexArray:
    """Return eigenvalues sorted so that each column changes little from row to row."""
    found = np.array(rows)
    for i in range(1, len(found)):
        guess = found[i - 1] if i == 1 else 2.0 * found[i - 1] - found[i - 2]
        cost = np.abs(guess[:, None] - found[i][None, :]) + np.abs(found[i - 1][:, None] - found[i][None, :])
        found[i] = found[i][scipy.optimize.linear_sum_assignment(cost)[1]]
    return found
