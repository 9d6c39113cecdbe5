"""Exact mass properties of the body that a closed triangle mesh bounds."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from atwood.arguments import FILE, instance, number, optional, takes
from atwood.errors import ParameterError
from atwood.solids.mesh import TriangleMesh, closed_mesh
from atwood.solids.properties import MassProperties
from atwood.solids.stl import read_stl

__all__ = ["mesh_solid", "stl_solid"]


_SIZE = optional(number("a positive number", above=0.0))
_MESH = instance("a mesh, as closed_mesh makes it", TriangleMesh)


@takes(ParameterError, mesh=_MESH, density=_SIZE, mass=_SIZE)
def mesh_solid(mesh: TriangleMesh, *, density: float | None = None, mass: float | None = None) -> MassProperties:
    """Return the mass properties of the homogeneous body that a closed mesh bounds, in the frame of its vertices.

    Parameters
    ----------
    mesh
        From `closed_mesh`.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.

    Notes
    -----
    The integrals of 1, x and x x^T over the body are sums over the tetrahedra between each triangle (a, b, c) and a
    fixed point taken as origin: with d = a . (b x c), they are d/6, d/24 s and d/120 (s s^T + a a^T + b b^T + c c^T),
    where s = a + b + c. They are exact, and equal those over faces by the divergence theorem of B. Mirtich, "Fast and
    accurate computation of polyhedral mass properties", J. Graphics Tools 1 (1996) 31, and D. Eberly, "Polyhedral mass
    properties (revisited)" (2002). The fixed point is the middle of the mesh, so that a body far from its origin loses
    no digits.
    """
    if (density is None) == (mass is None):
        found = "neither is given" if mass is None else "both are given"
        raise ParameterError(f"a mesh needs a density or a mass, and {found}", advice="Give density= or mass=.")
    given = density if mass is None else mass
    name = "density" if mass is None else "mass"
    if given is None or not np.isfinite(given) or given <= 0:
        raise ParameterError(f"the {name} is {given}", advice="It must be positive and finite.")
    middle = (np.min(mesh.vertices, axis=0) + np.max(mesh.vertices, axis=0)) / 2
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] - middle for corner in range(3))
    six_volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    sums = a + b + c
    volume = float(np.sum(six_volumes)) / 6
    centre = np.einsum("i,ij->j", six_volumes, sums) / 24 / volume
    squares = sum(np.einsum("i,ij,ik->jk", six_volumes, side, side) for side in (sums, a, b, c)) / 120
    about_centre = squares - volume * np.outer(centre, centre)
    inertia = np.trace(about_centre) * np.eye(3) - about_centre
    scale = float(given) if mass is None else float(given) / volume
    return MassProperties(scale * volume, middle + centre, scale * (inertia + inertia.T) / 2)


@takes(
    ParameterError,
    path=FILE,
    density=_SIZE,
    mass=_SIZE,
    scale=number("a positive number", above=0.0),
    tolerance=number("a number from 0 to 1", least=0.0, most=1.0),
)
def stl_solid(
    path: str | Path,
    *,
    density: float | None = None,
    mass: float | None = None,
    scale: float = 1.0,
    tolerance: float = 1e-6,
) -> MassProperties:
    """Return the mass properties of the homogeneous body in an STL file, in the frame of the file.

    Parameters
    ----------
    path
        An ASCII or binary STL file.
    density, mass
        Density in kg/m^3, or mass in kg: one of them.
    scale
        Metres per unit of the file, which does not say its unit: 1e-3 for a drawing in millimetres.
    tolerance
        Distance below which corners are one, relative to the size of the mesh (see `closed_mesh`).

    Raises
    ------
    ParameterError
        If the file cannot be read or its mesh is not closed.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise ParameterError(f"the scale is {scale}", where=str(path), advice="It must be positive and finite.")
    mesh = closed_mesh(read_stl(path) * scale, tolerance=tolerance, where=str(path))
    return mesh_solid(mesh, density=density, mass=mass)
