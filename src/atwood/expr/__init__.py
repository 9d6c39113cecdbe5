"""The expression graph: arithmetic, derivatives, sparsity, operation counts, and the road to and from sympy."""

from atwood.expr.core.analysis import (
    count_operations as count_operations,
    dependencies as dependencies,
    depends_on as depends_on,
    evaluate as evaluate,
    live as live,
    read_by as read_by,
    substitute as substitute,
)
from atwood.expr.core.arithmetic import DivisionByExactZeroError as DivisionByExactZeroError
from atwood.expr.core.derivatives import (
    SparseMatrix as SparseMatrix,
    affine_coefficients as affine_coefficients,
    jacobian as jacobian,
    jacobian_by_rows as jacobian_by_rows,
    jvp as jvp,
    sweeps_exceed as sweeps_exceed,
    vjp as vjp,
)
from atwood.expr.core.functions import (
    Scalar as Scalar,
    absolute as absolute,
    acos as acos,
    asin as asin,
    atan as atan,
    atan2 as atan2,
    cos as cos,
    cosh as cosh,
    exp as exp,
    external as external,
    floor as floor,
    hypot as hypot,
    is_zero as is_zero,
    log as log,
    maximum as maximum,
    minimum as minimum,
    select as select,
    sign as sign,
    sin as sin,
    sinh as sinh,
    solve as solve,
    sqrt as sqrt,
    tan as tan,
    tanh as tanh,
)
from atwood.expr.core.graph import Expression as Expression, Graph as Graph
from atwood.expr.core.operations import ExternalFunction as ExternalFunction
from atwood.expr.core.program import InputGroup as InputGroup, OutputGroup as OutputGroup, Program as Program
from atwood.expr.simplify.collect import collect as collect
