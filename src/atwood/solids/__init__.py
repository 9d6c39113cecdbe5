"""Mass properties of rigid bodies: from simple shapes, from closed triangle meshes, composed, and checked.

Its modules are loaded when a name of theirs is first used: scenes of points and rods need none of them.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

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

_MODULES = {
    "mesh": ("TriangleMesh", "closed_mesh", "mesh_solid", "stl_solid"),
    "properties": ("MassProperties", "combine", "point_mass", "subtract"),
    "shapes": ("box", "cone", "cylinder", "disc", "ellipsoid", "rod", "sphere", "spherical_shell", "tube"),
    "stl": ("read_stl",),
}

if not TYPE_CHECKING:  # so that type checkers know which names there are

    def __getattr__(name):
        for module, names in _MODULES.items():
            if name in names:
                found = getattr(importlib.import_module(f"{__name__}.{module}"), name)
                globals()[name] = found
                return found
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__():
        return sorted({*globals(), *__all__})
