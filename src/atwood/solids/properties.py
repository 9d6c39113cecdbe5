"""Mass, centre of mass and inertia of a rigid body: what they must fulfil, and how they move and add up.

The inertia is the tensor I = sum of m (|r|^2 1 - r r^T) with r from the centre of mass (Goldstein, Poole and Safko,
*Classical Mechanics*, 3rd ed., sec. 5.3), so its off-diagonal elements are *minus* the products of inertia.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from atwood.arguments import check, instance, number, real, show, takes
from atwood.arrays import FloatArray
from atwood.errors import ParameterError
from atwood.lazy_dataclasses import dataclass

_NOTHING_LEFT = 1e-9
"""A body of which holes leave less than this part has nothing left."""

_EQUAL_MOMENTS = 1e-9
"""Principal moments that are this close, relative to the largest one, count as equal: their axes are not unique."""


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre of mass and inertia of a rigid body, seen from a frame that is fixed in it.

    Parameters
    ----------
    mass
        Mass in kg; zero is allowed, for what has no inertia either.
    centre
        Position of the centre of mass in the frame, shape (3,), in m.
    inertia
        Inertia tensor about the *centre of mass*, along the axes of the frame, shape (3, 3), in kg m^2. A needle (one
        principal moment is zero) and a point (all are zero) are allowed.

    Raises
    ------
    ParameterError
        If a number is not finite, the mass is negative, or the inertia is one that no body can have: not symmetric,
        a negative principal moment, one principal moment greater than the sum of the other two.
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray

    def __post_init__(self) -> None:
        mass = checked_number(self.mass, "mass", "kg")
        centre = checked_array(self.centre, (3,), "centre of mass", "m")
        inertia = checked_array(self.inertia, (3, 3), "inertia", "kg m^2")
        if mass < 0:
            raise ParameterError(f"the mass is {mass:.6g} kg", advice="A mass cannot be negative.")
        inertia = verify_moments(symmetric_part(inertia))
        if mass == 0 and np.any(inertia):
            raise ParameterError(
                "there is an inertia but no mass", advice="Give the body a mass, or set its inertia to zero."
            )
        for name, array in (("centre", centre), ("inertia", inertia)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "mass", mass)

    @property
    def principal_moments(self) -> FloatArray:
        """The principal moments of inertia about the centre of mass, ascending, shape (3,), in kg m^2."""
        return self.principal()[0]

    @property
    def principal_axes(self) -> FloatArray:
        """The principal axes as columns, in the order of the moments, shape (3, 3): right-handed (see `principal`)."""
        return self.principal()[1]

    def principal(self) -> tuple[FloatArray, FloatArray]:
        """Return the principal moments and axes.

        Returns
        -------
        moments : ndarray, shape (3,)
            Ascending, in kg m^2.
        axes : ndarray, shape (3, 3)
            Columns are the axes, so that `inertia` is ``axes @ diag(moments) @ axes.T``; a rotation matrix. Where
            moments are equal the axes are taken along the frame's own as far as possible, and each axis but the last
            has its largest component positive; so the same body always gives the same axes.
        """
        moments, vectors = np.linalg.eigh(self.inertia)
        largest = float(np.max(np.abs(moments)))
        axes: list[FloatArray] = []
        start = 0
        for end in range(1, 4):
            if end < 3 and moments[end] - moments[end - 1] <= _EQUAL_MOMENTS * largest:
                continue
            axes.extend(_along_frame(vectors[:, start:end]))
            start = end
        if np.dot(np.cross(axes[0], axes[1]), axes[2]) < 0:
            axes[2] = -axes[2]
        return np.maximum(moments, 0.0), np.column_stack(axes)

    def inertia_about(self, point: ArrayLike) -> FloatArray:
        """Return the inertia about another point, by the parallel-axis (Steiner's) theorem.

        Parameters
        ----------
        point
            Position in the frame, shape (3,), in m.

        Returns
        -------
        ndarray, shape (3, 3)
            Along the axes of the frame, in kg m^2.
        """
        return self.inertia + _steiner(self.mass, self.centre - checked_array(point, (3,), "point", "m"))

    @classmethod
    def from_inertia_about(
        cls, mass: float, centre: ArrayLike, inertia: ArrayLike, point: ArrayLike = (0.0, 0.0, 0.0)
    ) -> MassProperties:
        """Make mass properties from an inertia that is known about another point than the centre of mass.

        Parameters
        ----------
        mass
            Mass in kg.
        centre
            Centre of mass in the frame, in m.
        inertia
            Inertia about `point`, along the axes of the frame, in kg m^2.
        point
            The point, in m; the origin of the frame unless given.

        Raises
        ------
        ParameterError
            If what is left about the centre of mass is an inertia that no body can have.
        """
        mass = checked_number(mass, "mass", "kg")
        middle = checked_array(centre, (3,), "centre of mass", "m")
        offset = middle - checked_array(point, (3,), "point", "m")
        tensor = symmetric_part(checked_array(inertia, (3, 3), "inertia", "kg m^2"))
        try:
            return cls(mass, middle, _cut_rounding(tensor - _steiner(mass, offset), float(np.trace(tensor))))
        except ParameterError as error:
            raise ParameterError(
                f"the inertia about the given point leaves none that a body can have about its centre of mass, "
                f"{np.linalg.norm(offset):.4g} m away: {error.message}",
                advice="Check which point the inertia is about.",
            ) from error

    def placed(self, rotation: ArrayLike | None = None, translation: ArrayLike = (0.0, 0.0, 0.0)) -> MassProperties:
        """Return the same body as seen from another frame.

        Parameters
        ----------
        rotation
            R_AB, shape (3, 3): its columns are the axes of this frame B in the other frame A. None for parallel axes.
        translation
            p_AB, shape (3,): the origin of this frame B in the other frame A, in m.

        Returns
        -------
        MassProperties
            Centre and inertia in A.

        Raises
        ------
        ParameterError
            If the matrix is not a right-handed rotation.
        """
        turn = np.eye(3) if rotation is None else checked_rotation(rotation)
        shift = checked_array(translation, (3,), "translation", "m")
        inertia = turn @ self.inertia @ turn.T
        return MassProperties(self.mass, turn @ self.centre + shift, (inertia + inertia.T) / 2)

    def is_close(self, other: MassProperties, relative: float = 1e-9) -> bool:
        """Return whether two bodies have the same mass properties.

        Lengths are compared relative to the size of the bodies (radius of gyration and distance of the centres from
        the origin), the other quantities relative to themselves.
        """
        check(BODY, other, "other", "MassProperties.is_close")
        relative = check(number("a number above 0", above=0.0), relative, "relative", "MassProperties.is_close")
        mass = max(self.mass, other.mass)
        inertia = max(float(np.max(np.abs(body.inertia))) for body in (self, other))
        length = max(float(np.linalg.norm(self.centre)), float(np.linalg.norm(other.centre)))
        if mass > 0:
            length = math.hypot(length, math.sqrt(inertia / mass))
        return bool(
            abs(self.mass - other.mass) <= relative * mass
            and np.all(np.abs(self.centre - other.centre) <= relative * length)
            and np.all(np.abs(self.inertia - other.inertia) <= relative * inertia)
        )


BODY = instance("the mass properties of a body, such as solids.box(1, 1, 1, mass=1)", MassProperties)


def point_mass(mass: float, position: ArrayLike = (0.0, 0.0, 0.0)) -> MassProperties:
    """Return the mass properties of a point mass (kg) at a position (m)."""
    return MassProperties(mass, checked_array(position, (3,), "position", "m"), np.zeros((3, 3)))


@takes(ParameterError, parts=BODY)
def combine(*parts: MassProperties) -> MassProperties:
    """Return the mass properties of parts that are rigidly joined, all seen from the same frame.

    Parameters
    ----------
    *parts
        At least one. Where all are massless the centre is the mean of their centres.

    Raises
    ------
    ParameterError
        If there is no part.
    """
    if not parts:
        raise ParameterError("there is nothing to combine", advice="Give at least one part.")
    return _total(parts, [1.0] * len(parts))


@takes(ParameterError, whole=BODY, holes=BODY)
def subtract(whole: MassProperties, *holes: MassProperties) -> MassProperties:
    """Return the mass properties of a body out of which pieces are cut.

    Parameters
    ----------
    whole
        The body before, seen from some frame.
    *holes
        What is taken away, as the mass properties of the missing material (of the density of the body), seen from the
        same frame. The pieces must lie inside the body and must not overlap, which cannot be checked from mass
        properties alone; what remains is checked as every inertia is.

    Raises
    ------
    ParameterError
        If less than nothing is left: the holes have more mass than the body, or the inertia that is left is one
        that no body can have.
    """
    left = whole.mass - math.fsum(hole.mass for hole in holes)
    if left <= _NOTHING_LEFT * whole.mass and holes:
        raise ParameterError(
            f"the holes take {whole.mass - left:.6g} kg out of {whole.mass:.6g} kg",
            advice="Check the sizes and that the density of the holes is the one of the body.",
        )
    try:
        return _total([whole, *holes], [1.0] + [-1.0] * len(holes))
    except ParameterError as error:
        raise ParameterError(
            f"what is left without the holes is no body: {error.message}",
            advice="Check that the holes lie inside the body and do not overlap.",
        ) from error


def _total(parts: Sequence[MassProperties], signs: Sequence[float]) -> MassProperties:
    """Add up parts with signs, about the mean of their centres: far from the origin nothing is lost."""
    near = np.mean([part.centre for part in parts], axis=0)
    weights = [sign * part.mass for sign, part in zip(signs, parts, strict=True)]
    mass = math.fsum(weights)
    if mass == 0:
        return MassProperties(0.0, near, np.zeros((3, 3)))
    offsets = [part.centre - near for part in parts]
    shift = sum((weight * offset for weight, offset in zip(weights, offsets, strict=True)), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    size = 0.0
    for sign, weight, part, offset in zip(signs, weights, parts, offsets, strict=True):
        about_total = part.inertia + _steiner(abs(weight), offset - shift)
        inertia += sign * about_total
        size += float(np.trace(about_total))
    return MassProperties(mass, near + shift, _cut_rounding(inertia, size))


def _cut_rounding(inertia: FloatArray, size: float) -> FloatArray:
    """Return a tensor that is the difference of larger ones, with what is only their rounding set to zero."""
    if float(np.max(np.abs(inertia))) <= 1e-14 * abs(size):
        return np.zeros((3, 3))
    return (inertia + inertia.T) / 2


def _steiner(mass: float, offset: FloatArray) -> FloatArray:
    """Return the inertia of a point mass about a point that lies at minus the offset from it."""
    return np.asarray(mass * (np.dot(offset, offset) * np.eye(3) - np.outer(offset, offset)))


def _along_frame(vectors: FloatArray) -> list[FloatArray]:
    """Return an orthonormal basis of the span of orthonormal columns, as close to the frame's axes as it goes."""
    if vectors.shape[1] == 1:
        axis = vectors[:, 0]
        # A component counts as the largest one although rounding makes another larger: else the sign would be chance.
        first = int(np.argmax(np.abs(axis) >= np.max(np.abs(axis)) * (1 - _EQUAL_MOMENTS)))
        return [axis * np.sign(axis[first])]
    basis: list[FloatArray] = []
    left = vectors @ vectors.T
    lengths = np.sqrt(np.maximum(np.diag(left), 0.0))
    # The frame's axes that reach furthest into the span, in the order x, y, z.
    best = sorted(range(3), key=lambda axis: (-round(float(lengths[axis]), 9), axis))[: vectors.shape[1]]
    for place in sorted(best):
        axis = left[:, place].copy()
        for other in basis:
            axis -= np.dot(axis, other) * other
        basis.append(axis / np.linalg.norm(axis))
    return basis


_SYMMETRY = 1e-9
"""How far opposite elements of an inertia may be apart, relative to its largest one."""

_PHYSICAL = 1e-5
"""How far moments may be from what a body can have, relative to the largest one: six printed digits of a thin plate,
whose greatest moment is exactly the sum of the other two, must pass."""

_ROTATION = 1e-9
"""How far the product of a rotation matrix with its transpose may be from the unit matrix."""


def verify_moments(inertia: FloatArray) -> FloatArray:
    """Return a tensor that a body can have, or raise an error where its principal moments are not.

    A principal moment that is negative by what printed digits leave (a needle's) becomes zero: motion about such an
    axis would have a negative energy.
    """
    moments, axes = np.linalg.eigh(inertia)
    allowed = _PHYSICAL * float(np.max(np.abs(moments)))
    listed = ", ".join(f"{moment:.6g}" for moment in moments)
    if moments[0] < -allowed:
        raise ParameterError(
            f"the inertia has a negative principal moment: its principal moments are {listed} kg m^2",
            advice=_advice(inertia, "No axis of a body has a negative moment of inertia."),
        )
    excess = moments[2] - moments[0] - moments[1]
    if excess > allowed:
        raise ParameterError(
            f"no body has the principal moments {listed} kg m^2: the largest, {moments[2]:.6g}, is greater than the "
            f"sum of the other two, {moments[0] + moments[1]:.6g}",
            advice=_advice(inertia, "Each moment of inertia must be at most the sum of the other two."),
        )
    if moments[0] >= -1e-14 * moments[2]:
        return inertia
    mended: FloatArray = (axes * np.maximum(moments, 0.0)) @ axes.T
    return symmetric_part(mended)


def _advice(inertia: FloatArray, rule: str) -> str:
    """Return the rule that is broken, and whether opposite signs of the products of inertia would mend it."""
    flipped = 2 * np.diag(np.diag(inertia)) - inertia
    moments = np.linalg.eigvalsh(flipped)
    allowed = _PHYSICAL * float(np.max(np.abs(moments)))
    if np.any(flipped != inertia) and moments[0] >= -allowed and moments[2] - moments[0] - moments[1] <= allowed:
        return (
            f"{rule} With the opposite signs off the diagonal it would be a body's: these elements are minus the "
            f"products of inertia."
        )
    return rule


def symmetric_part(inertia: FloatArray) -> FloatArray:
    """Return the symmetric part of a tensor that is symmetric but for rounding."""
    gap = np.abs(inertia - inertia.T)
    row, column = np.unravel_index(int(np.argmax(gap)), gap.shape)
    if gap[row, column] > _SYMMETRY * float(np.max(np.abs(inertia))):
        names = "xyz"
        raise ParameterError(
            f"the inertia is not symmetric: I_{names[row]}{names[column]} = {inertia[row, column]:.6g} and "
            f"I_{names[column]}{names[row]} = {inertia[column, row]:.6g} kg m^2",
            advice="Give the same value on both sides of the diagonal.",
        )
    return (inertia + inertia.T) / 2


def checked_rotation(value: ArrayLike) -> FloatArray:
    """Return a checked rotation matrix."""
    turn = checked_array(value, (3, 3), "rotation", "")
    if np.max(np.abs(turn @ turn.T - np.eye(3))) > _ROTATION:
        raise ParameterError(
            "the rotation is not one: its columns are not unit vectors at right angles",
            advice="Give a matrix whose columns are the axes of the body's frame.",
        )
    if np.linalg.det(turn) < 0:
        raise ParameterError("the rotation is a mirror image", advice="Give right-handed axes (determinant +1).")
    return turn


def checked_number(value: float, name: str, unit: str) -> float:
    """Return a finite number."""
    try:
        number = real(value)
    except Exception:  # a value of somebody else's class may raise anything
        raise ParameterError(f"the {name} is {show(value)}", advice=f"Give a number in {unit}.") from None
    if not math.isfinite(number):
        raise ParameterError(f"the {name} is {number}", advice=f"Give a finite number in {unit}.")
    return number


def checked_array(value: ArrayLike, shape: tuple[int, ...], name: str, unit: str) -> FloatArray:
    """Return an own copy of an array of finite numbers of a given shape."""
    try:
        array = np.array(value, dtype=float)
    except Exception:  # a value of somebody else's class may raise anything
        raise ParameterError(f"the {name} is {show(value)}", advice=f"Give numbers of shape {shape}.") from None
    if array.shape != shape:
        raise ParameterError(f"the {name} has shape {array.shape}", advice=f"Give numbers of shape {shape}.")
    if not np.all(np.isfinite(array)):
        unit_text = f" in {unit}" if unit else ""
        raise ParameterError(f"the {name} is not finite: {array.tolist()}", advice=f"Give finite numbers{unit_text}.")
    return array
