"""Every scene of the library as C, in both forms, beside `simulate`: one table.

Each is compiled with all warnings as errors, and run for 2 s at 1e-11; what is compared are all its quantities, in
units of what is largest of their kind along the motion. Where that is more than 1e-9 it is said how far the motion of
`simulate` at 1e-11 is from that at 1e-14, and how far both are apart there.

With ``--fmu`` (and fmpy) their FMUs of both versions instead: what fmpy finds wrong with them, and their co-simulation
at 1e-9 beside `simulate` at 1e-12, which at 1e-9 is as far as is said as its own.

python -m tests.exported_scenes [--fmu] [NAME ...]
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from atwood import assemble, export_c, export_fmu, simulate
from atwood_library.scenes import SCENES

SPAN, RTOL, POINTS = 2.0, 1e-11, 9
FLAGS = ["-O1", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off"]


def compiler() -> str | None:
    """Return a C compiler, or None."""
    return next((found for one in ("gcc", "clang", "cc") if (found := shutil.which(one))), None)


def built(scene: Any, folder: Path, form: str | None = None, flags: list[str] = FLAGS) -> Path:
    """Return the program that prints the motion of a scene."""
    sources = [one for one in export_c(scene, folder, form=form) if one.suffix == ".c"]
    found = compiler()
    assert found is not None
    done = subprocess.run(
        [found, *flags, *sources, "-lm", "-o", str(folder / "motion")], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[:4000]
    return folder / "motion"


def printed(program: Path, end: float, rtol: float, points: int, *more: str) -> dict[str, np.ndarray]:
    """Return what a program prints, by path."""
    done = subprocess.run([program, repr(end), repr(rtol), str(points), *more], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    head, *lines = done.stdout.splitlines()
    rows = np.array([line.split(",") for line in lines], dtype=np.float64)
    return dict(zip(head.split(","), rows.T, strict=True))


def happened(program: Path, end: float, rtol: float, outputs: int = 2) -> list[tuple[str, str, float]]:
    """Return what a program says of events: kinds, what they are of, and times."""
    done = subprocess.run([program, repr(end), repr(rtol), str(outputs), "--events"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    _, *lines = done.stdout.splitlines()
    texts = [one for line in lines for one in line.split('"')[1].split("; ") if one]
    return [(one.split()[0], " ".join(one.split()[1:-2]), float(one.split()[-2])) for one in texts]


def told_apart(program: Path, result: Any, end: float, rtol: float) -> str:
    """Return how events differ; what happens at one moment does so in any order."""
    known = sorted((one.kind, f"{one.part}.{one.law}", one.time) for one in result.events)
    found = sorted(one for one in happened(program, end, rtol))
    if [one[:2] for one in known] != [one[:2] for one in found]:
        return f", OTHER EVENTS: {len(found)} for {len(known)}"
    late = max((abs(a[2] - b[2]) for a, b in zip(known, found, strict=True)), default=0.0)
    return f", {len(known)} events within {late:.1e} s"


def apart(found: dict[str, np.ndarray], result: Any, assembly: Any) -> tuple[float, str, str]:
    """Return the largest difference in units of the largest value, where it is, and which numbers are equal.

    States of gaps and slips are told by what they do: one that bears no force may be in either.  Angles
    agree up to whole turns, which a result counts; two that share an axis at a pole are not compared.
    """
    worst, where, equal = 0.0, "", set()
    rows = {".".join(row.row.key[:2]) for row in assembly.own_equations.contacts}
    states_of_contacts = {f"{row}_{name}" for row in rows for name in ("state", "direction")}
    for path, values in found.items():
        if path == "time":
            continue
        one, known = assembly.observables[path], np.asarray(result[path])
        if np.array_equal(values, known):
            equal.add(path)
        if one.sharing or path in states_of_contacts:
            continue
        off = values - known
        if one.periodic:
            off -= 2.0 * np.pi * np.round(off / (2.0 * np.pi))
        size = float(np.max(np.abs(off))) / max(1.0, float(np.max(np.abs(known))))
        if not size <= worst:
            worst, where = size, path
    equations = assembly.own_equations
    states = {one.name for one in (*equations.names, *equations.speed_names)} & found.keys()
    return worst, where, f"{len(equal & states)} of {len(states)} states, {len(equal)} of {len(found) - 1} quantities"


def of_units(name: str, span: float) -> str:
    """Return what fmpy says of the FMUs of a scene, and how far their co-simulation is from `simulate`."""
    import fmpy
    from fmpy.validation import validate_fmu

    said = []
    outputs = np.linspace(0.0, span, POINTS)
    asked = {"t_end": span, "outputs": outputs, "solver": "explicit"}
    result, loose = (simulate(SCENES[name](), rtol=one, **asked) for one in (1e-12, 1e-9))
    assembly = assemble(SCENES[name]())
    for fmi in (2, 3):
        with tempfile.TemporaryDirectory() as folder:
            made = export_fmu(SCENES[name](), Path(folder) / "a.fmu", fmi=fmi)
            problems = validate_fmu(str(made.file))
            settings = {"stop_time": span, "output_interval": span / (POINTS - 1), "relative_tolerance": 1e-9}
            rows = fmpy.simulate_fmu(str(made.file), fmi_type="CoSimulation", **settings)
            assert len(rows) == POINTS
            found = {one: rows[one] for one in rows.dtype.names if one in result.paths}
            worst, where, _ = apart(found, result, assembly)
            own, _, _ = apart({one: np.asarray(loose[one]) for one in found}, result, assembly)
            far = "  FAR" if worst > max(1e-7, 10.0 * own) else ""
            kinds = "both" if len(made.kinds) == 2 else "co-simulation"
            said.append(f"FMI {fmi}: {len(problems)} problems, {kinds}, {worst:.1e} {where} (own {own:.1e}){far}")
    return "; ".join(said)


def of_c(name: str, form: str, span: float) -> str:
    """Return how far the C of a scene is from `simulate`."""
    scene = SCENES[name]()
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        program = built(scene, Path(folder), form)
        took = time.perf_counter() - began
        found = printed(program, span, RTOL, POINTS)
        outputs = np.linspace(0.0, span, POINTS)
        asked = {"form": form, "t_end": span, "outputs": outputs, "solver": "explicit"}
        result, assembly = simulate(scene, rtol=RTOL, **asked), assemble(scene, form=form)
        worst, where, equal = apart(found, result, assembly)
        equal += told_apart(program, result, span, RTOL) if len(result.events) else ""
        own, far = "", ""
        if worst > 1e-9:  # is it what a motion at this tolerance is off by?
            exact = simulate(scene, rtol=1e-14, **asked)
            off, _, _ = apart({path: np.asarray(result[path]) for path in found if path != "time"}, exact, assembly)
            tight, _, _ = apart(printed(program, span, 1e-14, POINTS), exact, assembly)
            own = f" (own {off:.1e}; at 1e-14 they are {tight:.1e} apart)"
            far = "  FAR" if worst > 2.0 * off or tight > 1e-9 else ""
    return f"{worst:.1e} {where}{own}, equal: {equal}, made in {took:.1f} s{far}"


def main(names: list[str]) -> None:
    """Print the table."""
    asks_units = "--fmu" in names
    for name in [one for one in names if one != "--fmu"] or list(SCENES):
        span = min(SPAN, getattr(SCENES[name](), "t_end", SPAN))
        for form in ("reduced",) if asks_units else ("reduced", "dae"):
            try:
                said = of_units(name, span) if asks_units else of_c(name, form, span)
            except Exception as error:  # of fmpy, too
                said = f"{type(error).__name__}: {error}".splitlines()[0]
            print(f"{name:24} {form:8} {said}", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(sys.argv[1:])
