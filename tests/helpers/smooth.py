"""Scenes of the library whose equations hold everywhere: those in which nothing touches and nothing rubs."""

from __future__ import annotations

from atwood import Component, Model
from atwood.model.declare.laws import Law
from atwood_library import Rope
from atwood_library.scenes import SCENES


def touches(model: Model) -> bool:
    """Tell whether a part of a model has a gap or dry friction; a stop that is not set is none, nor is a taut rope."""
    return any(touches(part) if isinstance(part, Model) else rubs(part) for part in model.parts.values())


def rubs(part: Component) -> bool:
    """Tell whether a part has a one-sided law that acts."""
    if isinstance(part, Rope):
        return "slack" in (part.when_slack, part.starts)
    return any(is_set(part, law) for law in type(part).contact_laws().values())


def is_set(part: Component, law: Law) -> bool:
    """Tell whether all parameters are given that a one-sided law needs."""
    return all(getattr(part, name) is not None for name in getattr(law.options, "given", ()))


SMOOTH = {name: make for name, make in SCENES.items() if not touches(make())}
