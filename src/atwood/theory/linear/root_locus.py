"""`root_locus`: eigenvalues of a scene while one value changes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from atwood.arguments import TEXT, Kind, takes
from atwood.arrays import ComplexArray, FloatArray
from atwood.display import fitted
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assemble
from atwood.ranges import values_of
from atwood.theory.linear.linearize import linearize
from atwood.theory.linear.operating_point import AT


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
    base = scene if isinstance(scene, Assembly) else assemble(scene)
    numbers = np.asarray(values, dtype=float)
    is_state = path in base.start_observables
    rows: list[ComplexArray] = []
    for value in numbers:
        if is_state:
            model = linearize(base, at={**(at or {}), path: float(value)})
        else:
            model = linearize(base.with_values({path: float(value)}), at=at)
        rows.append(model.eigenvalues)
        if len(rows[-1]) != len(rows[0]):
            raise UsageError(f"at {value:g} the scene has another number of states", where=path)
    return RootLocus(path, numbers, _followed(rows), base.flat.name)


def _followed(rows: list[ComplexArray]) -> ComplexArray:
    """Return eigenvalues sorted so that each column changes little from row to row."""
    found = np.array(rows)
    for i in range(1, len(found)):
        guess = found[i - 1] if i == 1 else 2.0 * found[i - 1] - found[i - 2]
        cost = np.abs(guess[:, None] - found[i][None, :]) + np.abs(found[i - 1][:, None] - found[i][None, :])
        found[i] = found[i][scipy.optimize.linear_sum_assignment(cost)[1]]
    return found
