"""Residuals, Jacobians and accelerations: Atwood's machine code against C by hand, plain Python, and other packages.

All are called in a loop in C over the same 64 states, so that only the kernels differ.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import by_hand
import numpy as np
import peers
from timing import best_of, options, peer, print_table, ratio, save

from atwood import Model, assemble
from atwood.codegen import compile_native, compile_program
from atwood.expr import Program
from atwood.forms.accelerations import acceleration_program
from atwood_library.scenes import Chain, DoublePendulum, SimplePendulum

STATES = 64


@dataclass(frozen=True)
class Case:
    """One program and its twin in C."""

    name: str
    scene: Model
    form: str
    what: str
    file: str = ""
    links: int = 0


def cases(quick: bool) -> list[Case]:
    """Return what is timed."""
    one, two = SimplePendulum(), DoublePendulum()
    found = [
        Case("pendulum, reduced", one, "reduced", "residual", "pendulum"),
        Case("pendulum, reduced", one, "reduced", "jacobian", "pendulum"),
        Case("pendulum, dae ggl", one, "dae", "residual", "ggl_chain", 1),
        Case("pendulum, dae ggl", one, "dae", "jacobian", "ggl_chain", 1),
        Case("double pendulum, reduced", two, "reduced", "residual", "double_pendulum"),
        Case("double pendulum, reduced", two, "reduced", "jacobian", "double_pendulum"),
        Case("double pendulum", two, "reduced", "accelerations", "double_pendulum"),
        Case("double pendulum, dae ggl", two, "dae", "residual", "ggl_chain", 2),
        Case("double pendulum, dae ggl", two, "dae", "jacobian", "ggl_chain", 2),
    ]
    for n in () if quick else (10, 40, 100):
        scene = Chain(links=n, mass=1.0 / n)
        found.append(Case(f"chain of {n}", scene, "reduced", "accelerations", "chain", n))
    if not quick:
        ten = Chain(links=10, mass=0.1)
        found.append(Case("chain of 10, dae ggl", ten, "dae", "residual", "ggl_chain", 10))
        found.append(Case("chain of 10, dae ggl", ten, "dae", "jacobian", "ggl_chain", 10))
    return found


def program_of(case: Case) -> tuple[Program, np.ndarray]:
    """Return the program and its parameter values."""
    assembly = assemble(case.scene, form=case.form)
    if case.what == "accelerations":
        found = acceleration_program(assembly)
        assert found is not None
        return found.program, assembly.parameter_values
    form = assembly.form_program()
    return getattr(form, case.what), assembly.parameter_values


def parameters_by_hand(case: Case, values: np.ndarray) -> np.ndarray:
    """Return the parameters as the C program takes them."""
    if case.file == "chain":
        l, m = values[: case.links], values[case.links : 2 * case.links]
        return np.concatenate([l, 1.0 / l, 1.0 / m, values[-1:]])
    if case.file == "ggl_chain" and case.links == 2:
        l1, m1, l2, m2, g = values
        return np.array([l1, l2, m1, m2, g])
    return np.array(values)


def by_hand_address(case: Case, flags: str) -> tuple[Any, int]:
    """Return the library (which must be kept) and the address of the twin."""
    library = by_hand.load(case.file, flags, {"LINKS": case.links} if case.links else {})
    assert library is not None
    if case.file == "ggl_chain":
        room = np.empty(36 * case.links, dtype=np.int32)
        library.prepare(room.ctypes.data_as(by_hand.c_void_p), room.copy().ctypes.data_as(by_hand.c_void_p))
    return library, by_hand.ctypes.cast(library[case.what], by_hand.c_void_p).value or 0


def measure(case: Case, flags: str, repeat: int, calls: int) -> dict[str, Any]:
    """Time one case."""
    program, values = program_of(case)
    began = time.perf_counter()
    native = compile_native(program, cache=False)
    compiled_in = time.perf_counter() - began
    bound = native.bind(values)
    random = np.random.default_rng(1)
    states = [[random.uniform(0.2, 1.2, len(group.symbols)) for group in program.inputs] for _ in range(STATES)]
    plain = compile_program(program).bind(values)
    lists = [[group.tolist() for group in state] for state in states]

    def python() -> float:
        began = time.perf_counter()
        for state in lists:
            plain(*state)
        return (time.perf_counter() - began) / STATES

    found: dict[str, Any] = {
        "case": case.name,
        "what": case.what,
        "operations": sum(program.operations.values()),
        "compile": compiled_in,
    }
    measures: dict[str, Callable[[], float]] = {"python": python}
    if by_hand.compiler() is None:
        arrays = [np.array(group) for group in states[0]]
        out = [np.empty(len(group.expressions)) for group in program.outputs]

        def called() -> float:  # from Python, with what a call costs there
            began = time.perf_counter()
            for _ in range(1000):
                bound.into(out, *arrays)
            return (time.perf_counter() - began) / 1000

        return found | best_of(measures | {"atwood": called}, repeat)
    [group] = program.outputs
    loop = by_hand.Loop(flags, states, len(group.expressions))
    library, address = by_hand_address(case, flags)
    own = parameters_by_hand(case, values)
    place = native.built.code.addresses["kernel"]
    ours, theirs = loop.at_first(place, bound.derived, native.scratch), loop.at_first(address, own)
    if not np.allclose(ours, theirs, rtol=1e-9, atol=1e-11):
        raise SystemExit(f"{case.name}: {case.what} by hand differs by {np.max(np.abs(ours - theirs)):.1e}")
    measures["atwood"] = lambda: loop.seconds(place, bound.derived, native.scratch, calls)
    measures["hand"] = lambda: loop.seconds(address, own, calls=calls)
    measures["empty"] = lambda: loop.seconds(loop.empty, own, calls=calls)
    del library
    return found | best_of(measures, repeat)


def others(quick: bool, repeat: int) -> list[dict[str, Any]]:
    """Time accelerations in other packages."""
    found = []
    if peer("sympy"):
        rates, y = peers.kane_chain(2, 1.0, 1.0), np.array([1.0, 0.5, 0.3, 0.2])

        def kane() -> float:
            began = time.perf_counter()
            for _ in range(200):
                rates(0.0, y)
            return (time.perf_counter() - began) / 200

        found.append(
            {"case": "double pendulum", "what": "sympy: Kane, lambdify, solve", **best_of({"s": kane}, repeat)}
        )
    mujoco, pinocchio, exudyn = (None if quick else peer(name) for name in ("mujoco", "pinocchio", "exudyn"))
    for n in (2, 10, 40, 100):
        if mujoco:
            times = best_of({"s": peers.mujoco_chain(mujoco, n)}, repeat)
            found.append({"case": f"chain of {n}", "what": "MuJoCo: a step, from C", **times})
        if pinocchio:
            times = best_of({"s": peers.pinocchio_chain(pinocchio, n)}, repeat)
            found.append({"case": f"chain of {n}", "what": "Pinocchio: aba, from Python", **times})
        if exudyn:
            times = best_of({"s": peers.exudyn_accelerations(exudyn, n)}, min(repeat, 3))
            found.append({"case": f"chain of {n}", "what": "Exudyn: a step of Euler's explicit method", **times})
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    if by_hand.compiler() is None:
        print("no C compiler: nothing by hand to compare with; times of Atwood include a call from Python")
    rows = []
    for case in cases(chosen.quick):
        calls = 2000 if chosen.quick else max(20_000, 2_000_000 // max(case.links, 10))
        rows.append(measure(case, chosen.cflags, chosen.repeat, calls))
    head = [
        "program",
        "of",
        "Atwood / C (<= 1.2, chains 1.5)",
        "Atwood ns",
        "C ns",
        "Python us",
        "Python / Atwood",
        "operations",
        "compile s",
    ]
    table = [
        [
            row["case"],
            row["what"],
            ratio(row["atwood"], row.get("hand")),
            1e9 * row["atwood"],
            1e9 * row["hand"] if "hand" in row else None,
            1e6 * row["python"],
            ratio(row["python"], row["atwood"]),
            row["operations"],
            row["compile"],
        ]
        for row in rows
    ]
    print_table(f"Kernels, one call; C with {chosen.cflags}", head, table)
    if rows and "empty" in rows[0]:
        print(f"\nAn empty call takes {1e9 * min(row['empty'] for row in rows):.1f} ns in this loop, in both columns.")
    more = others(chosen.quick, chosen.repeat)
    ours = {row["case"]: row["atwood"] for row in rows if row["what"] == "accelerations"}
    ours["chain of 2"] = ours["double pendulum"]
    table = [[r["case"], r["what"], ratio(r["s"], ours.get(r["case"])), 1e6 * r["s"]] for r in more]
    print_table("Accelerations elsewhere", ["mechanism", "how", "times Atwood (>= 10)", "us"], table)
    save(chosen.json, {"kernels": rows, "accelerations elsewhere": more, "cflags": chosen.cflags})


if __name__ == "__main__":
    main()
