"""The steps of the Taylor-series method in LLVM's language.

The code is that of `atwood.integrators.taylor.reference`, for any system: what it knows of one comes in through
pointers to the two compiled programs of its recurrences, so that it is compiled once and kept.
"""

from __future__ import annotations

from atwood.integrators.machine_text import exact, sample_code, unpack
from atwood.integrators.taylor.problem import HIGHEST, LOWEST, RETREAT, RETRIES, SMALLER, WATCHED
from atwood.integrators.taylor.start_code import begin_code
from atwood.integrators.taylor.stepping_code import LANES, ROWS, STRIDE, loop_code

__all__ = ["COUNTS", "FUNCTIONS", "NUMBERS", "POINTERS", "step_code"]

NUMBERS = (
    *("order_number", "order_inverse", "order_step", "order_tick"),  # what the program of an order is told
    *("t", "t_old", "t_new", "time"),
    *("unit", "last", "first", "stop", "stop_time", "share", "allowed", "longest", "horizon", "reach"),
)
COUNTS = (
    *("size", "padded", "order", "pair_blocks", "square_blocks", "limit"),
    *("steps", "failures", "evaluations", "undefined", "stiff", "filled"),
)
POINTERS = (
    *("start", "prologue", "recurrence"),  # functions
    *("start_derived", "derived", "scratch", "known"),
    *("new_in", "new_out", "trial_in", "trial_out", "order_in", "order_out"),  # tables of pointers
    *("arrays", "table", "pair_sums", "square_sums", "numbers", "counts"),
    *("guard", "guard_data"),
)
FUNCTIONS = ("run", "interpolate", "sample", "begin")


def _prologue() -> str:
    """Return the instructions that unpack the pointers of a session."""
    sizes = "  %n = load i64, ptr %size.at\n  %m = load i64, ptr %padded.at\n  %p = load i64, ptr %order.at"
    return f"{unpack(POINTERS, NUMBERS, COUNTS)}\n{sizes}"


def _row(name: str, row: str) -> str:
    """Return the instructions that find a row of the table of arrays."""
    return f"""  %{name}.index = mul i64 %m, {ROWS[row]}
  %{name} = getelementptr double, ptr %arrays, i64 %{name}.index"""


def _evaluate() -> str:
    """Return the function that finds rates and what recurrences need, and counts: 0, or 1 where one is not finite.

    Where they are found and where they go are the pointers of `from` and `to`.
    """
    return f"""define internal i32 @evaluate(ptr %session, ptr %from, ptr %to) #0 {{
{_prologue()}
  %code = call i32 %start(ptr %from, ptr %start_derived, ptr %scratch, ptr %to)
  %count = load i64, ptr %evaluations.at
  %raised = add i64 %count, 1
  store i64 %raised, ptr %evaluations.at
  %one = zext i32 %code to i64
  %lost = load i64, ptr %undefined.at
  %more = add i64 %lost, %one
  store i64 %more, ptr %undefined.at
  ret i32 %code
}}"""


def _expand() -> str:
    """Return the function that finds the coefficients at the state: 0, or 1 where one is not finite."""
    return f"""define internal i32 @expand(ptr %session) #0 {{
entry:
{_prologue()}
  %last = load double, ptr %last.at
  %moved = fcmp ogt double %last, 0.0
  %unit.old = load double, ptr %unit.at
  %wanted = select i1 %moved, double %last, double %unit.old
  call void %prologue(ptr %known, ptr %derived, ptr %scratch)
  %pairs = load i64, ptr %pair_blocks.at
  %squares = load i64, ptr %square_blocks.at
  %left.at = getelementptr ptr, ptr %order_out, i64 0
  %right.at = getelementptr ptr, ptr %order_out, i64 1
  %square.at = getelementptr ptr, ptr %order_out, i64 2
  %next.at = getelementptr ptr, ptr %order_out, i64 3
  %x.at = getelementptr ptr, ptr %order_in, i64 3
  %has.squares = icmp sgt i64 %squares, 0
  %square.index = mul i64 %pairs, {2 * STRIDE}
  %square.table = getelementptr double, ptr %table, i64 %square.index
  br label %attempt
attempt:
  %unit = phi double [ %wanted, %entry ], [ %smaller, %again ]
  %tries = phi i64 [ 0, %entry ], [ %tried, %again ]
  store double %unit, ptr %unit.at
  call void @unfold(ptr %arrays, i64 %m, double %unit)
  br label %order1
{chr(10).join(_order(k) for k in range(1, HIGHEST))}
failed:
  %lost = load i64, ptr %undefined.at
  %more = add i64 %lost, 1
  store i64 %more, ptr %undefined.at
  %tried = add i64 %tries, 1
  %given.up = icmp sge i64 %tried, {RETRIES}
  br i1 %given.up, label %none, label %again
again:
  %smaller = fmul double %unit, {exact(SMALLER)}
  br label %attempt
none:
  ret i32 1
order{HIGHEST}:
  ret i32 0
}}"""


def _order(k: int) -> str:
    """Return the instructions that find the coefficients of one order, and those of the unknowns of the next."""
    sums = f"""  call void @pairs{k}(ptr %table, ptr %pair_sums, i64 %pairs)
  br i1 %has.squares, label %squares{k}, label %sums{k}
squares{k}:
  call void @squares{k}(ptr %square.table, ptr %square_sums, i64 %squares)
  br label %sums{k}
sums{k}:
"""
    if k + 1 >= LOWEST:
        more = f"""  %is.last{k} = icmp eq i64 %p, {k + 1}
  br i1 %is.last{k}, label %order{HIGHEST}, label %order{k + 1}"""
    else:
        more = f"  br label %order{k + 1}"
    return f"""order{k}:
{sums}  store double {exact(float(k))}, ptr %order_number.at
  store double {exact(1.0 / k)}, ptr %order_inverse.at
  %step{k} = fmul double %unit, {exact(1.0 / (k + 1))}
  store double %step{k}, ptr %order_step.at
  store double {"%unit" if k == 1 else "0.0"}, ptr %order_tick.at
  %row{k} = getelementptr double, ptr %table, i64 {LANES * (k - 1)}
  store ptr %row{k}, ptr %left.at
  store ptr %row{k}, ptr %right.at
  store ptr %row{k}, ptr %square.at
  %x{k}.index = mul i64 %m, {k}
  %x{k} = getelementptr double, ptr %arrays, i64 %x{k}.index
  store ptr %x{k}, ptr %x.at
  %next{k} = getelementptr double, ptr %x{k}, i64 %m
  store ptr %next{k}, ptr %next.at
  %code{k} = call i32 %recurrence(ptr %order_in, ptr %derived, ptr %scratch, ptr %order_out)
  %ok{k} = icmp eq i32 %code{k}, 0
  br i1 %ok{k}, label %go{k}, label %failed
go{k}:
{more}"""


def _logarithms() -> tuple[str, str]:
    """Return the instructions that find the largest rate at which the last coefficients grow, and its name.

    A rate is the logarithm to base 2 of a coefficient over its order, good enough for a step: linear between powers of
    two, and finite at zero.
    """
    lines = []
    largest = exact(-1e9)
    for i in range(WATCHED):
        lines.append(f"""  %k{i} = sub i64 %p, {i}
  %top{i} = call double @largest(ptr %arrays, i64 %m, i64 %k{i})
  %is.tiny{i} = fcmp olt double %top{i}, {exact(2.0**-1022)}
  %bits{i} = bitcast double %top{i} to i64
  %biased{i} = lshr i64 %bits{i}, 52
  %exponent{i} = sub i64 %biased{i}, 1024
  %whole{i} = sitofp i64 %exponent{i} to double
  %fraction{i} = and i64 %bits{i}, {2**52 - 1}
  %as.one{i} = or i64 %fraction{i}, {1023 << 52}
  %mantissa{i} = bitcast i64 %as.one{i} to double
  %raw{i} = fadd double %mantissa{i}, %whole{i}
  %log{i} = select i1 %is.tiny{i}, double {exact(-1023.0)}, double %raw{i}
  %number{i} = sitofp i64 %k{i} to double
  %rate{i} = fdiv double %log{i}, %number{i}
  %above{i} = fcmp ogt double %rate{i}, {largest}
  %best{i} = select i1 %above{i}, double %rate{i}, double {largest}""")
        largest = f"%best{i}"
    return "\n".join(lines), largest


def _bound() -> str:
    """Return the instructions that keep a step so short that no unknown changes too much for events to be seen."""
    return """  %slope = call double @largest(ptr %arrays, i64 %m, i64 1)
  %bend2 = call double @largest(ptr %arrays, i64 %m, i64 2)
  %by.slope = fdiv double %reach, %slope
  %by.bend2 = fdiv double %reach, %bend2
  %by.bend = call double @llvm.sqrt.f64(double %by.bend2)
  %is.steep = fcmp olt double %by.slope, %value
  %value1 = select i1 %is.steep, double %by.slope, double %value
  %is.bent = fcmp olt double %by.bend, %value1
  %value2 = select i1 %is.bent, double %by.bend, double %value1
  %h.bound = fmul double %unit, %value2
  ret double %h.bound"""


def _choose() -> str:
    """Return the function of the step that the last coefficients allow, if none is given."""
    lines, largest = _logarithms()
    return f"""define internal double @choose(ptr %session) #0 {{
entry:
{_prologue()}
  %first = load double, ptr %first.at
  %is.given = fcmp ogt double %first, 0.0
  br i1 %is.given, label %given, label %found
given:
  store double 0.0, ptr %first.at
  ret double %first
found:
  call void @sizes(ptr %arrays, i64 %m)
{lines}
  %share = load double, ptr %share.at
  %power = fsub double %share, {largest}
  %floor = call double @llvm.floor.f64(double %power)
  %part = fsub double %power, %floor
  %curve = fmul double %part, {exact(0.3398)}
  %line = fadd double %curve, {exact(0.6602)}
  %bend = fmul double %part, %line
  %factor = fadd double %bend, 1.0
  %floor.whole = fptosi double %floor to i64
  %floor.biased = add i64 %floor.whole, 1023
  %two.bits = shl i64 %floor.biased, 52
  %two = bitcast i64 %two.bits to double
  %value = fmul double %factor, %two
  %unit = load double, ptr %unit.at
  %reach = load double, ptr %reach.at
  %is.bound = fcmp olt double %reach, 0x7FF0000000000000
  br i1 %is.bound, label %bound, label %free
bound:
{_bound()}
free:
  %h = fmul double %unit, %value
  ret double %h
}}"""


def _attempt() -> str:
    """Return the instructions that try a step: values at its end, rates there, and whether these fit."""
    return f"""attempt:
  %wanted = phi double [ %first, %choose ], [ %shorter, %retreat ]
  %sum = fadd double %t, %wanted
  %ends = fcmp oge double %sum, %stop_time
  %t_new = select i1 %ends, double %stop_time, double %sum
  %h = fsub double %t_new, %t
  %moves = fcmp ogt double %h, %least
  %forward = fcmp ogt double %h, 0.0
  %is_normal = fcmp oge double %h, {exact(1e-300)}
  %is_rest = and i1 %ends, %forward
  %long.enough = and i1 %moves, %is_normal
  %usable = or i1 %long.enough, %is_rest
  br i1 %usable, label %try, label %too_small
try:
  store double %t_new, ptr %t_new.at
  %share = fdiv double %h, %unit
  call void @move(ptr %arrays, i64 %m, i64 %p, double %share)
  %code = call i32 @evaluate(ptr %session, ptr %new_in, ptr %new_out)
  %ok = icmp eq i32 %code, 0
  br i1 %ok, label %compare, label %retreat
compare:
  %pace = fdiv double 1.0, %unit
  %weight = fdiv double %h, %p.number
  %missed = call i1 @misses(ptr %arrays, i64 %m, double %pace, double %weight, double %allowed)
  br i1 %missed, label %retreat, label %judge
judge:
  %asked = call i32 @guarded(ptr %session, double %t, double %h)
  %passes = icmp eq i32 %asked, 0
  br i1 %passes, label %accept, label %retreat"""


def _run() -> str:
    """Return the function that takes steps: 0 at the stop time, 1 at the limit of steps, 2 if steps get too small."""
    return f"""define i32 @run(ptr %session) #0 {{
entry:
{_prologue()}
  %stop = load double, ptr %stop.at
  %stop_time = load double, ptr %stop_time.at
  %allowed = load double, ptr %allowed.at
  %longest = load double, ptr %longest.at
  %limit = load i64, ptr %limit.at
  %p.number = sitofp i64 %p to double
  br label %step
step:
  %t = load double, ptr %t.at
  %reached = fcmp oge double %t, %stop
  br i1 %reached, label %return0, label %going
going:
  %steps = load i64, ptr %steps.at
  %used = icmp sge i64 %steps, %limit
  br i1 %used, label %return1, label %begin
begin:
  %none = call i32 @expand(ptr %session)
  %is.none = icmp ne i32 %none, 0
  br i1 %is.none, label %return2, label %choose
choose:
  %unit = load double, ptr %unit.at
  %chosen = call double @choose(ptr %session)
  %long = fcmp olt double %chosen, %longest
  %first = select i1 %long, double %chosen, double %longest
  %size = call double @llvm.fabs.f64(double %t)
  %least = fmul double %size, {exact(10.0 * 2.0**-52)}
  br label %attempt
{_attempt()}
retreat:
  %shorter = fmul double %h, {exact(RETREAT)}
  %failures = load i64, ptr %failures.at
  %failed = add i64 %failures, 1
  store i64 %failed, ptr %failures.at
  br label %attempt
accept:
  store double %t, ptr %t_old.at
  store double %t_new, ptr %t.at
  store double %h, ptr %last.at
  %stepped = add i64 %steps, 1
  store i64 %stepped, ptr %steps.at
  call void @accept(ptr %arrays, i64 %m)
  br label %step
too_small:
  ret i32 2
return0:
  ret i32 0
return1:
  ret i32 1
return2:
  ret i32 2
}}"""


def _interpolate() -> str:
    """Return the function that writes values and rates at a time within the last step; 3 where there are none."""
    return f"""define i32 @interpolate(ptr %session, double %time, ptr %y_out, ptr %yp_out) #0 {{
entry:
{_prologue()}
  %bytes = mul i64 %n, 8
  %t_new = load double, ptr %t.at
{_row("end.y", "y")}
{_row("end.rates", "rates")}
{_row("trial.y", "trial")}
{_row("trial.rates", "trial_rates")}
  %is_end = fcmp oeq double %time, %t_new
  br i1 %is_end, label %at_end, label %inside
at_end:
  call void @llvm.memcpy.p0.p0.i64(ptr %y_out, ptr %end.y, i64 %bytes, i1 false)
  call void @llvm.memcpy.p0.p0.i64(ptr %yp_out, ptr %end.rates, i64 %bytes, i1 false)
  ret i32 0
inside:
  %t = load double, ptr %t_old.at
  %unit = load double, ptr %unit.at
  %since = fsub double %time, %t
  %share = fdiv double %since, %unit
  store double %time, ptr %time.at
  call void @look(ptr %arrays, i64 %m, i64 %p, double %share)
  %code = call i32 @evaluate(ptr %session, ptr %trial_in, ptr %trial_out)
  call void @llvm.memcpy.p0.p0.i64(ptr %y_out, ptr %trial.y, i64 %bytes, i1 false)
  call void @llvm.memcpy.p0.p0.i64(ptr %yp_out, ptr %trial.rates, i64 %bytes, i1 false)
  %ok = icmp eq i32 %code, 0
  %result = select i1 %ok, i32 0, i32 3
  ret i32 %result
}}"""


def step_code() -> str:
    """Return the functions, to be added to a module of `atwood.codegen.llvm.module`, which declares what all use.

    They take a pointer to the pointers of a session, in the order of `POINTERS`; numbers and counts are in the order of
    `NUMBERS` and `COUNTS`.
    """
    parts = [
        loop_code(),
        _evaluate(),
        begin_code(_prologue()),
        _expand(),
        _choose(),
        _guarded(),
        _run(),
        _interpolate(),
    ]
    parts += [sample_code("%session", _prologue(), "%n")]
    parts += ["declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)", "declare double @llvm.floor.f64(double)"]
    return "\n".join(parts)
