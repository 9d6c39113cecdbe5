"""Runs as functions of JAX and PyTorch."""

import sys

import numpy as np
import pytest
from tests.study.sensitivities.test_inputs import NODES, pendulum

from atwood import AtwoodError, UsageError, as_jax, as_torch, sensitivities
from atwood.study.sensitivities.frameworks import RunFunction
from atwood_library.scenes import BouncingBall, DoublePendulum

WANTED = {
    "quantities": ["bob2.position.x", "rod1.tension"],
    "parameters": ["mass1", "length1"],
    "start": ["rod1.angle"],
    "t_end": 1.0,
    "outputs": [0.5, 1.0],
}


def plain(scene, quantities, parameters=(), start=(), inputs=(), t_end=None, outputs=5):
    """Return a run as a function without a framework."""
    from atwood import assemble

    about = tuple(quantities), tuple(parameters), tuple(start), inputs, "linear", t_end, outputs, 1e-11
    return RunFunction(lambda one: one.at, assemble(scene), *about)


def test_without_a_framework():
    function = plain(DoublePendulum(), **WANTED)
    assert function.by == ("mass1", "length1", "rod1.angle")
    values = function.values * 1.1
    weights = np.array([[1.0, -2.0], [0.5, 0.3]])
    gradient = function.back(values, weights)
    for k in range(3):
        step = 1e-4 * np.eye(3)[k]
        slopes = [
            np.sum(weights * (function(values + h * step) - function(values - h * step))) / (2e-4 * h) for h in (1, 2)
        ]
        assert gradient[k] == pytest.approx((4.0 * slopes[0] - slopes[1]) / 3.0, abs=1e-6)


def test_of_inputs_and_of_a_run_with_events():
    scene, rows = pendulum(rope=True), {"push.value": NODES}
    function = plain(scene, ["bob.position.x"], ["bob.mass"], inputs=rows, t_end=1.2, outputs=4)
    found = sensitivities(
        scene, ["bob.position.x"], parameters=["bob.mass"], inputs=rows, t_end=1.2, rtol=1e-11, outputs=4
    )
    assert function.by == found.by
    assert function(function.values).shape == (1, 4)
    assert function.back(function.values, np.array([[0.0, 0.0, 0.0, 1.0]])) == pytest.approx(
        found.at_end()[0], abs=1e-8
    )
    moved = function.values + np.array([0.0, 0.1, 0.0, 0.0, 0.0])
    assert function(moved)[0, -1] != pytest.approx(function(function.values)[0, -1], abs=1e-4)


def test_refuses():
    function = plain(BouncingBall(), ["ball.position.z"], ["height"], t_end=0.8)
    for values in (np.zeros(2), np.array([np.nan])):
        with pytest.raises(UsageError, match="height"):
            function(values)


@pytest.mark.parametrize(("make", "name"), [(as_jax, "jax"), (as_torch, "torch")])
def test_names_what_is_missing(make, name, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(AtwoodError, match=f"{name} is not installed.*pip install {name}"):
        make(DoublePendulum(), **WANTED)


def test_of_jax():
    jax = pytest.importorskip("jax", reason="JAX is not installed: pip install jax")
    jax.config.update("jax_enable_x64", True)
    function = as_jax(DoublePendulum(), **WANTED, rtol=1e-11)
    near = sensitivities(DoublePendulum(), **WANTED, rtol=1e-11).derivatives
    jacobian = jax.jacrev(jax.jit(function))(function.values)
    assert np.asarray(jacobian).transpose(0, 2, 1) == pytest.approx(near, abs=1e-8)
    cost = jax.grad(lambda scale: (function(scale * function.values) ** 2).sum())(1.0)
    values = function(function.values)
    assert cost == pytest.approx(float(np.einsum("qt,qkt,k->", 2.0 * values, near, function.values)), rel=1e-7)
    several = jax.vmap(function)(np.stack([function.values, 1.1 * function.values]))
    assert several[1] == pytest.approx(np.asarray(function(1.1 * function.values)), abs=1e-12)


def test_of_torch():
    torch = pytest.importorskip("torch", reason="PyTorch is not installed: pip install torch")
    function = as_torch(DoublePendulum(), **WANTED, rtol=1e-11)
    values = torch.tensor(function.values, requires_grad=True)
    near = sensitivities(DoublePendulum(), **WANTED, rtol=1e-11).derivatives
    (function(values) ** 2).sum().backward()
    wanted = np.einsum("qt,qkt->k", 2.0 * function(values).detach().numpy(), near)
    assert values.grad.numpy() == pytest.approx(wanted, rel=1e-7)
    jacobian = torch.autograd.functional.jacobian(function, values.detach())
    assert jacobian.numpy().transpose(0, 2, 1) == pytest.approx(near, abs=1e-8)
    single = function(torch.tensor(function.values, dtype=torch.float32))
    assert single.dtype == torch.float32
