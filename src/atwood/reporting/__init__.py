"""The mechanism report: what Atwood made of a scene, before anything runs."""

from atwood.reporting.mechanism import (
    BodyEntry,
    DroppedPart,
    JointEntry,
    MechanismReport,
    MergedPart,
    ParameterEntry,
    report,
)
from atwood.reporting.offers import Offer

__all__ = [
    "BodyEntry",
    "DroppedPart",
    "JointEntry",
    "MechanismReport",
    "MergedPart",
    "Offer",
    "ParameterEntry",
    "report",
]
