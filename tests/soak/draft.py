"""A mechanism in the making."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .description import Array, Body, Mount, Tie
from .draw_values import Chance


@dataclass
class Draft:
    """A mechanism in the making."""

    chance: Chance
    bodies: list[Body]
    ties: list[Tie]

    def pose(self, name: str) -> tuple[Array, Array]:
        """Return position and rotation of a body's frame, or of the world."""
        body = next((body for body in self.bodies if body.name == name), None)
        return (np.zeros(3), np.eye(3)) if body is None else (body.position, body.rotation)

    def mount_at(self, name: str, position: Array, turned: Array) -> Mount:
        """Return the mount on a body that is at a place in the world."""
        p, r = self.pose(name)
        return Mount(name, r.T @ (position - p), r.T @ turned)

    def is_point(self, name: str) -> bool:
        """Whether this is a material point."""
        return any(body.name == name and body.is_point for body in self.bodies)

    def random_mount(self, name: str) -> Mount:
        """Return a mount anywhere on a body."""
        if self.is_point(name):
            return Mount(name, np.zeros(3))
        return Mount(name, self.chance.place(0.7), self.chance.turn())

    def placed(self, mount: Mount) -> tuple[Array, Array]:
        """Return where a mount is in the world."""
        p, r = self.pose(mount.body)
        return p + r @ mount.position, r @ mount.rotation

    def add(self, sort: str, mounts: tuple[Mount, ...], values: dict[str, Any], grips: Any = ()) -> Tie:
        """Add a tie."""
        tie = Tie(f"{sort.replace('_', '')}{len(self.ties)}", sort, mounts, values, tuple(grips))
        self.ties.append(tie)
        return tie
