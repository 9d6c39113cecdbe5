"""Assemblies in pickles: the scene goes along, not its equations and code, and is assembled again where it is read.

Expressions, programs and machine code belong to a process. Assembling is deterministic, so that coordinates come out in
the same order, and machine code comes from the cache on disk where it was compiled before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from atwood.errors import UsageError
from atwood.forms.kept import Key
from atwood.forms.shared import Shared
from atwood.forms.source import Source
from atwood.model.local.flatten import FlatScene
from atwood.topology.orientation_coordinates import Orientation

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly

__all__ = ["recipe"]

_RESTORED: Key[Assembly] = Key("the first assembly of a pickle")

Signs = Mapping[tuple[str, str, str], float]


class _Kind(NamedTuple):
    """In which form a scene is assembled."""

    form: str
    level: str
    orientation: Orientation


class _Recipe(NamedTuple):
    """What an assembly is made from.

    Attributes
    ----------
    flat, source, kind
        The scene, how it is assembled, and in which form.
    modes, line_signs
        See `atwood.forms.source.Assemble`; no line_signs where the start tells them.
    relations, held, why_new
        See `Assembly.given_relations`, `Assembly.held` and `Assembly.why_new`.
    coordinates
        Names of the coordinates, which must come out again.
    """

    flat: FlatScene
    source: Source
    kind: _Kind
    modes: Mapping[str, str]
    line_signs: Signs | None
    relations: tuple[float, ...] | None
    held: tuple[float, ...] | None
    why_new: str
    coordinates: tuple[str, ...]


def recipe(assembly: Assembly) -> tuple[Callable[..., Assembly], tuple[Shared, _Recipe]]:
    """Return what makes an assembly again, for `pickle`.

    Parameters
    ----------
    assembly
        The assembly.

    Raises
    ------
    UsageError
        If it cannot be assembled again.
    """
    if assembly.source is None:
        raise UsageError("it was assembled from leaves and cannot be pickled", where=assembly.flat.name)
    mechanism, kind = assembly.mechanism, _Kind(assembly.form, assembly.level, assembly.orientation)
    line_signs: dict[tuple[str, str, str], float] | None = None
    if mechanism.space.name == "line" and mechanism.line_signs is None:  # they come from a start that has been found
        known = {path: local.binding.line_signs or {} for path, local in mechanism.locals_.items()}
        line_signs = {(path, *pair): sign for path, pairs in known.items() for pair, sign in pairs.items()}
    parts = (
        assembly.flat,
        assembly.source,
        kind,
        assembly.modes,
        line_signs,
        assembly.given_relations,
        assembly.held,
        assembly.why_new,
    )
    return _restored, (assembly.shared, _Recipe(*parts, tuple(one.name for one in assembly.own_equations.names)))


def _restored(shared: Shared, made_from: _Recipe) -> Assembly:
    """Return an assembly; those of one pickle that shared their programs do so again."""
    first = shared.get(_RESTORED, lambda: _assembled(made_from))
    found: Assembly | None = first
    if first.flat is not made_from.flat:
        found, _ = first.follow(made_from.flat, made_from.source)
    made = replace(
        _assembled(made_from) if found is None else found,
        given_relations=made_from.relations,
        held=made_from.held,
        why_new=made_from.why_new,
    )
    names = tuple(one.name for one in made.own_equations.names)
    if names != made_from.coordinates or len(made_from.relations or made.relations) != len(made.relations):
        raise UsageError(
            "it was pickled by another version, whose equations have other unknowns",
            where=made.flat.name,
            advice="Simulate the scene again; results are kept for long by save.",
        )
    return made


def _assembled(made_from: _Recipe) -> Assembly:
    flat, source, kind, modes, line_signs, *_ = made_from
    made = replace(source.assemble(flat, kind, modes, line_signs), source=source)
    if made.orientation == kind.orientation:
        return made
    return made.other_mode(modes, line_signs or {}, kind.orientation)
