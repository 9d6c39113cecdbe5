"""Mass properties of rigid bodies: from simple shapes, from closed triangle meshes, composed, and checked.

Its modules are loaded when a name of theirs is first used: scenes of points and rods need none of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from atwood.lazy_modules import imports_later

if TYPE_CHECKING:
    from atwood.solids.mesh import TriangleMesh, closed_mesh, mesh_solid, stl_solid
    from atwood.solids.properties import MassProperties, combine, point_mass, subtract
    from atwood.solids.shapes import box, cone, cylinder, disc, ellipsoid, rod, sphere, spherical_shell, tube
    from atwood.solids.stl import read_stl

__all__ = [
    "MassProperties",
    "TriangleMesh",
    "box",
    "closed_mesh",
    "combine",
    "cone",
    "cylinder",
    "disc",
    "ellipsoid",
    "mesh_solid",
    "point_mass",
    "read_stl",
    "rod",
    "sphere",
    "spherical_shell",
    "stl_solid",
    "subtract",
    "tube",
]

__getattr__ = imports_later(__name__)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
