"""The relations of what moves along a run: which are parameters, with which values, and which the laws have back."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Shared
from atwood.forms.sides import in_pieces
from atwood.integrators.methods import AUTO, METHODS
from atwood.lazy_dataclasses import replace
from atwood.simulation.events.sides import find_sides, layers, plain_sides
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.run.recorder import Stretch

_ASIDE = 1e-12
"""Of the scene's time: so far from a switch, on the side that a stretch is on, the states at its ends are recorded."""

_THIN = 0.1
"""A layer is so much of what the tolerances allow."""

_TINY = 1e-200
"""No layer is thinner."""

_SWAYS = 6
"""A relation that changes so often one short stretch after the other is handed back."""


class SidesOfRun:
    """Which sides the relations of what moves are on, mode by mode.

    Parameters
    ----------
    options
        What was asked for.
    """

    def __init__(self, options: RunOptions) -> None:
        self._options = options
        self._layered = (
            options.solver == AUTO or METHODS[options.solver].is_implicit
        )  # others would take many steps for each layer
        self._handed: dict[Shared, dict[int, float]] = {}
        self._changed: tuple[int, ...] = ()
        self._begins_at_switch = False
        self._sways: Counter[int] = Counter()

    def in_pieces(self, assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> Assembly:
        """Return a scene with its relations as parameters, with their values at a state as it is."""
        if not self._options.looks_for_events:
            return assembly
        handed = self._handed.get(assembly.shared, {})
        found = in_pieces(assembly, frozenset(handed), self._layered)
        if found.sides is None:
            return found
        found = replace(found, side_values=tuple(handed.get(i, 0.0) for i in range(len(found.side_values))))
        return replace(found, side_values=plain_sides(found, t, q, u))

    def like(self, assembly: Assembly, plan: SceneProblem) -> Assembly:
        """Return a scene with the relations of what moves of a plan, which was made of it in another piece."""
        sides, values = plan.assembly.sides, plan.assembly.side_values
        if sides is None:
            return assembly
        return replace(assembly, shared=sides.shared, sides=sides, side_values=values)

    def recorded(self, record: Stretch, plan: SceneProblem, assembly: Assembly, ends_at_switch: bool) -> Stretch:
        """Return what was recorded of a stretch with the laws as they are; on a switch, those of the stretch hold."""
        starts_at_switch, self._begins_at_switch = self._begins_at_switch, ends_at_switch
        if plan.assembly.sides is None:
            return record
        q, u = record.coordinates.copy(), record.speeds.copy()
        places = [(0, _ASIDE)] * starts_at_switch + [(-1, -_ASIDE)] * ends_at_switch
        for place, share in places if len(record.time) > 1 else ():
            if record.shown[place]:
                continue
            here, step = (float(record.time[place]), q[:, place].copy(), u[:, place].copy()), share * plan.scales.time
            q[:, place] += step * plan.balance.kinematic_map.rates(*here)
            u[:, place] += step * plan.balance.accelerate(*here, plan.kept)[0]
        return replace(record, plan=plan.in_piece(assembly), coordinates=q, speeds=u)

    def change(self, changed: Iterable[int], is_short: bool) -> None:
        """Take note of relations that change."""
        self._changed = tuple(changed)
        if not is_short:
            self._sways.clear()
        self._sways.update(self._changed)

    def on(self, assembly: Assembly, plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> SceneProblem | None:
        """Return a plan with the values of the relations from a state on; None if it is to be made anew."""
        sides, before, changed = plan.assembly.sides, plan.assembly.side_values, self._changed
        if sides is None:
            return plan
        self._changed = ()
        found = find_sides(plan, t, q, u, before, changed)
        stuck = [*found.stuck, *(number for number in changed if self._sways[number] > _SWAYS)]
        if stuck:
            options = self._options
            relative = options.absolute_tolerance or options.relative_tolerance
            widths = layers(plan, t, q, u, plan.tolerances(relative, options.nominal))
            handed = self._handed.setdefault(assembly.shared, {})
            handed |= {number: 1.0 / max(_THIN * widths[number], _TINY) for number in stuck}
            return None
        if found.values == before:
            return plan
        return plan.in_piece(replace(plan.assembly, side_values=found.values))
