"""The mechanism report: what Atwood made of a scene, before anything runs."""

from atwood.reporting.mechanism import MechanismReport, report
from atwood.reporting.offers import Offer
from atwood.reporting.parts import BodyEntry, DroppedPart, JointEntry, MergedPart, ParameterEntry

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
