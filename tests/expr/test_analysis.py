import pytest
from hypothesis import given, settings

from atwood import expr as ex
from atwood.errors import AtwoodError
from atwood.expr.core.analysis import dependents

from . import graphs


def make(names):
    graph = ex.Graph()
    return [graph.symbol(name) for name in names.split()]


def test_counts_are_exact():
    x, y, p = make("x y p")
    shared = ex.sin(x * p)
    outputs = [shared * y + 1, shared / (p * p + ex.cos(p)), -ex.sqrt(y) - 2 * ex.sin(p)]
    assert ex.count_operations(outputs, [p]) == {"add": 1, "div": 1, "mul": 2, "sin": 1, "sqrt": 1, "sub": 1}
    assert ex.count_operations(outputs) == {
        "add": 2, "cos": 1, "div": 1, "mul": 4, "sin": 2, "sqrt": 1, "sub": 1,
    }  # fmt: skip
    assert ex.count_operations([x, 2.0, p]) == {}
    assert ex.count_operations(ex.solve([[x, y], [y, x]], [1.0, p])) == {"solve": 1}


def test_dependencies():
    x, y, z = make("x y z")
    assert ex.dependencies([x * y, ex.sin(z), 3.0, x - x], [x, z]) == [
        frozenset({x}), frozenset({z}), frozenset(), frozenset(),
    ]  # fmt: skip
    assert ex.depends_on(ex.sin(x * y), [y, z])
    assert not ex.depends_on(ex.sin(x * y), [z])
    assert not ex.depends_on(1.0, [z])


@given(graphs.recipes, graphs.recipes)
@settings(max_examples=40)
def test_what_does_not_depend_on_roots_may_be_left_out(first, second):
    """Nothing that depends on one is, whether it is a symbol or not, and with any number of kinds of symbols."""
    graph = ex.Graph()
    start = [graph.parameter("p"), *(graph.symbol(f"{chr(97 + k)}:x") for k in range(12))]
    outputs = [*graphs.follow(first, start), *graphs.follow(second, start[::-1])]
    every = ex.live(outputs)
    for roots in ([start[1]], [start[12], start[9]], [start[0]], [every[len(every) // 2]], [every[-1], start[3]]):
        found, wanted = ex.live(outputs, roots), dependents(every, roots)
        assert [node for node in found if node.index in wanted] == [node for node in every if node.index in wanted]
        assert set(found) <= set(every)
        assert ex.live(outputs, roots, roots) == [node for node in found if node in ex.live(outputs, roots, roots)]
        assert ex.depends_on(outputs, roots) == any(root in every for root in roots)
    few, many = ex.live([outputs[0] * start[2]], [start[2]]), ex.live([outputs[0] * start[2]])
    assert len(few) <= len(many)


def test_other_kinds_of_symbols_are_passed_over():
    graph = ex.Graph()
    q, u, a = (graph.symbol(f"{kind}:x") for kind in "qua")
    force = ex.sin(q) * u / (1.0 + q * q)
    row = 2.0 * a + force
    assert len(ex.live([row], [a])) == 3
    assert ex.live([row], [a], [force]) == ex.live([row], [a])
    assert force in ex.live([row], [u])
    made = len(graph)
    assert ex.substitute([row], {force: 0.0}) == [2.0 * a]
    assert len(graph) == made


def test_live_is_in_topological_order():
    x, y = make("x y")
    nodes = ex.live([ex.sin(x) * y, x])
    assert nodes[-1] is ex.sin(x) * y
    assert len(nodes) == 4
    with pytest.raises(AtwoodError, match="different graphs"):
        ex.live([x, ex.Graph().symbol("x")])


def test_affine_coefficients():
    x, y, q, p = make("x y q p")
    found = ex.affine_coefficients(p * (x - 2 * y) + ex.sin(q) * q + 1, [x, y], [p])
    assert found == ([p, -2 * p], ex.sin(q) * q + 1)
    assert ex.affine_coefficients(q * x, [x], [p]) is None
    assert ex.affine_coefficients(x * x, [x], [p]) is None
    assert ex.affine_coefficients(x * y, [x, y], [p]) is None
    assert ex.affine_coefficients(ex.sign(x) + q, [x], [p]) is None
    assert ex.affine_coefficients(ex.absolute(x), [x], [p]) is None
    assert ex.affine_coefficients(ex.minimum(x, 1.0), [x], [p]) is None
    assert ex.affine_coefficients(p / x, [x], [p]) is None
    assert ex.affine_coefficients(ex.sin(q), [x], [p]) == ([x.graph.zero], ex.sin(q))
    coefficients, remainder = ex.affine_coefficients(ex.solve([[p, 1], [1, 2]], [x, q])[0], [x], [p])
    at = {"x": 0.3, "p": 5.0, "q": 0.7}
    value, slope, rest = ex.evaluate([ex.solve([[p, 1], [1, 2]], [x, q])[0], coefficients[0], remainder], at)
    assert value == pytest.approx(slope * 0.3 + rest)


def test_substitution_happens_at_once_and_folds():
    x, y = make("x y")
    assert ex.substitute([x + 2 * y, 3.0], {x: y, y: x}) == [y + 2 * x, x.graph.constant(3)]
    assert ex.substitute([ex.sin(x) * y], {ex.sin(x): 0.0})[0].is_zero
    assert ex.substitute([x * y], {}) == [x * y]
    [first, second] = ex.solve([[x, y], [y, 2]], [1, x])
    assert ex.substitute([first, second], {y: 0.0, x: 4.0}) == [x.graph.constant(0.25), x.graph.constant(2.0)]


def test_evaluate_names_a_missing_symbol():
    x, y = make("x y")
    with pytest.raises(AtwoodError, match="symbol y"):
        ex.evaluate([x * y], {x: 1.0})


def program(x, p, outputs):
    return ex.Program("demo", (ex.InputGroup("state", (x,)),), (p,), (ex.OutputGroup("rows", tuple(outputs)),))


def test_program_names_stray_and_repeated_symbols():
    x, y, p = make("x y p")
    with pytest.raises(AtwoodError, match="demo: the output group rows depends on the symbol y"):
        program(x, p, [x * y])
    with pytest.raises(AtwoodError, match="listed twice"):
        program(x, x, [x])
    with pytest.raises(AtwoodError, match="not a symbol"):
        program(x * 2, p, [x])
    with pytest.raises(AtwoodError, match="different graphs"):
        program(x, ex.Graph().symbol("q"), [x])


def test_prologue_is_what_the_rest_uses():
    x, p = make("x p")
    made = program(x, p, [x * ex.sin(p * p), p, ex.cos(p), p + x])
    assert set(made.prologue) == {p, ex.sin(p * p), ex.cos(p)}
    assert made.operations == {"add": 1, "mul": 1}
    assert made.size == 7
    assert made.graph is x.graph


def test_digest_is_that_of_the_structure():
    def digest(extra, flip, factor=2.0):
        x, p = make("x p") if not flip else reversed(make("p x"))
        if extra:
            ex.cos(x)
        terms = [factor * x * p, ex.sin(x)]
        return program(x, p, [terms[1] + terms[0] if flip else terms[0] + terms[1]]).digest

    assert digest(False, False) == digest(True, False) == digest(False, True)
    assert digest(False, False) != digest(False, False, 3.0)


@settings(derandomize=True, max_examples=30, deadline=None)
@given(graphs.recipes)
def test_live_equals_what_an_evaluation_visits(recipe):
    _, outputs = graphs.build(recipe)
    nodes = ex.live(outputs)
    seen = set()
    for node in nodes:
        assert all(argument in seen for argument in node.arguments)
        seen.add(node)
    assert set(outputs) <= seen
