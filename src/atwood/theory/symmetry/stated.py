"""Symmetries that a person states: a generator, and if need be the function whose rate L changes by."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from atwood.arguments import BY_PATH, NAME, TEXT, Kind, Refused, check_fields, show
from atwood.errors import UsageError, suggestion
from atwood.expr import Expression
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.outputs.totals import add_up
from atwood.model.values.units import parse_unit
from atwood.theory.equations.formulas import EquationFormulas
from atwood.theory.equations.stated import FUNCTION, ExpressionReader
from atwood.theory.formulas.printers import text
from atwood.theory.symmetry.find import Finding
from atwood.theory.symmetry.proof import Prover
from atwood.theory.symmetry.quantities import Quantities, is_constant
from atwood.theory.symmetry.states import KEPT, RandomStates, State

_STATES = 16

_LONGEST = 400
"""Signs of what is left over of a symmetry that is none, beyond which it is not written."""


def _generator(value: Any) -> Mapping[str, Any]:
    for path, one in BY_PATH.read(value).items():
        try:
            FUNCTION.read(one)
        except Exception:
            raise Refused(f"{path} cannot be displaced by {show(one)}.") from None
    if not value:
        raise Refused
    return BY_PATH.read(value)  # type: ignore[no-any-return]


_GENERATOR = Kind("displacements by path, as sympy expressions or numbers, such as {'body.angle': 1}", _generator)


def _unit(value: Any) -> str:
    if TEXT.read(value):
        parse_unit(value)
    return str(value)


_UNIT = Kind("a unit, such as 'kg*m^2/s', or no text where it is not known", _unit)


@dataclass(frozen=True, eq=False)
class Symmetry:
    """A symmetry of a scene: small displacements of its coordinates that leave L as it is, but for a rate of change.

    With ``delta q = epsilon * generator`` the Lagrangian changes by ``epsilon df/dt`` along every path, and
    ``p . generator - f`` is conserved (Noether; Goldstein, section 13.7). Generators may depend on velocities, as that
    of the Laplace-Runge-Lenz vector does.

    Attributes
    ----------
    generator
        For each coordinate that is displaced, by its path: a sympy expression in the symbols of `atwood.equations` (its
        `coordinates`, `velocities`, parameters and t), or a number.
    f
        The function f of coordinates, velocities and time, J*s times what epsilon is measured in; zero if not given.
    name
        What the quantity is called.
    unit
        Its unit.
    """

    generator: Mapping[str, Any]
    f: Any = 0.0
    name: str = "stated symmetry"
    unit: str = ""

    def __post_init__(self) -> None:
        check_fields(self, generator=_GENERATOR, f=FUNCTION, name=NAME, unit=_UNIT)


def check_symmetry(symmetry: Symmetry, quantities: Quantities, prover: Prover, formulas: EquationFormulas) -> Finding:
    """Return what a stated symmetry conserves."""
    found, scene = quantities.found, quantities.assembly.flat.name
    reader = ExpressionReader(formulas)
    named = zip(found.velocity_names, found.moves, strict=True)
    paths = [one.name if place is None else found.names[place].name for one, place in named]
    generator: dict[int, Expression] = {}
    for path, value in symmetry.generator.items():
        if path not in paths:
            raise UsageError(
                "no coordinate has this path", where=f"{scene}: {path}", advice=suggestion(path, paths) or _list(paths)
            )
        generator[paths.index(path)] = reader.read(value, path)
    f = reader.read(symmetry.f, "f")
    momenta = quantities.momenta
    value = add_up([found.graph.zero, *(momenta[k] * w for k, w in generator.items())]) - f
    if all(one.is_zero for one in generator.values()):
        raise UsageError("its generator displaces nothing", where=f"{scene}: {symmetry.name}")
    drawn = RandomStates(quantities.assembly, quantities.on_speeds([value]))
    states = drawn.draw(_STATES, quantities.center[1])
    if not states:
        raise UsageError(f"nothing could be checked at random states near its start: {drawn.reason}", where=scene)
    worst = max(states, key=lambda one: abs(float(one.rates[0])) / (float(one.terms[0]) or 1.0))
    if abs(float(worst.rates[0])) > KEPT * float(worst.terms[0]):
        rest = text.formula(formulas.formula(prover.rest(value, generator), energy=True)) if prover.is_small else ""
        left = f": {rest} is left over" if rest and len(rest) <= _LONGEST else ""
        raise UsageError(
            f"it is no symmetry: L changes by more than df/dt{left}; p . delta q - f changes at {worst.rates[0]:.6g} a "
            f"second (its terms at {worst.terms[0]:.3g}) at {_state_text(quantities, worst)}",
            where=f"{scene}: {symmetry.name}",
            advice="Look at the generator, its sign and factor, and at f.",
        )
    proven = prover.along(value, generator)
    meaning = "p . delta q - f of a symmetry that was stated"
    if is_constant(np.array([one.values[0] for one in states])):
        meaning += "; it has one value at all states"
    evidence = prover.evidence(proven, len(states))
    return Finding(symmetry.name, "stated symmetry", symmetry.unit, meaning, value, bool(proven), evidence, (), ())


def _list(paths: list[str]) -> str:
    return f"There are {', '.join(paths[:12])}." if paths else "The scene has none."


def _state_text(quantities: Quantities, state: State) -> str:
    e = quantities.found.equations
    told = [f"t = {state.t:.6g}"]
    told += [f"{one.name} = {value:.6g}" for one, value in zip(e.names, state.q, strict=True)]
    told += [f"{one.name} = {value:.6g}" for one, value in zip(e.speed_names, state.u, strict=True)]
    return ", ".join(told[:13]) + (", ..." if len(told) > 13 else "")
