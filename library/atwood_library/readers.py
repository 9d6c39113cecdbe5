"""Files of other programs that are read as scenes, by how their names end: `atwood run robot.urdf` looks here."""

from __future__ import annotations

from collections.abc import Callable

from atwood import Scene
from atwood_library.robots.mjcf import read_mjcf
from atwood_library.robots.urdf import read_urdf

READERS: dict[str, Callable[[str], Scene]] = {".urdf": read_urdf, ".xml": read_mjcf, ".mjcf": read_mjcf}
