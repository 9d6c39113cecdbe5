"""What surrounds an integration: a process, an assembled scene run again, other values, sample periods, sweeps.

One table with the goal beside each figure. Processes are measured as `startup.py` does it, in processor time as times
the import of NumPy. All else is the least of many rounds in one process, in which what is compared takes turns;
"beside" is what a call of `simulate` takes less the time in its solver (`Statistics.seconds`).
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import startup
from timing import options, print_table, save

from atwood import Assembly, Model, Result, Scene, assemble, simulate, sweep
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.methods import EXPLICIT, Task
from atwood.integrators.protocol import SolverOptions
from atwood.simulation.problem.explicit_scene import explicit_problem
from atwood_library import Mass1D, TranslationalGap
from atwood_library.scenes import CartPole, Chain, DoublePendulum, FourBar

Row = tuple[str, float, float | None, str]
"""What it is, how much, the goal, and the unit."""

SCENES: tuple[tuple[str, Model, float, str], ...] = (
    ("double pendulum, 10 s", DoublePendulum(), 10.0, "mass2"),
    ("four-bar, 1 s", FourBar(), 1.0, "coupler_length"),
    ("chain of 10, 1 s", Chain(links=10), 1.0, "mass"),
)
PROCESSES = {
    "atwood": 1.3,
    "warm run double-pendulum --t-end 10": 3.2,
    "cold run double-pendulum --t-end 10": None,
}
PERIODS = 300


def milliseconds(call: Callable[..., Result], *given: object, **more: object) -> tuple[float, float]:
    """Return the time of a run, and how much of it is in the solver, ms."""
    began = time.perf_counter()
    result = call(*given, **more)
    return 1e3 * (time.perf_counter() - began), 1e3 * result.statistics.seconds


def processes(rounds: int, quick: bool) -> list[Row]:
    """Measure whole processes."""
    with tempfile.TemporaryDirectory() as folder:
        every = startup.processes(Path(folder), quick=True)
        measures = {name: every[name] for name in ("numpy", *PROCESSES)}
        spent = startup.in_turn(measures, 1 if quick else rounds)
    rows: list[Row] = []
    for name, goal in PROCESSES.items():
        pairs = zip(spent[name], spent["numpy"], strict=True)
        found = statistics.median(one[1] / numpy[1] for one, numpy in pairs)
        rows.append((name, found, goal, "import numpy"))
    warm, cold = rows[1][1], rows[2][1]
    return [*rows[:2], ("cold above warm", cold - warm, 1.5, "import numpy")]


def runs(rounds: int) -> list[Row]:
    """Measure runs of assembled scenes, again and with other values to the first step."""
    rows: list[Row] = []
    for name, scene, end, path in SCENES:
        assembly, value = assemble(scene), float(getattr(scene, path))
        again, inside, other = [], [], []
        simulate(assembly, t_end=end)
        for number in range(1, rounds + 1):
            spent, integration = milliseconds(simulate, assembly, t_end=end)
            again.append(spent - integration)
            inside.append(integration)
            given = {path: value * (1.0 + 1e-3 * number)}
            spent, integration = milliseconds(_first_step, assembly, given, t_end=end)
            other.append(spent - integration)
        rows.append((f"{name}: integration", min(inside), None, "ms"))
        rows.append((f"{name}: run again, beside it", min(again), 0.5, "ms"))
        rows.append((f"{name}: other values to the first step", min(other), 1.0, "ms"))
    return rows


def _first_step(assembly: Assembly, given: dict[str, float], t_end: float) -> Result:
    return simulate(assembly.with_values(given), t_end=t_end, max_steps=1)


def sessions(rounds: int) -> list[Row]:
    """Measure how soon an explicit session stands at its start: a new one, and one that is begun again."""
    assembly = assemble(DoublePendulum())
    problem = explicit_problem(assembly)
    assert problem is not None
    chosen, start = SolverOptions(1e-8, 1e-8), np.array([1.0, 1.0, 0.0, 0.0])
    task = Task(chosen, 0.0, start, explicit=problem)
    session = EXPLICIT.open(task)
    assert isinstance(session, ExplicitSession)
    new, again = [], []
    for _ in range(20 * rounds):
        began = time.perf_counter()
        EXPLICIT.open(task)
        new.append(1e6 * (time.perf_counter() - began))
        began = time.perf_counter()
        session.begin_again(0.0, start, 1.0, None, None, 1.0)
        again.append(1e6 * (time.perf_counter() - began))
    return [
        ("explicit session: opened", min(new), 5.0, "us"),
        ("explicit session: begun again", min(again), 5.0, "us"),
    ]


def sampled(rounds: int) -> list[Row]:
    """Measure the sample periods of the cart-pole's regulator."""
    scene = CartPole()
    end = PERIODS * scene.period
    assembly = assemble(scene)
    total, inside = [], []
    for _ in range(max(1, rounds // 5)):
        spent, integration = milliseconds(simulate, assembly, t_end=end)
        total.append(spent)
        inside.append(integration)
    return [
        (f"{PERIODS} sample periods: one", 1e3 * min(total) / PERIODS, None, "us"),
        (f"{PERIODS} sample periods", min(total) / min(inside), 50.0, "their integration"),
    ]


def swept(rounds: int, quick: bool) -> list[Row]:
    """Measure runs of sweeps in one thread, in machine code many at a time: a tree, a loop, and stops that are met."""
    rows: list[Row] = []
    count = 4 if quick else 200
    shares = 1.0 + 1e-4 * np.arange(count)
    for name, scene, given in (
        ("masses of a double pendulum", DoublePendulum(), {"vary": {"mass2": shares}}),
        ("lengths of a four-bar", FourBar(), {"vary": {"coupler_length": 2.5 * shares}}),
        ("speeds of a four-bar", FourBar(), {"start": {"crank.angular_velocity": 2.0 * shares}}),
        ("speeds of a mass between stops", between_stops(), {"start": {"mass.speed": 3.0 * shares}}),
    ):
        assembly = assemble(scene)
        spent = []
        for _ in range(max(1, rounds // 10)):
            began = time.perf_counter()
            found = sweep(assembly, **given, t_end=1.0, threads=1)
            spent.append(1e3 * (time.perf_counter() - began) / count)
        assert not found.statistics.failed
        rows.append((f"sweep over {name}, 1 s: a run", min(spent), None, "ms"))
    return rows


def between_stops() -> Model:
    """Return a mass between two elastic stops, which it meets about ten times in a second."""
    scene = Scene(gravity=0.0)
    mass = scene.add("mass", Mass1D(mass=1.0))
    gap = scene.add("gap", TranslationalGap(against="ground", lower=-0.2, upper=0.3, stiffness=4e3))
    scene.connect(mass.slide, gap.b)
    scene.start.update({"mass.displacement": 0.0, "mass.speed": 3.0})
    return scene


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    rounds = 2 if chosen.quick else max(startup.ROUNDS, chosen.repeat)
    rows = [*processes(rounds, chosen.quick), *runs(5 * rounds), *sessions(rounds), *sampled(rounds)]
    rows += swept(rounds, chosen.quick)
    print_table(f"What surrounds an integration; {rounds} rounds and more", ["what", "found", "goal", "unit"], rows)
    save(chosen.json, {"opening": {f"{what} ({unit})": found for what, found, _, unit in rows}})


if __name__ == "__main__":
    main()
