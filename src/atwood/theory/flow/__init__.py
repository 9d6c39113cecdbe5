"""How neighbouring motions move: tangent flow, Lyapunov exponents, Poincare sections."""

from atwood.theory.flow.phase_portrait import (
    PhasePortrait,
    PoincareSection,
    RestPoint,
    phase_portrait,
    poincare_section,
)
from atwood.theory.flow.tangent_flow import LyapunovExponents, TangentFlow, lyapunov_exponents, tangent_flow

__all__ = [
    "LyapunovExponents",
    "PhasePortrait",
    "PoincareSection",
    "RestPoint",
    "TangentFlow",
    "lyapunov_exponents",
    "phase_portrait",
    "poincare_section",
    "tangent_flow",
]
