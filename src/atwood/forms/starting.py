"""A scene as its start is found, before that start says what becomes of its constraints on velocities."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from atwood.errors import StartError, UsageError, suggestion, suggestion_in_parts
from atwood.expr import Expression
from atwood.forms.kept import Key
from atwood.forms.shared import DECIDED, Shared, decided_alike, with_values_of
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.constraints.values import holds_velocities
from atwood.mechanics.kinematics.mechanism import Mechanism, started_at
from atwood.model.compose.composite import Model
from atwood.model.compose.scene import Scene
from atwood.model.local.flatten import FlatScene

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly
    from atwood.mechanics.outputs.observables import Observable


_STARTING: Key[Shared] = Key("what the scene shares as its start is found")


def starting(assembly: Assembly) -> Assembly:
    """Return a scene as its start is found: with constraints on velocities as they are, which no start decides."""
    mechanism = assembly.mechanism
    if mechanism.places is None:
        return assembly
    shared = assembly.shared.get(_STARTING, lambda: _beside(assembly.shared))
    values = {symbol: value for symbol, value in mechanism.table.values.items() if symbol not in mechanism.constants}
    table = replace(mechanism.table, values=values)
    before = replace(mechanism, table=table, places=None, constants={})
    return replace(assembly, mechanism=before, source=None, why_new="", shared=shared)


def with_constants_of_start(assembly: Assembly) -> Assembly:
    """Return a scene with what its start makes of its constraints on velocities: some are integrals with a constant.

    Where parts have modes, another mode could begin with other constants, and everything stays as it is.
    """
    if assembly.modes or assembly.source is None or not holds_velocities(assembly.mechanism):
        return assembly
    places, shared = assembly.source.find_places(assembly), _beside(assembly.shared)
    shared.get(_STARTING, lambda: assembly.shared)
    made = replace(assembly, mechanism=replace(assembly.mechanism, places=places), shared=shared)
    constants = {**made.reduced.constants, **made.maximal.constants}
    return replace(made, mechanism=started_at(replace(made.mechanism, constants=constants), places))


def _beside(shared: Shared) -> Shared:
    """Return what other equations on the same graph share, which only one thread at a time may add to."""
    made = Shared()
    made.lock = shared.lock
    return made


def moved_to(assembly: Assembly, flat: FlatScene) -> tuple[Mechanism | None, str]:
    """Return the mechanism with the values of another scene; None, and why, if its structure is another."""
    before = starting(assembly)
    with assembly.shared.lock:
        # What was decided by the size of numbers is known only when the equations are.
        if before is assembly:
            _ = assembly.reduced
        else:
            _ = before.regular, before.maximal, assembly.reduced, assembly.maximal
        mechanism, reason = with_values_of(before.flat, before.mechanism, before.shared, flat)
    if mechanism is None or before is assembly:
        return mechanism, reason
    own = assembly.mechanism
    places = own.places
    if own.constants:
        if assembly.source is None:
            return None, "the start gives constants of integration"
        there = replace(before, flat=flat, mechanism=mechanism, given_relations=None)
        places = assembly.source.find_places(there)
    assert places is not None
    values = {**own.table.values, **mechanism.table.values}
    made = replace(own, table=replace(own.table, values=values), locals_=mechanism.locals_)
    made = started_at(made, places)
    if places == own.places and made.table.values == own.table.values:
        return made, ""  # at the same place with the same numbers everything was decided already
    with assembly.shared.lock:
        return (made, "") if decided_alike(made, assembly.shared) else (None, DECIDED)


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
        """Return a copy of the scene with other values."""
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
    """Return the error that says that a start value is of nothing."""
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
