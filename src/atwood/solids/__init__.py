"""Mass properties of rigid bodies: from simple shapes, from closed triangle meshes, composed, and checked."""

from atwood.solids.integrals import mesh_solid, stl_solid
from atwood.solids.mesh import TriangleMesh, closed_mesh
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
