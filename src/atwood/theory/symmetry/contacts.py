"""What gaps and slips leave conserved: in every set of contacts, and through every impact.

A contact pushes with ``J^T f``, and an impact with ``J^T P``, where J are the slopes of the gap's rate or of the slip.
Both leave a quantity C alone where the displacements w that it generates are none of the gap or slip, ``J w = 0``: of
a quantity that is linear in the momenta, where the gap has its symmetry. Energy is no such quantity: a gap that stays
closed does no work, an impact none where restitution is one, and friction takes energy.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, evaluate, jvp, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.totals import add_up
from atwood.model.declare.contact_laws import value_names
from atwood.theory.symmetry.proof import Proof, Prover
from atwood.theory.symmetry.states import KEPT, State


@dataclass(frozen=True)
class Push:
    """What a gap or a slip may do to speeds.

    Attributes
    ----------
    path
        The gap or the slip.
    slopes
        Of the rate of the gap, or of the slip, along each speed.
    takes_energy
        Why energy is not conserved where it acts; empty where it is.
    """

    path: str
    slopes: tuple[Expression, ...]
    takes_energy: str


def pushes_of(assembly: Assembly, loose: Assembly) -> tuple[Push, ...]:
    """Return what the gaps and slips of a scene may do, in the coordinates of the scene without these."""
    e, rows, found = loose.reduced, assembly.reduced.contacts, []
    known = assembly.known_values
    for one in rows:
        part, law, number = one.row.key
        value = loose.observables[f"{part}.{value_names(one.law)[number]}"].value
        is_rate = one.is_slip or one.is_speed
        rate = value if is_rate else jvp([value], dict(zip(e.coordinates, e.rates, strict=True)))[0]
        why = ""
        if one.is_slip:
            why = "friction takes energy"
        elif not jvp([value], {e.time: 1.0})[0].is_zero:
            why = "it moves by itself and does work"
        elif one.is_speed or one.restitution is None or not one.restitution.is_parametric:
            why = "impacts take energy"
        elif evaluate([one.restitution], known)[0] != 1.0:
            why = "impacts take energy, with a restitution below 1"
        elif one.is_poisson and len(rows) > 1:
            why = "several impacts at once may take energy by Poisson's law"
        found.append(Push(f"{part}.{law}", tuple(vjp([rate], [e.graph.one], list(e.speeds))), why))
    return tuple(found)


class Pushes:
    """What gaps and slips do to quantities at random states.

    Parameters
    ----------
    assembly
        The scene without its gaps and slips.
    pushes
        What these may do.
    """

    def __init__(self, assembly: Assembly, pushes: Sequence[Push]) -> None:
        self.pushes, e = tuple(pushes), assembly.reduced
        every = tuple(slope for one in pushes for slope in one.slopes)
        self._kernel = assembly.kernel(coordinate_program(assembly, "pushes", e, every))

    def at(self, state: State) -> FloatArray:
        """Return the slopes of all rows along speeds, shape (rows, speeds)."""
        found = np.asarray(self._kernel([state.t], state.q, state.u)[0], dtype=float)
        return found.reshape(len(self.pushes), -1)

    def on(self, states: Sequence[State]) -> Iterator[State]:
        """Yield, for each state and each row, the rates of quantities by a unit of its force."""
        for one in states:
            for row in self.at(one):
                terms = np.abs(one.generators) @ np.abs(row)
                yield replace(one, rates=one.generators @ row, terms=terms)

    def changed(self, states: Sequence[State], number: int) -> str:
        """Return what changes a quantity: the path of a gap or slip, empty where none does."""
        for one in states:
            w, rows = one.generators[number], self.at(one)
            missed = np.abs(rows @ w) > KEPT * (np.abs(rows) @ np.abs(w))
            if np.any(missed):
                return self.pushes[int(np.argmax(missed))].path
        return ""

    def proof(self, prover: Prover, states: Sequence[State], number: int) -> Proof:
        """Return whether it is proven that none of them changes a quantity."""
        generator = prover.fitted(states, [one.generators[number] for one in states])
        if generator is None:
            return Proof.NONE
        works = [add_up([w * one.slopes[k] for k, w in generator.items()]) for one in self.pushes if generator]
        return min((prover.is_zero(work) for work in works), default=Proof.ALL)
