"""The loops of the explicit method of order 8(5,3) over all unknowns, in LLVM's language.

Everything lies in one table of arrays.  Its rows are padded to a multiple of `WIDTH`, and are worked on `WIDTH`
numbers at a time; the padding stays finite and counts nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

from atwood.integrators.dop853.tableau import DENSE, ERROR_3, ERROR_5, STAGES
from atwood.integrators.machine_text import WIDTH, exact

__all__ = ["ROWS", "loop_code"]

ROWS = {"slope": 0, "y": 16, "y_old": 17, "trial": 18, "absolute": 19, "dense": 20, "last": 27, "all": 28}
_VECTOR = f"<{WIDTH} x double>"


def _constant(value: float) -> str:
    """Return a vector of equal numbers."""
    return f"<{', '.join([f'double {exact(value)}'] * WIDTH)}>"


class _Loop:
    """The body of a loop over the columns of the table of arrays."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._count = 0

    def put(self, text: str) -> str:
        """Add an instruction; return the name of its value."""
        self._count += 1
        self.lines.append(f"  %v{self._count} = {text}")
        return f"%v{self._count}"

    def load(self, row: int) -> str:
        """Load a part of a row."""
        return self.put(f"load {_VECTOR}, ptr {self._place(row)}, align 8")

    def store(self, value: str, row: int) -> None:
        """Store a part of a row."""
        place = self._place(row)
        self.lines.append(f"  store {_VECTOR} {value}, ptr {place}, align 8")

    def binary(self, operation: str, a: str, b: str) -> str:
        """Add an operation on two vectors."""
        return self.put(f"{operation} {_VECTOR} {a}, {b}")

    def spread(self, scalar: str) -> str:
        """Return a vector of equal numbers from one that is known when the code runs."""
        first = self.put(f"insertelement {_VECTOR} poison, double {scalar}, i32 0")
        return self.put(f"shufflevector {_VECTOR} {first}, {_VECTOR} poison, <{WIDTH} x i32> zeroinitializer")

    def weighted(self, weights: Mapping[int, float]) -> str:
        """Return a weighted sum of rows."""
        total = ""
        for row, weight in weights.items():
            term = self.binary("fmul", self.load(row), _constant(weight))
            total = self.binary("fadd", total, term) if total else term
        return total

    def _place(self, row: int) -> str:
        at = self.put(f"mul i64 %m, {row}")
        index = self.put(f"add i64 {at}, %j")
        return self.put(f"getelementptr double, ptr %arrays, i64 {index}")

    def function(
        self, name: str, arguments: str = "", start: str = "", carried: str = "", end: str = "  ret void"
    ) -> str:
        """Return the function of the loop; `carried` are values that go from turn to turn."""
        kind = "void" if end == "  ret void" else "double"
        return f"""define internal {kind} @{name}(ptr %arrays, i64 %m{arguments}) #0 {{
entry:
{start}  br label %head
head:
  %j = phi i64 [ 0, %entry ], [ %following, %body ]
{carried}  %more = icmp slt i64 %j, %m
  br i1 %more, label %body, label %done
body:
{chr(10).join(self.lines)}
  %following = add i64 %j, {WIDTH}
  br label %head
done:
{end}
}}"""


def _stage(stage: int) -> str:
    """Return the function that writes the values at which a slope is taken, or the new values."""
    loop = _Loop()
    base = ROWS["y_old"] if stage > 12 else ROWS["y"]
    moved = loop.binary("fmul", loop.weighted(STAGES[stage - 1]), loop.spread("%h"))
    value = loop.binary("fadd", loop.load(base), moved)
    loop.store(value, ROWS["trial"])
    if stage == 11:
        loop.store(value, ROWS["last"])
    return loop.function(f"stage{stage}", ", double %h")


def _squares(name: str, weights: Mapping[int, float]) -> str:
    """Return the function of the sum of the squares of an error estimate in units of the tolerances."""
    loop = _Loop()
    largest = []
    for row in (ROWS["y"], ROWS["trial"]):
        largest.append(loop.put(f"call {_VECTOR} @llvm.fabs.v{WIDTH}f64({_VECTOR} {loop.load(row)})"))
    is_first = loop.put(f"fcmp ogt {_VECTOR} {largest[0]}, {largest[1]}")
    size = loop.put(f"select <{WIDTH} x i1> {is_first}, {_VECTOR} {largest[0]}, {_VECTOR} {largest[1]}")
    allowed = loop.binary("fmul", size, loop.spread("%relative"))
    scale = loop.binary("fadd", allowed, loop.load(ROWS["absolute"]))
    error = loop.binary("fdiv", loop.weighted(weights), scale)
    return _sum(loop, name, loop.binary("fmul", error, error), ", double %relative")


def _sum(loop: _Loop, name: str, square: str, arguments: str = "") -> str:
    """Return the function that adds up what a loop computes."""
    loop.lines.append(f"  %sum = fadd {_VECTOR} %total, {square}")
    carried = f"  %total = phi {_VECTOR} [ zeroinitializer, %entry ], [ %sum, %body ]\n"
    end = f"""  %result = call double @llvm.vector.reduce.fadd.v{WIDTH}f64(double -0.0, {_VECTOR} %total)
  ret double %result"""
    return loop.function(name, arguments, carried=carried, end=end)


def _size(name: str, row: int, less: int | None = None) -> str:
    """Return the function of the sum of the squares of a row, or of a difference, in units of what is allowed at y."""
    loop = _Loop()
    magnitude = loop.put(f"call {_VECTOR} @llvm.fabs.v{WIDTH}f64({_VECTOR} {loop.load(ROWS['y'])})")
    allowed = loop.binary("fmul", magnitude, loop.spread("%relative"))
    scale = loop.binary("fadd", allowed, loop.load(ROWS["absolute"]))
    value = loop.load(row) if less is None else loop.binary("fsub", loop.load(row), loop.load(less))
    scaled = loop.binary("fdiv", value, scale)
    return _sum(loop, name, loop.binary("fmul", scaled, scaled), ", double %relative")


def _euler() -> str:
    """Return the function that writes where a step of Euler's method leads."""
    loop = _Loop()
    moved = loop.binary("fmul", loop.load(12), loop.spread("%h"))
    loop.store(loop.binary("fadd", loop.load(ROWS["y"]), moved), ROWS["trial"])
    return loop.function("euler", ", double %h")


def _distance(name: str, a: int, b: int) -> str:
    """Return the function of the square of the distance between two rows."""
    loop = _Loop()
    apart = loop.binary("fsub", loop.load(a), loop.load(b))
    return _sum(loop, name, loop.binary("fmul", apart, apart))


def _copy(name: str, moves: Mapping[int, int]) -> str:
    """Return a function that copies rows, in this order, from source to target."""
    loop = _Loop()
    for source, target in moves.items():
        loop.store(loop.load(source), target)
    return loop.function(name)


def _dense() -> str:
    """Return the function of the coefficients of the dense output."""
    loop = _Loop()
    h = loop.spread("%h")
    step = loop.binary("fsub", loop.load(ROWS["y"]), loop.load(ROWS["y_old"]))
    begin, end = (loop.binary("fmul", h, loop.load(row)) for row in (0, 12))
    loop.store(step, ROWS["dense"])
    loop.store(loop.binary("fsub", begin, step), ROWS["dense"] + 1)
    twice = loop.binary("fadd", step, step)
    loop.store(loop.binary("fsub", twice, loop.binary("fadd", begin, end)), ROWS["dense"] + 2)
    for number, weights in enumerate(DENSE, 3):
        loop.store(loop.binary("fmul", h, loop.weighted(weights)), ROWS["dense"] + number)
    return loop.function("dense", ", double %h")


def _polynomial() -> str:
    """Return the function that writes the dense output at a share of the step."""
    loop = _Loop()
    shares = (loop.spread("%x"), loop.spread("%rest"))
    value = loop.load(ROWS["dense"] + 6)
    for power in range(7):
        value = loop.binary("fmul", value, shares[power % 2])
        row = ROWS["dense"] + 5 - power if power < 6 else ROWS["y_old"]
        value = loop.binary("fadd", value, loop.load(row))
    loop.store(value, ROWS["trial"])
    return loop.function("polynomial", ", double %x", start="  %rest = fsub double 1.0, %x\n")


def _slope() -> str:
    """Return the function that writes the slope of the cubic through both ends of a step, at a share of it."""
    loop = _Loop()
    step = loop.binary("fsub", loop.load(ROWS["y"]), loop.load(ROWS["y_old"]))
    total = loop.binary("fmul", step, loop.spread("%both"))
    for row, name in ((0, "%begin"), (12, "%end")):
        total = loop.binary("fadd", total, loop.binary("fmul", loop.load(row), loop.spread(name)))
    loop.store(total, ROWS["last"])
    start = """  %rest = fsub double 1.0, %x
  %product = fmul double %x, %rest
  %six = fmul double %product, 6.0
  %both = fdiv double %six, %h
  %thrice = fmul double %x, 3.0
  %left = fsub double 1.0, %thrice
  %begin = fmul double %rest, %left
  %past = fsub double %thrice, 2.0
  %end = fmul double %x, %past
"""
    return loop.function("slope", ", double %x, double %h", start=start)


def loop_code() -> str:
    """Return the functions; each takes the table and the length of its rows."""
    parts = [_stage(stage) for stage in range(1, 16)]
    parts += [_squares("squares5", ERROR_5), _squares("squares3", ERROR_3)]
    parts += [_distance("slopes", 12, 11), _distance("values", ROWS["trial"], ROWS["last"])]
    parts += [_size("size0", ROWS["y"]), _size("size1", 12), _size("size2", 1, 12), _euler()]
    parts += [_copy("shift", {12: 0}), _copy("unshift", {0: 12})]
    parts += [_copy("accept", {ROWS["y"]: ROWS["y_old"], ROWS["trial"]: ROWS["y"]})]
    parts += [_dense(), _polynomial(), _slope()]
    parts += [
        f"declare {_VECTOR} @llvm.fabs.v{WIDTH}f64({_VECTOR})",
        f"declare double @llvm.vector.reduce.fadd.v{WIDTH}f64(double, {_VECTOR})",
    ]
    return "\n".join(parts)
