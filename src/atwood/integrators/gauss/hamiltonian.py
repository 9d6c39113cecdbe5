"""Hamilton's equations of a scene, as methods of equal steps are given them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from atwood.arrays import FloatArray
from atwood.expr import Program
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.integrators.gauss.layout import Layout


class CompiledMethod(Protocol):
    """A method with fixed steps, for any parameter values and any step."""

    order: int
    layout: Layout
    functions: dict[str, Callable[..., int]]

    def memory(self, parameter_values: FloatArray) -> tuple[FloatArray, tuple[object, ...]]:
        """Return the array of a session, and what it leads to."""
        ...


@dataclass(frozen=True, eq=False)
class Hamiltonian:
    """Hamilton's equations, with what a run with equal steps was asked for.

    Attributes
    ----------
    name
        Of the scene.
    equations
        Program of (t, q, p), or of (t, q, p, u), with q' and p', and with the speeds where these are not q'.
    separated
        Returns the programs of the forces (t, q) and of the velocities p where H is T(p) + V(q, t); else None.
    speeds
        How many speeds there are.
    values
        Values of the parameters.
    momenta
        ``momenta(t, q, u)``: what p is there.
    sizes
        How large coordinates and momenta are in the scene.
    order, step
        What was asked for; None where that is to be chosen.
    compiled
        ``compiled(make, *key)``: a method as machine code, made at most once for all scenes of one structure.
    """

    name: str
    equations: Program
    separated: Callable[[], tuple[Program, Program] | None]
    speeds: int
    values: FloatArray
    momenta: Callable[[float, FloatArray, FloatArray], FloatArray]
    sizes: FloatArray
    order: int | None
    step: float | None
    compiled: Callable[..., Any]
