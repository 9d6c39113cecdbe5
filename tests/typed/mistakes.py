"""Mistakes that mypy --strict and pyright find: a comment that hides none is itself an error to both."""

# pyright: strict, reportUnnecessaryTypeIgnoreComment=true

from __future__ import annotations

from atwood import Scene
from atwood_library import Pivot, PointMass, Rod
from atwood_library.scenes import DoublePendulum

rod = Rod(lenght=1.0)  # type: ignore[call-arg]
bob = PointMass(2.0)  # type: ignore[call-arg]
pendulum = DoublePendulum(length3="80 cm")  # type: ignore[call-arg]
scene = Scene(space=3)  # type: ignore[arg-type]
word: str = Rod().length  # type: ignore[assignment]
place = Pivot().a.positon  # type: ignore[attr-defined]
