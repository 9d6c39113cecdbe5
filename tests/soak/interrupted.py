"""What is killed in a trial of kind `interrupts`: runs a mechanism, saves it, again and again.

    python -m tests.soak.interrupted DIRECTORY ROUNDS

It says "ready" once it has begun, and at the end of its rounds a checksum of all numbers. Stopped by Ctrl-C, it ends
with status 130 at once, as a program does that looks at the status of a run.
"""

from __future__ import annotations

import hashlib
import math
import signal
import sys
import warnings
from pathlib import Path

import atwood
import atwood_library as lib
from atwood_library.scenes import SCENES

FILES = ("run.csv", "run.nc", "run.npz", "scene.json")
BESIDE = "run.csv.json"
_WIND = atwood.ExternalFunction("wind", math.cos)
PATHS = ("rod1.angle", "rod1.tension", "bob2.position.x")


def main(directory: Path, rounds: int) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    warnings.simplefilter("ignore")  # of laws in Python, which are slower
    print("ready", flush=True)
    for _ in range(rounds):
        seen = make(directory)
    print(seen, flush=True)


def make(directory: Path) -> str:
    """Run a scene in both forms and as a sweep, save all, and return a checksum of the numbers."""
    checksum = hashlib.sha256()
    for form, solver in (("reduced", "explicit"), ("dae", "ida")):
        scene = SCENES["double-pendulum"]()
        result = atwood.simulate(scene, t_end=2.0, outputs=401, form=form, solver=solver)
        leave_unless(result.status == "finished")
        for path in PATHS:
            checksum.update(result.array(path).tobytes())
    for name in FILES[:-1]:
        atwood.save_result(result, directory / name, PATHS)
    scene.set("rod1.length", 0.75)
    atwood.save_scene(scene, directory / FILES[-1])
    for form, threads in (("reduced", 2), ("dae", 1)):
        values, how = {"rod1.length": [0.5, 0.75, 1.0]}, {"form": form, "threads": threads}
        many = atwood.sweep(scene, values, t_end=0.5, outputs=11, quantities=PATHS, **how)
        leave_unless(all(status == "finished" for status in many.status))
    for solver in ("explicit", "ida", "ida-sundae"):
        result = atwood.simulate(_called(), t_end=1.0, outputs=11, solver=solver)
        leave_unless(result.status == "finished")
        checksum.update(result.array("mass.position.x").tobytes())
    return checksum.hexdigest()


def _called() -> atwood.Scene:
    """Return a scene with a function of Python, which compiled steps call."""
    scene = atwood.Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    mass, push = scene.add("mass", lib.PointMass()), scene.add("push", lib.Force())
    scene.connect(mass.point, push.point)
    scene.set("push.value", lambda t: atwood.external(_WIND, t))
    return scene


def leave_unless(finished: bool) -> None:
    if not finished:
        raise SystemExit(130)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), int(sys.argv[2]))
    except KeyboardInterrupt:
        raise SystemExit(130) from None
