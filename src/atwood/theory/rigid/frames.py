"""The Foucault pendulum in letters: how its plane of swing turns, to the first terms that books leave out."""

from __future__ import annotations

from collections.abc import Mapping

from atwood.arguments import check, takes_names
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.sheet import FormulaSheet, statements_of


@takes_names
def foucault_formulas(*, symbols: Mapping[str, str] | None = None) -> FormulaSheet:
    """Return how the plane of a Foucault pendulum turns as seen from the ground, as an expansion.

    Omega is the rate of the Earth, beta the latitude, l the length, a the amplitude, ``omega_0^2 = g/l``. The first
    term is that of Landau and Lifshitz, Mechanics, section 39; the second comes from the centrifugal force, whose share
    differs along the meridian and across it; the third from the swing not being small: released at rest, the bob
    goes round an ellipse with the other semi-axis ``b``, which advances by 3 pi a b/(4 l^2) in a period.

    Parameters
    ----------
    symbols
        Other letters.

    Returns
    -------
    FormulaSheet
        ``frequencies``: the equation for the frequencies w of small swings; ``small``: the rate of their plane;
        ``b`` and ``swing``: what the amplitude adds where the plate turns at ``Omega sin(beta)`` alone.
    """
    return FormulaSheet("Foucault pendulum", statements_of(_FOUCAULT)).in_letters(check(SYMBOLS, symbols, "symbols"))


_FOUCAULT = """
frequencies | Frequencies w of small swings | | (omega_0**2 - Omega**2*sin(beta)**2 - w**2)*(omega_0**2 - Omega**2 - w**2) = 4*Omega**2*sin(beta)**2*w**2
small | Precession of small swings | phi' | -Omega*sin(beta) - Omega**3*cos(beta)**4/(32*omega_0**2*sin(beta))
b | Released at rest, the swing is an ellipse in space | b | a*Omega*sin(beta)/omega_0
swing | Precession at the amplitude a | phi' | -Omega*sin(beta)*(1 - 3*a**2/(8*l**2))
"""  # noqa: E501
