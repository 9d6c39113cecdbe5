"""Groups of bodies of which any two may touch: which scenes have one, and who refuses them."""

from __future__ import annotations

from atwood.errors import UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.integrators.methods import MOREAU, advise
from atwood.model.declare.contact_group import ContactGroup

_GROUPS: Key[list[str]] = Key("groups of bodies of which any two may touch")


def groups_of(assembly: Assembly) -> list[str]:
    """Return the paths of the groups of bodies in a scene."""

    def find() -> list[str]:
        return [path for path, part in assembly.flat.parts.items() if isinstance(part.component, ContactGroup)]

    return assembly.shared.get(_GROUPS, find)


def refuse_groups(assembly: Assembly) -> None:
    """Refuse a scene with a group of bodies where nothing is known of their contacts."""
    paths = groups_of(assembly)
    if paths:
        raise UnsupportedError(
            "its contacts are sought in steps of equal length alone, and nothing else knows of them",
            where=paths[0],
            advice=f"{advise(MOREAU)} Or declare a contact for each pair.",
        )
