"""A golden file: every number of every library scene, to the bit, to compare two versions of Atwood on one machine.

    python -m tests.golden write before.json      with the version before a change that must not change a number
    python -m tests.golden check before.json      with the version after it

Values depend on the processor and the libraries, so a golden file is made and used on one machine and is not kept in
the repository. BLAS runs with one thread and one kernel, set below before NumPy is imported.
"""

from __future__ import annotations

import os

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", OPENBLAS_CORETYPE="Haswell")

import hashlib
import json
import sys
import warnings
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from atwood import AtwoodError, report, simulate
from atwood.result.about import describe_run
from atwood_library.scenes import SCENES

RUNS = (
    *(("reduced", "", solver) for solver in ("auto", "ida", "ida-sundae", "explicit", "taylor")),
    *(("dae", level, "ida") for level in ("ggl", "index1", "index1-projected")),
    ("dae", "ggl", "ida-sundae"),
)
"""Form, level and solver of each run."""

SPAN = 0.4
"""How much of each scene is run, s: as much as can be done twice in some minutes."""

OTHER = ("wall_s", "versions", "why", "reason", "what", "message", "meaning")
"""What is no number: times on the clock, versions, and sentences, whose words may change."""


def digest(values: np.ndarray[Any, Any]) -> str:
    """Return a short hash of the bits of an array, in which every nan is the same."""
    bits = np.where(np.isnan(values), np.nan, values).astype(float).tobytes()
    return hashlib.sha256(bits).hexdigest()[:16]


def plain(value: Any) -> Any:
    """Return data without what is no number, and with floats to the bit."""
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items() if key not in OTHER}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, (bool, int, str)) or value is None:
        return value
    return float(value).hex() if isinstance(value, (float, np.floating)) else str(type(value).__name__)


def mechanism(name: str) -> dict[str, Any]:
    """Return what the report says of a scene: freedoms, states, constraints and operations of every form."""
    made = report(SCENES[name]())
    offers = tuple(replace(one, assembly=None) for one in made.offers)
    found: dict[str, Any] = plain(asdict(replace(made, offers=offers)))
    return found


def run(name: str, form: str, level: str, solver: str) -> dict[str, Any]:
    """Return everything about one run that is a number."""
    scene = SCENES[name]()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            end = min(SPAN, float(scene.t_end))
            result = simulate(scene, form=form, level=level or "ggl", solver=solver, t_end=end, outputs=21)
    except AtwoodError as error:
        return {"error": type(error).__name__, "where": error.where}
    table = result.table()
    return {
        "about": plain(describe_run(result)),
        "final": {path: float(values[-1]).hex() for path, values in table.items()},
        "series": {path: digest(values) for path, values in table.items()},
    }


def measure(names: tuple[str, ...]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Give the name and the numbers of one report or run after another."""
    for name in names or SCENES:
        yield f"{name} report", mechanism(name)
        for form, level, solver in RUNS:
            yield " ".join(part for part in (name, form, level, solver) if part), run(name, form, level, solver)


def differences(before: Any, after: Any, path: str = "") -> Iterator[str]:
    """Give each place at which two trees of data differ."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in sorted(set(before) | set(after)):
            yield from differences(before.get(key), after.get(key), f"{path}/{key}")
    elif before != after:
        yield f"{path}: {before} -> {after}"


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("action", type=click.Choice(["write", "check"]))
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--scene", "names", multiple=True, help="Only this scene; may be given more than once.")
def main(action: str, file: Path, names: tuple[str, ...]) -> None:
    """Write a golden file, or compare with one."""
    found = dict(measure(names))
    if action == "write":
        file.write_text(json.dumps(found, indent=1, sort_keys=True), encoding="utf-8")
        print(f"{len(found)} entries written to {file}")
        return
    before = json.loads(file.read_text(encoding="utf-8"))
    known = {key: value for key, value in before.items() if not names or key.split()[0] in names}
    changed = list(differences(known, json.loads(json.dumps(found))))
    for line in changed[:40]:
        print(line)
    print(f"{len(found)} entries compared, {len(changed)} differences")
    sys.exit(bool(changed))


if __name__ == "__main__":
    main()
