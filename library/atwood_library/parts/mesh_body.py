"""MeshBody: a body of any shape, read from a file."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

from atwood import AtwoodError, Number, Outline, ParameterError, Scalar, Vector, parameter
from atwood.solids import MassProperties, TriangleMesh, closed_mesh, mesh_solid, read_stl
from atwood_library.interfaces.shape import Shape
from atwood_library.interfaces.solid import Tensor


class MeshBody(Shape):
    """A homogeneous body that a closed triangle mesh bounds, read from an STL file, in the frame of the file.

    Its mass, its centre of mass and its inertia follow from the mesh exactly (`atwood.solids.mesh_solid`).
    """

    file: str = parameter(text=True, doc="Path of the STL file, text or binary, from where the program runs.")
    scale: Number = parameter(
        1.0, unit="m", above=0.0, doc="Length of the file's unit: 1 mm for most drawings.", symbol="a"
    )

    def check_values(self) -> None:
        """Refuse a file that cannot be read, and a mesh that is not closed."""
        self.unit_solid()
        super().check_values()

    def unit_solid(self) -> MassProperties:
        """Return the mass properties at one kilogram for each unit of volume and one metre for each unit of length."""
        return self._read()[1]

    def _read(self) -> tuple[TriangleMesh, MassProperties]:
        path = Path(self.file).absolute()  # a relative one means another file from another folder
        try:
            known = os.stat(path)
            return _read(str(path), known.st_mtime_ns, known.st_size)
        except (AtwoodError, OSError) as error:
            message = error.message if isinstance(error, AtwoodError) else error.strerror or str(error)
            advice = error.advice if isinstance(error, AtwoodError) else "Give the path of an STL file."
            where = f"{self.path or type(self).__name__}.file"
            raise ParameterError(f"{self.file!r}: {message}", where=where, advice=advice) from error

    def volume(self) -> Scalar:
        """Return the volume."""
        return self.unit_solid().mass * (self.scale * self.scale * self.scale)

    def center_of_mass(self) -> Vector:
        """Return the centre of mass."""
        x, y, z = (float(component) for component in self.unit_solid().centre)
        return Vector(x * self.scale, y * self.scale, z * self.scale)

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        solid, square = self.unit_solid(), self.scale * self.scale
        x, y, z = ((float(entry) / solid.mass * square for entry in row) for row in solid.inertia)
        return tuple(x), tuple(y), tuple(z)  # type: ignore[return-value]

    def outline(self) -> Outline:
        """Return what it looks like."""
        mesh = self._read()[0]
        return Outline.mesh(mesh.vertices * self.scale, mesh.triangles)


@lru_cache(maxsize=16)
def _read(path: str, changed: int, size: int) -> tuple[TriangleMesh, MassProperties]:
    """Return mesh and mass properties of a file; read again when it has changed."""
    mesh = closed_mesh(read_stl(path), where=path)
    return mesh, mesh_solid(mesh, density=1.0)
