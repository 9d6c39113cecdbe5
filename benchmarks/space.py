"""Chains of rigid bodies on universal joints in space: deriving, compiling, one call, beside Pinocchio in the same run.

Inverse dynamics is the residual of the reduced form, `rnea` there; forward dynamics are the accelerations, `aba` there.
Both are also timed as they are called from Python, since that is how Pinocchio is used from there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import by_hand
import numpy as np
from timing import best_of, options, peer, print_table, ratio, save

import atwood_library as lib
from atwood import Assembly, Scene, assemble
from atwood.codegen import compile_native
from atwood.forms.accelerations import acceleration_program

MASS, LENGTH, MOMENTS = 1.3, 0.4, (0.02, 0.03, 0.01)
CENTER = (0.01, -0.02, -0.2)


def chain(links: int) -> Scene:
    """Return a chain: each body hangs on a universal joint at the lower end of the one before."""
    scene = Scene(space="space")
    above = scene.add("ground", lib.Ground()).frame
    for i in range(links):
        joint = scene.add(f"joint{i}", lib.Universal(axis_a=(1.0, 0.0, 0.0), axis_b=(0.0, 1.0, 0.0)))
        body = scene.add(f"body{i}", lib.RigidBody(mass=MASS, center=CENTER, moments=MOMENTS))
        scene.connect(above, joint.a)
        scene.connect(joint.b, body.frame)
        if i < links - 1:
            end = scene.add(f"end{i}", lib.Weld(displacement=(0.0, 0.0, -LENGTH)))
            scene.connect(body.frame, end.a)
            above = end.b
    return scene


def pinocchio_model(pinocchio: Any, links: int) -> Any:
    """Return Pinocchio's model of the chain."""
    model, joint = pinocchio.Model(), 0
    along_x, along_y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    inertia = pinocchio.Inertia(MASS, np.array(CENTER), np.diag(MOMENTS))
    for i in range(links):
        place = pinocchio.SE3(np.eye(3), np.array([0.0, 0.0, -LENGTH if i else 0.0]))
        joint = model.addJoint(joint, pinocchio.JointModelUniversal(along_x, along_y), place, f"joint{i}")
        model.appendBodyToJoint(joint, inertia, pinocchio.SE3.Identity())
    return model


def called(call: Callable[[], object], times: int = 1000) -> Callable[[], float]:
    """Return what measures the seconds of a call from Python."""

    def measure() -> float:
        began = time.perf_counter()
        for _ in range(times):
            call()
        return (time.perf_counter() - began) / times

    return measure


def check(pinocchio: Any, assembly: Assembly, residual: np.ndarray, state: Sequence[np.ndarray]) -> None:
    """Stop if generalized forces differ from Pinocchio's."""
    order = [int(one.name.split(".")[0][5:]) * 2 + one.name.endswith("b") for one in assembly.own_equations.names]
    n = len(order)
    q, v, a = (np.empty(n) for _ in range(3))
    q[order], v[order], a[order] = state[1][:n], state[1][n:], state[2][n:]
    model = pinocchio_model(pinocchio, n // 2)
    theirs = pinocchio.rnea(model, model.createData(), q, v, a)[order]
    if not np.allclose(residual[n:], theirs, rtol=1e-9, atol=1e-9 * np.max(np.abs(theirs))):
        raise SystemExit(f"the residual differs from rnea by {np.max(np.abs(residual[n:] - theirs)):.1e}")


def pinocchio_calls(pinocchio: Any, links: int, random: np.random.Generator) -> dict[str, Callable[[], float]]:
    """Return what measures Pinocchio's inverse and forward dynamics."""
    model = pinocchio_model(pinocchio, links)
    data = model.createData()
    q, v, a = (random.uniform(0.2, 0.9, 2 * links) for _ in range(3))
    return {
        "rnea": called(lambda: pinocchio.rnea(model, data, q, v, a)),
        "aba": called(lambda: pinocchio.aba(model, data, q, v, a)),
    }


def measure(links: int, flags: str, repeat: int, calls: int) -> dict[str, Any]:
    """Time one chain."""
    scene = chain(links)
    began = time.perf_counter()
    assembly = assemble(scene)
    program = assembly.form_program().residual
    derived = time.perf_counter() - began
    native = compile_native(program, cache=False)
    compiled = time.perf_counter() - began - derived
    free = acceleration_program(assembly)
    assert free is not None
    forward = compile_native(free.program, cache=False)
    found: dict[str, Any] = {
        "links": links,
        "operations": sum(program.operations.values()),
        "derived": derived,
        "compiled": compiled,
    }
    random = np.random.default_rng(3)
    measures: dict[str, Callable[[], float]] = {}
    pinocchio = peer("pinocchio")
    for name, made in (("residual", native), ("accelerations", forward)):
        bound = made.bind(assembly.parameter_values)
        inputs = made.program.inputs
        states = [[random.uniform(0.2, 0.9, len(group.symbols)) for group in inputs] for _ in range(64)]
        out = [np.empty(len(group.expressions)) for group in made.program.outputs]
        measures[f"{name}, from Python"] = called(lambda b=bound, o=out, s=states[0]: b.into(o, *s))  # type: ignore[misc]
        if by_hand.compiler() is not None:
            loop = by_hand.Loop(flags, states, len(out[0]))
            place = made.built.code.addresses["kernel"]
            measures[name] = lambda at=place, m=made, b=bound, one=loop: one.seconds(at, b.derived, m.scratch, calls)  # type: ignore[misc]
        if pinocchio and name == "residual":
            bound.into(out, *states[0])
            check(pinocchio, assembly, out[0], states[0])
            measures |= pinocchio_calls(pinocchio, links, random)
    return found | best_of(measures, repeat)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    rows = [
        measure(links, chosen.cflags, chosen.repeat, 2000 if chosen.quick else 50_000)
        for links in ((3,) if chosen.quick else (5, 20, 60))
    ]
    head = ["bodies", "operations", "derived s", "compiled s"]
    print_table("Deriving", head, [[str(r["links"]), r["operations"], r["derived"], r["compiled"]] for r in rows])
    table = []
    for row in rows:
        for what, theirs in (("residual", "rnea"), ("accelerations", "aba")):
            ours, python, other = row.get(what), row[f"{what}, from Python"], row.get(theirs)
            cells = [f"{row['links']}, {what}", ours and 1e6 * ours, 1e6 * python, theirs, other and 1e6 * other]
            table.append([*cells, ratio(ours, other), ratio(python, other)])
    print_table(
        "One call",
        ["", "Atwood us", "from Python us", "Pinocchio", "us", "Atwood / Pinocchio (<= 0.5)", "both from Python"],
        table,
    )
    save(chosen.json, rows)


if __name__ == "__main__":
    main()
