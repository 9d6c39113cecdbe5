"""What the balance of energy tells of the error of a run: a bound from below, without any other run.

Where a solver steps over a law that acts briefly, its own estimates see nothing, and neither does a second run that
steps over it, too. The balance of energy does, as soon as one sample meets the law: a state that is right to a share of
the scene's sizes has an energy that is right to as large a share of what these sizes are worth. So a drift that is
larger bears witness to an error of the state. The reverse does not hold: many errors leave the energy as it is.
"""

from __future__ import annotations

import numpy as np

from atwood.errors import AtwoodError
from atwood.result.accounts import account, energy_near
from atwood.result.energy import EnergyLedger
from atwood.result.segment_quantities import SegmentQuantities
from atwood.result.work import find_ledger, ledger_of_samples
from atwood.simulation.run.made import Run

__all__ = ["needed_error"]

_NEAR = 1e-6
"""By such a share of their sizes states are moved to see what the energy makes of it."""


def needed_error(run: Run, doubt: float) -> float:
    """Return the error of the state of a run that the drift of its energy needs at least, at any sample.

    It is a share of the sizes of coordinates and speeds; zero where rounding, and the error of the work as an integral,
    account for the drift, and where there is no balance.

    Parameters
    ----------
    run
        The run.
    doubt
        An error up to this is no reason to look at the work more closely than samples tell.
    """
    every = np.ones(sum(len(one.time) for one in run.segments), dtype=bool)
    with np.errstate(all="ignore"):
        try:
            pieces = [account(SegmentQuantities(one)) for one in run.segments]
            worth = max(energy_near(one, _NEAR) for one in run.segments) / _NEAR
            found = _beyond(ledger_of_samples(pieces, every)) / worth
            if found > doubt and any(one.power is not None for one in pieces):
                found = _beyond(find_ledger(run, pieces, every)) / worth
        except (AtwoodError, ArithmeticError, ValueError):  # laws without a value where they are asked
            return 0.0
    return found if np.isfinite(found) else 0.0


def _beyond(ledger: EnergyLedger) -> float:
    """Return by how much a balance drifts beyond what is known of it, J."""
    balance = ledger.total - ledger.work
    return float(np.maximum(0.0, np.max(np.abs(balance - balance[0])) - ledger.uncertainty))
