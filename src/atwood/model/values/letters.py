"""Letters as people write them: ``theta``, ``l_0``, ``omega_1``, or in Unicode; and what may be one."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from atwood.arguments import BY_PATH, Kind, Refused, each, show
from atwood.lazy_dataclasses import replace

GREEK = (
    *("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu"),
    *("nu", "xi", "pi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega", "Gamma"),
    *("Delta", "Theta", "Lambda", "Xi", "Pi", "Sigma", "Upsilon", "Phi", "Psi", "Omega"),
)
"""The names of Greek letters."""

GREEK_SIGNS = "αβγδεζηθικλμνξπρστυφχψωΓΔΘΛΞΠΣΥΦΨΩ"
"""The Greek letters, in the same order."""

_MEANT: Mapping[str, str] = {"t": "time", "pi": "the number"}
"""Letters that stand for something already."""


def split_letter(name: str) -> tuple[str, ...]:
    """Return a name as a letter and what stands below it: ``theta1`` and ``theta_1`` are theta with a 1."""
    head, *below = name.split("_")
    found = re.fullmatch(r"([A-Za-z]|" + "|".join(GREEK) + r")(\d+)", head)
    return (found[1], found[2], *below) if found else (head, *below)


def _letter(value: Any) -> str:
    if not isinstance(value, str):
        raise Refused
    plain = value.strip()
    for sign, name in zip(GREEK_SIGNS, GREEK, strict=True):
        plain = plain.replace(sign, name)
    plain = plain.translate(str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789"))
    if not re.fullmatch(r"[A-Za-z]+\d*(_[A-Za-z0-9]+)*", plain):
        raise Refused("A letter has letters, and perhaps figures or words below it, each after _.")
    if plain in _MEANT:
        raise Refused(f"{plain} stands for {_MEANT[plain]}.")
    return "_".join(split_letter(plain))


LETTER = Kind("a letter such as 'theta', 'l_0' or 'θ₁'", _letter, "LETTER")
OWN_LETTERS = each(LETTER, "a letter, or one for each component")


def _letters(value: Any, signed: bool = False) -> dict[str, str]:
    found = {}
    for path, letter in BY_PATH.read(value).items():
        sign = "-" if signed and isinstance(letter, str) and letter.strip().startswith("-") else ""
        try:
            found[path] = sign + LETTER.read(letter.strip().removeprefix("-") if sign else letter)
        except Refused as refused:
            said = f"{path} cannot be {show(letter)}. {refused}".strip()
            raise Refused(said) from None
    return found


LETTERS = replace(BY_PATH, what="letters by path, such as {'hoop.angle': 'theta'}", read=_letters, word="PATH=LETTER")
"""What stands for coordinates, parameters and parts, by path: the argument ``symbols`` of what writes formulas."""

SIGNED_LETTERS = replace(LETTERS, read=lambda value: _letters(value, signed=True))
"""The same, where a coordinate may have the other sign: ``{"rod.angle": "-theta"}``."""
