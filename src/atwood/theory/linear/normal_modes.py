"""`normal_modes`: small oscillations of a scene about rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np

from atwood.arguments import check, command, number, takes, whole
from atwood.arrays import ComplexArray, FloatArray
from atwood.forms.assembly import Assembly
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE
from atwood.result.result import Result
from atwood.showing import data_of, plain
from atwood.table import Shown, Table, table
from atwood.theory.linear.linearize import not_steady
from atwood.theory.linear.mode_motion import mode_motion
from atwood.theory.linear.modes import find_modes
from atwood.theory.linear.operating_point import AT, At, OperatingPoint, find_operating_point, values_at
from atwood.theory.linear.state_space import find_state_space
from atwood.theory.linear.steady import find_steady, still
from atwood.theory.linear.switches import refuse_switches

__all__ = ["NormalModes", "modes_of", "normal_modes", "shape_text"]


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
    def frequencies(self) -> FloatArray:
        """Frequencies, Hz."""
        return self.angular_frequencies / (2.0 * np.pi)

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
        told = data_of(self, "scene", "values", "angular_frequencies", "growth_rates")
        return {**told, "shapes": shapes, "spaces": plain(self.spaces)}

    def tables(self) -> tuple[Table, ...]:
        """Return frequencies, growth and shape of each mode."""
        columns = zip(self.angular_frequencies, self.frequencies, self.growth_rates, self.shapes, strict=True)
        rows = [
            (str(k), f"{omega:.9g}", f"{hertz:.6g}", f"{growth:.6g}", shape_text(shape))
            for k, (omega, hertz, growth, shape) in enumerate(columns)
        ]
        notes = [
            f"Modes {', '.join(map(str, group))} have equal eigenvalues: any combination of them is a mode."
            for group in self.spaces
            if len(group) > 1
        ]
        title = f"{self.scene}: {len(self)} modes about {values_text(self.values)}"
        return (table(("mode", "rad/s>", "Hz>", "growth, 1/s>", "shape"), rows, title, notes),)

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


@command("modes")
@takes(scene=SCENE, at=AT)
def normal_modes(scene: Model | Assembly, *, at: At = None) -> NormalModes:
    """Find the frequencies and shapes of small oscillations.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    at
        The state of rest or the steady motion, as for `linearize`. The scene's start if not given.

    Returns
    -------
    NormalModes
        One for each degree of freedom without velocity terms; with damping or gyroscopic terms one for each pair of
        conjugate eigenvalues and for each real one.

    Raises
    ------
    UsageError
        If the state is neither at rest nor a steady motion, or a law switches there.
    """
    point = find_operating_point(scene, at, ())
    return modes_of(point)


def modes_of(point: OperatingPoint, is_steady: bool = False) -> NormalModes:
    """Return the modes about an operating point.

    Parameters
    ----------
    point
        The operating point.
    is_steady
        Whether it is known that it stays there, though other things may change with time.
    """
    flow = point.scene.flow(point.t, point.q, point.u, point.kept)
    if not is_steady:
        refuse_switches(point.scene, flow, point.kept)
    steady = still(flow) if point.is_from_result else find_steady(point.scene, flow, point.kept)
    if not steady.is_steady:
        if not is_steady:
            raise not_steady(point, flow, steady)
        steady = still(flow)  # it keeps still in a scene that changes, as a load that is hoisted
    space = find_state_space(point.scene, flow, steady, point.kept)
    found = find_modes(flow, space)
    names = point.scene.tangents.names
    shapes = tuple(dict(zip(names, map(complex, column), strict=True)) for column in found.shapes.T)
    return NormalModes(
        found.angular_frequencies,
        found.growth_rates,
        found.eigenvalues,
        shapes,
        found.spaces,
        values_at(point),
        point.assembly.flat.name,
        point,
        found.shapes,
    )
