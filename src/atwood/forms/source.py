"""Where an assembly comes from: its scene, and how scenes are assembled."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from atwood.errors import StartError, UsageError, suggestion
from atwood.model.composite import Model
from atwood.model.flatten import FlatScene
from atwood.model.scene import Scene

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly

__all__ = ["Assemble", "Source", "no_start_quantity"]


class Assemble(Protocol):
    """Assembles a scene that was taken apart, in the form of another assembly."""

    def __call__(
        self,
        flat: FlatScene,
        like: Assembly,
        modes: Mapping[str, str] | None = None,
        sides: Mapping[tuple[str, str, str], float] | None = None,
    ) -> Assembly:
        """Return the assembly."""
        ...


@dataclass(frozen=True, eq=False)
class Source:
    """Where an assembly comes from.

    Attributes
    ----------
    assemble
        How scenes are assembled.
    scene
        A copy of the scene, which nobody else changes; None if there were only its leaves.
    """

    assemble: Assemble
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


def no_start_quantity(path: str, known: Collection[str]) -> StartError:
    """Return the error that says that a start value is of nothing."""
    return StartError("there is no such quantity to start with", where=path, advice=suggestion(path, list(known)))
