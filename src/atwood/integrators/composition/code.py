"""The steps of a composition in LLVM's language, for one scene and one order.

A step of second order is half a step along the velocities, one along the forces there, and half a step along the new
velocities; half steps that follow each other are one. Increments are added with compensation.
"""

from __future__ import annotations

from atwood.integrators.gauss.code import interpolate_code, samples_code
from atwood.integrators.gauss.fixed_steps import Step, run_code
from atwood.integrators.gauss.layout import COUNTS, NUMBERS, POINTERS, Layout
from atwood.integrators.gauss.writer import Code
from atwood.integrators.machine_text import exact

__all__ = ["composition_code"]


def _call(c: Code, layout: Layout, name: str, inputs: list[str], derived: str) -> str:
    """Call a program that writes to the F of the main work area; return the name of its code."""
    places = layout.places
    given, made = c.put("alloca [2 x ptr]"), c.put("alloca [1 x ptr]")
    for k, one in enumerate(inputs):
        c.do(f"store ptr {one}, ptr {c.put(f'getelementptr ptr, ptr {given}, i64 {k}')}")
    c.do(f"store ptr {c.at('%mem', places['main.F'])}, ptr {made}")
    constants, scratch = (
        c.put(f"load ptr, ptr {c.at('%mem', places['pointers'] + POINTERS.index(one))}") for one in (derived, "scratch")
    )
    return c.put(f"call i32 @{name}(ptr {given}, ptr {constants}, ptr {scratch}, ptr {made})")


def _add(c: Code, layout: Layout, offset: int) -> None:
    """Add `%amount` times F to a half of the state, with what rounding has left."""

    def one(i: str) -> None:
        increment = c.put(f"fmul double %amount, {c.load('%mem', i, layout.places['main.F'])}")
        total = c.put(f"fadd double {c.load('%rest', i, offset)}, {increment}")
        old = c.load("%y", i, offset)
        new = c.put(f"fadd double {old}, {total}")
        c.store(new, "%y", i, offset)
        c.store(c.put(f"fadd double {c.put(f'fsub double {old}, {new}')}, {total}"), "%rest", i, offset)

    c.loop(layout.coordinates, one)


def _drift(layout: Layout) -> str:
    c = Code("internal i32 @drift(ptr %mem, ptr %y, ptr %rest, double %amount)")
    code = _call(c, layout, "flow", [c.at("%y", layout.coordinates)], "derived_2")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)
    _add(c, layout, 0)
    return c.text()


def _kick(layout: Layout) -> str:
    c = Code("internal i32 @kick(ptr %mem, ptr %y, ptr %rest, double %t, double %amount)")
    time = c.put("alloca double")
    c.do(f"store double %t, ptr {time}")
    c.count_up(layout.places["counts"] + COUNTS.index("evaluations"))
    code = _call(c, layout, "kernel", [time, "%y"], "derived")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)
    _add(c, layout, layout.coordinates)
    return c.text()


def _compose(layout: Layout, steps: tuple[float, ...]) -> str:
    """Return the function that takes a state one step on, in its place; 1 where there is no force."""
    c = Code("internal i32 @compose(ptr %mem, ptr %y, ptr %rest, double %t, double %h)")
    before, done = 0.0, 0.0
    for step in (*steps, 0.0):
        share = 0.5 * (before + step)
        amount = c.put(f"fmul double %h, {exact(share)}")
        moved = c.put(f"call i32 @drift(ptr %mem, ptr %y, ptr %rest, double {amount})")
        c.leave_if(c.put(f"icmp ne i32 {moved}, 0"), 1)
        done, before = done + share, step
        if step == 0.0:
            break
        now = c.put(f"fadd double %t, {c.put(f'fmul double %h, {exact(done)}')}")
        push = c.put(f"fmul double %h, {exact(step)}")
        code = c.put(f"call i32 @kick(ptr %mem, ptr %y, ptr %rest, double {now}, double {push})")
        c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)
    return c.text()


def _begin(layout: Layout) -> str:
    """Return the function that starts at the y of a session; 1 where there is no force."""
    c, n, places = Code("i32 @begin(ptr %mem)"), layout.size, layout.places
    y, rest = c.at("%mem", places["y"]), c.at("%mem", places["rest"])

    def clear(i: str) -> None:
        c.store("0.0", rest, i)
        c.store(c.load(y, i), "%mem", i, places["y_old"])

    c.loop(n, clear)
    t = c.load("%mem", places["numbers"] + NUMBERS.index("t"))
    for name in ("t_old", "origin"):
        c.store(t, "%mem", places["numbers"] + NUMBERS.index(name))
    c.do(f"store i64 0, ptr {c.at('%mem', places['counts'] + COUNTS.index('since'))}")
    code = c.put(f"call i32 @kick(ptr %mem, ptr {y}, ptr {rest}, double {t}, double 0.0)")
    return c.text(f"ret i32 {code}")


def _run(layout: Layout) -> str:
    n = layout.size

    def attempt(c: Code, step: Step) -> None:
        c.loop(n, lambda i: c.store(c.load(step.y, i), step.old, i))
        code = c.put(f"call i32 @compose(ptr %mem, ptr {step.y}, ptr {step.rest}, double {step.t}, double {step.h})")
        c.do(f"br i1 {c.put(f'icmp eq i32 {code}, 0')}, label %good, label %failed")

    def failed(c: Code, step: Step) -> None:
        c.loop(n, lambda i: c.store(c.load(step.old, i), step.y, i))

    return run_code(layout, attempt, failed=failed)


def _trial(layout: Layout) -> str:
    """Return the function that makes one step of any length from `%from` to `%to`; 3 where it fails."""
    c, n = Code("i32 @trial(ptr %mem, double %t, double %h, ptr %from, ptr %to)"), layout.size
    rest = c.at("%mem", layout.places["aside.L"])

    def copy(i: str) -> None:
        c.store(c.load("%from", i), "%to", i)
        c.store("0.0", rest, i)

    c.loop(n, copy)
    code = c.put(f"call i32 @compose(ptr %mem, ptr %to, ptr {rest}, double %t, double %h)")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 3)
    return c.text()


def _speeds(layout: Layout) -> str:
    """Return the function that writes coordinates and velocities; 1 where there are none."""
    c, n = Code("i32 @speeds(ptr %mem, double %t, ptr %y, ptr %out)"), layout.coordinates
    code = _call(c, layout, "flow", [c.at("%y", n)], "derived_2")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)
    c.loop(n, lambda i: c.store(c.load("%y", i), "%out", i))
    c.loop(n, lambda i: c.store(c.load("%mem", i, layout.places["main.F"]), "%out", i, n))
    return c.text()


def composition_code(layout: Layout, steps: tuple[float, ...]) -> str:
    """Return the functions of a composition, for a module with forces as ``@kernel`` and velocities as ``@flow``.

    They are those of `atwood.integrators.gauss.code`, on the same memory.
    """
    parts = [_drift(layout), _kick(layout), _compose(layout, steps), _begin(layout), _run(layout), _trial(layout)]
    return "\n".join([*parts, _speeds(layout), interpolate_code(layout), samples_code(layout)])
