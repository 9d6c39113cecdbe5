"""Robots' files: URDF and MJCF, read as scenes and written."""

from __future__ import annotations

from atwood_library.robots.inertias import nearest_inertia
from atwood_library.robots.mjcf import read_mjcf
from atwood_library.robots.mjcf_written import write_mjcf
from atwood_library.robots.urdf import read_urdf
from atwood_library.robots.urdf_written import write_urdf

__all__ = ["nearest_inertia", "read_mjcf", "read_urdf", "write_mjcf", "write_urdf"]
