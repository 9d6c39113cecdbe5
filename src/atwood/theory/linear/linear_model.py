"""Linear models: named matrices, eigenvalues, controllable and observable parts, zeros and frequency responses.

A coordinate that nothing depends on gives a zero eigenvalue, together with its conserved momentum a double one, which
rounding would make a pair of size 1e-8 that spoils its neighbours. So what a matrix takes to zero is split off first,
step by step (the staircase form; Golub and Wilkinson, SIAM Review 18, 1976); the rest is left to the QR method.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import ARRAY, check
from atwood.arrays import ComplexArray, FloatArray
from atwood.display import data_of
from atwood.errors import UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import needed, scipy
from atwood.numerics.matrices import least_squares
from atwood.numerics.rank import decompose, null_space, rank, span
from atwood.simulation.contacts.chosen import words_text
from atwood.table import Shown, Table, facts, table


@dataclass(frozen=True, eq=False)
class LinearModel(Shown):
    """A linear model ``x' = A x + B w``, ``y = C x + D w`` of a scene about a state.

    Attributes
    ----------
    A, B, C, D
        Its matrices, in SI units.
    states
        What the states are deviations of: coordinates, small rotations of bodies in their own axes
        (``body.rotation.x``, rad) and speeds, by path; position and speed of drives that are inputs come last.
    inputs
        Inputs by path; with a prime twice, ``drive.motion''``, where it is the second derivative of a prescribed
        motion.
    outputs
        Quantities by path.
    units
        SI unit of every state, input and output by name.
    values
        The state that it is about: value by path of the coordinates and speeds that have one number each.
    scene
        Name of the scene.
    form
        Form whose equations were linearised.
    about
        ``"rest"``, ``"steady motion"`` or ``"motion"``, for a state of a run, where A holds at that time alone.
    contacts
        The set of contacts that it holds in: what each gap and slip does, by path.
    error, sizes
        How far rounding can have taken the entries of A, and what is large for each state.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: Mapping[str, str]
    values: Mapping[str, float]
    scene: str
    form: str
    about: str
    error: FloatArray = field(repr=False)
    sizes: FloatArray = field(repr=False)
    contacts: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def spectrum(self) -> Spectrum:
        """Eigenvalues of A with their vectors, zero ones split off."""
        return find_spectrum(self.A, self.error, self.sizes)

    @property
    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues of A, 1/s: largest real part first, those that are zero last and exactly zero."""
        return self.spectrum.values

    @property
    def poles(self) -> ComplexArray:
        """The same as `eigenvalues`."""
        return self.eigenvalues

    @property
    def is_stable(self) -> bool:
        """Whether no eigenvalue has a positive real part beyond rounding."""
        return not bool(np.any(self.spectrum.others.real > _GROWING * self._fastest))

    @property
    def kind(self) -> str:
        """What the state is, in words."""
        return _ABOUT[self.about]

    @property
    def _fastest(self) -> float:
        return float(np.max(np.abs(self.spectrum.others), initial=0.0))

    @property
    def matrices(self) -> Matrices:
        """A, B, C and D."""
        return self.A, self.B, self.C, self.D

    def zeros(self) -> ComplexArray:
        """Return the finite transmission zeros, 1/s.

        Raises
        ------
        UsageError
            If there are not as many outputs as inputs.
        """
        if len(self.inputs) != len(self.outputs) or not self.inputs:
            raise UsageError(
                f"zeros belong to as many outputs as inputs, and here are {len(self.outputs)} and {len(self.inputs)}",
                where=self.scene,
                advice="Choose as many of both, one each for a transfer function.",
            )
        return transmission_zeros(self.matrices)

    def dc_gain(self) -> FloatArray:
        """Return the response to constant inputs, shape (outputs, inputs).

        Raises
        ------
        UsageError
            If an output grows without bound under a constant input.
        """
        found = static_gain(self.matrices)
        if found is None:
            raise UsageError(
                "under constant inputs an output grows without bound", where=self.scene, advice="Look at its rate."
            )
        return found

    def minimal_realization(self) -> Matrices:
        """Return A, B, C and D of the part that inputs reach and outputs see; its states have no names."""
        return minimal_realization(self.matrices)

    def frequency_response(self, angular_frequencies: Iterable[float]) -> ComplexArray:
        """Return the response to harmonic inputs.

        Parameters
        ----------
        angular_frequencies
            In rad/s.

        Returns
        -------
        numpy.ndarray
            Complex, shape (frequencies, outputs, inputs).
        """
        omega = check(ARRAY, angular_frequencies, "angular_frequencies", "frequency_response")
        return frequency_response(self.matrices, np.ravel(omega))

    def to_scipy(self) -> Any:
        """Return it as `scipy.signal.StateSpace`."""
        return scipy.signal.StateSpace(*self.matrices)

    def to_control(self) -> Any:
        """Return it as `control.StateSpace`, with the names of states, inputs and outputs.

        Raises
        ------
        UsageError
            If python-control is not installed.
        """
        control = needed("control", "'atwood[control]'", "python-control")
        names = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        flat = {kind: [one.replace(".", "_") for one in own] for kind, own in names.items()}
        return control.ss(*self.matrices, **{kind: own for kind, own in flat.items() if own})

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        about = data_of(self, "scene", "form", "about", "contacts", "values", "states", "inputs", "outputs", "units")
        return {**about, **data_of(self, *"ABCD", "eigenvalues")}

    def tables(self) -> tuple[Table, ...]:
        """Return states, inputs, outputs and eigenvalues, and the matrices where there are few states."""
        zeros = f"; {self.spectrum.zeros} times 0" if self.spectrum.zeros else ""
        swinging = [value for value in self.spectrum.others if value.imag > 0.0]
        rows = [
            ("states", ", ".join(self.states)),
            ("inputs", ", ".join(self.inputs) or "none: name some with --input"),
            ("outputs", ", ".join(self.outputs) or "none: name some with --output"),
            ("eigenvalues", ", ".join(complex_text(value) for value in self.spectrum.others) + f" 1/s{zeros}"),
            *([("frequencies", ", ".join(map(_oscillation, swinging)))] if swinging else []),
            *([("contacts", words_text(self.contacts))] if self.contacts else []),
            ("stability", "no deviation grows" if self.is_stable else "some deviations grow"),
        ]
        title = f"{self.scene} ({self.form}), linear about a {self.kind}"
        if len(self.states) > _SHOWN:
            return (facts(rows, title, [f"Matrices of {len(self.states)} states: --json writes them."]),)
        of = {"A": (self.states, self.states), "B": (self.states, self.inputs)}
        of |= {"C": (self.outputs, self.states), "D": (self.outputs, self.inputs)}
        matrices = (
            table(
                (name, *(f"{one}>" for one in across)),
                ((one, *(f"{x:.6g}" for x in values)) for one, values in zip(down, getattr(self, name), strict=True)),
            )
            for name, (down, across) in of.items()
            if down and across
        )
        return (facts(rows, title), *matrices)

    __str__ = Shown.as_text


_SHOWN = 8
"""Matrices of more states are not shown."""

_GROWING = 1e-9
"""Relative to the fastest eigenvalue: a real part below it is rounding."""

_ABOUT = {"rest": "state of rest", "steady motion": "steady motion", "motion": "state of a motion"}


def _oscillation(value: complex) -> str:
    return f"{value.imag / (2.0 * np.pi):.6g} Hz with damping ratio {-value.real / abs(value):.4g}"


def complex_text(value: complex) -> str:
    """Return a complex number as it is written."""
    if value.imag == 0.0:
        return f"{value.real:.6g}"
    real = f"{value.real:.6g} " if abs(value.real) > _GROWING * abs(value) else ""
    sign = ("+ " if value.imag > 0.0 else "- ") if real else "-" * int(value.imag < 0.0)
    return f"{real}{sign}{abs(value.imag):.6g}i"


Matrices = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""A, B, C, D."""

_LOST = 1e-10
"""How far matrices of a model, which come without errors, may be off, relative to what is in them."""


def minimal_realization(model: Matrices) -> Matrices:
    """Return the part of a model that inputs reach and outputs see.

    Kalman's decomposition by orthogonal staircases (Van Dooren, IEEE Trans. Automatic Control 26, 1981).
    """
    a, b, c, d = balanced(model)
    reached = _reached(a, b)
    a, b, c = reached.T @ a @ reached, reached.T @ b, c @ reached
    seen = _reached(a.T, c.T)
    return seen.T @ a @ seen, seen.T @ b, c @ seen, d


def balanced(model: Matrices) -> Matrices:
    """Return the same model in states of like size."""
    a, b, c, d = model
    if not len(a):
        return model
    _, (scale, _) = scipy.linalg.matrix_balance(a, permute=False, separate=True)
    return a * scale / scale[:, None], b / scale[:, None], c * scale, d


def _reached(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return an orthonormal basis, as columns, of what inputs reach."""
    n = len(a)
    basis = np.zeros((n, 0))
    new, size = b, max(float(np.linalg.norm(a)), 1e-300)
    while basis.shape[1] < n and new.size:
        left = new - basis @ (basis.T @ new)
        columns = np.linalg.norm(new, axis=0)
        left = left / np.where(columns > 0.0, columns, 1.0)
        found = span(left, _LOST)
        if not found.shape[1]:
            break
        found = np.linalg.qr(found - basis @ (basis.T @ found))[0]
        basis = np.hstack([basis, found])
        new = a @ found
        new = np.where(np.linalg.norm(new, axis=0) > _LOST * size, new, 0.0)
    return basis


def transmission_zeros(model: Matrices) -> ComplexArray:
    """Return the finite zeros of a model with as many outputs as inputs.

    They are the generalized eigenvalues of ``[[A, B], [C, D]]`` and ``[[I, 0], [0, 0]]`` (Rosenbrock, 1970). Infinite
    ones are split off before: each step leaves a smaller pencil with the same finite eigenvalues.
    """
    a, b, c, d = minimal_realization(model)
    while len(a):
        at_once = decompose(d, _LOST * max(float(np.linalg.norm(d, 2)), float(np.linalg.norm(c))))
        if at_once.rank == len(d):
            return np.asarray(np.linalg.eigvals(a - b @ np.linalg.solve(d, c)), dtype=complex)
        # Outputs that no input reaches at once hold C x = 0: what stays on it is a smaller model (Silverman).
        c, d = at_once.left.T @ c, at_once.left.T @ d
        held = decompose(c[at_once.rank :], _LOST * float(np.linalg.norm(c)))
        if held.rank < len(d) - at_once.rank:
            return np.zeros(0, dtype=complex)  # outputs depend on each other: every number would be a zero
        stay, leave = held.null_space, held.row_space
        c = np.vstack([c[: at_once.rank] @ stay, leave.T @ a @ stay])
        d = np.vstack([d[: at_once.rank], leave.T @ b])
        a, b = stay.T @ a @ stay, stay.T @ b
    return np.zeros(0, dtype=complex)


def static_gain(model: Matrices) -> FloatArray | None:
    """Return ``D - C A^-1 B`` of the minimal realization; None if that has an integrator."""
    a, b, c, d = minimal_realization(model)
    if not len(a):
        return d
    if rank(a, _LOST * float(np.linalg.norm(a, 2))) < len(a):
        return None
    return np.asarray(d - c @ np.linalg.solve(a, b))


def frequency_response(model: Matrices, omega: FloatArray) -> ComplexArray:
    """Return ``C (i omega - A)^-1 B + D``, shape (frequencies, outputs, inputs)."""
    a, b, c, d = balanced(model)
    shifted = 1j * omega[:, None, None] * np.eye(len(a)) - a
    return np.asarray(c @ np.linalg.solve(shifted, np.broadcast_to(b.astype(complex), (len(omega), *b.shape))) + d)


_ROUNDING = 1e-14
"""Relative to the largest singular value after balancing: what is less is rounding of the decomposition itself."""

_SWEEPS, _FACTOR = 3, 4.0
"""So often every state is scaled, each time by this at most."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenvalues of a matrix.

    Attributes
    ----------
    zeros
        How many are zero.
    others
        The others, sorted by real part, then imaginary part, largest first.
    vectors
        A column for each of these.
    """

    zeros: int
    others: ComplexArray
    vectors: ComplexArray

    @property
    def values(self) -> ComplexArray:
        """All eigenvalues, zeros last."""
        return np.concatenate([self.others, np.zeros(self.zeros, dtype=complex)])


def find_spectrum(matrix: FloatArray, error: FloatArray, sizes: FloatArray) -> Spectrum:
    """Return the eigenvalues of a matrix."""
    n = len(matrix)
    if n == 0:
        return Spectrum(0, np.zeros(0, dtype=complex), np.zeros((0, 0), dtype=complex))
    # Entries that are nothing but rounding say nothing of how large states are beside each other.
    certain = np.where(np.abs(matrix) > error, matrix, 0.0)
    scale = sizes * _scale(certain * sizes / sizes[:, None])
    balanced = certain * scale[None, :] / scale[:, None]
    zeros, basis, left = _split(balanced, rounding(balanced, error * scale[None, :] / scale[:, None]))
    values, own = np.linalg.eig(left)
    chosen = np.lexsort((-values.imag, -values.real))
    vectors = _lifted(balanced, basis, values[chosen], own[:, chosen])
    return Spectrum(zeros, values[chosen], scale[:, None] * vectors)


def rounding(matrix: FloatArray, error: FloatArray) -> float:
    """Return how far a matrix may be off: its entries, and its decomposition."""
    return max(_ROUNDING * float(np.linalg.norm(matrix, 2)), float(np.linalg.norm(error)))


def _scale(matrix: FloatArray) -> FloatArray:
    """Return sizes of states with which rows and columns are alike, as far as a few steps lead.

    Osborne's iteration (J. ACM 7, 1960). It does not end where states do not act on each other both ways, as where
    coordinates are cyclic; what it has reached by then is good enough.
    """
    scale, sizes = np.ones(len(matrix)), np.abs(matrix)
    np.fill_diagonal(sizes, 0.0)
    for _ in range(_SWEEPS):
        for i in range(len(matrix)):
            row, column = float(np.sum(sizes[i] * scale)) / scale[i], float(np.sum(sizes[:, i] / scale)) * scale[i]
            if row > 0.0 and column > 0.0:
                scale[i] *= np.clip(np.sqrt(row / column), 1.0 / _FACTOR, _FACTOR)
    return np.asarray(scale / np.exp(np.mean(np.log(scale))))


def _split(matrix: FloatArray, bound: float) -> tuple[int, FloatArray, FloatArray]:
    """Return how many eigenvalues are zero, a basis of what is left, and the matrix on it."""
    basis, left, zeros = np.eye(len(matrix)), matrix, 0
    while len(left):
        found = decompose(left, bound)
        if found.rank == len(left):
            break
        zeros += len(left) - found.rank
        # On the quotient by what goes to zero: the rest of an orthonormal basis.
        keep = found.row_space
        basis, left = basis @ keep, keep.T @ left @ keep
    return zeros, basis, left


def _lifted(matrix: FloatArray, basis: FloatArray, values: ComplexArray, own: ComplexArray) -> ComplexArray:
    """Return eigenvectors of the whole matrix from those on the quotient."""
    found = np.empty((len(matrix), len(values)), dtype=complex)
    rest = null_space(basis.T, rank=basis.shape[1]) if len(values) else np.zeros((len(matrix), 0))
    for k, value in enumerate(values):
        # (A - lambda) v = 0 with v = basis y + what was split off; A is not singular there at lambda != 0.
        v = basis @ own[:, k]
        if rest.shape[1]:
            shifted = matrix - value * np.eye(len(matrix))
            v = v - rest @ least_squares(shifted @ rest, shifted @ v)
        found[:, k] = v / np.linalg.norm(v)
    return found
