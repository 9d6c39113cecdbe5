"""The programs of every scene and form against differences of themselves."""

import numpy as np
import pytest

from atwood_library.scenes import SCENES

from ..helpers.runs import EVERY_FORM, FORMS, GENERAL, dense, difference_quotient, moved, nearby_states, packed, prepare

EVERY_SCENE_AND_FORM = [(name, form, level) for name in GENERAL for form, level in EVERY_FORM]


@pytest.mark.sample(6)
@pytest.mark.parametrize(("name", "form", "level"), EVERY_SCENE_AND_FORM)
def test_jacobian_is_the_derivative_of_the_residual(name: str, form: str, level: str) -> None:
    prepared = prepare(SCENES[name](), form, level)
    program = prepared.plan.program
    residual, jacobian = (prepared.bound(p) for p in (program.residual, program.jacobian))
    random = np.random.default_rng(7)
    for q, u in nearby_states(prepared, 2):
        y, yp = packed(prepared, q, u)
        # off the solution, so that no term is hidden by being zero there
        y, yp = (x + 0.1 * random.standard_normal(len(x)) for x in (y, yp))
        t, cj = 0.3, 1.7
        expected = difference_quotient(
            lambda d, y=y, yp=yp, t=t, cj=cj: residual([t], y + d, yp + cj * d)[0], np.zeros(len(y)), step=1e-3
        )
        found = dense(program.rows, program.columns, jacobian([t], y, yp, [cj])[0], (program.size, program.size))
        assert np.max(np.abs(found - expected)) < 1e-9 * np.max(np.abs(expected))


@pytest.mark.sample(32)
@pytest.mark.parametrize(("name", "form", "level"), EVERY_SCENE_AND_FORM)
def test_residual_vanishes_at_consistent_states(name: str, form: str, level: str) -> None:
    # states packed from the balance of forces, which the residual is not made of
    prepared = prepare(SCENES[name](), form, level)
    program = prepared.plan.program
    residual = prepared.bound(program.residual)
    for q, u in [(prepared.q, prepared.u), *nearby_states(prepared, 3)]:
        y, yp = packed(prepared, q, u)
        size = max(1.0, float(np.max(np.abs(yp))), float(np.max(np.abs(y))))
        assert np.max(np.abs(residual([prepared.time], y, yp)[0])) < 1e-11 * size


@pytest.mark.sample(24)
@pytest.mark.parametrize(("name", "form", "level"), EVERY_SCENE_AND_FORM)
def test_algebraic_unknowns_are_those_without_a_derivative(name: str, form: str, level: str) -> None:
    prepared = prepare(SCENES[name](), form, level)
    program = prepared.plan.program
    residual = prepared.bound(program.residual)
    (q, u), *_ = nearby_states(prepared, 1)
    y, yp = packed(prepared, q, u)
    y, yp = y + 0.01, yp + 0.01
    slope = difference_quotient(lambda d: residual([0.3], y, yp + d)[0], np.zeros(len(y)), step=1e-3)
    silent = np.flatnonzero(np.max(np.abs(slope), axis=0) < 1e-9)
    assert tuple(silent) == program.algebraic
    # the index is at most two: in the reduced form and at index 1, dF/dy + cj dF/dy' stays regular for large cj
    if level != "ggl" or form == "reduced":
        whole = dense(
            program.rows,
            program.columns,
            prepared.bound(program.jacobian)([0.3], y, yp, [1e4])[0],
            slope.shape,
        )
        assert np.linalg.matrix_rank(whole / np.max(np.abs(whole), axis=1)[:, None]) == program.size


@pytest.mark.sample(18)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", GENERAL)
def test_levels_of_constraints_are_derivatives_of_each_other(name: str, form: str) -> None:
    prepared = prepare(SCENES[name](), form)
    balance = prepared.plan.balance
    if not balance.constraints:
        return
    random = np.random.default_rng(3)
    n, t = len(prepared.u), 0.7
    still, held = np.zeros(n), list(balance.holonomic)
    for q, u in nearby_states(prepared, 2):
        q = q + 0.05 * random.standard_normal(len(q))  # levels belong together off the constraints, too
        a = random.standard_normal(n)
        now = balance.at(t, q, u)
        slope = difference_quotient(
            lambda d, q=q, u=u: balance.at(t, moved(prepared, q, d, still, 1.0, t), u).value[held],
            np.zeros(n),
            step=1e-3,
        )
        assert np.max(np.abs(now.jacobian[held] - slope)) < 1e-9 * max(1.0, float(np.max(np.abs(slope))))
        rate = difference_quotient(
            lambda h, q=q, u=u: balance.at(t + h[0], moved(prepared, q, u, still, h[0], t), u).value[held],
            np.zeros(1),
            step=1e-3 / max(1.0, float(np.max(np.abs(u)))),
        )
        assert np.max(np.abs(now.rate[held] - rate[:, 0])) < 1e-8 * max(1.0, float(np.max(np.abs(u))))
        assert np.max(np.abs(now.rate - now.jacobian @ u - now.explicit_rate)) < 1e-12 * max(
            1.0, np.max(np.abs(now.rate))
        )
        path = lambda h, q=q, u=u, a=a: balance.at(t + h, moved(prepared, q, u, a, h, t), u + h * a).rate  # noqa: E731
        # Steps so short that what turns fastest hardly turns within one.
        step = 1e-3 / max(1.0, float(np.max(np.abs(u))))
        second = difference_quotient(lambda h, path=path: path(h[0]), np.zeros(1), step=step)[:, 0]
        assert np.max(np.abs(now.jacobian @ a + now.gamma - second)) < 1e-8 * max(1.0, float(np.max(np.abs(u))) ** 2)
