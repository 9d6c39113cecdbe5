"""Compiled runs from given states: the bits of their ends are the same on every processor.

    python -m tests.machines.bits check                 the whole library, on this processor
    ATWOOD_CPU=haswell python -m tests.machines.bits check      as on another
    python -m tests.machines.bits write                 after a change of numbers, on purpose

A start is found with libraries whose last bits depend on the processor. So states stand in the file `bits.json`, with
a hash of where explicit steps, Taylor series and symplectic steps lead from them.
"""

from __future__ import annotations

import hashlib
import json
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from atwood import AtwoodError, simulate
from atwood.integrators.methods import METHODS
from atwood.integrators.methods.record import Task
from atwood_library.scenes import SCENES

FILE = Path(__file__).with_name("bits.json")

RUNS = {
    "explicit": ("reduced", {}),
    "taylor": ("reduced", {}),
    "gauss": ("reduced", {"step": 2.0**-7}),
    "composition": ("reduced", {"step": 2.0**-7}),
    "dae": ("dae", {}),
}
"""Form and settings of each kind of run: by the method of its name, and explicit steps on constraints."""

SPAN = 0.4
"""How much of each scene is run at most, s."""

ABSOLUTE = 1e-9
"""The absolute tolerance of every unknown."""


class Taken(Exception):
    """What a session would be opened with."""


def task_of(name: str, kind: str, span: float = SPAN, rtol: float = 1e-9) -> Task:
    """Return the task of a run, with the start that is found here."""
    form, settings = RUNS[kind]
    method = METHODS["explicit" if kind == "dae" else kind]
    scene, opened = SCENES[name](), method.open

    def take(task: Task) -> Any:
        raise Taken(task)

    object.__setattr__(method, "open", take)
    try:
        end = min(span, float(scene.t_end))
        simulate(scene, form=form, solver=method.key, t_end=end, outputs=2, rtol=rtol, **settings)
    except Taken as taken:
        task: Task = taken.args[0]
        return task
    finally:
        object.__setattr__(method, "open", opened)
    raise AssertionError(f"{name} opens no session of {method.key}")


def end_of(name: str, kind: str, task: Task, start: Sequence[float]) -> str:
    """Return a hash of where a task leads from a state: time, state and steps."""
    y = np.array(start)
    settings = replace(task.settings, absolute_tolerances=np.full(y.shape, ABSOLUTE))
    method = METHODS["explicit" if kind == "dae" else kind]
    session = method.open(replace(task, y=y, settings=settings, on_stiff=None))
    found = session.advance(task.t + SPAN if task.end > task.t + SPAN else task.end)
    numbers = np.array([found.t, *found.y, float(session.statistics.steps)])
    return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()[:16]


def found(keys: Sequence[str], known: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield runs by their keys, from the states that are known; what cannot be run so is left out."""
    for key in keys:
        name, kind = key.split()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                task = task_of(name, kind)
                start = [float.fromhex(x) for x in known[key]["start"]] if key in known else task.y.tolist()
                ended = end_of(name, kind, task, start)
            except AtwoodError:  # a method that is not for this scene
                continue
        yield key, {"start": [x.hex() for x in start], "end": ended}


def differences(keys: Sequence[str]) -> list[str]:
    """Return the runs whose ends do not have the bits of the file."""
    known = json.loads(FILE.read_text(encoding="utf-8"))
    here = dict(found(keys, known))
    return [key for key in keys if key not in here or here[key]["end"] != known[key]["end"]]


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("action", type=click.Choice(["write", "check"]))
@click.argument("keys", nargs=-1)
def main(action: str, keys: tuple[str, ...]) -> None:
    """Write the file, or compare runs with it: all, or those of these keys."""
    known = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    if action == "write":
        every = [f"{name} {kind}" for name in SCENES for kind in RUNS]
        made = dict(found(keys or every, {} if not keys else known))
        FILE.write_text(json.dumps({**known, **made} if keys else made, indent=0) + "\n", encoding="utf-8")
        print(f"{len(made)} runs written")
        return
    changed = differences(keys or list(known))
    print(f"{len(keys or known)} runs compared, {len(changed)} differ", *changed, sep="\n")
    sys.exit(bool(changed))


if __name__ == "__main__":
    main()
