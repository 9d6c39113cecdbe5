"""Scenes of the library whose equations hold everywhere: those in which nothing touches and nothing rubs."""

from __future__ import annotations

from atwood import Model
from atwood_library.scenes import SCENES


def touches(model: Model) -> bool:
    """Tell whether a part of a model has a gap or dry friction."""
    return any(
        touches(part) if isinstance(part, Model) else bool(type(part).contact_laws()) for part in model.parts.values()
    )


SMOOTH = {name: make for name, make in SCENES.items() if not touches(make())}
