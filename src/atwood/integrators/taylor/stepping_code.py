"""The loops of the Taylor-series method in LLVM's language: convolutions, and what goes over all unknowns.

The coefficients that are convolved lie in blocks of `LANES` values, each block with one row for each order, so that
the convolutions of a block are worked out together and read memory in order: nothing has to be gathered, and no lane
waits for another.  The terms of a convolution are written out for each order; only the blocks are a loop.

The other loops go over the columns of a table of arrays, as in `atwood.integrators.dop853.stepping_code`.
"""

from __future__ import annotations

from atwood.integrators.machine_text import WIDTH, exact
from atwood.integrators.taylor.problem import HIGHEST

__all__ = ["LANES", "ROWS", "STRIDE", "loop_code", "positions"]

LANES = 8
"""How many convolutions are worked out at a time."""

STRIDE = LANES * (HIGHEST + 1)
"""How far one block is from the next: an odd number of rows, so that the rows of one order do not share cache sets."""

_NAMES = (
    *("y", "y_low", "new", "new_low", "rates", "new_rates", "slope", "floors", "sizes"),
    *("trial", "trial_rates", "kept", "kept_rates"),
)
ROWS = {"x": 0, **{name: HIGHEST + 1 + i for i, name in enumerate(_NAMES)}, "all": HIGHEST + 1 + len(_NAMES)}
"""The rows of the table of arrays: the coefficients of the unknowns from order zero on, and what steps need."""

_CHAINS = 4
"""Sums that the terms of a convolution are spread over, so that additions do not wait for each other."""

_NONE = "zeroinitializer"
"""The sum of no terms."""

_BLOCK = f"<{LANES} x double>"
_PART = f"<{WIDTH} x double>"


def positions(pairs: int, squares: int, size: int) -> tuple[int, ...]:
    """Return where the results of the program of an order go, from the row of that order in the first block.

    The blocks of left and right factors take turns, and those of squares follow; the coefficients of the unknowns have
    an array of their own.
    """
    left = [2 * (i // LANES) * STRIDE + i % LANES for i in range(pairs)]
    first = 2 * (-(-pairs // LANES))
    last = [(first + i // LANES) * STRIDE + i % LANES for i in range(squares)]
    return (*left, *(at + STRIDE for at in left), *last, *range(size))


# -- convolutions -------------------------------------------------------------------------------------------------


class _Terms:
    """The instructions that add up products of rows."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._count = 0

    def put(self, text: str) -> str:
        """Add an instruction; return the name of its value."""
        self._count += 1
        self.lines.append(f"  %v{self._count} = {text}")
        return f"%v{self._count}"

    def load(self, pointer: str, order: int) -> str:
        """Load the row of an order."""
        place = self.put(f"getelementptr double, ptr {pointer}, i64 {LANES * (order - 1)}")
        return self.put(f"load {_BLOCK}, ptr {place}, align 64")

    def binary(self, operation: str, a: str, b: str) -> str:
        """Add an operation on two rows."""
        return self.put(f"{operation} {_BLOCK} {a}, {b}")

    def multiply_add(self, a: str, b: str, c: str) -> str:
        """Return a product of two rows and a third."""
        return self.put(f"call {_BLOCK} @llvm.fmuladd.v{LANES}f64({_BLOCK} {a}, {_BLOCK} {b}, {_BLOCK} {c})")

    def total(self, products: list[tuple[str, str]]) -> str:
        """Return the sum of products."""
        chains: list[str] = []
        for i, (a, b) in enumerate(products):
            if i < _CHAINS:
                chains.append(self.binary("fmul", a, b))
            else:
                chains[i % _CHAINS] = self.multiply_add(a, b, chains[i % _CHAINS])
        while len(chains) > 1:
            chains = [
                self.binary("fadd", *chains[i : i + 2]) if i + 1 < len(chains) else chains[i]
                for i in range(0, len(chains), 2)
            ]
        return chains[0] if chains else _NONE


def _pairs(order: int) -> str:
    """Return the function of the convolutions of two values at an order.

    The rows of the order before have just been written by parts, and are the last that can be read: what they are in
    is added last.
    """
    terms = _Terms()
    products = [(terms.load("%left", j), terms.load("%right", order - j)) for j in range(1, order)]
    total = terms.total(products[1:-1])
    for a, b in products[:1] + products[1:][-1:]:
        total = terms.binary("fmul", a, b) if total == _NONE else terms.multiply_add(a, b, total)
    return _blocks(f"pairs{order}", 2 * STRIDE, terms, total)


def _squares(order: int) -> str:
    """Return the function of the convolutions of values with themselves: each product occurs twice but the middle.

    What the rows of the order before are in is added last.
    """
    terms = _Terms()
    half = terms.total([(terms.load("%left", j), terms.load("%left", order - j)) for j in range(2, (order + 1) // 2)])
    total = half if half == _NONE else terms.binary("fadd", half, half)
    if order % 2 == 0:
        middle = terms.load("%left", order // 2)
        total = terms.binary("fmul", middle, middle) if total == _NONE else terms.multiply_add(middle, middle, total)
    if order > 2:
        first, last = terms.load("%left", 1), terms.load("%left", order - 1)
        twice = terms.binary("fadd", first, first)
        total = terms.binary("fmul", twice, last) if total == _NONE else terms.multiply_add(twice, last, total)
    return _blocks(f"squares{order}", STRIDE, terms, total)


def _blocks(name: str, stride: int, terms: _Terms, total: str) -> str:
    return f"""define internal void @{name}(ptr %table, ptr %sums, i64 %blocks) #0 {{
entry:
  br label %head
head:
  %b = phi i64 [ 0, %entry ], [ %following, %body ]
  %more = icmp slt i64 %b, %blocks
  br i1 %more, label %body, label %done
body:
  %at = mul i64 %b, {stride}
  %left = getelementptr double, ptr %table, i64 %at
  %right = getelementptr double, ptr %left, i64 {STRIDE}
{chr(10).join(terms.lines)}
  %to = mul i64 %b, {LANES}
  %place = getelementptr double, ptr %sums, i64 %to
  store {_BLOCK} {total}, ptr %place, align 64
  %following = add i64 %b, 1
  br label %head
done:
  ret void
}}"""


# -- loops over the unknowns --------------------------------------------------------------------------------------


class _Columns(_Terms):
    """The body of a loop over the columns of the table of arrays."""

    def place(self, row: str | int) -> str:
        """Return the place of a part of a row."""
        at = self.put(f"mul i64 %m, {row}")
        index = self.put(f"add i64 {at}, %j")
        return self.put(f"getelementptr double, ptr %arrays, i64 {index}")

    def row(self, name: str | int) -> str:
        """Load a part of a row, by its name or number."""
        number = ROWS[name] if isinstance(name, str) else name
        return self.put(f"load {_PART}, ptr {self.place(number)}, align 8")

    def keep(self, value: str, name: str | int) -> None:
        """Store a part of a row."""
        place = self.place(ROWS[name] if isinstance(name, str) else name)
        self.lines.append(f"  store {_PART} {value}, ptr {place}, align 8")

    def each(self, operation: str, a: str, b: str) -> str:
        """Add an operation on two parts."""
        return self.put(f"{operation} {_PART} {a}, {b}")

    def size(self, value: str) -> str:
        """Return absolute values."""
        return self.put(f"call {_PART} @llvm.fabs.v{WIDTH}f64({_PART} {value})")

    def larger(self, a: str, b: str) -> str:
        """Return the larger values of two."""
        first = self.put(f"fcmp ogt {_PART} {a}, {b}")
        return self.put(f"select <{WIDTH} x i1> {first}, {_PART} {a}, {_PART} {b}")

    def function(self, name: str, arguments: str = "", spread: tuple[str, ...] = (), carried: str = "") -> str:
        """Return the function of the loop.

        Parameters
        ----------
        name, arguments
            What it is called, and what it takes besides the table.
        spread
            Scalar arguments that are needed as vectors, with ``.all`` at the end of their names.
        carried
            ``"or"`` or ``"max"``: %found is gathered over all turns, and the function returns it.
        """
        kind = {"": "void", "or": "i1", "max": "double"}[carried]
        vector = {"": "", "or": f"<{WIDTH} x i1>", "max": _PART}[carried]
        start = ""
        for word in spread:
            start += f"""  %{word}.one = insertelement {_PART} poison, double %{word}, i32 0
  %{word}.all = shufflevector {_PART} %{word}.one, {_PART} poison, <{WIDTH} x i32> zeroinitializer
"""
        phi = f"  %total = phi {vector} [ zeroinitializer, %entry ], [ %found, %tail ]\n" if carried else ""
        end = "  ret void"
        if carried == "or":
            end = f"  %any = call i1 @llvm.vector.reduce.or.v{WIDTH}i1({vector} %total)\n  ret i1 %any"
        elif carried == "max":
            end = f"  %top = call nnan double @llvm.vector.reduce.fmax.v{WIDTH}f64({vector} %total)\n  ret double %top"
        return f"""define internal {kind} @{name}(ptr %arrays, i64 %m{arguments}) #0 {{
entry:
{start}  br label %head
head:
  %j = phi i64 [ 0, %entry ], [ %following, %tail ]
{phi}  %more = icmp slt i64 %j, %m
  br i1 %more, label %body, label %done
body:
{chr(10).join(self.lines)}
  br label %tail
tail:
  %following = add i64 %j, {WIDTH}
  br label %head
done:
{end}
}}"""


def _unfold() -> str:
    """Return the function that writes the coefficients of order zero and one."""
    loop = _Columns()
    loop.keep(loop.row("y"), 0)
    loop.keep(loop.each("fmul", loop.row("rates"), "%unit.all"), 1)
    return loop.function("unfold", ", double %unit", ("unit",))


def _sizes() -> str:
    """Return the function that writes one over the size of each unknown."""
    loop = _Columns()
    size = loop.each("fadd", loop.row("floors"), loop.size(loop.row("y")))
    one = f"<{', '.join([f'double {exact(1.0)}'] * WIDTH)}>"
    loop.keep(loop.each("fdiv", one, size), "sizes")
    return loop.function("sizes")


def _largest() -> str:
    """Return the function of the largest coefficient of an order, in units of the sizes."""
    loop = _Columns()
    place = loop.place("%order")
    value = loop.size(loop.put(f"load {_PART}, ptr {place}, align 8"))
    found = loop.larger(loop.each("fmul", value, loop.row("sizes")), "%total")
    loop.lines.append(f"  %found = bitcast {_PART} {found} to {_PART}")
    return loop.function("largest", ", i64 %order", carried="max")


def _horner(loop: _Columns) -> tuple[str, str]:
    """Write the loop of Horner's scheme; return what it gives for the polynomial less its first term, and its slope."""
    top = loop.put(f"load {_PART}, ptr {loop.place('%order')}, align 8")
    mul_add = f"call {_PART} @llvm.fmuladd.v{WIDTH}f64({_PART}"
    loop.lines.append(f"""  %highest = sub i64 %order, 1
  br label %terms
terms:
  %k = phi i64 [ %highest, %body ], [ %lower, %terms ]
  %value = phi {_PART} [ {top}, %body ], [ %next.value, %terms ]
  %turn = phi {_PART} [ zeroinitializer, %body ], [ %next.turn, %terms ]
  %k.at = mul i64 %k, %m
  %k.index = add i64 %k.at, %j
  %k.place = getelementptr double, ptr %arrays, i64 %k.index
  %k.row = load {_PART}, ptr %k.place, align 8
  %next.turn = {mul_add} %turn, {_PART} %share.all, {_PART} %value)
  %next.value = {mul_add} %value, {_PART} %share.all, {_PART} %k.row)
  %lower = sub i64 %k, 1
  %again = icmp sgt i64 %lower, 0
  br i1 %again, label %terms, label %summed
summed:""")
    slope = loop.put(f"{mul_add} %next.turn, {_PART} %share.all, {_PART} %next.value)")
    return loop.each("fmul", "%next.value", "%share.all"), slope


def _move() -> str:
    """Return the function that writes the values at the end of a step, what they leave out, and the slope there."""
    loop = _Columns()
    moved, slope = _horner(loop)
    loop.keep(slope, "slope")
    high = loop.row("y")
    total = loop.each("fadd", high, moved)
    part = loop.each("fsub", total, high)
    lost = loop.each("fsub", high, loop.each("fsub", total, part))
    lost = loop.each("fadd", lost, loop.each("fsub", moved, part))
    low = loop.each("fadd", loop.row("y_low"), lost)
    new = loop.each("fadd", total, low)
    loop.keep(new, "new")
    loop.keep(loop.each("fsub", low, loop.each("fsub", new, total)), "new_low")
    return loop.function("move", ", i64 %order, double %share", ("share",))


def _look() -> str:
    """Return the function that writes the values at a share of a step."""
    loop = _Columns()
    moved, _ = _horner(loop)
    loop.keep(loop.each("fadd", loop.row(0), moved), "trial")
    return loop.function("look", ", i64 %order, double %share", ("share",))


def _inside() -> str:
    """Return the function that writes values, and the slopes of their polynomials, at a share of a step."""
    loop = _Columns()
    moved, slope = _horner(loop)
    loop.keep(loop.each("fadd", loop.row(0), moved), "trial")
    loop.keep(loop.each("fmul", slope, "%pace.all"), "trial_rates")
    return loop.function("inside", ", i64 %order, double %share, double %pace", ("share", "pace"))


def _misses() -> str:
    """Return the function that tells whether rates are not the slope of the polynomial."""
    loop = _Columns()
    slope = loop.each("fmul", loop.row("slope"), "%pace.all")
    apart = loop.each("fmul", loop.size(loop.each("fsub", slope, loop.row("new_rates"))), "%weight.all")
    larger = loop.larger(loop.size(loop.row("y")), loop.size(loop.row("new")))
    size = loop.each("fmul", loop.each("fadd", loop.row("floors"), larger), "%allowed.all")
    fits = loop.put(f"fcmp ole {_PART} {apart}, {size}")
    ones = f"<{', '.join(['i1 true'] * WIDTH)}>"
    missed = loop.put(f"xor <{WIDTH} x i1> {fits}, {ones}")
    loop.lines.append(f"  %found = or <{WIDTH} x i1> %total, {missed}")
    words = ("pace", "weight", "allowed")
    return loop.function("misses", "".join(f", double %{word}" for word in words), words, "or")


def _accept() -> str:
    """Return the function that makes what was tried the state."""
    loop = _Columns()
    for source, target in (("new", "y"), ("new_low", "y_low"), ("new_rates", "rates")):
        loop.keep(loop.row(source), target)
    return loop.function("accept")


def loop_code() -> str:
    """Return the functions."""
    parts = [_pairs(order) for order in range(1, HIGHEST)] + [_squares(order) for order in range(1, HIGHEST)]
    parts += [_unfold(), _sizes(), _largest(), _move(), _look(), _inside(), _misses(), _accept()]
    parts += [
        f"declare {_BLOCK} @llvm.fmuladd.v{LANES}f64({_BLOCK}, {_BLOCK}, {_BLOCK})",
        f"declare {_PART} @llvm.fmuladd.v{WIDTH}f64({_PART}, {_PART}, {_PART})",
        f"declare {_PART} @llvm.fabs.v{WIDTH}f64({_PART})",
        f"declare double @llvm.vector.reduce.fmax.v{WIDTH}f64({_PART})",
        f"declare i1 @llvm.vector.reduce.or.v{WIDTH}i1(<{WIDTH} x i1>)",
    ]
    return "\n".join(parts)
