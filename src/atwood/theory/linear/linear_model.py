"""Linear models: matrices with the names of what they belong to, and what follows from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import ARRAY, check
from atwood.arrays import ComplexArray, FloatArray
from atwood.errors import UsageError
from atwood.late import dataclass
from atwood.showing import data_of
from atwood.table import Shown, Table, facts, table
from atwood.theory.linear.realization import (
    Matrices,
    frequency_response,
    minimal_realization,
    static_gain,
    transmission_zeros,
)
from atwood.theory.linear.spectrum import Spectrum, find_spectrum

__all__ = ["LinearModel", "complex_text"]


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
        from scipy.signal import StateSpace

        return StateSpace(*self.matrices)

    def to_control(self) -> Any:
        """Return it as `control.StateSpace`, with the names of states, inputs and outputs.

        Raises
        ------
        UsageError
            If python-control is not installed.
        """
        try:
            import control
        except ImportError:
            raise UsageError(
                "python-control is not installed", advice="Install it: pip install 'atwood[control]'."
            ) from None
        names = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        flat = {kind: [one.replace(".", "_") for one in own] for kind, own in names.items()}
        return control.ss(*self.matrices, **{kind: own for kind, own in flat.items() if own})

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        names = ("scene", "form", "about", "values", "states", "inputs", "outputs", "units", *"ABCD", "eigenvalues")
        return data_of(self, *names)

    def tables(self) -> tuple[Table, ...]:
        """Return states, inputs, outputs and eigenvalues, and the matrices where there are few states."""
        zeros = f"; {self.spectrum.zeros} times 0" if self.spectrum.zeros else ""
        rows = [
            ("states", ", ".join(self.states)),
            ("inputs", ", ".join(self.inputs) or "none: name some with --input"),
            ("outputs", ", ".join(self.outputs) or "none: name some with --output"),
            ("eigenvalues", ", ".join(complex_text(value) for value in self.spectrum.others) + f" 1/s{zeros}"),
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


def complex_text(value: complex) -> str:
    """Return a complex number as it is written."""
    if value.imag == 0.0:
        return f"{value.real:.6g}"
    real = f"{value.real:.6g} " if abs(value.real) > _GROWING * abs(value) else ""
    sign = ("+ " if value.imag > 0.0 else "- ") if real else "-" * int(value.imag < 0.0)
    return f"{real}{sign}{abs(value.imag):.6g}i"
