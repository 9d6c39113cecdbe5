"""Every scene of the library as C, in both forms, beside `simulate`: one table.

Each is compiled with all warnings as errors, and run for 2 s at 1e-11; what is compared are all its quantities, in
units of what is largest of their kind along the motion.

python -m tests.exported_scenes [NAME ...]
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

from atwood import assemble, export_c, simulate
from atwood.errors import AtwoodError
from atwood_library.scenes import SCENES

SPAN, RTOL, POINTS = 2.0, 1e-11, 9
FLAGS = ["-O1", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off"]


def compiler() -> str | None:
    """Return a C compiler, or None."""
    return next((found for one in ("gcc", "clang", "cc") if (found := shutil.which(one))), None)


def built(scene: Any, folder: Path, form: str | None = None, flags: list[str] = FLAGS) -> Path:
    """Return the program that prints the motion of a scene."""
    _, source, main = export_c(scene, folder, form=form)
    found = compiler()
    assert found is not None
    done = subprocess.run(
        [found, *flags, str(source), str(main), "-lm", "-o", str(folder / "motion")], capture_output=True, text=True
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


def apart(found: dict[str, np.ndarray], result: Any, assembly: Any) -> tuple[float, str, str]:
    """Return the largest difference in units of the largest value, where it is, and which numbers are equal.

    Angles agree up to whole turns, which a result counts; two that share an axis at a pole are not compared.
    """
    worst, where, equal = 0.0, "", set()
    for path, values in found.items():
        if path == "time":
            continue
        one, known = assembly.observables[path], np.asarray(result[path])
        if np.array_equal(values, known):
            equal.add(path)
        if one.sharing:
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


def main(names: list[str]) -> None:
    """Print the table."""
    for name in names:
        scene = SCENES[name]()
        span = min(SPAN, getattr(scene, "t_end", SPAN))
        for form in ("reduced", "dae"):
            with tempfile.TemporaryDirectory() as folder:
                try:
                    began = time.perf_counter()
                    program = built(scene, Path(folder), form)
                    took = time.perf_counter() - began
                    found = printed(program, span, RTOL, POINTS)
                    outputs = np.linspace(0.0, span, POINTS)
                    settings = {"form": form, "t_end": span, "outputs": outputs, "solver": "explicit"}
                    assembly = assemble(scene, form=form)
                    worst, where, equal = apart(found, simulate(scene, rtol=RTOL, **settings), assembly)
                    far = "  FAR" if worst > 1e-9 else ""
                    said = f"{worst:.1e} {where}, equal: {equal}, made in {took:.1f} s{far}"
                except (AtwoodError, AssertionError) as error:
                    said = f"{type(error).__name__}: {error}".splitlines()[0]
            print(f"{name:24} {form:8} {said}", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(sys.argv[1:] or list(SCENES))
