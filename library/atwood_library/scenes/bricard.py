"""bricard: six hinges in a loop that could not move, and does."""

from __future__ import annotations

from collections.abc import Sequence

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody

_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 0, -1), (1, -1, -1), (0, -1, -1), (0, -1, 0))
_AXES = ((0, 0, 1), (0, -1, 0), (1, 0, 0), (0, 0, 1), (0, -1, 0), (1, 0, 0))


class Bricard(Scene):
    """Bricard's loop of five equal rods and six hinges, each square to the next: one degree of freedom.

    Counting says that it has none: one of its constraints follows from the others, in every position. The IFToMM
    benchmark A04, with y and z exchanged so that gravity is along -z. With the angles of the hinges (a, b, a, b, a, b)
    it moves along ``(1 + sin a)(1 + sin b) = 1``.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of each rod.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of each rod.")
    width: Number = parameter(0.1, unit="m", above=0.0, doc="Width of the rods' square section.")
    space = "space"
    t_end = 10.0

    near: Ground = Ground()
    far: Ground = Ground()
    hinge1: Pivot = Pivot(axis=_AXES[0])
    rod1: RigidBody = RigidBody(mass=mass)
    end1: Weld = Weld()
    hinge2: Pivot = Pivot(axis=_AXES[1])
    rod2: RigidBody = RigidBody(mass=mass)
    end2: Weld = Weld()
    hinge3: Pivot = Pivot(axis=_AXES[2])
    rod3: RigidBody = RigidBody(mass=mass)
    end3: Weld = Weld()
    hinge4: Pivot = Pivot(axis=_AXES[3])
    rod4: RigidBody = RigidBody(mass=mass)
    end4: Weld = Weld()
    hinge5: Pivot = Pivot(axis=_AXES[4])
    rod5: RigidBody = RigidBody(mass=mass)
    end5: Weld = Weld()
    hinge6: Pivot = Pivot(axis=_AXES[5])
    connections = [
        connect(near.frame, hinge1.a),
        connect(hinge1.b, rod1.frame),
        connect(rod1.frame, end1.a),
        connect(end1.b, hinge2.a),
        connect(hinge2.b, rod2.frame),
        connect(rod2.frame, end2.a),
        connect(end2.b, hinge3.a),
        connect(hinge3.b, rod3.frame),
        connect(rod3.frame, end3.a),
        connect(end3.b, hinge4.a),
        connect(hinge4.b, rod4.frame),
        connect(rod4.frame, end4.a),
        connect(end4.b, hinge5.a),
        connect(hinge5.b, rod5.frame),
        connect(rod5.frame, end5.a),
        connect(end5.b, hinge6.a),
        connect(hinge6.b, far.frame),
    ]

    def build(self) -> None:
        """Give each rod its direction and the inertia of a square bar."""
        across, along = (self.length**2 + self.width**2) / 12.0, self.width**2 / 6.0
        self.set("far.position", _scaled(self.length, _CORNERS[5]))
        for number in range(5):
            step = [b - a for a, b in zip(_CORNERS[number], _CORNERS[number + 1], strict=True)]
            self.set(f"rod{number + 1}.moments", tuple(self.mass * (along if c else across) for c in step))
            self.set(f"rod{number + 1}.center", _scaled(0.5 * self.length, step))
            self.set(f"end{number + 1}.displacement", _scaled(self.length, step))


def _scaled(factor: float, vector: Sequence[float]) -> tuple[float, ...]:
    return tuple(factor * component for component in vector)
