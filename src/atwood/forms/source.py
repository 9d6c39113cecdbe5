"""Where an assembly comes from: its scene, and what finds its start."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from atwood.errors import StartError, UsageError, suggestion, suggestion_in_parts
from atwood.expr import Expression
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.model.compose.scene import Scene

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly
    from atwood.mechanics.outputs.observables import Observable

__all__ = ["Places", "Source", "no_start_quantity"]


Places = Mapping[str, Mapping[Expression, float]]
"""Where a scene starts, by form and by the symbols of its coordinates."""


@dataclass(frozen=True, eq=False)
class Source:
    """Where an assembly comes from.

    Attributes
    ----------
    find_places
        Finds where a scene starts. Constants of integration have their values from there, and so do equations with
        such constants; starts are found with equations, in rooms above this one.
    scene
        A copy of the scene, which nobody else changes; None if there were only its leaves.
    """

    find_places: Callable[[Assembly], Places]
    scene: Model | None = None

    def changed(self, values: Mapping[str, Any], start: Mapping[str, Any], guess: Mapping[str, Any]) -> Model:
        """Return a copy of the scene with other values.

        Parameters
        ----------
        values
            Parameters by path.
        start, guess
            Start values by path; None lets one go.
        """
        if self.scene is None:
            raise UsageError(
                "it was assembled from leaves, so that its scene is not known", advice="Assemble the scene itself."
            )
        scene = self.scene.copy()
        change_scene(scene, values, start, guess)
        return scene


def change_scene(scene: Model, values: Mapping[str, Any], start: Mapping[str, Any], guess: Mapping[str, Any]) -> None:
    """Give a scene other values; see `Source.changed`."""
    for path, value in values.items():
        scene.set(path, value)
    if not isinstance(scene, Scene):
        if start or guess:
            raise UsageError("this is a model and no scene, and has no start of its own", where=type(scene).__name__)
        return
    for target, given in ((scene.start, start), (scene.guess, guess)):
        for path, value in given.items():
            if value is not None:
                target[path] = value
            elif path in target:
                del target[path]
            else:
                raise UsageError("the scene has no such start value", where=path, advice=suggestion(path, target))


def no_start_quantity(path: str, known: Mapping[str, Observable]) -> StartError:
    """Return the error that says that a start value is of nothing.

    Parameters
    ----------
    path
        What was given.
    known
        The quantities there are; what is offered instead is a position or a speed, of the same part if there is one.
    """
    if re.match(r"(lambda|mu)\b", path):
        return StartError(
            "a multiplier follows from positions and speeds and cannot be prescribed at the start",
            where=path,
            advice="Give coordinates, positions and velocities.",
        )
    message = "there is no such quantity to start with"
    choices = [name for name, one in known.items() if one.unit in _POSITIONS_AND_SPEEDS]
    parts = [name for name in choices if name.rpartition(".")[0] == path]
    if f"{path}.x" in parts:
        return StartError(
            message, where=path, advice=f"It is a vector: give {' and '.join(parts)}, each with a number."
        )
    return StartError(message, where=path, advice=suggestion_in_parts(path, choices, "can start with"))


_POSITIONS_AND_SPEEDS = ("1", "m", "rad", "m/s", "rad/s")
