"""The functions with IDA's signatures around the kernels of a residual and a Jacobian, and what such have in common."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.codegen.routines.kernels import call_kernel, place_of
from atwood.codegen.routines.kinds import ADDRESS, BOOLEAN, CODE, INTEGER, NUMBER, Scalar
from atwood.codegen.routines.language import Record, Routine, Value
from atwood.codegen.routines.source import RoutineSource
from atwood.codegen.sundials.layout import SundialsLayout

FIELDS = ("derived_residual", "derived_jacobian", "scratch", "relative", "absolute", "rows", "starts")
"""The pointers of the user's data, in order; the last two lead to the pattern of a sparse matrix."""

RESIDUAL = {"t": NUMBER, "yy": ADDRESS, "yyp": ADDRESS, "rr": ADDRESS, "data": ADDRESS}
JACOBIAN = {"t": NUMBER, "cj": NUMBER} | dict.fromkeys(("yy", "yyp", "rr", "matrix", "data", "a", "b", "c"), ADDRESS)


def callbacks_source(layout: SundialsLayout, size: int, form: str, entries: int) -> RoutineSource:
    """Return what writes residual, Jacobian and error weights."""
    return RoutineSource("codegen.sundials.ida_routines", (), (layout, size, form, entries))


def write_routines(layout: SundialsLayout, size: int, form: str, entries: int) -> list[Routine]:
    """Write the routines; see `callbacks_source`."""
    return [_residual(layout), write_weights(layout, size, FIELDS), _jacobian(layout, size, form, entries)]


def array_of(structure: Value, offset: int) -> Value:
    """Return an array of one of SUNDIALS' structures: through its content, which is its first member."""
    return structure.read(0, ADDRESS).read(offset // 8, ADDRESS)


def _residual(layout: SundialsLayout) -> Routine:
    r = Routine("ida_residual", RESIDUAL, exported=True)
    t, *vectors, data = r.arguments
    own = Record(data, dict.fromkeys(FIELDS, ADDRESS))
    y, yp, found = (array_of(one, layout.vector_data) for one in vectors)
    r.give(call_kernel(r, "residual", [place_of(r, t), y, yp], own.derived_residual, own.scratch, [found]))
    return r


def _jacobian(layout: SundialsLayout, size: int, form: str, entries: int) -> Routine:
    r = Routine("ida_jacobian", JACOBIAN, exported=True)
    t, cj, yy, yyp, _, matrix, data, *_ = r.arguments
    own = Record(data, dict.fromkeys(FIELDS, ADDRESS))
    inputs = [place_of(r, t), *(array_of(one, layout.vector_data) for one in (yy, yyp)), place_of(r, cj)]
    derived, scratch = own.derived_jacobian, own.scratch
    found = array_of(matrix, layout.sparse_data if form == "sparse" else layout.dense_data)
    if form == "columns":
        _fill_columns(r, size, inputs, (derived, scratch), found)
        return r
    if form == "sparse":
        _copy_pattern(r, layout, matrix, (own.rows, entries), (own.starts, size + 1))
    r.give(call_kernel(r, "jacobian", inputs, derived, scratch, [found]))
    return r


def _fill_columns(r: Routine, size: int, inputs: list[Value], work: tuple[Value, Value], found: Value) -> None:
    """Fill a dense matrix by products with one unit vector after the other."""
    direction, bad = r.array(size), r.variable(0, CODE)
    r.clear(direction, direction.at(size))
    with r.count(size) as j:
        direction[j] = 1.0
        code = call_kernel(r, "jacobian", [*inputs, direction], *work, [found.at(j * size)])
        direction[j] = 0.0
        bad.now = bad.now | code
    r.give(bad.now)


def _copy_pattern(
    r: Routine, layout: SundialsLayout, matrix: Value, rows: tuple[Value, int], starts: tuple[Value, int]
) -> None:
    """Copy the pattern into a matrix in compressed columns; -1 where that has no room."""
    kind = index_kind(layout)
    room = matrix.read(0, ADDRESS).at(layout.sparse_room // 8).read(0, kind)
    with r.when(room < rows[1]):
        r.give(-1)
    r.copy(array_of(matrix, layout.sparse_values), *rows, kind)
    r.copy(array_of(matrix, layout.sparse_pointers), *starts, kind)


def index_kind(layout: SundialsLayout) -> Scalar:
    """Return the kind of SUNDIALS' indices."""
    return CODE if layout.index_bytes == 4 else INTEGER


def write_weights(layout: SundialsLayout, size: int, fields: Sequence[str], attention: int | None = None) -> Routine:
    """Write the error weights, ``1 / (relative |y| + absolute)``; -1 where one is not positive.

    IDA asks for them before every step. On -1 it hands over what it has; so it does where somebody should look.
    """
    r = Routine("ida_weights", {"yy": ADDRESS, "weights": ADDRESS, "data": ADDRESS}, exported=True)
    *vectors, data = r.arguments
    own = Record(data, dict.fromkeys(fields, ADDRESS))
    y, weights = (array_of(one, layout.vector_data) for one in vectors)
    relative, absolute = own.relative, own.absolute
    stops = r.variable(0 if attention is None else own.state[attention] != 0.0, BOOLEAN)
    with r.count(size) as k:
        allowed = relative[k] * r.size(y[k]) + absolute[k]
        weights[k] = 1.0 / allowed
        stops.now = stops.now | ~(allowed > 0.0)
    r.give(r.choose(stops.now, -1, 0, CODE))
    return r
