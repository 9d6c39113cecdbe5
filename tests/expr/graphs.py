"""Random expression graphs that are smooth and regular everywhere, for the tests of derivatives and kernels."""

from hypothesis import strategies as st

from atwood import expr as ex

NAMES = ("x", "y", "z")

UNARY = (
    lambda a: -a,
    ex.sin,
    ex.cos,
    ex.tanh,
    ex.atan,
    lambda a: ex.sqrt(a * a + 0.5),
    lambda a: ex.log(a * a + 1.5),
    lambda a: ex.exp(ex.sin(a)),
    lambda a: ex.sinh(ex.cos(a)),
    lambda a: ex.cosh(ex.sin(a)),
    lambda a: ex.asin(0.5 * ex.sin(a)),
    lambda a: ex.acos(0.5 * ex.cos(a)),
    lambda a: ex.tan(ex.sin(a)),
    lambda a: (ex.sin(a) + 2.0) ** 1.7,
    lambda a: (ex.cos(a) + 2.0) ** -3,
    lambda a: 3 * a - 1,
    lambda a: a / 4,
)
BINARY = (
    lambda a, b: a + b,
    lambda a, b: a - b,
    lambda a, b: ex.sin(a) * b,
    lambda a, b: a * ex.cos(b),
    lambda a, b: a / (b * b + 1.25),
    lambda a, b: ex.atan2(a, b * b + 1.0),
    lambda a, b: (ex.sin(a) + 2.0) ** ex.cos(b),
    lambda a, b: ex.hypot(a, b, 1.0),
    lambda a, b: ex.solve([[3.0, ex.sin(a)], [ex.cos(b), 4.0]], [a, b])[0],
    lambda a, b: ex.solve([[5.0, ex.sin(a), 1.0], [ex.atan(b), 4.0, 0.0], [1.0, 0.0, 3.0]], [ex.sin(b), 1.0, a])[2],
)

_step = st.tuples(st.integers(0, len(UNARY) + len(BINARY) - 1), st.integers(0, 30), st.integers(0, 30))
recipes = st.lists(_step, min_size=1, max_size=14)
values = st.tuples(*[st.floats(-2.0, 2.0, allow_nan=False).map(lambda v: round(v, 3))] * len(NAMES))


def follow(recipe, start):
    """Apply a recipe to starting values of any kind, and return the last results."""
    pool = list(start)
    for operation, i, j in recipe:
        a, b = pool[i % len(pool)], pool[j % len(pool)]
        if operation < len(UNARY):
            pool.append(UNARY[operation](a))
        else:
            pool.append(BINARY[operation - len(UNARY)](a, b))
    return pool[-2:]


def build(recipe):
    """Return the symbols and outputs of a recipe on a new graph."""
    graph = ex.Graph()
    symbols = [graph.symbol(name) for name in NAMES]
    return symbols, follow(recipe, symbols)
