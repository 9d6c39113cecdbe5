"""The steps of the methods of Gauss in LLVM's language, for one set of equations and one order.

Stages are found by fixed-point iteration, each with those before it that are known already, from what the polynomial of
the last step gives; it ends where changes are rounding, since what is left of the iteration's error would not be
symplectic. Increments are added with compensation (Hairer, Lubich and Wanner, Geometric Numerical Integration, sections
VIII.5 and VIII.6).
"""

from __future__ import annotations

from atwood.integrators.gauss.fixed_steps import Step, run_code
from atwood.integrators.gauss.layout import COUNTS, NUMBERS, Layout
from atwood.integrators.gauss.tableau import Tableau
from atwood.integrators.gauss.writer import Code
from atwood.integrators.machine_text import exact, sample_code

__all__ = ["FUNCTIONS", "gauss_code", "interpolate_code", "samples_code"]

FUNCTIONS = ("run", "interpolate", "sample", "begin", "trial", "speeds")

_ULP = 2.0**-53
_ROUNDING, _IDLE, _SWEEPS = 1e-11, 3, 200
"""Changes of this share of the sizes that so many sweeps do not make smaller are rounding; and the most sweeps."""


def _evaluate(layout: Layout) -> str:
    """Return the function that evaluates the equations at the Y of a work area: F, and speeds from those at `%from`."""
    c, n = Code("internal i32 @evaluate(ptr %mem, ptr %w, double %t, ptr %from)"), layout.coordinates
    places = layout.places
    time, inputs, outputs = (c.put(f"alloca {kind}") for kind in ("double", "[4 x ptr]", "[3 x ptr]"))
    c.do(f"store double %t, ptr {time}")
    y, f, v = (c.at("%w", layout.within(key)) for key in ("Y", "F", "V"))
    given = [time, y, c.at(y, n), "%from"][: 4 if layout.takes_speeds else 3]
    made = [f, c.at(f, n), v][: 3 if layout.has_speeds else 2]
    for array, pointers in ((inputs, given), (outputs, made)):
        for k, pointer in enumerate(pointers):
            c.do(f"store ptr {pointer}, ptr {c.put(f'getelementptr ptr, ptr {array}, i64 {k}')}")
    derived, scratch = (c.put(f"load ptr, ptr {c.at('%mem', places['pointers'] + k)}") for k in (0, 1))
    c.count_up(places["counts"] + COUNTS.index("evaluations"))
    code = c.put(f"call i32 @kernel(ptr {inputs}, ptr {derived}, ptr {scratch}, ptr {outputs})")
    return c.text(f"ret i32 {code}")


def _stage(layout: Layout, method: Tableau, j: int) -> str:
    """Return the function that improves one stage; its largest change goes to `%delta`, in units of what values were.

    In units of the scene's sizes it goes to `%coarse`: a value that should be zero is rounding for ever.
    """
    n, m, s = layout.size, layout.speeds, layout.stages
    c = Code(f"internal i32 @stage{j}(ptr %mem, ptr %w, ptr %y, double %t, double %h, ptr %delta, ptr %coarse)")

    def place(i: str) -> None:
        total = ""
        for k in range(s):
            term = c.put(f"fmul double {exact(method.shares[j][k])}, {c.load('%w', i, k * n)}")
            total = c.put(f"fadd double {total}, {term}") if total else term
        value = c.put(f"fadd double {c.load('%y', i)}, {total}")
        c.store(value, "%w", i, layout.within("Y"))

    c.loop(n, place)
    later = c.put(f"fadd double %t, {c.put(f'fmul double %h, {exact(method.nodes[j])}')}")
    guess = c.at("%w", layout.within("U") + j * m)
    code = c.put(f"call i32 @evaluate(ptr %mem, ptr %w, double {later}, ptr {guess})")
    bad = c.put(f"icmp ne i32 {code}, 0")
    c.leave_if(bad, 1)
    weight = c.put(f"fmul double %h, {exact(method.weights[j])}")

    def take(i: str) -> None:
        new = c.put(f"fmul double {weight}, {c.load('%w', i, layout.within('F'))}")
        old = c.load("%w", i, j * n)
        c.store(new, "%w", i, j * n)
        change = c.put(f"call double @llvm.fabs.f64(double {c.put(f'fsub double {new}, {old}')})")
        size = c.put(f"call double @llvm.fabs.f64(double {c.load('%w', i, layout.within('Y'))})")
        scale = c.larger(size, c.load("%w", i, layout.within("scale")))
        c.store(scale, "%w", i, layout.within("scale"))
        same = c.put(f"fcmp oeq double {change}, 0.0")
        ratio = c.put(f"select i1 {same}, double 0.0, double {c.put(f'fdiv double {change}, {scale}')}")
        largest = c.larger(ratio, c.put("load double, ptr %delta"))
        c.do(f"store double {largest}, ptr %delta")
        share = c.put(f"fmul double {change}, {c.load('%mem', i, layout.places['per_size'])}")
        c.do(f"store double {c.larger(share, c.put('load double, ptr %coarse'))}, ptr %coarse")

    c.loop(n, take)
    if layout.takes_speeds:

        def keep(i: str) -> None:
            c.store(c.load("%w", i, layout.within("V")), "%w", i, layout.within("U") + j * m)

        c.loop(m, keep)
    return c.text()


def _solve(layout: Layout) -> str:
    """Return the function that finds the stages of a step; 1 where they are not found."""
    c = Code("internal i32 @solve(ptr %mem, ptr %w, ptr %y, double %t, double %h)")
    delta, coarse = (c.put("alloca double") for _ in range(2))
    c.do("br label %sweep")
    c.block("sweep")
    c.do("%count = phi i64 [ 0, %entry ], [ %more, %again ]")
    c.do("%best = phi double [ 0x7FF0000000000000, %entry ], [ %least, %again ]")
    c.do("%idle = phi i64 [ 0, %entry ], [ %since, %again ]")
    c.do(f"store double 0.0, ptr {delta}")
    c.do(f"store double 0.0, ptr {coarse}")
    for j in range(layout.stages):
        code = c.put(
            f"call i32 @stage{j}(ptr %mem, ptr %w, ptr %y, double %t, double %h, ptr {delta}, ptr {coarse})",
        )
        c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)
    c.do(f"%now = load double, ptr {delta}")
    c.do("%more = add i64 %count, 1")
    done = c.put(f"fcmp ole double %now, {exact(_ULP)}")
    c.leave_if(done, 0)
    c.do("%better = fcmp olt double %now, %best")
    c.do("%least = select i1 %better, double %now, double %best")
    c.do(f"%since = select i1 %better, i64 0, i64 {c.put('add i64 %idle, 1')}")
    stalled = c.put(f"icmp sge i64 %since, {_IDLE}")
    small = c.put(f"fcmp ole double {c.put(f'load double, ptr {coarse}')}, {exact(_ROUNDING)}")
    c.leave_if(c.put(f"and i1 {stalled}, {small}"), 0)
    few = c.put(f"icmp slt i64 %more, {_SWEEPS}")
    c.leave_if(c.put(f"xor i1 {few}, true"), 1)
    c.do("br label %again")
    c.block("again")
    return c.text("br label %sweep")


def _flat(layout: Layout, method: Tableau) -> str:
    """Return the function that sets all stages to the rates at `%y`; 1 where there are none."""
    c, n = Code("internal i32 @flat(ptr %mem, ptr %w, ptr %y, double %t, double %h)"), layout.size
    c.loop(n, lambda i: c.store(c.load("%y", i), "%w", i, layout.within("Y")))
    last = c.at("%w", layout.within("U") + (layout.stages - 1) * layout.speeds)
    code = c.put(f"call i32 @evaluate(ptr %mem, ptr %w, double %t, ptr {last})")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)

    def spread(i: str) -> None:
        increment = c.put(f"fmul double %h, {c.load('%w', i, layout.within('F'))}")
        for j, weight in enumerate(method.weights):
            c.store(c.put(f"fmul double {increment}, {exact(weight)}"), "%w", i, j * n)

    c.loop(n, spread)
    return c.text()


def _ahead(layout: Layout, method: Tableau) -> str:
    """Return the function that takes the stages of a step on to the next one."""
    c, n, s = Code("internal void @ahead(ptr %w)"), layout.size, layout.stages

    def extrapolate(i: str) -> None:
        old = [c.load("%w", i, k * n) for k in range(s)]
        for j in range(s):
            total = ""
            for k in range(s):
                term = c.put(f"fmul double {exact(method.ahead[j][k])}, {old[k]}")
                total = c.put(f"fadd double {total}, {term}") if total else term
            c.store(total, "%w", i, j * n)

    c.loop(n, extrapolate)
    return c.text("ret void")


def _advance(layout: Layout) -> str:
    """Return the function that adds the stages up: from `%y` and what rounding has left of it, to both."""
    c, n = Code("internal void @advance(ptr %w, ptr %y, ptr %rest)"), layout.size

    def add(i: str) -> None:
        total = c.load("%rest", i)
        for j in range(layout.stages):
            total = c.put(f"fadd double {total}, {c.load('%w', i, j * n)}")
        old = c.load("%y", i)
        new = c.put(f"fadd double {old}, {total}")
        c.store(new, "%y", i)
        lost = c.put(f"fadd double {c.put(f'fsub double {old}, {new}')}, {total}")
        c.store(lost, "%rest", i)

    c.loop(n, add)
    return c.text("ret void")


def _speeds(layout: Layout) -> str:
    """Return the function that writes coordinates and speeds at the Y of the area aside; 1 where there are none."""
    c = Code("i32 @speeds(ptr %mem, double %t, ptr %y, ptr %out)")
    n, m, places = layout.coordinates, layout.speeds, layout.places
    w = c.at("%mem", places["aside.L"])
    c.loop(2 * n, lambda i: c.store(c.load("%y", i), w, i, layout.within("Y")))
    guess = c.at(w, layout.within("U"))
    for _ in range(6 if layout.takes_speeds else 1):  # Newton's method, which began near by
        code = c.put(f"call i32 @evaluate(ptr %mem, ptr {w}, double %t, ptr {guess})")
        c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)
        if layout.takes_speeds:
            c.loop(m, lambda i: c.store(c.load(w, i, layout.within("V")), guess, i))
    c.loop(n, lambda i: c.store(c.load("%y", i), "%out", i))
    source = layout.within("V" if layout.has_speeds else "F")
    c.loop(m, lambda i: c.store(c.load(w, i, source), "%out", i, n))
    return c.text()


def _begin(layout: Layout, method: Tableau) -> str:
    """Return the function that starts at the y of a session; 1 where the equations have no value there."""
    c, n, places = Code("i32 @begin(ptr %mem)"), layout.size, layout.places
    y, w = c.at("%mem", places["y"]), c.at("%mem", places["main.L"])
    t = c.load("%mem", places["numbers"] + NUMBERS.index("t"))
    step = c.load("%mem", places["numbers"] + NUMBERS.index("step"))
    code = c.put(f"call i32 @flat(ptr %mem, ptr {w}, ptr {y}, double {t}, double {step})")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 1)

    def size(i: str) -> None:
        c.store("0.0", "%mem", i, places["rest"])
        c.store(c.load(y, i), "%mem", i, places["y_old"])
        scale = c.put(f"call double @llvm.fabs.f64(double {c.load(y, i)})")
        for j in range(layout.stages):
            scale = c.put(f"fadd double {scale}, {c.put(f'call double @llvm.fabs.f64(double {c.load(w, i, j * n)})')}")
        c.store(scale, w, i, layout.within("scale"))

    c.loop(n, size)
    c.store(t, "%mem", places["numbers"] + NUMBERS.index("t_old"))
    c.store(t, "%mem", places["numbers"] + NUMBERS.index("origin"))
    since = c.at("%mem", places["counts"] + COUNTS.index("since"))
    c.do(f"store i64 0, ptr {since}")
    return c.text()


def _run(layout: Layout) -> str:
    n = layout.size

    def attempt(c: Code, step: Step) -> None:
        w = c.at("%mem", layout.places["main.L"])
        arguments = f"ptr %mem, ptr {w}, ptr {step.y}, double {step.t}, double {step.h}"
        c.do(f"br i1 {c.put(f'icmp eq i64 {step.since}, 0')}, label %first, label %later")
        c.block("first")
        c.do("br label %found")
        c.block("later")
        c.do(f"call void @ahead(ptr {w})")
        c.do("br label %found")
        c.block("found")
        code = c.put(f"call i32 @solve({arguments})")
        c.do(f"br i1 {c.put(f'icmp eq i32 {code}, 0')}, label %good, label %retry")
        c.block("retry")  # from a poor guess the iteration may lead where the equations have no value
        c.leave_if(c.put(f"icmp ne i32 {c.put(f'call i32 @flat({arguments})')}, 0"), 2)
        again = c.put(f"call i32 @solve({arguments})")
        c.do(f"br i1 {c.put(f'icmp eq i32 {again}, 0')}, label %good, label %failed")

    def good(c: Code, step: Step) -> None:
        c.loop(n, lambda i: c.store(c.load(step.y, i), step.old, i))
        c.do(f"call void @advance(ptr {c.at('%mem', layout.places['main.L'])}, ptr {step.y}, ptr {step.rest})")

    return run_code(layout, attempt, good=good)


def _trial(layout: Layout) -> str:
    """Return the function that makes one step of any length aside, from `%from` to `%to`; 3 where it fails."""
    c, n, places = Code("i32 @trial(ptr %mem, double %t, double %h, ptr %from, ptr %to)"), layout.size, layout.places
    w, own = c.at("%mem", places["aside.L"]), c.at("%mem", places["main.L"])
    c.loop(n, lambda i: c.store(c.load(own, i, layout.within("scale")), w, i, layout.within("scale")))
    if layout.takes_speeds:
        m = layout.speeds
        last = layout.within("U") + (layout.stages - 1) * m
        for j in range(layout.stages):
            c.loop(m, lambda i, j=j: c.store(c.load(own, i, last), w, i, layout.within("U") + j * m))  # type: ignore[misc]
    code = c.put(f"call i32 @flat(ptr %mem, ptr {w}, ptr %from, double %t, double %h)")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 3)
    found = c.put(f"call i32 @solve(ptr %mem, ptr {w}, ptr %from, double %t, double %h)")
    c.leave_if(c.put(f"icmp ne i32 {found}, 0"), 3)

    def add(i: str) -> None:
        total = c.load(w, i)
        for j in range(1, layout.stages):
            total = c.put(f"fadd double {total}, {c.load(w, i, j * n)}")
        c.store(c.put(f"fadd double {c.load('%from', i)}, {total}"), "%to", i)

    c.loop(n, add)
    return c.text()


def interpolate_code(layout: Layout) -> str:
    """Return the function that writes values and rates at a time within the last step, by a step of its own."""
    c, places = Code("i32 @interpolate(ptr %mem, double %time, ptr %out, ptr %yps)"), layout.places
    t, t_old = (c.load("%mem", places["numbers"] + NUMBERS.index(name)) for name in ("t", "t_old"))
    y, old = (c.at("%mem", places[name]) for name in ("y", "y_old"))
    there = c.put(f"alloca [{layout.size} x double]")
    c.do(f"br i1 {c.put(f'fcmp oeq double %time, {t}')}, label %at_end, label %inside")
    c.block("at_end")
    end = c.put(f"call i32 @speeds(ptr %mem, double %time, ptr {y}, ptr %out)")
    c.leave_if(c.put(f"icmp ne i32 {end}, 0"), 3)
    c.do("br label %rates")
    c.block("inside")
    share = c.put(f"fsub double %time, {t_old}")
    code = c.put(f"call i32 @trial(ptr %mem, double {t_old}, double {share}, ptr {old}, ptr {there})")
    c.leave_if(c.put(f"icmp ne i32 {code}, 0"), 3)
    done = c.put(f"call i32 @speeds(ptr %mem, double %time, ptr {there}, ptr %out)")
    c.leave_if(c.put(f"icmp ne i32 {done}, 0"), 3)
    c.do("br label %rates")
    c.block("rates")
    function, data = (c.put(f"load ptr, ptr {c.at('%mem', places['pointers'] + k)}") for k in (2, 3))
    last = c.put(f"call i32 {function}(double %time, ptr %out, ptr %yps, ptr {data})")
    c.leave_if(c.put(f"icmp ne i32 {last}, 0"), 3)
    return c.text()


def samples_code(layout: Layout) -> str:
    """Return the function that goes through output times and fills a table; it ends as `run` does."""
    places, width = layout.places, layout.coordinates + layout.speeds
    stop = places["numbers"] + NUMBERS.index("stop")
    filled = places["counts"] + COUNTS.index("filled")
    prologue = f"""  %stop.at = getelementptr double, ptr %mem, i64 {stop}
  %filled.at = getelementptr i64, ptr %mem, i64 {filled}"""
    return sample_code("%mem", prologue, str(width))


def gauss_code(layout: Layout, method: Tableau) -> str:
    """Return the functions of a method, to be added to a module with the equations as ``@kernel``.

    They take a session's array, which begins with what `POINTERS`, `NUMBERS` and `COUNTS` name.
    """
    parts = [_evaluate(layout), *(_stage(layout, method, j) for j in range(layout.stages)), _solve(layout)]
    parts += [_flat(layout, method), _ahead(layout, method), _advance(layout), _speeds(layout), _begin(layout, method)]
    return "\n".join([*parts, _run(layout), _trial(layout), interpolate_code(layout), samples_code(layout)])
