"""The assembly of a scene with other values, in other modes, in other coordinates, or from a pickle.

What keeps the structure goes on with the same equations, programs and code; anything else is assembled anew. In a
pickle the scene goes along, not its equations and code: expressions, programs and machine code belong to a process.
Assembling is deterministic, so that coordinates come out in the same order, and machine code comes from the cache on
disk where it was compiled before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from atwood.errors import UsageError
from atwood.forms.caches import Key, Shared, without_collection
from atwood.forms.law_code import law_code
from atwood.forms.other_values import Source, moved_to, with_constants_of_start
from atwood.lazy_dataclasses import replace
from atwood.mechanics.kinematics.mechanism import Connector
from atwood.mechanics.read import LineSigns, read_mechanism
from atwood.model.local.flatten import FlatScene
from atwood.model.local.kinds import OWN
from atwood.stages import stage
from atwood.topology.orientation_coordinates import Orientation

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly, FormName


_OTHER_MODE: Key[Assembly] = Key("the scene in another mode")

_FRESH: dict[str, Any] = {"why_new": "", "given_relations": None, "held": None}
"""What other values start with: the relations and discrete states that hold at their start."""


def modes_of(flat: FlatScene) -> dict[str, str]:
    """Return the mode in which each part that has modes begins."""
    return {
        path: str(part.values.get(part.component.mode_parameter, part.component.modes[0]))
        for path, part in flat.parts.items()
        if part.component.modes
    }


def assembled(
    kind: type[Assembly],
    flat: FlatScene,
    source: Source | None,
    form: FormName,
    level: str,
    orientation: str,
    modes: Mapping[str, str] | None = None,
    line_signs: LineSigns | None = None,
    **origin: Connector | None,
) -> Assembly:
    """Assembly of a scene in one form, with equations of its own."""
    all_modes = modes_of(flat) | dict(modes or {})
    with stage("mechanism"), without_collection():
        mechanism = read_mechanism(flat, all_modes, line_signs, **origin)
    made = kind(flat, mechanism, form, level, all_modes, source, orientation=Orientation(orientation))
    return with_constants_of_start(made)


def with_flat(assembly: Assembly, flat: FlatScene, source: Source | None = None) -> Assembly:
    """Return the assembly of a scene with other values: with the same programs if it has the same structure."""
    source = source or assembly.source
    found, reason = follow(assembly, flat, source)
    if found is not None:
        return found
    if source is None:
        raise UsageError(f"its structure changes: {reason}", where=flat.name, advice="Assemble it anew.")
    return replace(assembled(type(assembly), flat, source, *_form_of(assembly)), why_new=reason)


def _form_of(assembly: Assembly) -> tuple[FormName, str, str]:
    """Form and level of an assembly, and the kind of its orientation coordinates."""
    return assembly.form, assembly.level, assembly.orientation.kind


def follow(assembly: Assembly, flat: FlatScene, source: Source | None = None) -> tuple[Assembly | None, str]:
    """Return the assembly of a scene with other values, with the same programs; None, and why, if it needs others."""
    mechanism, reason = moved_to(assembly, flat)
    if mechanism is None:
        return None, reason
    return replace(assembly, flat=flat, mechanism=mechanism, source=source, **_FRESH), ""


STRUCTURES: dict[tuple[str, ...], tuple[list[Any], Assembly]] = {}
"""What its laws are written with, and the newest assembly, of each of the last structures that were run; by name and
form, the oldest first."""

_REMEMBERED, _LARGEST = 4, 100
"""So many are remembered, of scenes with no more parts: equations take memory."""


def assembled_again(
    assembly: Callable[[], Assembly],
    flat: FlatScene,
    source: Source,
    has_run: Callable[[Assembly], bool],
    *form: str,
) -> tuple[Assembly, Assembly | None]:
    """Return the assembly of a scene, and the one of the same structure that it follows, if one has run before.

    Both scenes have the same classes of parts, with laws as they were, connections, letters and times, and the
    structure stays as it does for other values (`follow`). One that found no start is not followed: its parts may
    contradict each other, and those of the other scene not.
    """
    key = flat.name, *form
    laws, known = STRUCTURES.pop(key, (None, None))
    now = law_code(dict.fromkeys(type(part.component) for part in flat.parts.values()))
    found = None
    if known is not None and has_run(known) and now is not None and laws == now and _is_alike(known.flat, flat):
        found, _ = follow(known, flat, source)
    made = assembly() if found is None else found
    if now is not None and len(flat.parts) <= _LARGEST:
        STRUCTURES[key] = now, made
        for oldest in list(STRUCTURES)[:-_REMEMBERED]:
            STRUCTURES.pop(oldest, None)
    return made, None if found is None else known


def _is_alike(flat: FlatScene, other: FlatScene) -> bool:
    """Return whether two scenes are alike in what other values cannot change."""
    if (flat.t_start, flat.t_end, flat.symbols) != (other.t_start, other.t_end, other.symbols):
        return False
    parts = (*flat.parts.values(), *other.parts.values())
    return all(vars(part.component).keys() <= OWN for part in parts)


def other_mode(
    assembly: Assembly,
    modes: Mapping[str, str],
    line_signs: LineSigns,
    orientation: Orientation | None = None,
) -> Assembly:
    """Return a scene in other modes, with lengths on a line signed as given; what was made before is used again."""
    if assembly.source is None:
        raise UsageError("it was assembled from leaves, so that it has no other modes", where=assembly.flat.name)
    coordinates = orientation or assembly.orientation

    def make() -> Assembly:
        origin = assembly.mechanism.origin
        form = _form_of(assembly)
        made = assembled(type(assembly), assembly.flat, assembly.source, *form, modes, line_signs, origin=origin)
        return replace(made, shared=Shared(assembly.shared.family), orientation=coordinates)

    about = tuple(sorted(modes.items())), tuple(sorted(line_signs.items())), coordinates
    known = assembly.shared.family.get(_OTHER_MODE, make, *about)
    if known.flat is assembly.flat and known.source is assembly.source and not known.why_new:
        return known  # with what is kept of it
    mechanism, _ = moved_to(known, assembly.flat)
    if mechanism is None:
        return make()
    return replace(known, flat=assembly.flat, mechanism=mechanism, source=assembly.source, why_new="")


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
    """Return what makes an assembly again, for `pickle`."""
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
    made = assembled(kind, flat, source, form, level, orientation.kind, modes, line_signs)
    return made if made.orientation == orientation else made.other_mode(modes, line_signs or {}, orientation)
