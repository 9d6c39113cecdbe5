"""The Taylor-series method: what it is given, its order, and how its steps are chosen.

A. Jorba and M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods,
Experimental Mathematics 14 (2005) 99-117: the order from the tolerance and the step from the last coefficients are in
section 3.  Three things differ:

- Sizes are those of each unknown, as its tolerances say, where they take the largest of all.
- Their two last coefficients are not enough: a mechanism that is released at rest where its forces are odd has series
  in which only every fourth coefficient is there, and both can be zero.  So four are looked at.
- At the end of a step, the rates are compared with the derivative of the polynomial.  That costs nothing, since the
  next step begins with these rates, and it shows what no coefficient can: a law that changes within a step.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, exp, frexp, inf, log
from typing import TYPE_CHECKING

from atwood.arrays import FloatArray
from atwood.integrators.protocol import SolverOptions
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.expr.series.taylor import TaylorPrograms
    from atwood.integrators.taylor.native import CompiledRecurrences


LOWEST, HIGHEST = 5, 28
"""The orders that are used."""

FACTOR = 0.65
"""Orders for each factor e of the tolerance; a step is then e^(-1/FACTOR) of the radius of convergence.

A half is best if an order costs as much as its number of terms; here convolutions are cheap beside what every order
costs, and 0.6 to 0.7 takes the least time for an error (chains of 2, 10 and 40 links, errors from 1e-3 to 1e-12).
"""

WATCHED = 4
"""The radius of convergence is estimated from so many last coefficients."""

DEFECT = 30.0
"""How far the rates at the end of a step may be from the polynomial's, in units of the tolerance."""

FLOOR = 1e-12
"""The least such difference that is looked at, relative to the sizes: below it is rounding."""

RETREAT = 0.5
"""The share of a step that is tried next where the rates do not fit or have no value."""


RETRIES, SMALLER = 4, 1e-6
"""How often coefficients that are not finite are tried again, with a unit of time that is so many times smaller."""


PARTS = 2
"""What judges a step is asked about so many parts of it: longer ones bend more than the cubics between their ends."""


REACH = 0.5
"""Where events are looked for, no step changes an unknown by more than so many times its size."""


@dataclass(frozen=True, eq=False)
class TaylorProblem:
    """The recurrences of one mode, with parameter values.

    Parameters
    ----------
    programs
        The recurrences, of which `atwood.integrators.taylor.memory.LANES` convolutions are worked out at a time.
    parameters
        The values of the parameters of the program of order zero.
    compiled
        ``compiled()``: the recurrences as machine code, and what depends on their parameters alone.
    stop_time
        No step goes beyond this time: what acts may change there.
    reach
        No step changes an unknown by more than so many times its size: where events are looked for, a step must not be
        so long that one comes and goes within it.
    """

    programs: TaylorPrograms
    parameters: FloatArray
    compiled: Callable[[], tuple[CompiledRecurrences, FloatArray]]
    stop_time: float = inf
    reach: float = inf


def choose_order(options: SolverOptions) -> int:
    """Return the order that suits a tolerance: Jorba and Zou, section 3.1, where the factor is 1/2."""
    found = ceil(1.0 - FACTOR * log(options.relative_tolerance))
    return min(max(found, LOWEST), HIGHEST)


def share_of_radius(order: int, tolerance: float) -> float:
    """Return the step as a share of the radius of convergence: where terms of order p - 1 are as small as allowed.

    The last factor is that of Jorba and Zou, section 3.2.
    """
    return exp((log(tolerance) - 0.7) / (order - 1))


def logarithm(value: float) -> float:
    """Return the logarithm to base 2, good enough for a step: linear between powers of two, and finite at zero."""
    if value < 2.0**-1022:
        return -1023.0
    mantissa, exponent = frexp(value)
    return 2.0 * mantissa + (exponent - 2)
