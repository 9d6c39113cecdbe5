"""What each stage takes of 10, 100, 1,000 and 10,000 bodies: a chain, a tree, a net, ragdolls, a row of four-bars.

Each case is a process of its own with an empty cache: it makes the scene, assembles it, makes a short run, the same
again, and one to another end. Machine code of its accelerations is written once more outside the cache; LLVM takes a
share of that, and the text the rest. Then runs of some steps and of three times that time, in machine code, tell what
a step takes: their difference, the best of five each. Times are of the processor, memory is the most that the process
has had so far, less what it had before. A case that takes longer than `LONGEST` is not shown. BLAS has one thread.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

LONGEST = 600.0
"""Seconds that a case may take."""

COUNTS = (10, 100, 1000, 10_000)
STAGES = ("scene", "assemble", "first run", "again", "another end")
CODE = ("text of code, s", "LLVM, s", "lines of text")
SPAN = 1e-3
STEPS = 100
"""In that time a run of which steps are measured takes at least so many."""


def chain(count: int) -> Any:
    """Return a chain of links."""
    from atwood_library.scenes import Chain

    return Chain(links=count)


def net(count: int) -> Any:
    """Return a square net of masses."""
    import large

    return large.net(max(2, round(count**0.5)))


def tree(count: int) -> Any:
    """Return masses on rods, two below each."""
    from atwood import Scene
    from atwood_library import Ground, PointMass, Rod

    scene = Scene()
    ends: list[Any] = [scene.add("ground", Ground()).frame]
    for i in range(count):
        rod, bob = scene.add(f"rod{i}", Rod(length=1.0 / (i + 1) ** 0.5)), scene.add(f"bob{i}", PointMass())
        scene.connect(ends[(i + 1) // 2], rod.a)
        scene.connect(rod.b, bob.point)
        scene.start.update({f"rod{i}.angle": 0.5 if i % 2 else -0.5, f"rod{i}.angular_velocity": 0.0})
        ends.append(bob.point)
    return scene


BONES = (0, 1, 1, 3, 1, 5, 1, 7, 1, 9)
"""What each bone hangs on, counted from one: a trunk, a head, and arms and legs of two bones each."""


def ragdolls(count: int) -> Any:
    """Return falling figures of ten bodies with balls for joints, side by side."""
    from atwood import Scene
    from atwood_library import RigidBody, Spherical, Weld

    scene = Scene(space="space")
    for i in range(max(1, count // len(BONES))):
        bones = []
        for k, parent in enumerate(BONES):
            name = f"{i}_{k}"
            bone = scene.add(f"bone{name}", RigidBody(moments=(0.02, 0.02, 0.01)))
            top = scene.add(f"top{name}", Weld(displacement=(0.1 * (k % 3), 0.0, 0.2)))
            scene.connect(bone.frame, top.a)
            if parent:
                ball = scene.add(f"joint{name}", Spherical())
                scene.connect(bones[parent - 1].frame, ball.a)
                scene.connect(ball.b, top.b)
            else:
                scene.start.update({f"bone{name}.position.x": 1.0 * i, f"bone{name}.position.z": 1.0})
            bones.append(bone)
    return scene


def row(count: int) -> Any:
    """Return four-bars in a row, two bodies each."""
    from atwood_library.scenes import FourBarRow

    return FourBarRow(windows=max(1, count // 2))


SCENES: dict[str, Callable[[int], Any]] = {"chain": chain, "tree": tree, "net": net, "ragdolls": ragdolls, "row": row}


def one_case(name: str, count: int, report: Path) -> None:
    """Go through the stages of a case, and write what each took."""
    from atwood import assemble, simulate

    found: dict[str, float] = {}
    before = _memory()

    def timed(stage: str, make: Callable[[], Any]) -> Any:
        began = time.process_time()
        made = make()
        found[stage] = time.process_time() - began
        found[f"{stage}, MB"] = _memory() - before
        return made

    scene = timed("scene", lambda: SCENES[name](count))
    assembly = timed("assemble", lambda: assemble(scene))

    def run(end: float, **how: Any) -> Any:
        return simulate(assembly, t_end=end, outputs=2, samples=1, solver="explicit", **how).statistics

    for stage, end in (("first run", SPAN), ("again", SPAN), ("another end", 1.1 * SPAN)):
        timed(stage, lambda end=end: run(end))
    timed("text", lambda: found.update(_of_code(assembly)))
    found["text"] -= found["LLVM"]
    found["ns, step and body"] = 1e9 * _of_a_step(run) / count
    report.write_text(json.dumps(found), encoding="utf-8")


def _of_code(assembly: Any) -> dict[str, float]:
    """Write machine code of the accelerations; return what LLVM takes, s, and how long its text and code are."""
    from atwood.codegen.llvm import build
    from atwood.forms.accelerations import accelerations_of

    made, compiling, found = accelerations_of(assembly), build.compile_text, {"LLVM": 0.0}
    if made is None:  # constraints stay
        return found

    def timed(text: str, *given: Any, **named: Any) -> bytes:
        began = time.process_time()
        code = compiling(text, *given, **named)
        found.update({"LLVM": time.process_time() - began, "lines": float(text.count("\n")), "bytes": float(len(code))})
        return code

    build.compile_text = timed
    parts = [build.Part("kernel", made.program)]
    build.build_code(parts, build.default_options(parts), cached=False)
    build.compile_text = compiling
    return found


def _of_a_step(run: Callable[..., Any]) -> float:
    """Return the seconds that a step takes in machine code, of what tells the steps of a run to an end."""
    ends, best, steps = (SPAN, 3.0 * SPAN), [float("inf")] * 2, [0, 0]
    run(ends[1], max_step=SPAN / STEPS)
    gc.disable()  # expressions by the million are not looked through within a run
    for _ in range(5):
        for k, end in enumerate(ends):
            began = time.process_time()
            steps[k] = run(end, max_step=SPAN / STEPS).steps
            best[k] = min(best[k], time.process_time() - began)
    gc.enable()
    return (best[1] - best[0]) / (steps[1] - steps[0])


def _memory() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measured(name: str, count: int) -> dict[str, float] | None:
    """Return what a case takes in a process of its own; None where that is too long, or fails."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "case.json"
        own = {"ATWOOD_CACHE_DIR": str(Path(folder) / "cache"), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        command = [sys.executable, __file__, "--case", name, str(count), str(report)]
        try:
            subprocess.run(command, env=os.environ | own, timeout=LONGEST, check=True)
        except (subprocess.TimeoutExpired, subprocess.CalledProcessError) as error:
            print(f"{name} of {count}: {type(error).__name__}")
            return None
        made: dict[str, float] = json.loads(report.read_text(encoding="utf-8"))
        return made


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    from drawing import draw_growth
    from timing import options, print_table, save

    chosen = options(__doc__, arguments, plot=True, scenes=list(SCENES))
    results: dict[str, Any] = {}
    for name in chosen.scenes[:1] if chosen.quick else chosen.scenes:
        rows = []
        for count in COUNTS[:1] if chosen.quick else COUNTS:
            made = results[f"{name} {count}"] = measured(name, count)
            if made is None:
                break
            cells = [f"{made[one]:.2g} s, {made[f'{one}, MB']:.0f} MB" for one in STAGES]
            code = [made["text"], made["LLVM"], made.get("lines")]
            rows.append([f"{count:,}", *cells, *code, made["ns, step and body"]])
        print_table(name, ["bodies", *STAGES, *CODE, "ns, step and body"], rows)
    save(chosen.json, results)
    if chosen.plot:
        draw_growth(chosen.plot, results, STAGES)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--case"]:
        one_case(sys.argv[2], int(sys.argv[3]), Path(sys.argv[4]))
    else:
        main()
