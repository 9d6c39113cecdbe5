"""Numbers of a scene that can be changed while it goes on, and zeros that stay in its equations for that."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from atwood.errors import ParameterError, check_known, suggestion_in_parts
from atwood.expr import depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.other_values import Slot, find_slots
from atwood.lazy_dataclasses import replace
from atwood.model.values.units import parse_unit
from atwood.plotting.live.pulls import PULL

_TRIALS = 1.0, 0.5, 0.1, -1.0


def with_sliders(assembly: Assembly, sliders: Sequence[str]) -> tuple[Assembly, set[str]]:
    """Return a scene in whose equations some parameters stay that are zero, and the names of their symbols.

    They have other values there; see `with_zeros`.

    Raises
    ------
    ParameterError
        If there is no such parameter, or it shapes the equations.
    """
    slots = {slot.path: slot for _, slot in find_slots(assembly.flat)} | dict(find_slots(assembly.flat))
    zeros: dict[str, Slot] = {}
    for path in sliders:
        check_known(path, slots, "there is no such parameter", hint=suggestion_in_parts, error=ParameterError)
        value = slots[path].read(assembly.flat)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or _is_structural(assembly, slots[path]):
            raise ParameterError(
                "it shapes the equations, so that a page cannot change it",
                where=path,
                advice="Make a page for each of its values.",
            )
        if value == 0.0:
            zeros[path] = slots[path]
    if not zeros:
        return assembly, set()
    made = assembly.with_values({path: _trial(assembly, slot) for path, slot in zeros.items()})
    places = {(slot.part, slot.name, slot.axis) for slot in zeros.values()}
    return made, {name for name, slot in find_slots(made.flat) if (slot.part, slot.name, slot.axis) in places}


def with_zeros(assembly: Assembly, names: Collection[str]) -> Assembly:
    """Return a scene with the same equations, in which the parameters of some symbols are zero."""
    if not names:
        return assembly
    table = assembly.mechanism.table
    values = {symbol: 0.0 if symbol.name in names else value for symbol, value in table.values.items()}
    return replace(assembly, mechanism=replace(assembly.mechanism, table=replace(table, values=values)))


def _is_structural(assembly: Assembly, slot: Slot) -> bool:
    specs = assembly.flat.parts[slot.part].component.parameter_specs() if slot.part else {}
    return slot.name in specs and specs[slot.name].structural


def _trial(assembly: Assembly, slot: Slot) -> float:
    """Return a value that a parameter may have, not zero."""
    low, high, _ = _bounds(assembly, slot)
    for one in _TRIALS:
        if (low is None or one >= low) and (high is None or one <= high):
            return one
    return 0.5 * high if high else low or 1.0


def _bounds(assembly: Assembly, slot: Slot) -> tuple[float | None, float | None, bool]:
    """Return the least and the largest value, and whether the least is none itself."""
    specs = assembly.flat.parts[slot.part].component.parameter_specs() if slot.part else {}
    spec = specs.get(slot.name)
    if spec is None:
        return None, None, False
    return (spec.minimum if spec.above is None else spec.above), spec.maximum, spec.above is not None


def find_parameters(assembly: Assembly) -> dict[str, tuple[int, Slot]]:
    """Return the parameters that can be changed by path: where they stand, and their numbers among all parameters.

    Constants of integration and times of switches were found with the values that there are: what these read stays.
    """
    if assembly.mechanism.constants:
        return {}
    slots = dict(find_slots(assembly.flat))
    fixed = [one.difference for one in assembly.relations]
    sampled = {
        f"{path}.{name}"
        for path, part in assembly.flat.parts.items()
        for law in part.component.laws("update")
        for name in (law.options.every, law.options.offset)
    }
    return {
        slots[symbol.name].path: (number, slots[symbol.name])
        for number, symbol in enumerate(assembly.mechanism.table.values)
        if symbol.name in slots
        and symbol.name not in sampled
        and not symbol.name.startswith(PULL)
        and not (fixed and depends_on(fixed, [symbol]))
    }


def live_parameters(assembly: Assembly) -> list[dict[str, Any]]:
    """Return what pages know of the parameters that can be changed."""
    values = assembly.parameter_values
    return [_described(assembly, slot, float(values[number])) for number, slot in find_parameters(assembly).values()]


def _described(assembly: Assembly, slot: Slot, value: float) -> dict[str, Any]:
    low, high, is_open = _bounds(assembly, slot)
    kind, unit = "gravity", parse_unit("m/s^2")
    if slot.part:
        component = assembly.flat.parts[slot.part].component
        is_input = slot.name in component.signal_specs() and slot.name not in component.parameter_specs()
        kind = "input" if is_input else "parameter"
        unit = (component.signal_specs() if is_input else component.parameter_specs())[slot.name].unit
    return {
        "path": slot.path,
        "value": value,
        "unit": "" if isinstance(slot.axis, str) else unit.text,
        "low": low,
        "high": high,
        "lower_open": is_open,
        "kind": kind,
    }
