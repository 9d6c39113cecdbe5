"""Mass properties of bodies of simple shape, from their sizes and a density or a mass.

Every shape has its own frame, said in its docstring; `MassProperties.placed` puts it elsewhere. Shapes of revolution
lie along z unless `axis` says "x" or "y". Closed forms: Goldstein, Poole and Safko, *Classical Mechanics*, ch. 5; Beer
and Johnston, *Vector Mechanics for Engineers*, table of mass moments of inertia.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from atwood.arguments import check, one_of, real, show, takes_names
from atwood.errors import ParameterError
from atwood.solids.properties import MassProperties

Axis = Literal["x", "y", "z"]


@takes_names
def box(
    length_x: float, length_y: float, length_z: float, *, density: float | None = None, mass: float | None = None
) -> MassProperties:
    """Return a solid box with its edges along the axes; the origin is its centre.

    Parameters
    ----------
    length_x, length_y, length_z
        Lengths of the edges in m.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.

    Notes
    -----
    I_xx = m (b^2 + c^2) / 12, and so on.
    """
    a, b, c = (
        _positive(length_x, "length along x"),
        _positive(length_y, "length along y"),
        _positive(length_z, "length along z"),
    )
    m = _mass(a * b * c, density, mass, "density", "kg/m^3")
    return _centred(m, (m * (b * b + c * c) / 12, m * (c * c + a * a) / 12, m * (a * a + b * b) / 12))


@takes_names
def cylinder(
    radius: float, length: float, *, density: float | None = None, mass: float | None = None, axis: Axis = "z"
) -> MassProperties:
    """Return a solid circular cylinder along `axis`; the origin is its centre.

    Parameters
    ----------
    radius, length
        In m.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.
    axis
        The axis of revolution.

    Notes
    -----
    m r^2 / 2 about its axis, m (3 r^2 + l^2) / 12 across.
    """
    r, l = _positive(radius, "radius"), _positive(length, "length")
    m = _mass(math.pi * r * r * l, density, mass, "density", "kg/m^3")
    return _revolved(m, m * r * r / 2, m * (3 * r * r + l * l) / 12, 0.0, axis)


@takes_names
def tube(
    outer_radius: float,
    inner_radius: float,
    length: float,
    *,
    density: float | None = None,
    mass: float | None = None,
    axis: Axis = "z",
) -> MassProperties:
    """Return a hollow circular cylinder along `axis`; the origin is its centre.

    Parameters
    ----------
    outer_radius, inner_radius, length
        In m. An inner radius equal to the outer one is a thin-walled tube, which has a mass but no density.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.
    axis
        The axis of revolution.

    Notes
    -----
    m (R^2 + r^2) / 2 about its axis, m (3 (R^2 + r^2) + l^2) / 12 across.
    """
    outer, l = _positive(outer_radius, "outer radius"), _positive(length, "length")
    inner = _inner(inner_radius, outer)
    m = _mass(math.pi * (outer - inner) * (outer + inner) * l, density, mass, "density", "kg/m^3")
    squares = outer * outer + inner * inner
    return _revolved(m, m * squares / 2, m * (3 * squares + l * l) / 12, 0.0, axis)


@takes_names
def sphere(
    radius: float, *, inner_radius: float = 0.0, density: float | None = None, mass: float | None = None
) -> MassProperties:
    """Return a sphere, solid or with a concentric cavity; the origin is its centre.

    Parameters
    ----------
    radius, inner_radius
        In m.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.

    Notes
    -----
    2 m (R^5 - r^5) / (5 (R^3 - r^3)), computed without cancellation for thin shells.
    """
    outer = _positive(radius, "radius")
    inner = _inner(inner_radius, outer)
    ratio = inner / outer
    cubes = 1 + ratio + ratio**2
    fifths = cubes + ratio**3 + ratio**4
    volume = 4 / 3 * math.pi * outer**2 * (outer - inner) * cubes
    m = _mass(volume, density, mass, "density", "kg/m^3")
    moment = 2 / 5 * m * outer**2 * fifths / cubes
    return _centred(m, (moment, moment, moment))


@takes_names
def spherical_shell(radius: float, *, area_density: float | None = None, mass: float | None = None) -> MassProperties:
    """Return a thin spherical shell; the origin is its centre.

    Parameters
    ----------
    radius
        In m.
    area_density, mass
        Mass per area in kg/m^2, or mass in kg: one of them.

    Notes
    -----
    2 m r^2 / 3.
    """
    r = _positive(radius, "radius")
    m = _mass(4 * math.pi * r * r, area_density, mass, "area_density", "kg/m^2")
    moment = 2 / 3 * m * r * r
    return _centred(m, (moment, moment, moment))


@takes_names
def disc(
    radius: float,
    *,
    inner_radius: float = 0.0,
    area_density: float | None = None,
    mass: float | None = None,
    axis: Axis = "z",
) -> MassProperties:
    """Return a thin disc at right angles to `axis`, or a thin ring; the origin is its centre.

    Parameters
    ----------
    radius, inner_radius
        In m; equal radii make a hoop, which has a mass but no area density.
    area_density, mass
        Mass per area in kg/m^2, or mass in kg: one of them.
    axis
        The axis of revolution.

    Notes
    -----
    m (R^2 + r^2) / 2 about its axis, half of that across.
    """
    outer = _positive(radius, "radius")
    inner = _inner(inner_radius, outer)
    area = math.pi * (outer - inner) * (outer + inner)
    m = _mass(area, area_density, mass, "area_density", "kg/m^2")
    squares = outer * outer + inner * inner
    return _revolved(m, m * squares / 2, m * squares / 4, 0.0, axis)


@takes_names
def rod(
    length: float, *, line_density: float | None = None, mass: float | None = None, axis: Axis = "z"
) -> MassProperties:
    """Return a slender rod along `axis`; the origin is its centre. It has no moment of inertia about its axis.

    Parameters
    ----------
    length
        In m.
    line_density, mass
        Mass per length in kg/m, or mass in kg: one of them.
    axis
        The direction of the rod.

    Notes
    -----
    m l^2 / 12 across.
    """
    l = _positive(length, "length")
    m = _mass(l, line_density, mass, "line_density", "kg/m")
    return _revolved(m, 0.0, m * l * l / 12, 0.0, axis)


@takes_names
def cone(
    radius: float, height: float, *, density: float | None = None, mass: float | None = None, axis: Axis = "z"
) -> MassProperties:
    """Return a solid circular cone; the origin is the centre of its base, its tip lies at +`height` on `axis`.

    Parameters
    ----------
    radius
        Radius of the base in m.
    height
        In m.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.
    axis
        The axis of revolution.

    Notes
    -----
    The centre of mass lies at h/4; about it 3 m r^2 / 10 about the axis and 3 m (4 r^2 + h^2) / 80 across.
    """
    r, h = _positive(radius, "radius"), _positive(height, "height")
    m = _mass(math.pi * r * r * h / 3, density, mass, "density", "kg/m^3")
    return _revolved(m, 3 * m * r * r / 10, 3 * m * (4 * r * r + h * h) / 80, h / 4, axis)


@takes_names
def ellipsoid(
    semi_axis_x: float,
    semi_axis_y: float,
    semi_axis_z: float,
    *,
    density: float | None = None,
    mass: float | None = None,
) -> MassProperties:
    """Return a solid ellipsoid with its semi-axes along the axes; the origin is its centre.

    Parameters
    ----------
    semi_axis_x, semi_axis_y, semi_axis_z
        In m.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.

    Notes
    -----
    I_xx = m (b^2 + c^2) / 5, and so on.
    """
    a, b, c = (
        _positive(semi_axis_x, "semi-axis along x"),
        _positive(semi_axis_y, "semi-axis along y"),
        _positive(semi_axis_z, "semi-axis along z"),
    )
    m = _mass(4 / 3 * math.pi * a * b * c, density, mass, "density", "kg/m^3")
    return _centred(m, (m * (b * b + c * c) / 5, m * (c * c + a * a) / 5, m * (a * a + b * b) / 5))


def _centred(mass: float, moments: tuple[float, float, float]) -> MassProperties:
    """Return a body with its centre at the origin and its principal axes along the frame's."""
    return MassProperties(mass, np.zeros(3), np.diag(moments))


def _revolved(mass: float, about: float, across: float, height: float, axis: Axis) -> MassProperties:
    """Return a body of revolution from its moments about its axis and across it, and the height of its centre."""
    check(one_of(("x", "y", "z")), axis, "axis", error=ParameterError)
    number = "xyz".index(axis)
    moments, centre = np.full(3, across), np.zeros(3)
    moments[number], centre[number] = about, height
    return MassProperties(mass, centre, np.diag(moments))


def _mass(measure: float, density: float | None, mass: float | None, name: str, unit: str) -> float:
    """Return the mass from exactly one of a density and a mass."""
    if (density is None) == (mass is None):
        found = "neither is given" if mass is None else "both are given"
        raise ParameterError(f"a shape needs its {name} or its mass, and {found}", advice=f"Give {name}= or mass=.")
    if mass is not None:
        return _positive(mass, "mass", "kg")
    if measure == 0:
        raise ParameterError(f"a shape without extent has no mass from its {name}", advice="Give its mass= instead.")
    return _positive(density, name, unit) * measure


def _inner(inner: float, outer: float) -> float:
    """Return an inner radius that is not negative and at most the outer one."""
    value = 0.0 if type(inner) in (int, float) and inner == 0 else _positive(inner, "inner radius")
    if value > outer:
        raise ParameterError(
            f"the inner radius, {value:.6g} m, is greater than the outer one, {outer:.6g} m",
            advice="Give an inner radius from zero to the outer one.",
        )
    return value


def _positive(value: float | None, name: str, unit: str = "m") -> float:
    """Return a positive finite number."""
    try:
        number = real(value)
    except Exception:  # a value of somebody else's class may raise anything
        raise ParameterError(f"the {name} is {show(value)}", advice=f"Give a number in {unit}.") from None
    if not (math.isfinite(number) and number > 0):
        raise ParameterError(f"the {name} is {number:.6g} {unit}", advice="It must be positive and finite.")
    return number
