"""How neighbouring motions move: tangent flow, Lyapunov exponents, Poincare sections."""

from atwood.theory.flow.cloud import LiouvilleDensity, PhaseCloud, liouville_density, phase_cloud
from atwood.theory.flow.phase_portrait import (
    PhasePortrait,
    PoincareSection,
    RestPoint,
    Separatrix,
    phase_portrait,
    poincare_section,
)
from atwood.theory.flow.tangent_flow import LyapunovExponents, TangentFlow, lyapunov_exponents, tangent_flow

__all__ = [
    "LiouvilleDensity",
    "LyapunovExponents",
    "PhaseCloud",
    "PhasePortrait",
    "PoincareSection",
    "RestPoint",
    "Separatrix",
    "TangentFlow",
    "liouville_density",
    "lyapunov_exponents",
    "phase_cloud",
    "phase_portrait",
    "poincare_section",
    "tangent_flow",
]
