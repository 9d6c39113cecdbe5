"""Many four-bars, each turned and moved: `python -m tests.scenes.test_turned 200 driven --anywhere --workers 2`."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from functools import cache
from typing import NamedTuple

import click

from atwood import AtwoodError, Result, Scene
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.initialization.start import find_start, own_state

from ..helpers.four_bars import UPRIGHT, Stand, apart, driven, governor, plates, run, standing, stands

__all__ = ["main"]

MAKE: dict[str, Callable[[Stand], Scene]] = {"standing": standing, "driven": driven, "governor": governor}
ALIKE = 1e-9
"""How far apart motion and forces may be, relative to their size."""

_RTOL = 1e-13


class Job(NamedTuple):
    """One scene that is run: of which kind, in which form, the how many-th, and how it stands."""

    kind: str
    form: str
    number: int
    stand: Stand


class Found(NamedTuple):
    """What came of it: what is wrong, in words; how far apart motion and forces are; steps and seconds it took."""

    wrong: str = ""
    motion: float = 0.0
    forces: float = 0.0
    steps: int = 0
    seconds: float = 0.0


def attempt(job: Job) -> Found:
    """Compare a scene with the upright one; each process of ours may do this."""
    expected, began = _upright(job.kind, job.form), time.process_time()
    name = f"{job.form} {job.number}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = run(MAKE[job.kind](job.stand), job.form, _RTOL)
            (motion, forces), seconds = apart(found, expected, job.stand), time.process_time() - began
    except (AtwoodError, AssertionError, Warning) as error:
        return Found(f"{name}: {type(error).__name__}: {error}: {job.stand}")
    here, there = _counts(found), _counts(expected)
    wrong = ""
    if here != there:
        wrong = f"{name}: freedoms and redundant constraints are {here}, not {there}: {job.stand}"
    elif not max(motion, forces) < ALIKE:
        wrong = f"{name}: differs by {motion:.3g}, forces by {forces:.3g}: {job.stand}"
    return Found(wrong, motion, forces, found.statistics.steps, seconds)


@cache
def _upright(kind: str, form: str) -> Result:
    return run(MAKE[kind](UPRIGHT), form, _RTOL)


def _counts(found: Result) -> tuple[int, int]:
    """Return the degrees of freedom, and how many constraints of joints follow from others."""
    plan = found.run.segments[0].plan
    start = find_start(plan.assembly)
    of_joints = ReactionSolver(plan.assembly, start.time, *own_state(plan.assembly, start)).finding
    return len(plan.sizes) - plan.finding.rank, len(of_joints.redundant)


@click.command()
@click.argument("count", default=200)
@click.argument("kind", type=click.Choice(list(MAKE)), default="standing")
@click.option("--form", "forms", multiple=True, default=("reduced", "dae"), show_default=True, help="Which forms.")
@click.option("--seed", default=23, show_default=True, help="Where angles and places come from.")
@click.option("--anywhere", is_flag=True, help="The axis of the drive, or the shaft, is any, and gravity along it.")
@click.option("--workers", default=1, show_default=True, help="Processes.")
def main(count: int, kind: str, forms: tuple[str, ...], seed: int, anywhere: bool, workers: int) -> None:
    """Compare four-bars that are turned and moved with the upright one; the exit status is 1 if one is not alike."""
    each = list(stands(count, seed) if kind == "standing" else plates(count, seed, anywhere))
    jobs = [Job(kind, form, i, stand) for form in forms for i, stand in enumerate(each)]
    with ProcessPoolExecutor(workers) if workers > 1 else nullcontext() as pool:
        wrong = _said(jobs, pool.map(attempt, jobs, chunksize=5) if pool else map(attempt, jobs))
    sys.exit(bool(wrong))


def _said(jobs: list[Job], done: Iterable[Found]) -> int:
    """Say what is wrong as it is found, and what came of all; return how many are wrong."""
    all_found = []
    for found in done:
        all_found.append(found)
        if found.wrong:
            click.echo(found.wrong)
    for form in dict.fromkeys(job.form for job in jobs):
        ones = [found for job, found in zip(jobs, all_found, strict=True) if job.form == form]
        wrong = sum(bool(one.wrong) for one in ones)
        click.echo(
            f"{form}: {len(ones) - wrong} of {len(ones)} alike; motion within {max(one.motion for one in ones):.2g}, "
            f"forces within {max(one.forces for one in ones):.2g}, at most {max(one.steps for one in ones)} steps, "
            f"{sum(one.seconds for one in ones) / len(ones):.2f} s each"
        )
    return sum(bool(one.wrong) for one in all_found)
