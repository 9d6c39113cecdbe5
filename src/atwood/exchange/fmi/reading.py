"""What an FMU says of itself: the file modelDescription.xml of FMI 2.0 and 3.0."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

from atwood.errors import UnsupportedError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.xml_files import read_xml

REALS = {"Real": "Real", "Float64": "Float64", "Float32": "Float32"}
"""Types of variables that are real numbers."""
WHOLES = ("Integer", "Boolean", "Enumeration", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))
"""Types of variables that are whole numbers or truth values."""
_KINDS = {"model exchange": "ModelExchange", "co-simulation": "CoSimulation"}
_BASE_UNITS = ("kg", "m", "s", "A", "rad")


@dataclass(frozen=True)
class Variable:
    """One number of an FMU; an array is as many of them.

    Attributes
    ----------
    name, reference, type
        Its name, its value reference, and the type that the FMU gives it.
    index, size
        Its place among the numbers with its reference, and how many these are.
    causality, variability, initial
        As FMI has them.
    start
        Its value before it is set; None where the FMU works it out.
    minimum, maximum, nominal
        Bounds, and a usual size; None where nothing is said.
    unit
        Its SI unit, ``"any"`` where there is none, or it is no product of powers of base units.
    text
        One line of meaning.
    """

    name: str
    reference: int
    type: str
    index: int
    size: int
    causality: str
    variability: str
    initial: str
    start: float | None
    minimum: float | None
    maximum: float | None
    nominal: float | None
    unit: str
    text: str


@dataclass(frozen=True)
class Description:
    """What an FMU says of itself.

    Attributes
    ----------
    version
        Of FMI, 2 or 3.
    name, token
        The model's name, and what its binary is told apart by.
    identifiers
        The name of the binary by kind, of those that the FMU offers.
    has_jvp
        Kinds with directional derivatives.
    variables
        All numbers.
    states, derivatives
        Continuous states, and their derivatives in the same order.
    indicators
        How many event indicators there are.
    start, step
        Of its default experiment, s; the step is None where nothing is said.
    left_out
        Names of variables that have no counterpart, with why.
    """

    version: int
    name: str
    token: str
    identifiers: dict[str, str]
    has_jvp: frozenset[str]
    variables: tuple[Variable, ...]
    states: tuple[Variable, ...]
    derivatives: tuple[Variable, ...]
    indicators: int
    start: float
    step: float | None
    left_out: dict[str, str]


def read_description(data: bytes, path: Path) -> Description:
    """Return what the file modelDescription.xml says.

    Raises
    ------
    UsageError
        If it is no description of a model, or contradicts itself.
    UnsupportedError
        If its version is neither 2 nor 3, or it offers neither model exchange nor co-simulation.
    """
    root = read_xml(data, f"{path}/modelDescription.xml")
    try:
        return _read(root, path)
    except (KeyError, ValueError, IndexError, OverflowError) as error:
        raise UsageError(
            f"its modelDescription.xml cannot be read ({type(error).__name__}: {error})", where=str(path)
        ) from None


def _read(root: ElementTree.Element, path: Path) -> Description:
    if root.tag != "fmiModelDescription":
        raise UsageError(f"its modelDescription.xml begins with {root.tag!r}", where=str(path))
    version = root.attrib["fmiVersion"]
    if version.split(".")[0] not in ("2", "3"):
        raise UnsupportedError(f"it is an FMU of FMI {version}", where=str(path), advice="FMI 2 and 3 are read.")
    major = int(version.split(".")[0])
    offered = {kind: root.find(tag) for kind, tag in _KINDS.items()}
    elements = {kind: one for kind, one in offered.items() if one is not None}
    if not elements:
        raise UnsupportedError(
            "it offers neither model exchange nor co-simulation, but scheduled execution, in which clocks from "
            "outside call its parts",
            where=str(path),
        )
    nodes = [_of_version(one, major) for one in root.iterfind("ModelVariables/*")]
    left_out: dict[str, str] = {}
    variables = _variables(root, nodes, left_out)
    by_node: dict[int, list[Variable]] = {}
    for number, own in variables:
        by_node.setdefault(number, []).append(own)
    numbers = {int(node["valueReference"]): number for number, (_, node, _) in enumerate(nodes)}
    states: list[Variable] = []
    derivatives: list[Variable] = []
    rates = "ModelStructure/Derivatives/Unknown" if major == 2 else "ModelStructure/ContinuousStateDerivative"
    for one in root.iterfind(rates):
        rate = int(one.attrib["index"]) - 1 if major == 2 else numbers[int(one.attrib["valueReference"])]
        of = int(nodes[rate][1]["derivative"])
        derivatives += by_node[rate]
        states += by_node[of - 1 if major == 2 else numbers[of]]
    if major == 2:
        indicators = int(root.get("numberOfEventIndicators", "0"))
    else:
        found = root.iterfind("ModelStructure/EventIndicator")
        indicators = sum(len(by_node[numbers[int(one.attrib["valueReference"])]]) for one in found)
    experiment = root.find("DefaultExperiment")
    given = {} if experiment is None else experiment.attrib
    fixed = elements["co-simulation"].attrib.get("fixedInternalStepSize") if "co-simulation" in elements else None
    step = given.get("stepSize", fixed)
    has_jvp = frozenset(
        kind
        for kind, one in elements.items()
        if _truth(one.get("providesDirectionalDerivative" if major == 2 else "providesDirectionalDerivatives", "0"))
    )
    return Description(
        major,
        root.attrib["modelName"],
        root.attrib["guid" if major == 2 else "instantiationToken"],
        {kind: one.attrib["modelIdentifier"] for kind, one in elements.items()},
        has_jvp,
        tuple(own for _, own in variables),
        tuple(states),
        tuple(derivatives),
        indicators,
        float(given.get("startTime", "0")),
        None if step is None else float(step),
        left_out,
    )


def _of_version(node: ElementTree.Element, major: int) -> tuple[str, dict[str, str], ElementTree.Element]:
    """Return type, attributes and element of a variable; in FMI 2 part of them are those of an element inside."""
    if major == 3:
        return node.tag, dict(node.attrib), node
    inner = next(one for one in node if one.tag in (*REALS, *WHOLES, "String"))
    return inner.tag, {**inner.attrib, **node.attrib}, node


def _variables(
    root: ElementTree.Element, nodes: list[tuple[str, dict[str, str], ElementTree.Element]], left_out: dict[str, str]
) -> list[tuple[int, Variable]]:
    """Return all numbers, each with the place of its variable; what is no number is noted."""
    units = {one.attrib["name"]: _unit(one.find("BaseUnit")) for one in root.iterfind("UnitDefinitions/Unit")}
    types: dict[str, dict[str, str]] = {}
    for one in root.iterfind("TypeDefinitions/*"):
        inner = one[0].attrib if one.tag == "SimpleType" and len(one) else {}
        types[one.attrib["name"]] = {**one.attrib, **inner}
    sizes = {int(node["valueReference"]): node.get("start", "1") for _, node, _ in nodes}
    found: list[tuple[int, Variable]] = []
    for number, (kind, own, element) in enumerate(nodes):
        name = own["name"]
        if kind not in REALS and kind not in WHOLES:
            left_out[name] = f"a variable of type {kind} has no counterpart"
            continue
        node = {**types.get(own.get("declaredType", ""), {}), **own}
        shape = [
            int(one.get("start", "")) if "start" in one.attrib else int(sizes[int(one.attrib["valueReference"])])
            for one in element.iterfind("Dimension")
        ]
        size = math.prod(shape)
        starts = [_number(word) for word in own["start"].split()] if "start" in own else []
        if starts and len(starts) not in (1, size):
            raise ValueError(f"{name} has {size} numbers and {len(starts)} start values")
        bounds = [None if key not in node else _number(node[key]) for key in ("min", "max", "nominal")]
        for index in range(size):
            place = [str(index // math.prod(shape[axis + 1 :]) % length + 1) for axis, length in enumerate(shape)]
            made = Variable(
                f"{name}[{','.join(place)}]" if shape else name,
                int(node["valueReference"]),
                kind,
                index,
                size,
                node.get("causality", "local"),
                node.get("variability", "continuous" if kind in REALS else "discrete"),
                node.get("initial", ""),
                starts[index if len(starts) > 1 else 0] if starts else None,
                bounds[0],
                bounds[1],
                bounds[2],
                units.get(node.get("unit", ""), "any"),
                own.get("description", ""),
            )
            found.append((number, made))
    return found


def _number(text: str) -> float:
    value = float({"true": "1", "false": "0"}.get(text, text))
    if not math.isfinite(value):
        raise ValueError(f"{text} is not a finite number")
    return value


def _truth(text: str) -> bool:
    return text in ("true", "1")


def _unit(base: ElementTree.Element | None) -> str:
    """Return a unit as a product of powers of base units."""
    if base is None or float(base.get("factor", "1")) != 1.0 or float(base.get("offset", "0")) != 0.0:
        return "any"
    if any(int(base.get(name, "0")) for name in ("K", "mol", "cd")):
        return "any"
    powers = {name: int(base.get(name, "0")) for name in _BASE_UNITS}
    above = "*".join(f"{name}^{power}" if power > 1 else name for name, power in powers.items() if power > 0)
    below = "*".join(f"{name}^{-power}" if power < -1 else name for name, power in powers.items() if power < 0)
    return f"{above or '1'}/({below})" if below else above or "1"
