"""DiscContacts: many discs of which any two may touch."""

from __future__ import annotations

from atwood import ContactGroup


class DiscContacts(ContactGroup):
    """Equal discs of which any two may touch, and walls in the world that none may pass; for time stepping.

    Connect `disc[0]`, `disc[1]` and so on to the frames of discs, and simulate with ``solver="moreau"``.
    """

    synonyms = ("Granular material", "Many bodies", "Sand", "Billiards")
