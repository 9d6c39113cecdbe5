"""Where an assembly comes from: its scene, and how scenes are assembled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from atwood.errors import StartError, UsageError, suggestion, suggestion_in_parts
from atwood.expr import Expression
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.model.compose.scene import Scene
from atwood.model.local.flatten import FlatScene
from atwood.topology.orientation_coordinates import Orientation

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly
    from atwood.mechanics.outputs.observables import Observable

__all__ = ["Assemble", "Kind", "Source", "no_start_quantity"]


class Kind(Protocol):
    """In which form a scene is assembled; an `Assembly` says it of itself."""

    @property
    def form(self) -> str:
        """``"reduced"`` or ``"dae"``."""

    @property
    def level(self) -> str:
        """Level of the dae form; empty for the reduced form."""

    @property
    def orientation(self) -> Orientation:
        """In which coordinates the reduced form has orientations in space."""


class Assemble(Protocol):
    """Assembles a scene that was taken apart, in the form of another assembly."""

    def __call__(
        self,
        flat: FlatScene,
        like: Kind,
        modes: Mapping[str, str] | None = None,
        line_signs: Mapping[tuple[str, str, str], float] | None = None,
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
    places
        Gives where a scene starts, as `atwood.mechanics.kinematics.mechanism.Mechanism` has it.
    scene
        A copy of the scene, which nobody else changes; None if there were only its leaves.
    """

    assemble: Assemble
    places: Callable[[Assembly], Mapping[str, Mapping[Expression, float]]]
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
    message = "there is no such quantity to start with"
    choices = [name for name, one in known.items() if one.unit in _POSITIONS_AND_SPEEDS]
    parts = [name for name in choices if name.rpartition(".")[0] == path]
    if f"{path}.x" in parts:
        return StartError(
            message, where=path, advice=f"It is a vector: give {' and '.join(parts)}, each with a number."
        )
    return StartError(message, where=path, advice=suggestion_in_parts(path, choices, "can start with"))


_POSITIONS_AND_SPEEDS = ("1", "m", "rad", "m/s", "rad/s")
