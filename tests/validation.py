"""What the site shows of accuracy: every library scene against its reference, beside the tolerance that was asked for.

python -m tests.validation [NAME ...]

Rows of scenes that are named, or of all, are written to `docs/validation.csv`, and processor and date to
`docs/validation.json`. The build of the site draws them, and runs nothing.
"""

from __future__ import annotations

import csv
import json
import sys
import warnings
from pathlib import Path

from atwood import AtwoodError, compare
from atwood.study.comparison.found import environment
from atwood_library.scenes import SCENES

DOCS = Path(__file__).parents[1] / "docs"
COLUMNS = "scene", "method", "rtol", "error", "estimate", "energy_drift", "constraint_drift", "reference", "said"
RTOLS, LEVELS, SECONDS = (1e-4, 1e-7, 1e-10), ("ggl",), 10.0


def rows_of(name: str) -> list[list[str]]:
    """Return the rows of a scene, also of what was refused or took too long."""
    try:
        found = compare(SCENES[name](), rtols=RTOLS, levels=LEVELS, max_seconds=2.0, total_seconds=SECONDS, name=name)
    except AtwoodError as error:
        return [[name, *[""] * 7, error.message]]
    reference = found.reference.description
    return [
        [
            *(name, row.label, f"{row.rtol:.0e}"),
            *("" if one is None else f"{one:.2e}" for one in (row.error, row.estimate)),
            *("" if one is None else f"{one:.2e}" for one in (row.energy_drift, row.constraint_drift)),
            *(reference, row.reason or ""),
        ]
        for row in found.rows
    ]


def main(names: list[str]) -> None:
    """Write the rows of some scenes, and keep those of the others."""
    file = DOCS / "validation.csv"
    kept = list(csv.reader(file.read_text(encoding="utf-8").splitlines()))[1:] if file.exists() else []
    known = {name: [row for row in kept if row[0] == name] for name in SCENES}
    for name in names:
        known[name] = rows_of(name)
        print(name, len(known[name]), flush=True)
        with file.open("w", encoding="utf-8", newline="") as out:
            csv.writer(out).writerows([COLUMNS, *(row for rows in known.values() for row in rows)])
    told = json.dumps(environment(), indent=1)
    (DOCS / "validation.json").write_text(told + "\n", encoding="utf-8")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(sys.argv[1:] or list(SCENES))
