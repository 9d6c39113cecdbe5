"""What a run was asked for, what came of it in a few numbers, and which versions answered."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from typing import Any

import numpy as np

from atwood.display import data_of
from atwood.errors import AtwoodError
from atwood.result.result import Result
from atwood.simulation.events.modes import EventRecord

_LIMITS = ("max_steps", "max_seconds", "max_step", "first_step")


def versions() -> dict[str, str]:
    """Return the versions of what a run depends on."""
    from importlib.metadata import PackageNotFoundError, version

    from atwood.integrators.ida.library import available, library

    found = {"python": platform.python_version()}
    for name in ("atwood", "numpy", "scipy", "scikit-sundae"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # a checkout that is not installed
            found[name] = "unknown"
    found["sundials"] = ".".join(map(str, library().version)) if available() else "unknown"
    return found


def solver_name(result: Result) -> str:
    """Return the name of the solver that a run was made with; of all, if it was changed on the way."""
    return ", then ".join(dict.fromkeys(one.name for one in result.run.choices))


def _describe_event(event: EventRecord) -> dict[str, Any]:
    what = {"time": event.time, "part": event.part, "what": event.message, "mode": event.target, "kind": event.kind}
    struck = event.struck
    return what if struck is None else {**what, "impulse": struck.impulse, "loss": struck.loss}


def describe_run(result: Result) -> dict[str, Any]:
    """Return everything about a run but its trajectories, as plain data."""
    statistics, options, flat = result.statistics, result.run.options, result.assembly.flat
    ledger, missed = result.energy, result.constraint_max
    outputs = options.outputs
    return {
        "scene": flat.name,
        **data_of(result, "form", "level", "method", "status", "message"),
        "t_start": float(result.start.time),
        "t_end": float(result.time[-1]),
        "happenings": [_describe_event(one) for one in result.events],
        "singular_positions": [
            {"time": one.time, "ways": one.ways, "parts": list(one.parts), "what": one.describe()}
            for one in result.singular_crossings
        ],
        "orientation": result.assembly.orientation.kind,
        "restated": [{"time": one.time, "body": one.body} for one in result.coordinate_switches],
        "solver": {
            "name": solver_name(result),
            "why": result.run.why,
            "choices": [
                {"from": one.time, "solver": one.solver, "name": one.name, "reason": one.reason}
                for one in result.run.choices
            ],
            **data_of(statistics, "steps", "residual_evaluations", "jacobian_evaluations"),
            "wall_s": statistics.seconds,
        },
        "energy": {
            "start": float(ledger.total[0]),
            "end": float(ledger.total[-1]),
            "work": float(ledger.work[-1] - ledger.work[0]),
            **data_of(ledger, "max_drift", "exchanged", "uncertainty"),
        },
        **({} if result.conserved is None else {"conserved": result.conserved.to_dict()}),
        "constraint_max": max(missed["position"], missed["velocity"]),
        "constraint_held": max(missed["held_position"], missed["held_velocity"]),
        "asked": {
            "t_end": options.t_end,
            "rtol": options.relative_tolerance,
            "atol": options.absolute_tolerance,
            "outputs": int(outputs) if isinstance(outputs, (int, np.integer)) else len(outputs),
            **data_of(options, *_LIMITS, "nominal"),
            **data_of(flat, "start", "guess"),
        },
        "versions": versions(),
    }


def describe_all(result: Result) -> dict[str, Any]:
    """Return the same with all that a run is made again from: every parameter, the scene, and what was asked for."""
    from atwood.model.compose.serialization import to_data  # few runs are saved

    found, source = describe_run(result), result.assembly.source
    scene = None if source is None else source.scene
    parts = [one.component for one in result.assembly.flat.parts.values()]
    found["parameters"] = dict(_values(parts if scene is None else [scene]))
    try:
        found |= {"no_source": "it was assembled from leaves"} if scene is None else {"source": to_data(scene)}
    except AtwoodError as error:
        found["no_source"] = str(error)
    found["asked"]["again"] = _arguments(result)
    return found


def _values(waiting: list[Any]) -> Iterator[tuple[str, Any]]:
    """Yield the parameters and inputs of components, and of all in them, with their paths; functions as text."""
    while waiting:
        one = waiting.pop(0)
        waiting.extend(one._children().values())
        for name in (*one.parameter_specs(), *one.signal_specs()):
            value = one._value(name)
            text = getattr(value, "text", "a function of time") if callable(value) else value
            yield f"{one.path}.{name}".lstrip("."), text


def _arguments(result: Result) -> dict[str, Any]:
    """Return the arguments of `simulate` for the same run; None for a condition that is a function."""
    options, assembly = result.run.options, result.assembly
    outputs = options.outputs
    asked = {
        "form": assembly.form,
        "level": assembly.level or None,
        "orientation": assembly.orientation.kind,
        "t_end": options.t_end,
        "outputs": int(outputs) if isinstance(outputs, (int, np.integer)) else np.asarray(outputs).tolist(),
        **data_of(options, *_LIMITS, "solver", "order", "step", "samples", "structure"),
        "nominal": dict(options.nominal) or None,
    }
    if options.accuracy is None:
        asked |= {"rtol": options.relative_tolerance, "atol": options.absolute_tolerance}
    else:
        asked["accuracy"] = options.accuracy
    found = {name: value for name, value in asked.items() if value is not None}
    for name, is_end in (("until", True), ("record", False)):
        given = [one.given for one in options.conditions if (one.target == "stop") is is_end]
        if given:
            found[name] = given if all(isinstance(one, str) for one in given) else None
    return found
