"""Inertias of files: checked, and on request replaced by the nearest that a body can have."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from atwood import ParameterError
from atwood.solids import MassProperties

__all__ = ["checked_inertia", "nearest_inertia"]

Tensor = NDArray[np.float64]


def nearest_inertia(inertia: Any) -> Tensor:
    """Return the inertia that a body can have and that is nearest to a symmetric matrix, in the Frobenius norm.

    The principal axes stay. The principal moments are ``J_1 = s_2 + s_3`` and so on, with second moments of mass s that
    are not negative; that is the triangle inequality (Wensing, Kim and Slotine, IEEE Robotics and Automation Letters 3,
    60, 2018). The nearest moments solve a least-squares problem in s.

    Parameters
    ----------
    inertia
        About the centre of mass, shape (3, 3), kg m^2.
    """
    tensor = np.asarray(inertia, dtype=float)
    moments, axes = np.linalg.eigh((tensor + tensor.T) / 2)
    second, _ = nnls(1.0 - np.eye(3), moments)
    nearest: Tensor = axes @ np.diag((1.0 - np.eye(3)) @ second) @ axes.T
    return nearest


def checked_inertia(mass: float, centre: Any, inertia: Any, inertias: str, where: str) -> MassProperties:
    """Return mass properties; an inertia that no body has is refused, or replaced if `inertias` is ``"nearest"``.

    Of what has no mass the nearest inertia is none.

    Raises
    ------
    ParameterError
        If no body can have them, with the principal moments.
    """
    try:
        return MassProperties(mass, centre, inertia)
    except ParameterError as error:
        if inertias == "nearest" and mass >= 0.0:
            near = nearest_inertia(inertia) if mass > 0.0 else np.zeros((3, 3))
            return MassProperties(mass, centre, near)
        moments = ", ".join(f"{one:.6g}" for one in np.linalg.eigvalsh(np.asarray(inertia)))
        said = "" if moments in error.message else f"; its principal moments are {moments} kg m^2"
        raise ParameterError(
            f"{error.message}{said}",
            where=where,
            advice="Correct the file, or read it with inertias='nearest'.",
        ) from None
