"""Full Jacobians and mass matrices column by column."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import simulate
from atwood.forms import program as derivative
from atwood.forms.reassembly import STRUCTURES
from atwood.pipeline import assemble
from atwood.simulation.dynamics.balance import balance_of, columns_of, masses_at
from atwood_library.scenes import Chain

from ..helpers.nets import spring_net


@pytest.fixture
def by_columns(monkeypatch):
    """Treat every Jacobian of fifty columns as too long."""
    monkeypatch.setattr(derivative, "_LONGEST", 0)


def both(monkeypatch, make):
    entries = make()
    with monkeypatch.context() as patch:
        patch.setattr(derivative, "_LONGEST", 0)
        STRUCTURES.clear()  # or the equations of the first are used again
        columns = make()
    return entries, columns


def derived():
    assembly = assemble(Chain(links=26))
    form = assembly.form_program()
    return assembly, form, form.derivative.by_columns


def test_the_product_is_the_matrix(monkeypatch):
    random = np.random.default_rng(4)
    (written, entries, is_short), (short, columns, by_columns) = both(monkeypatch, derived)
    assert (is_short, by_columns) == (False, True)
    n = entries.size
    y, yp = random.uniform(-1.0, 1.0, n), random.uniform(-1.0, 1.0, n)
    expected = np.zeros((n, n))
    expected[entries.rows, entries.columns] = written.kernel(entries.jacobian)([0.0], y, yp, [7.0])[0]
    found = columns_of(short.kernel(columns.jacobian, vectorized=True), n, [0.0], y, yp, [7.0])
    np.testing.assert_allclose(found, expected, atol=1e-13)


def test_the_mass_matrix_is_the_same(monkeypatch):
    random = np.random.default_rng(5)
    q, u = random.uniform(-1.0, 1.0, 60), random.uniform(-1.0, 1.0, 60)
    found = []
    for assembly in both(monkeypatch, lambda: [a := assemble(Chain(links=60)), a.balance("reduced")][0]):
        assert assembly.balance("reduced").program is not None
        found.append((assembly, balance_of(assembly, "reduced").at(0.0, q, u)))
    (_, written), (short, columns) = found
    assert short.balance("reduced").mass_product is not None
    np.testing.assert_allclose(columns.mass, written.mass, rtol=1e-12)
    np.testing.assert_allclose(columns.bias, written.bias, rtol=1e-12)
    states = masses_at(short, np.zeros(1), np.array([q, q]), np.array([u, u]), short.parameter_values)
    np.testing.assert_allclose(states[1], written.mass, rtol=1e-12)


@pytest.mark.parametrize("solver", ["ida", "ida-sundae"])
def test_the_solver_takes_the_same_steps(monkeypatch, solver):
    run = lambda: simulate(Chain(links=26), solver=solver, rtol=1e-6, t_end=0.1, outputs=3)  # noqa: E731
    written, short = both(monkeypatch, run)
    assert short.run.segments[0].plan.program.derivative.by_columns
    assert abs(short.statistics.steps - written.statistics.steps) <= 2
    a, b = (one.run.segments[0].coordinates for one in (written, short))
    np.testing.assert_allclose(a, b, atol=1e-7)


def test_accelerations_are_found_without_the_mass_matrix(monkeypatch):
    written, short = both(
        monkeypatch,
        lambda: simulate(Chain(links=60), rtol=1e-6, t_end=0.02, outputs=2, samples=4).array("bob[59].acceleration.z"),
    )
    np.testing.assert_allclose(short, written, rtol=1e-6)


def test_what_is_not_full_stays_entry_by_entry(by_columns):
    assembly = assemble(spring_net(8, 8))
    assert not assembly.form_program().derivative.by_columns
    assert assembly.balance("reduced").mass_product is None


def test_work_grows_linearly_with_a_chain():
    sizes = [assemble(Chain(links=n)).form_program() for n in (100, 200)]
    assert all(one.derivative.by_columns for one in sizes)
    assert sizes[1].jacobian.size < 2.05 * sizes[0].jacobian.size
