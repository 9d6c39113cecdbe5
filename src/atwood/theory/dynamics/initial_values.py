"""`solve_initial_values`: parameters and start values with which a scene starts as it is said to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from atwood.arguments import BY_PATH, PATHS, takes
from atwood.arrays import FloatArray
from atwood.display import fitted
from atwood.errors import AtwoodError, SolveError, UsageError, check_known, suggestion_in_parts
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jvp
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model, owner_of
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.numerics.matrices import or_one
from atwood.numerics.newton import Missing, newton
from atwood.pipeline import SCENE, scene_of, smooth_assembly_of
from atwood.theory.dynamics.dynamics import Dynamics
from atwood.theory.dynamics.functions import Function
from atwood.tolerances import tolerances

_STEPS, _HALVINGS = 60, 40
_NEARLY = 10.0
"""Times `tolerances.MET`, relative to the terms of a condition: what counts as met where rounding leaves no better."""

_DIFFERENCE = 1e-6
"""Relative: by so much unknowns are moved for central differences, which only the number of steps depends on."""


@dataclass(frozen=True, eq=False)
class StartSolution:
    """Parameters and start values with which a scene starts as it is said to.

    Attributes
    ----------
    values
        What was found, by path, in SI units.
    assembly
        The scene with these values, ready to be run.
    """

    values: Mapping[str, float]
    assembly: Assembly = field(repr=False)

    def __repr__(self) -> str:
        rows = [f"  {path} = {value:.9g}" for path, value in self.values.items()]
        return fitted("\n".join([f"{self.assembly.flat.name}: start solved", *rows]))


@takes(scene=SCENE, unknowns=PATHS, conditions=BY_PATH)
def solve_initial_values(
    scene: Model | Assembly, *, unknowns: Sequence[str], conditions: Mapping[str, Any]
) -> StartSolution:
    """Find parameters, and start values, with which quantities at the start have given values.

    So a spring's stiffness follows from where the scene hangs at rest, and a speed from an acceleration: of any
    quantity of results, ``path`` is its value, ``path'`` its rate and ``path''`` its second rate, which the balance of
    forces gives. It is solved by Newton's method from the values that the scene has.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; its other start values hold as they are said.
    unknowns
        Paths of parameters, or of quantities that the scene can start with; they begin with what the scene says.
    conditions
        Values of quantities at the start, by path, in SI units or as text with a unit; as many as unknowns.

    Returns
    -------
    StartSolution
        The values, and the scene with them.

    Raises
    ------
    UsageError
        If there are not as many conditions as unknowns, or there is no such quantity.
    SolveError
        If no values near by make the scene start so.
    """
    first = smooth_assembly_of(scene, form=None, orientation=None)
    if len(unknowns) != len(conditions) or len(set(unknowns)) != len(unknowns):
        raise UsageError(
            f"{len(set(unknowns))} unknowns have {len(conditions)} conditions",
            where=first.flat.name,
            advice="Give as many conditions as unknowns.",
        )
    problem = _Problem(first, tuple(unknowns), tuple(conditions))
    wanted = np.array([problem.read(path, value) for path, value in conditions.items()])

    def look(x: FloatArray) -> Missing:
        missed, slopes = problem.values(problem.assembly(x)) - wanted, problem.slopes(x)
        sizes = np.abs(wanted) + np.abs(slopes) @ np.abs(x)
        return Missing(missed, or_one(sizes), lambda: slopes)

    x = problem.begin()
    scales = or_one(np.abs(x))
    x, left = newton(
        look,
        np.add,
        x,
        scales,
        steps=_STEPS,
        met=_NEARLY * tolerances.MET,
        exact=tolerances.MET,
        halvings=_HALVINGS,
        refused=(AtwoodError,),
    )
    if left.miss <= _NEARLY * tolerances.MET:
        return StartSolution(dict(zip(unknowns, x.tolist(), strict=True)), problem.assembly(x))
    worst = int(np.argmax(np.abs(left.value)))
    raise SolveError(
        f"no values near by make the scene start so: {problem.paths[worst]} is missed by {abs(left.value[worst]):.3g}",
        where=first.flat.name,
        advice="Begin with other values of the unknowns, or let others be found.",
    )


class _Problem:
    """The quantities at the start as functions of the unknowns."""

    def __init__(self, assembly: Assembly, unknowns: tuple[str, ...], paths: tuple[str, ...]) -> None:
        self.first, self.unknowns, self.paths = assembly, unknowns, paths
        self.is_start = [path in assembly.start_observables for path in unknowns]

    def read(self, path: str, value: Any) -> float:
        """Return the value of a condition."""
        quantity, rates = _split(path)
        check_known(quantity, self.first.observables, "there is no such quantity", where=path, hint=suggestion_in_parts)
        if isinstance(value, str):
            unit = self.first.observables[quantity].unit
            if rates:
                raise UsageError("of a rate, give a number in SI units", where=path)
            return float(parse_quantity(value, parse_unit(unit), path))
        return float(value)

    def begin(self) -> FloatArray:
        """Return the unknowns as the scene has them."""
        scene = scene_of(self.first)
        starts = self._quantities(
            self.first, [path for path, own in zip(self.unknowns, self.is_start, strict=True) if own]
        )
        found = []
        for path, own in zip(self.unknowns, self.is_start, strict=True):
            if own:
                found.append(starts[path])
                continue
            value = getattr(*owner_of(scene, path), None)
            if not isinstance(value, (int, float)):
                raise UsageError(
                    "it is no parameter with a number, and no quantity to start with",
                    where=path,
                    advice="Name a parameter, such as 'rod.length', or a coordinate or a speed, such as 'rod.angle'.",
                )
            found.append(float(value))
        return np.array(found)

    def assembly(self, x: FloatArray) -> Assembly:
        """Return the scene with values of the unknowns."""
        pairs = [(path, float(one), own) for path, one, own in zip(self.unknowns, x, self.is_start, strict=True)]
        values = {path: one for path, one, own in pairs if not own}
        start = {path: one for path, one, own in pairs if own}
        return self.first.with_values(values, start=start)

    def values(self, assembly: Assembly) -> FloatArray:
        """Return the quantities of the conditions at the start of a scene."""
        found = self._quantities(assembly, self.paths)
        return np.array([found[path] for path in self.paths])

    def slopes(self, x: FloatArray) -> FloatArray:
        """Return how the quantities change with the unknowns, by central differences."""
        columns = []
        for i, one in enumerate(x):
            e = np.zeros(len(x))
            e[i] = _DIFFERENCE * (abs(one) or 1.0)
            ends = [self.values(self.assembly(x + side * e)) for side in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (2.0 * e[i]))
        return np.array(columns).T

    def _quantities(self, assembly: Assembly, paths: Sequence[str]) -> dict[str, float]:
        motion = Dynamics(assembly)
        q, u = motion.start()
        found, accelerations = {}, None
        for path in paths:
            value = _expression(assembly, motion, path)
            needed = depends_on(value, motion.equations.accelerations)
            if needed and accelerations is None:
                accelerations = motion.forward_dynamics(q, u)
            a = accelerations if needed else np.zeros(len(u))
            groups = {group.name: group for group in state_groups(motion.equations)}
            chosen = (groups["t"], groups["q"], groups["u"], InputGroup("a", motion.equations.accelerations))
            program = Program(path, chosen, assembly.parameters, (OutputGroup("value", (value,)),))
            found[path] = float(Function(assembly, program, (1,))(None, (q, u, a), None)[0])
        return found


def _split(path: str) -> tuple[str, int]:
    """Return a quantity and of which order its rate is."""
    quantity = path.rstrip("'")
    return quantity, len(path) - len(quantity)


def _expression(assembly: Assembly, motion: Dynamics, path: str) -> Expression:
    """Return a quantity, or a rate of it, as a function of the state and its accelerations."""
    e, (quantity, rates) = motion.equations, _split(path)
    value = assembly.observables[quantity].value
    for _ in range(rates):
        if depends_on(value, e.accelerations):
            raise UsageError("it depends on accelerations, whose rates are not known", where=path)
        (value,) = jvp([value], e.course)
    if depends_on(value, [one.symbol for one in assembly.reactions]):
        raise UsageError("it depends on reactions", where=path, advice="Ask for a place, a speed or an acceleration.")
    return value
