"""Assemblies in pickles: the scene goes along, not its equations and code, and is assembled again where it is read.

Expressions, programs and machine code belong to a process. Assembling is deterministic, so that coordinates come out in
the same order, and machine code comes from the cache on disk where it was compiled before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from atwood.errors import UsageError
from atwood.forms.kept import Key
from atwood.forms.shared import Shared
from atwood.forms.source import Source
from atwood.forms.starting import with_constants_of_start
from atwood.late import replace
from atwood.mechanics.read import LineSigns, read_mechanism
from atwood.model.local.flatten import FlatScene
from atwood.topology.orientation_coordinates import Orientation

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly, FormName

__all__ = ["recipe"]

_RESTORED: Key[Assembly] = Key("the first assembly of a pickle")


class _Recipe(NamedTuple):
    """What an assembly is made from.

    Attributes
    ----------
    kind
        The class of assemblies.
    flat, source, form, level, orientation
        The scene, where it comes from, and in which form it is.
    modes, line_signs
        Mode of each part that has modes; on a line, the sign of lengths, None where the start tells them.
    relations, held, why_new
        See `Assembly.given_relations`, `Assembly.held` and `Assembly.why_new`.
    coordinates
        Names of the coordinates, which must come out again.
    """

    kind: type[Assembly]
    flat: FlatScene
    source: Source
    form: FormName
    level: str
    orientation: Orientation
    modes: Mapping[str, str]
    line_signs: LineSigns | None
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
    mechanism = assembly.mechanism
    line_signs: dict[tuple[str, str, str], float] | None = None
    if mechanism.space.is_line and mechanism.line_signs is None:  # they come from a start that has been found
        known = {path: local.binding.line_signs or {} for path, local in mechanism.locals_.items()}
        line_signs = {(path, *pair): sign for path, pairs in known.items() for pair, sign in pairs.items()}
    parts = (
        type(assembly),
        assembly.flat,
        assembly.source,
        assembly.form,
        assembly.level,
        assembly.orientation,
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
    kind, flat, source, form, level, orientation, modes, line_signs, *_ = made_from
    mechanism = read_mechanism(flat, modes, line_signs)
    first = kind(flat, mechanism, form, level, modes, source, orientation=Orientation(orientation.kind))
    made = with_constants_of_start(first)
    return made if made.orientation == orientation else made.other_mode(modes, line_signs or {}, orientation)
