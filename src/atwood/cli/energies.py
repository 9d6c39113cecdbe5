"""The energy of each component, as `atwood run --energy parts` shows it."""

from __future__ import annotations

import numpy as np

from atwood.cli.output import Writer
from atwood.display import count_of
from atwood.result.part_energy import PartEnergies, PartEnergy
from atwood.table import table

_MOST = 40
"""Rows of the table."""

_NOTHING = 1e-7
"""Of what is exchanged: by less nothing has come in, nor by less than what does not balance."""


def print_energies(parts: PartEnergies, out: Writer) -> None:
    """Show what each component gained from start to end, and where it came from."""
    shown = {path: parts[path] for path in (*parts, *parts.models)}
    nothing = max(_NOTHING, 3.0 * parts.max_error) * parts.exchanged
    found = {path: cells for path, one in shown.items() if (cells := _cells(one, nothing))}
    heads = ["", "gained>", "supplied>", "dissipated>", "constraints>", "impacts>", "came in through"]
    lines = [[path + ("" if shown[path].is_unique else " *"), *cells] for path, cells in list(found.items())[:_MOST]]
    used = [i for i in range(len(heads)) if i < 2 or any(row[i] for row in lines)]
    hidden = len(shown) - len(lines)
    notes = [f"{count_of(hidden, 'more component')}: --json or --save FILE shows all"] if hidden else []
    notes += [*["* not unique"] * bool(parts.undetermined), *parts.describe().split("\n")]
    rows = [[row[i] for i in used] for row in lines]
    out.line()
    out.show(table([heads[i] for i in used] if lines else (), rows, "energy from start to end, J", notes))


def _cells(one: PartEnergy, nothing: float) -> list[str]:
    """Return the row of a component; nothing where it takes no part."""

    def written(value: float) -> str:
        return f"{value:.4g}" if abs(value) > nothing else ""

    sums = (one.gained, one.supplied, one.dissipated, one.constraints, one.impacts)
    cells = [written(float(values[-1])) for values in sums]
    through = ", ".join(f"{name} {text}" for name, x in one.work.items() if (text := written(float(x[-1]))))
    largest = max(float(np.max(np.abs(values), initial=0.0)) for values in (*sums, *one.work.values()))
    return [cells[0] or "0", *cells[1:], through] if largest > nothing else []
