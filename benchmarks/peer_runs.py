"""Whole runs of the same mechanisms with other packages, as their users would do them."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import peers
from mechanisms import GRAVITY, FloatArray, Mechanism

__all__ = [
    "diffrax_run",
    "drake_run",
    "exudyn_run",
    "heyoka_rates",
    "heyoka_run",
    "kane_run",
    "mujoco_run",
    "pinocchio_rk4_run",
    "pinocchio_run",
]

Run = Callable[[], tuple[float, FloatArray]]


def _start(mechanism: Mechanism) -> FloatArray:
    return np.concatenate([mechanism.angles_at_start(), np.zeros(mechanism.links)])


# -- heyoka -------------------------------------------------------------------------------------------------------


def heyoka_rates(heyoka: Any, mechanism: Mechanism) -> tuple[list[Any], list[Any]]:
    """Return the unknowns (q, u) and their rates as heyoka's expressions, with numbers for the parameters."""
    q, u = ([heyoka.expression(f"{letter}{i}") for i in range(mechanism.links)] for letter in "qu")
    return [*q, *u], _rates(q, u, heyoka.sin, heyoka.cos, mechanism)


def _rates(q: Any, u: Any, sin: Any, cos: Any, mechanism: Mechanism) -> list[Any]:
    """Return the rates of (q, u), in whatever numbers or expressions they come.

    The double pendulum is in closed form; longer chains have the O(N) elimination of the rods' tensions that the C by
    hand has (`hand/chain.c`): heyoka, like JAX, has no models of chains and no linear solver for them.
    """
    n, l, m = mechanism.links, mechanism.length, mechanism.mass
    if n == 2:
        d = q[0] - q[1]
        s, c = sin(d), cos(d)
        r1 = u[1] * u[1] * s + 2.0 * (GRAVITY / l) * sin(q[0])
        r2 = u[0] * u[0] * s - (GRAVITY / l) * sin(q[1])
        over = 1.0 / (2.0 - c * c)
        return [*u, -(r1 + c * r2) * over, (2.0 * r2 + c * r1) * over]
    w = 1.0 / m
    turned = [q[i + 1] - q[i] for i in range(n - 1)]
    ws, wc = [w * sin(d) for d in turned], [w * cos(d) for d in turned]
    tension: list[Any] = []
    slope: list[Any] = []
    above: Any = 0.0
    carried: Any = GRAVITY * cos(q[0])
    for i in range(n):
        over = 1.0 / ((w if i else 0.0) + w - above)
        tension.append((l * u[i] * u[i] + carried) * over)
        if i < n - 1:
            slope.append(wc[i] * over)
            above, carried = wc[i] * slope[i], wc[i] * tension[i]
    for i in range(n - 2, -1, -1):
        tension[i] = tension[i] + slope[i] * tension[i + 1]
    rates = []
    for i in range(n):
        pulled = ws[i] * tension[i + 1] if i < n - 1 else 0.0
        rates.append((pulled - (ws[i - 1] * tension[i - 1] if i else GRAVITY * sin(q[0]))) / l)
    return [*u, *rates]


def heyoka_run(heyoka: Any, mechanism: Mechanism, tolerance: float) -> Run:
    """Return a run with heyoka's Taylor method.

    The first step is a short one of its own: at a start at rest every other coefficient of the series is zero, for
    horizontal links also further ones, and from two of them that are both zero heyoka derives a step without limit.
    """
    symbols, rates = heyoka_rates(heyoka, mechanism)
    start = _start(mechanism)
    method = heyoka.taylor_adaptive(
        list(zip(symbols, rates, strict=True)), start, tol=tolerance, compact_mode=mechanism.links > 10
    )

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        method.time = 0.0
        method.state[:] = start
        method.step(mechanism.t_end / 1000.0)
        outcome = method.propagate_until(mechanism.t_end)[0]
        spent = time.perf_counter() - began
        if outcome != heyoka.taylor_outcome.time_limit:
            raise ArithmeticError(f"heyoka: {outcome}")
        return spent, mechanism.from_angles(method.state)

    return run


# -- Pinocchio ----------------------------------------------------------------------------------------------------


def _pinocchio(
    pinocchio: Any, mechanism: Mechanism
) -> tuple[Callable[[FloatArray, FloatArray], FloatArray], FloatArray]:
    """Return accelerations of the joints by the articulated-body algorithm, and the joints at the start."""
    model = peers.pinocchio_model(pinocchio, mechanism.links, mechanism.length, mechanism.mass)
    data, idle = model.createData(), np.zeros(mechanism.links)
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    start = -np.diff(mechanism.angles_at_start(), prepend=0.0)  # it turns the other way round y
    return lambda q, v: pinocchio.aba(model, data, q, v, idle), start


def pinocchio_run(pinocchio: Any, mechanism: Mechanism, tolerance: float) -> Run:
    """Return a run with Pinocchio's `aba` and SciPy's DOP853."""
    accelerations, joints = _pinocchio(pinocchio, mechanism)
    n = mechanism.links

    def rates(t: float, y: FloatArray) -> FloatArray:
        return np.concatenate([y[n:], accelerations(y[:n], y[n:])])

    return _scipy(rates, np.concatenate([joints, np.zeros(n)]), mechanism, tolerance, lambda y: -np.cumsum(y[:n]))


def pinocchio_rk4_run(pinocchio: Any, mechanism: Mechanism, steps: int) -> Run:
    """Return a run with Pinocchio's `aba` and the classical Runge-Kutta method in Python."""
    accelerations, joints = _pinocchio(pinocchio, mechanism)
    h = mechanism.t_end / steps

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        q, v = joints.copy(), np.zeros(mechanism.links)
        for _ in range(steps):
            a1 = accelerations(q, v)
            v2 = v + 0.5 * h * a1
            a2 = accelerations(q + 0.5 * h * v, v2)
            v3 = v + 0.5 * h * a2
            a3 = accelerations(q + 0.5 * h * v2, v3)
            v4 = v + h * a3
            a4 = accelerations(q + h * v3, v4)
            q = q + h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
            v = v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        return time.perf_counter() - began, mechanism.from_angles(-np.cumsum(q))

    return run


# -- MuJoCo -------------------------------------------------------------------------------------------------------


def mujoco_run(mujoco: Any, mechanism: Mechanism, steps: int) -> Run:
    """Return a run with MuJoCo's Runge-Kutta method of order 4, all steps in one call."""
    step = mechanism.t_end / steps
    model = peers.mujoco_model(mujoco, mechanism.links, mechanism.length, mechanism.mass, step, "RK4")
    data = mujoco.MjData(model)
    start = np.diff(mechanism.angles_at_start(), prepend=0.0)
    mujoco.set_mju_user_warning(lambda text: None)  # it is counted in the data

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        mujoco.mj_resetData(model, data)
        data.qpos[:] = start
        mujoco.mj_step(model, data, nstep=steps)
        spent = time.perf_counter() - began
        if any(warning.number for warning in data.warning):
            raise ArithmeticError("MuJoCo: the simulation is unstable")
        return spent, mechanism.from_angles(np.cumsum(data.qpos))

    return run


# -- Exudyn -------------------------------------------------------------------------------------------------------


def exudyn_run(exudyn: Any, mechanism: Mechanism, steps: int) -> Run:
    """Return a run with Exudyn: a kinematic tree, and its explicit Runge-Kutta method of order 6."""
    mbs = peers.exudyn_tree(exudyn, mechanism.links, mechanism.length, mechanism.mass, mechanism.start)
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = mechanism.t_end
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.explicitIntegration.computeEndOfStepAccelerations = False
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = mechanism.t_end
    settings.displayComputationTime = False

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK67)
        spent = time.perf_counter() - began
        joints = np.asarray(mbs.GetNodeOutput(0, exudyn.OutputVariableType.Coordinates))
        return spent, mechanism.from_angles(-np.cumsum(joints))

    return run


# -- Drake --------------------------------------------------------------------------------------------------------


def drake_run(drake: Any, mechanism: Mechanism, accuracy: float) -> Run:
    """Return a run with Drake: a continuous plant, and its Runge-Kutta method of order 5."""
    plant = peers.drake_plant(drake, mechanism.links, mechanism.length, mechanism.mass)
    simulator = drake.Simulator(plant)
    drake.ResetIntegratorFromFlags(simulator, "runge_kutta5", 0.1 * mechanism.t_end)
    simulator.get_mutable_integrator().set_target_accuracy(accuracy)
    context = simulator.get_mutable_context()
    start = np.diff(mechanism.angles_at_start(), prepend=0.0)

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        context.SetTime(0.0)
        plant.SetPositions(context, start)
        plant.SetVelocities(context, np.zeros(mechanism.links))
        simulator.Initialize()
        simulator.AdvanceTo(mechanism.t_end)
        spent = time.perf_counter() - began
        return spent, mechanism.from_angles(np.cumsum(plant.GetPositions(context)))

    return run


# -- JAX and diffrax ----------------------------------------------------------------------------------------------


@cache
def _diffrax(diffrax: Any, mechanism: Mechanism) -> Callable[[Any, float], Any]:
    """Return what gives the end from the start and a tolerance, compiled once a mechanism."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    n, at_end = mechanism.links, diffrax.SaveAt(t1=True)

    def rates(_: Any, y: Any, __: Any) -> Any:
        return jnp.stack(_rates(y[:n], y[n:], jnp.sin, jnp.cos, mechanism))

    term = diffrax.ODETerm(rates)

    @jax.jit
    def end(start: Any, tolerance: Any) -> Any:
        steps = diffrax.PIDController(rtol=tolerance, atol=tolerance)
        made = diffrax.diffeqsolve(
            term,
            diffrax.Dopri8(),
            0.0,
            mechanism.t_end,
            None,
            start,
            saveat=at_end,
            stepsize_controller=steps,
            max_steps=None,
        )
        return made.ys[-1]

    return end


def diffrax_run(diffrax: Any, mechanism: Mechanism, tolerance: float) -> Run:
    """Return a run with diffrax's Dormand-Prince method of order 8(7), compiled by JAX, in double precision."""
    end, start = _diffrax(diffrax, mechanism), _start(mechanism)

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        found = end(start, tolerance).block_until_ready()
        return time.perf_counter() - began, mechanism.from_angles(np.asarray(found))

    return run


# -- sympy and SciPy ----------------------------------------------------------------------------------------------


def kane_run(mechanism: Mechanism, tolerance: float) -> Run:
    """Return a run with sympy's equations and SciPy's DOP853."""
    rates = peers.kane_chain(mechanism.links, mechanism.length, mechanism.mass)
    return _scipy(rates, _start(mechanism), mechanism, tolerance, lambda y: y[: mechanism.links])


def _scipy(
    rates: Callable[[float, FloatArray], FloatArray],
    start: FloatArray,
    mechanism: Mechanism,
    tolerance: float,
    angles: Callable[[FloatArray], FloatArray],
) -> Run:
    from scipy.integrate import solve_ivp

    def run() -> tuple[float, FloatArray]:
        began = time.perf_counter()
        made = solve_ivp(rates, (0.0, mechanism.t_end), start, method="DOP853", rtol=tolerance, atol=tolerance)
        spent = time.perf_counter() - began
        if not made.success:
            raise ArithmeticError(made.message)
        return spent, mechanism.from_angles(angles(made.y[:, -1]))

    return run
