"""Units with their dimensions: read, compared and converted to SI.

A unit is written as it is read: ``"kg*m^2"``, ``"N/m"``, ``"N m s/rad"``, ``"1"``.  An angle counts as a number.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache

from atwood.errors import DeclarationError, ParameterError, suggestion
from atwood.lazy_dataclasses import dataclass

Exponents = tuple[int, int, int, int]
"""Powers of mass, length, time and electric current."""

_BASE: dict[str, tuple[float, Exponents]] = {
    "1": (1.0, (0, 0, 0, 0)),
    "rad": (1.0, (0, 0, 0, 0)),
    "deg": (math.pi / 180.0, (0, 0, 0, 0)),
    "rev": (2.0 * math.pi, (0, 0, 0, 0)),
    "rpm": (math.pi / 30.0, (0, 0, -1, 0)),
    "kg": (1.0, (1, 0, 0, 0)),
    "g": (1e-3, (1, 0, 0, 0)),
    "t": (1e3, (1, 0, 0, 0)),
    "m": (1.0, (0, 1, 0, 0)),
    "mm": (1e-3, (0, 1, 0, 0)),
    "cm": (1e-2, (0, 1, 0, 0)),
    "km": (1e3, (0, 1, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "ms": (1e-3, (0, 0, 1, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "h": (3600.0, (0, 0, 1, 0)),
    "Hz": (1.0, (0, 0, -1, 0)),
    "N": (1.0, (1, 1, -2, 0)),
    "kN": (1e3, (1, 1, -2, 0)),
    "J": (1.0, (1, 2, -2, 0)),
    "kJ": (1e3, (1, 2, -2, 0)),
    "W": (1.0, (1, 2, -3, 0)),
    "kW": (1e3, (1, 2, -3, 0)),
    "Pa": (1.0, (1, -1, -2, 0)),
    "A": (1.0, (0, 0, 0, 1)),
    "C": (1.0, (0, 0, 1, 1)),
    "V": (1.0, (1, 2, -3, -1)),
    "T": (1.0, (1, 0, -2, -1)),
    "Wb": (1.0, (1, 2, -2, -1)),
    "H": (1.0, (1, 2, -2, -2)),
    "F": (1.0, (-1, -2, 4, 2)),
    "S": (1.0, (-1, -2, 3, 2)),
    "ohm": (1.0, (1, 2, -3, -2)),
}

_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")

_TOKEN = re.compile(r"\s*(?:(\*\*|\^)\s*(-?\d{1,2})|([*/·.()])|(?:([A-Za-z]+)(-?[2-9]|-1)?|(1)))")
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")


@dataclass(frozen=True)
class Unit:
    """A unit: its text, its size in SI, and the powers of mass, length, time and current in it.

    Attributes
    ----------
    text
        The unit as it was written.
    factor
        How many SI units it is.
    exponents
        Powers of kg, m, s and A.
    """

    text: str
    factor: float
    exponents: Exponents

    @property
    def as_asked(self) -> str:
        """How a number is asked for, as "in m"; "without a unit" where it has none."""
        return "without a unit" if self.text == "1" else f"in {self.text}"

    def has_dimension_of(self, other: Unit) -> bool:
        """Return whether a value in this unit can be given in the other; ``"any"`` takes every unit."""
        if "any" in (self.text, other.text):
            return True
        return self.exponents == other.exponents


@lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Read a unit."""
    if text == "any":  # of a source, whose value takes the unit of the input that it drives
        return Unit(text, 1.0, (0, 0, 0, 0))
    tokens = _tokens(text)
    factor, exponents = _product(tokens, text)
    if tokens:
        raise _unreadable(text)
    return Unit(text, factor, exponents)


def _unreadable(text: str) -> DeclarationError:
    if re.match(r"\s*,\s*\d", text):
        return DeclarationError("a number has a comma before its decimals", advice="Write a point, as in '1.5 m'.")
    return DeclarationError(f"cannot read the unit {text!r}", advice="Write it like 'kg*m^2', 'N/m' or 'kg/(m s^2)'.")


def _tokens(text: str) -> list[str]:
    """Return names, operators, brackets and powers (``^2``) in reverse order, so that the next is the last."""
    found: list[str] = []
    position, stripped = 0, re.sub("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda raised: f"^{raised[0].translate(_RAISED)}", text.strip())
    while position < len(stripped):
        match = _TOKEN.match(stripped, position)
        if match is None:
            raise _unreadable(text)
        _, power, sign, name, raised, one = match.groups()
        name = name or one
        if name and found and found[-1] not in "*/·.(" and not stripped[position].isspace():
            raise _unreadable(text)
        found += [f"^{power}" if power else sign or name, *([f"^{raised}"] if raised else [])]
        position = match.end()
    return found[::-1]


def _product(tokens: list[str], text: str) -> tuple[float, Exponents]:
    """Read factors up to the end, or up to a bracket that closes."""
    factor, exponents = 1.0, (0, 0, 0, 0)
    divides = needed = False
    while tokens and (needed or tokens[-1] != ")"):
        token = tokens.pop()
        if token in "*/·." and not needed:
            divides, needed = token == "/", True
            continue
        size, powers = _factor(token, tokens, text)
        power = -1 if divides else 1
        if tokens and tokens[-1].startswith("^"):
            power *= int(tokens.pop()[1:])
        factor *= size**power
        a, b, c, d = (e + power * p for e, p in zip(exponents, powers, strict=True))
        exponents = (a, b, c, d)
        divides = needed = False
    if needed:
        raise _unreadable(text)
    return factor, exponents


def _factor(token: str, tokens: list[str], text: str) -> tuple[float, Exponents]:
    """Read one name, or what is in brackets."""
    if token == "(":
        inside = _product(tokens, text) if tokens and tokens[-1] != ")" else None
        if inside is None or not tokens or tokens.pop() != ")":
            raise _unreadable(text)
        return inside
    if token in _BASE:
        return _BASE[token]
    if not token[0].isalpha():
        raise _unreadable(text)
    within = f", in {text!r}" if token != text.strip() else ""
    advice = suggestion(token, _BASE) or "Write it like 'kg*m^2' or 'N/m'."
    raise DeclarationError(f"{token!r} is not a unit{within}", advice=advice)


def parse_si_unit(text: str) -> Unit:
    """Read a unit that must be an SI unit, as everything is declared and reported in."""
    unit = parse_unit(text)
    if unit.factor != 1.0:
        raise DeclarationError(
            f"{text!r} is not an SI unit",
            advice=f"Declare it in {unit_of(unit.exponents).text}; a value can still be given as text in {text}.",
        )
    return unit


def unit_of(exponents: Exponents) -> Unit:
    """Return the SI unit with the given powers of kg, m, s and A."""
    above = [f"{n}^{p}" if p > 1 else n for n, p in zip(_NAMES, exponents, strict=True) if p > 0]
    below = [f"{n}^{-p}" if p < -1 else n for n, p in zip(_NAMES, exponents, strict=True) if p < 0]
    return Unit("/".join(["*".join(above) or "1", *below]), 1.0, exponents)


ALONG = {"N": "m", "N*m": "rad"}
"""What a force of each unit acts along."""

_NAMES = ("kg", "m", "s", "A")


def split_quantity(text: str) -> tuple[float, str] | None:
    """Return the number and the text of the unit of a quantity; None if it does not begin with a number."""
    match = _QUANTITY.match(text)
    return None if match is None else (float(match.group(1)), match.group(2))


def parse_quantity(text: str, unit: Unit, where: str) -> float:
    """Read a number with an optional unit, such as ``"30 cm"``, and return it in the SI unit asked for."""
    split = split_quantity(text)
    if split is None:
        raise ParameterError(f"{text!r} is not a number", where=where, advice=f"Give a number {unit.as_asked}.")
    number, unit_text = split
    if not unit_text:
        return number
    try:
        given = parse_unit(unit_text)
    except DeclarationError as error:
        raise ParameterError(error.message, where=where, advice=error.advice) from None
    if not given.has_dimension_of(unit):
        raise ParameterError(
            f"{unit_text!r} does not measure what is asked for here", where=where, advice=f"Give it {unit.as_asked}."
        )
    if "Hz" in re.findall(r"[A-Za-z]+", unit_text) and "rad" in re.findall(r"[A-Za-z]+", unit.text):
        raise ParameterError(
            f"{unit_text!r} leaves open whether it counts turns or radians",
            where=where,
            advice=f"Give it in rpm, rev/s or {unit.text}.",
        )
    ratio = given.factor / unit.factor
    inverse = round(1.0 / ratio) if ratio < 1.0 else 0
    if inverse and math.isclose(inverse * ratio, 1.0, rel_tol=1e-15):  # 35 cm is 35/100 m, the float 0.35 exactly
        return number / inverse
    return number * ratio
