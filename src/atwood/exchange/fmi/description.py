"""The description of an FMU: variables, units and structure, as FMI 2.0 and 3.0 write them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from xml.sax.saxutils import quoteattr

from atwood.exchange.c.text import SceneText
from atwood.exchange.fmi.equations import Dependencies
from atwood.lazy_dataclasses import dataclass
from atwood.model.values.units import parse_unit

Depends = dict[int, list[int]] | None
"""On which value references rates and quantities depend, by their own; None where that is not known."""


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU.

    Attributes
    ----------
    name, unit
        Its path, and its unit in SI.
    reference
        Its value reference.
    causality, variability
        As the standard has them.
    start, low, high, nominal
        Numbers; None for none.
    derivative
        The value reference of the state whose rate it is.
    """

    name: str
    unit: str
    reference: int
    causality: str
    variability: str
    start: float | None = None
    low: float | None = None
    high: float | None = None
    nominal: float | None = None
    derivative: int | None = None


def variables_of(text: SceneText, watched: bool) -> list[Variable]:
    """Return the variables of a scene; a quantity that is a state stands once, and what events watch last.

    States of a scene with modes are none: another mode may have others.
    """
    data = text.mode.data
    states = [] if text.modes else [*data["coordinates"], *data["speeds"]]
    shown = {one.path for one in text.mode.known}
    size = text.size
    made = [Variable("time", "s", 0, "independent", "continuous")]
    for k, one in enumerate(states):
        causality = "output" if one["name"] in shown else "local"
        start, nominal = data["state"][k], data["tolerances"][k]
        more = {"start": start, "nominal": nominal if nominal > 0.0 else None}
        made.append(Variable(one["name"], _unit(one["unit"]), 1 + k, causality, "continuous", **more))
    taken = {one.name for one in made}
    for k, one in enumerate(states):
        unit = _unit(one["unit"]) or "1"
        unit = f"{unit}^2" if unit.endswith("/s") else f"{unit}/s"
        made.append(Variable(f"der({one['name']})", unit, 1 + size + k, "local", "continuous", derivative=1 + k))
    for k, each in enumerate(text.parameters):
        kind = ("input", "continuous") if each["kind"] == "input" else ("parameter", "tunable")
        low = each["low"]
        if low is not None and each["lower_open"]:
            low = math.nextafter(low, math.inf)
        name = each["path"] if each["path"] not in taken else f"parameter {each['path']}"
        made.append(Variable(name, _unit(each["unit"]), 1 + 2 * size + k, *kind, each["value"], low, each["high"]))
        taken.add(name)
    first = 1 + 2 * size + len(text.parameters)
    for k, quantity in enumerate(text.mode.known):
        if quantity.path not in taken:
            made.append(Variable(quantity.path, _unit(quantity.unit), first + k, "output", "continuous"))
    for k, event in enumerate(data["events"] if watched else ()):
        name = f"event {k + 1}: {event['part']}.{event['law']}"
        made.append(Variable(name, "", first + len(text.mode.known) + k, "local", "continuous"))
    return made


def _unit(text: str) -> str:
    return "" if text == "any" else text


def structure(text: SceneText, found: tuple[Dependencies, Dependencies], inputs: Sequence[int]) -> dict[int, list[int]]:
    """Return on which value references rates and quantities depend, by their own."""
    data = text.mode.data
    size = len(data["coordinates"]) + len(data["speeds"])
    numbers = {data["numbers"][one["path"]]: 1 + 2 * size + k for k, one in enumerate(text.parameters)}
    knowns = [*range(1, 1 + size), *(numbers[one] for one in inputs)]
    first = 1 + 2 * size + len(text.parameters)
    made = {1 + size + k: [knowns[i] for i in each] for k, each in enumerate(found[0])}
    return made | {first + k: [knowns[i] for i in each] for k, each in enumerate(found[1])}


def _attributes(given: Mapping[str, object]) -> str:
    texts = {key: repr(one) if isinstance(one, float) else str(one) for key, one in given.items() if one is not None}
    return "".join(f" {key}={quoteattr(one)}" for key, one in texts.items())


def units_xml(variables: Iterable[Variable]) -> list[str]:
    """Return the units of variables in terms of those of SI."""
    lines = ["<UnitDefinitions>"]
    for unit in sorted({one.unit for one in variables if one.unit}):
        found = parse_unit(unit)
        powers = {name: power for name, power in zip(("kg", "m", "s", "A"), found.exponents, strict=True) if power}
        whole = {name: int(power) for name, power in powers.items() if power == int(power)}
        if unit == "rad":
            whole = {"rad": 1}
        factor = found.factor if found.factor != 1.0 else None
        base = f"<BaseUnit{_attributes({**whole, 'factor': factor})}/>" if whole == powers or unit == "rad" else ""
        lines.append(f"<Unit name={quoteattr(unit)}>{base}</Unit>")
    return [*lines, "</UnitDefinitions>"]


def description(
    text: SceneText, token: str, variables: Sequence[Variable], depends: Depends, both: bool, fmi: int
) -> str:
    """Return the file modelDescription.xml of FMI 2.0 or 3.0; `both` with model exchange beside co-simulation."""
    first, s = fmi == 2, "s" if fmi == 3 else ""
    state = "FMUstate" if first else "FMUState"
    can = {"modelIdentifier": text.name, f"canGetAndSet{state}": "true", f"canSerialize{state}": "true"}
    derives = [f"provides{kind}Derivative{s}" for kind in ("Directional", "Adjoint")[: fmi - 1]]
    head: dict[str, object] = {"fmiVersion": f"{fmi}.0", "modelName": text.mode.flat.name}
    head |= {"guid" if first else "instantiationToken": token, "generationTool": "Atwood"}
    head |= {"variableNamingConvention": "flat"}
    sources = ""
    if first:
        head["numberOfEventIndicators"] = len(text.mode.data["events"]) if both else None
        units = ["fmi2.c", *(one for one in text.modes if one.endswith(".c"))]
        named = "".join(f"<File{_attributes({'name': one})}/>" for one in units)
        sources = f"<SourceFiles>{named}</SourceFiles>"
    kinds = {"ModelExchange": dict.fromkeys(derives, "true")} if both else {}
    kinds["CoSimulation"] = {"canHandleVariableCommunicationStepSize": "true"}
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f"<fmiModelDescription{_attributes(head)}>"]
    lines += [f"<{kind}{_attributes({**can, **more})}>{sources}</{kind}>" for kind, more in kinds.items()]
    lines += units_xml(variables)
    lines += ['<LogCategories><Category name="logStatusError"/></LogCategories>', _experiment(text)]
    place = {one.reference: k if first else one.reference for k, one in enumerate(variables, 1)}
    lines += ["<ModelVariables>", *(_variable(one, place, first) for one in variables), "</ModelVariables>"]
    lines += ["<ModelStructure>", *(_structure_2 if first else _structure_3)(variables, depends, place)]
    return "\n".join([*lines, "</ModelStructure>", "</fmiModelDescription>"]) + "\n"


def _variable(one: Variable, place: Mapping[int, int], first: bool) -> str:
    own = {"name": one.name, "valueReference": one.reference, "causality": one.causality}
    own |= {"variability": one.variability, "initial": _initial(one)}
    real = {"unit": one.unit or None, "min": one.low, "max": one.high, "nominal": one.nominal, "start": one.start}
    real |= {"derivative": None if one.derivative is None else place[one.derivative]}
    if first:
        return f"<ScalarVariable{_attributes(own)}><Real{_attributes(real)}/></ScalarVariable>"
    return f"<Float64{_attributes({**own, **real})}/>"


def _structure_2(variables: Sequence[Variable], depends: Depends, place: Mapping[int, int]) -> list[str]:
    unknowns = [(place[one.reference], _named(depends, one, place)) for one in variables if one.causality == "output"]
    rates = [(place[one.reference], _named(depends, one, place)) for one in variables if one.derivative is not None]
    starting = sorted({i for i, _ in unknowns if variables[i - 1].start is None} | {i for i, _ in rates})
    lines = []
    for name, ones in (
        ("Outputs", unknowns),
        ("Derivatives", rates),
        ("InitialUnknowns", [(i, None) for i in starting]),
    ):
        rows = [f"<Unknown{_attributes({'index': i, 'dependencies': found})}/>" for i, found in ones]
        lines += [f"<{name}>", *rows, f"</{name}>"] if rows else []
    return lines


def _structure_3(variables: Sequence[Variable], depends: Depends, place: Mapping[int, int]) -> list[str]:
    outputs = [one for one in variables if one.causality == "output"]
    rates = [one for one in variables if one.derivative is not None]
    lines = []
    for name, ones in (("Output", outputs), ("ContinuousStateDerivative", rates)):
        for one in ones:
            own = {"valueReference": one.reference, "dependencies": _named(depends, one, place)}
            lines.append(f"<{name}{_attributes(own)}/>")
    starting = [one for one in (*outputs, *rates) if one.start is None]
    lines += [f'<InitialUnknown valueReference="{one.reference}"/>' for one in starting]
    watching = [one for one in variables if one.name.startswith("event ")]
    return [*lines, *(f'<EventIndicator valueReference="{one.reference}"/>' for one in watching)]


def _named(depends: Depends, one: Variable, place: Mapping[int, int]) -> str | None:
    """Return the list of what a variable depends on, where it is known; a state depends on itself."""
    if depends is None:
        return None
    return " ".join(str(place[each]) for each in depends.get(one.reference, [one.reference]))


def _initial(one: Variable) -> str | None:
    if one.causality in ("independent", "input"):
        return None
    return "exact" if one.start is not None else "calculated"


def _experiment(text: SceneText) -> str:
    end = text.end_time if text.end_time > text.start_time else text.start_time + 1.0
    given = {"startTime": text.start_time, "stopTime": end, "tolerance": 1e-8}
    return f"<DefaultExperiment{_attributes(given)}/>"


def build_xml(text: SceneText) -> str:
    """Return the buildDescription.xml of FMI 3.0."""
    modes = "".join(f'\n<SourceFile name="{one}"/>' for one in text.modes if one.endswith(".c"))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
<BuildConfiguration modelIdentifier="{text.name}" description="C99 without libraries but that of C.">
<SourceFileSet name="all" language="C99" compilerOptions="-std=c99 -ffp-contract=off">
<SourceFile name="fmi3.c"/>{modes}
</SourceFileSet>
<Library name="m" external="true"/>
</BuildConfiguration>
</fmiBuildDescription>
"""
