"""Rows of a mechanism with loops, projected on the null space of its constraints, in LLVM's language.

Two kernels compute what does not depend on which coordinates are dependent: the stack ``(K, r, g, g')`` of kinematic
rows, balances of forces, constraints and their rates, with their Jacobian ``G``; and the derivatives of the stack
with ``r - G^T lambda`` in the place of r, at given multipliers.  What does depend on it comes in as numbers:

    lambda = G_d^-T r_d,    F = (K_i, g, r_i - G_i^T lambda, g'),    dF = (..., dR_i - G_i^T G_d^-T dR_d, ...)

where d are the dependent speeds, i the independent ones and R = r - G^T lambda with lambda held.  So another choice of
dependent coordinates is another list of numbers, for which nothing is compiled.  Constraints that share no dependent
speed are solved separately, block by block.
"""

from __future__ import annotations

from functools import cached_property

from atwood.codegen.llvm.linear_systems import ROUTINES
from atwood.codegen.llvm.routine import Routine
from atwood.codegen.llvm.text import literal
from atwood.codegen.sundials.text import SundialsLayout
from atwood.late import dataclass

__all__ = ["ATTENTION", "FIELDS", "LIMIT", "RATE", "NullSpaceShape", "null_space_text"]

FIELDS = (
    "derived_residual",
    "derived_jacobian",
    "scratch",
    "relative",
    "absolute",
    "choice",
    "work",
    "sizes",
    "state",
)
"""The pointers of the user's data, in order."""

ATTENTION, RATE, LIMIT = range(3)
"""In the state: whether the choice has become a poor one, cj of the last Jacobian, and what is poor."""


@dataclass(frozen=True)
class NullSpaceShape:
    """How many there are of each.

    Attributes
    ----------
    coordinates, speeds
        The length of q and of u.
    values, rates
        The number of constraints on q and on u.
    """

    coordinates: int
    speeds: int
    values: int
    rates: int

    @property
    def size(self) -> int:
        """The length of y, and the number of rows."""
        return self.coordinates + self.speeds

    @property
    def stack(self) -> int:
        """The number of rows from which those are chosen and projected."""
        return self.size + self.values + self.rates

    @property
    def free(self) -> int:
        """The number of independent speeds."""
        return self.speeds - self.rates

    @cached_property
    def choice(self) -> dict[str, int]:
        """Where the lists of a choice begin; see `atwood.simulation.dynamics.partitioning.Choice`."""
        lengths = {
            "source": self.size,
            "target": self.free,
            "independent": self.free,
            "dependent": self.rates,
            "constraints": self.rates,
            "starts": self.rates + 1,
            "blocks": 1,
        }
        return _places(lengths)

    @cached_property
    def work(self) -> dict[str, int]:
        """Where the arrays of one evaluation begin."""
        m = self.rates
        lengths = {
            "stack": self.stack,
            "jacobian": m * self.speeds,
            "derivatives": self.stack * self.size,
            "multipliers": m,
            "matrix": m * m,
            "pivots": m,
            "side": m,
            "weights": m * self.free,
            "column": m,
        }
        return _places(lengths)


def _places(lengths: dict[str, int]) -> dict[str, int]:
    """Return where arrays begin that lie one after the other, and where the last ends as ``end``."""
    found, total = {}, 0
    for name, length in lengths.items():
        found[name] = total
        total += length
    return found | {"end": total}


class _Evaluation:
    """What residual and Jacobian have in common while they are written."""

    def __init__(self, layout: SundialsLayout, shape: NullSpaceShape) -> None:
        self.layout, self.shape = layout, shape
        self.code = Routine()
        self.data = {name: self.code.load_pointer("%data", k) for k, name in enumerate(FIELDS)}

    def vector(self, structure: str) -> str:
        """Return the numbers of one of SUNDIALS' vectors."""
        return self.inside(structure, self.layout.vector_data)

    def inside(self, structure: str, offset: int) -> str:
        """Return an address that lies in the content of one of SUNDIALS' structures."""
        content = self.code.put(f"load ptr, ptr {structure}")
        return self.code.put(f"load ptr, ptr {self.code.put(f'getelementptr i8, ptr {content}, i64 {offset}')}")

    def array(self, name: str) -> str:
        """Return the begin of an array of the work space."""
        return self.code.place(self.data["work"], self.shape.work[name])

    def listed(self, name: str, position: str | int) -> str:
        """Return an element of one of the lists of the choice."""
        return self.code.load_index(self.data["choice"], self.shape.choice[name], position)

    def call(self, kernel: str, inputs: tuple[str, ...], output: str) -> str:
        """Call a kernel; return whether it found a value that is not finite."""
        code = self.code
        places = code.put(f"alloca [{len(inputs)} x ptr]")
        for k, name in enumerate(inputs):
            code.do(f"store ptr {name}, ptr {code.put(f'getelementptr ptr, ptr {places}, i64 {k}')}")
        target = code.put("alloca ptr")
        code.do(f"store ptr {output}, ptr {target}")
        derived, scratch = self.data[f"derived_{kernel}"], self.data["scratch"]
        found = code.put(f"call i32 @{kernel}(ptr {places}, ptr {derived}, ptr {scratch}, ptr {target})")
        return code.put(f"icmp ne i32 {found}, 0")

    def scalar(self, name: str) -> str:
        """Return the address of a number that the function is given."""
        place = self.code.put("alloca double")
        self.code.do(f"store double {name}, ptr {place}")
        return place

    def answer(self, *missing: str) -> None:
        """Return 1 if one of the conditions holds, else 0."""
        total = missing[0]
        for one in missing[1:]:
            total = self.code.put(f"or i1 {total}, {one}")
        self.code.do(f"ret i32 {self.code.put(f'zext i1 {total} to i32')}")

    def is_not_finite(self, total: str) -> str:
        """Return whether a sum of values is not finite."""
        nothing = self.code.number("fsub", total, total)
        return self.code.put(f"fcmp une double {nothing}, 0.0")

    def solve_multipliers(self) -> None:
        """Write ``lambda = G_d^-T r_d``, block by block."""
        code, shape = self.code, self.shape
        jacobian, matrix, pivots, side = (self.array(name) for name in ("jacobian", "matrix", "pivots", "side"))
        balances = code.place(self.array("stack"), shape.coordinates)
        multipliers = self.array("multipliers")
        with code.loop(0, self.listed("blocks", 0)) as block:
            start, count = self._block(block.index)
            with code.loop(0, count) as row:
                speed = self.listed("dependent", code.index("add", start, row.index))
                code.store(code.load(balances, speed), side, row.index)
                at = code.index("mul", row.index, count)
                with code.loop(0, count) as column:
                    constraint = self.listed("constraints", code.index("add", start, column.index))
                    entry = code.load(jacobian, code.index("mul", constraint, shape.speeds), speed)
                    code.store(entry, matrix, at, column.index)
            code.do(f"call void @factorise_block(i64 {count}, ptr {matrix}, ptr {pivots})")
            code.do(f"call void @substitute_block(i64 {count}, ptr {matrix}, ptr {pivots}, ptr {side})")
            with code.loop(0, count) as row:
                constraint = self.listed("constraints", code.index("add", start, row.index))
                code.store(code.load(side, row.index), multipliers, constraint)

    def solve_weights(self) -> str:
        """Write ``W = G_d^-1 G_i``, one row for each independent speed; return whether it is finite."""
        code, shape = self.code, self.shape
        jacobian, matrix, pivots, side = (self.array(name) for name in ("jacobian", "matrix", "pivots", "side"))
        weights, sizes, state = self.array("weights"), self.data["sizes"], self.data["state"]
        limit = code.load(state, LIMIT)
        with code.loop(0, self.listed("blocks", 0), (literal(0.0),)) as block:
            start, count = self._block(block.index)
            with code.loop(0, count) as row:
                constraint = self.listed("constraints", code.index("add", start, row.index))
                entries = code.place(jacobian, code.index("mul", constraint, shape.speeds))
                at = code.index("mul", row.index, count)
                with code.loop(0, count) as column:
                    speed = self.listed("dependent", code.index("add", start, column.index))
                    code.store(code.load(entries, speed), matrix, at, column.index)
            code.do(f"call void @factorise_block(i64 {count}, ptr {matrix}, ptr {pivots})")
            with code.loop(0, shape.free, block.carried) as free:
                speed = self.listed("independent", free.index)
                with code.loop(0, count, (literal(0.0),)) as row:
                    constraint = self.listed("constraints", code.index("add", start, row.index))
                    entry = code.load(jacobian, code.index("mul", constraint, shape.speeds), speed)
                    code.store(entry, side, row.index)
                    size = code.put(f"call double @llvm.fabs.f64(double {entry})")
                    row.following = (code.number("fadd", row.carried[0], size),)
                with code.when(code.put(f"fcmp une double {row.carried[0]}, 0.0")):
                    code.do(f"call void @substitute_block(i64 {count}, ptr {matrix}, ptr {pivots}, ptr {side})")
                own = code.load(sizes, speed)
                with code.loop(0, count, free.carried) as column:
                    weight = code.load(side, column.index)
                    position = code.index("add", start, column.index)
                    code.store(weight, weights, code.index("mul", free.index, shape.rates), position)
                    other = code.load(sizes, self.listed("dependent", position))
                    size = code.put(f"call double @llvm.fabs.f64(double {weight})")
                    moved, allowed = code.number("fmul", size, own), code.number("fmul", limit, other)
                    with code.when(code.put(f"fcmp ugt double {moved}, {allowed}")):
                        code.store(literal(1.0), state, ATTENTION)
                    column.following = (code.number("fadd", column.carried[0], size),)
                free.following = column.carried
            block.following = free.carried
        return self.is_not_finite(block.carried[0])

    def _block(self, block: str) -> tuple[str, str]:
        start = self.listed("starts", block)
        return start, self.code.index("sub", self.listed("starts", self.code.index("add", block, 1)), start)


def null_space_text(layout: SundialsLayout, shape: NullSpaceShape, sparse: bool) -> str:
    """Write residual, Jacobian and error weights with IDA's signatures.

    Parameters
    ----------
    layout
        Where SUNDIALS' structures have their arrays.
    shape
        How many there are of each.
    sparse
        Whether IDA's matrix is sparse.
    """
    # The routines have names of their own, since the kernels may bring the same ones.
    routines = ROUTINES.replace("@factorise(", "@factorise_block(").replace("@substitute(", "@substitute_block(")
    texts = (_residual_text(layout, shape), _jacobian_text(layout, shape, sparse), _weights_text(layout, shape))
    return routines + "".join(texts)


def _residual_text(layout: SundialsLayout, shape: NullSpaceShape) -> str:
    """Write the residual with IDA's signature."""
    made = _Evaluation(layout, shape)
    code = made.code
    t, y, yp, out = made.scalar("%t"), *(made.vector(name) for name in ("%yy", "%yyp", "%rr"))
    stack, jacobian = made.array("stack"), made.array("jacobian")
    missing = made.call("residual", (t, y, yp), stack)
    made.solve_multipliers()
    multipliers, balances = made.array("multipliers"), code.place(stack, shape.coordinates)
    with code.loop(0, shape.rates) as row:
        multiplier = code.load(multipliers, row.index)
        entries = code.place(jacobian, code.index("mul", row.index, shape.speeds))
        with code.loop(0, shape.speeds) as speed:
            force = code.number("fmul", code.load(entries, speed.index), multiplier)
            code.store(code.number("fsub", code.load(balances, speed.index), force), balances, speed.index)
    with code.loop(0, shape.size, (literal(0.0),)) as row:
        value = code.load(stack, made.listed("source", row.index))
        code.store(value, out, row.index)
        row.following = (code.number("fadd", row.carried[0], value),)
    made.answer(missing, made.is_not_finite(row.carried[0]))
    return code.function("define i32 @ida_residual(double %t, ptr %yy, ptr %yyp, ptr %rr, ptr %data) #0")


def _jacobian_text(layout: SundialsLayout, shape: NullSpaceShape, sparse: bool) -> str:
    """Write the Jacobian with IDA's signature; it writes every entry of the matrix, and the pattern of a sparse one."""
    made = _Evaluation(layout, shape)
    code = made.code
    t, cj = made.scalar("%t"), made.scalar("%cj")
    y, yp = made.vector("%yy"), made.vector("%yyp")
    out = made.inside("%matrix", layout.sparse_data if sparse else layout.dense_data)
    if sparse:
        _write_pattern(made)
    code.store("%cj", made.data["state"], RATE)
    missing = made.call("residual", (t, y, yp), made.array("stack"))
    made.solve_multipliers()
    derivatives = made.array("derivatives")
    lost = made.call("jacobian", (t, y, yp, cj, made.array("multipliers")), derivatives)
    poor = made.solve_weights()
    weights, column = made.array("weights"), made.array("column")
    with code.loop(0, shape.size) as unknown:
        entries = code.place(derivatives, code.index("mul", unknown.index, shape.stack))
        target = code.place(out, code.index("mul", unknown.index, shape.size))
        with code.loop(0, shape.size) as row:
            code.store(code.load(entries, made.listed("source", row.index)), target, row.index)
        with code.loop(0, shape.rates, (literal(0.0),)) as row:
            value = code.load(entries, made.listed("dependent", row.index), shape.coordinates)
            code.store(value, column, row.index)
            size = code.put(f"call double @llvm.fabs.f64(double {value})")
            row.following = (code.number("fadd", row.carried[0], size),)
        with code.when(code.put(f"fcmp une double {row.carried[0]}, 0.0")):
            _project_column(made, weights, column, target)
    made.answer(missing, lost, poor)
    return code.function(
        "define i32 @ida_jacobian(double %t, double %cj, ptr %yy, ptr %yyp, ptr %rr, ptr %matrix, ptr %data, "
        "ptr %v1, ptr %v2, ptr %v3) #0"
    )


def _project_column(made: _Evaluation, weights: str, column: str, target: str) -> None:
    """Subtract from the projected rows of a column what the dependent rows contribute."""
    code, shape = made.code, made.shape
    with code.loop(0, shape.free) as free:
        own = code.place(weights, code.index("mul", free.index, shape.rates))
        place = code.place(target, made.listed("target", free.index))
        with code.loop(0, shape.rates, (code.put(f"load double, ptr {place}"),)) as row:
            product = code.number("fmul", code.load(own, row.index), code.load(column, row.index))
            row.following = (code.number("fsub", row.carried[0], product),)
        code.do(f"store double {row.carried[0]}, ptr {place}")


def _write_pattern(made: _Evaluation) -> None:
    """Write the pattern of a matrix in compressed columns that is full."""
    code, layout, size = made.code, made.layout, made.shape.size
    integer = f"i{8 * layout.index_bytes}"
    rows = made.inside("%matrix", layout.sparse_values)
    starts = made.inside("%matrix", layout.sparse_pointers)

    def write(value: str, array: str, position: str) -> None:
        narrow = value if layout.index_bytes == 8 else code.put(f"trunc i64 {value} to {integer}")
        code.do(f"store {integer} {narrow}, ptr {code.put(f'getelementptr {integer}, ptr {array}, i64 {position}')}")

    with code.loop(0, size + 1) as column:
        write(code.index("mul", column.index, size), starts, column.index)
    with code.loop(0, size) as column, code.loop(0, size) as row:
        write(row.index, rows, code.index("add", code.index("mul", column.index, size), row.index))


def _weights_text(layout: SundialsLayout, shape: NullSpaceShape) -> str:
    """Write the error weights with IDA's signature.

    They are ``1 / (relative |y| + absolute)``.  IDA asks for them before every step; -1, on which it hands over what
    it has, means that a weight is not positive, or that the choice of dependent coordinates has become a poor one.
    """
    made = _Evaluation(layout, shape)
    code = made.code
    y, weights = made.vector("%yy"), made.vector("%ewt")
    attention = code.put(f"fcmp une double {code.load(made.data['state'], ATTENTION)}, 0.0")
    with code.loop(0, shape.size, (literal(0.0),)) as row:
        size = code.put(f"call double @llvm.fabs.f64(double {code.load(y, row.index)})")
        share = code.number("fmul", code.load(made.data["relative"], row.index), size)
        allowed = code.number("fadd", share, code.load(made.data["absolute"], row.index))
        code.store(code.number("fdiv", literal(1.0), allowed), weights, row.index)
        wrong = code.put(f"uitofp i1 {code.put(f'fcmp ule double {allowed}, 0.0')} to double")
        row.following = (code.number("fadd", row.carried[0], wrong),)
    refused = code.put(f"fcmp une double {row.carried[0]}, 0.0")
    stops = code.put(f"or i1 {attention}, {refused}")
    code.do(f"ret i32 {code.put(f'sext i1 {stops} to i32')}")
    return code.function("define i32 @ida_weights(ptr %yy, ptr %ewt, ptr %data) #0")
