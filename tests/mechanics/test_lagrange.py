"""The balance of forces against Lagrange's equations, done with differences of the energies."""

from typing import Any

import numpy as np
import pytest

from atwood.arrays import FloatArray
from atwood.forms.quantities import energy_program, known_program
from atwood.mechanics.outputs.part_power import applied_power
from atwood.result.energy import POWER
from atwood.simulation.dynamics.reactions import accelerations_and_multipliers, maximal_state
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS, GENERAL, Prepared, difference_quotient, moved, nearby_states, prepare

EVERY_SCENE_AND_FORM = [(name, form) for name in GENERAL for form in FORMS]


def short(u: FloatArray, a: FloatArray) -> float:
    """Return a time in which nothing turns or speeds up much."""
    return 1e-3 / max(1.0, float(np.max(np.abs(u))), float(np.max(np.abs(a))) ** 0.5)


def dampers(prepared: Prepared) -> bool:
    """Return whether anything takes energy out."""
    return any(local.dissipations for local in prepared.assembly.mechanism.locals_.values())


def energies(prepared: Prepared, t: float, q: FloatArray, u: FloatArray) -> tuple[float, float]:
    assembly = prepared.assembly
    kernel = assembly.kernel(energy_program(assembly))
    kinetic, potential = kernel([t], q, u, np.zeros_like(u), [0.0] * len(assembly.reactions))[0]
    return kinetic, potential


@pytest.mark.sample(20)
@pytest.mark.parametrize(("name", "form"), EVERY_SCENE_AND_FORM)
def test_rows_are_lagranges_equations(name: str, form: str) -> None:
    # d/dt dT/du - dT/dq + dV/dq, time derivatives along (u, a); Goldstein, equation 1.57
    prepared = prepare(SCENES[name](), form)
    if prepared.assembly.own_equations.orientation_coordinates or dampers(prepared):
        return  # speeds that are no rates of coordinates, forces that have no potential: see the balance of power below
    balance, t = prepared.plan.balance, 0.4
    n = len(prepared.q)
    random = np.random.default_rng(5)

    def kinetic(t: float, q: FloatArray, u: FloatArray) -> float:
        return energies(prepared, t, q, u)[0]

    def momentum(t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        return difference_quotient(lambda d: kinetic(t, q, u + d), np.zeros(n), step=1e-2)

    def lagrange(t: float, q: FloatArray, u: FloatArray, a: FloatArray) -> Any:
        rate = difference_quotient(
            lambda h: momentum(t + h[0], q + h[0] * u + 0.5 * h[0] ** 2 * a, u + h[0] * a), np.zeros(1), step=2e-3
        )[:, 0]
        slope = difference_quotient(
            lambda d: kinetic(t, q + d, u) - energies(prepared, t, q + d, u)[1], np.zeros(n), step=2e-3
        )
        return rate - slope

    for q, u in nearby_states(prepared, 2):
        a = random.standard_normal(n)
        now = balance.at(t, q, u)
        expected = lagrange(t, q, u, a)
        assert np.max(np.abs(now.mass @ a + now.bias - expected)) < 2e-7 * max(1.0, np.max(np.abs(expected)))


@pytest.mark.sample(20)
@pytest.mark.parametrize(("name", "form"), EVERY_SCENE_AND_FORM)
def test_mass_matrix_is_symmetric_and_carries_the_kinetic_energy(name: str, form: str) -> None:
    prepared = prepare(SCENES[name](), form)
    for q, u in nearby_states(prepared, 3):
        now = prepared.plan.balance.at(0.0, q, u)
        assert np.max(np.abs(now.mass - now.mass.T)) < 1e-12 * np.max(np.abs(now.mass))
        if name in ("driven-pendulum", "foucault-pendulum", "rolling-ball") and form == "reduced":
            continue  # what moves as prescribed has kinetic energy of its own
        kinetic, _ = energies(prepared, 0.0, q, u)
        assert kinetic == pytest.approx(0.5 * u @ now.mass @ u, rel=1e-12)


@pytest.mark.sample(20)
@pytest.mark.parametrize(("name", "form"), EVERY_SCENE_AND_FORM)
def test_power_balance_at_any_state(name: str, form: str) -> None:
    # the energy changes by the work of drives alone, at admissible states whatever they are
    prepared = prepare(SCENES[name](), form)
    balance, t = prepared.plan.balance, prepared.time
    for q, u in nearby_states(prepared, 3):
        a, multipliers = balance.accelerate(t, q, u, prepared.plan.kept)
        change = difference_quotient(
            lambda h, q=q, u=u, a=a: [
                sum(energies(prepared, t + h[0], moved(prepared, q, u, a, h[0], t), u + h[0] * a))
            ],
            np.zeros(1),
            step=short(u, a),
        )[0, 0]
        now = balance.at(t, q, u)
        kept = slice(None) if prepared.plan.kept is None else prepared.plan.kept
        power = -multipliers @ now.explicit_rate[kept] if balance.constraints else 0.0
        if dampers(prepared):
            assembly = prepared.assembly
            program = known_program(assembly, POWER, lambda a=assembly: [applied_power(a.mechanism, a.own_equations)])
            power += assembly.kernel(program)([t], q, u, a, [0.0] * len(assembly.reactions))[0][0]
        if name == "foucault-pendulum":
            continue  # its drive works, and nothing says how much
        if name == "driven-pendulum" and form == "reduced":
            # at t = 0 the drive moves at amplitude times angular frequency
            power = _drive_force(prepared, q, u, "drive.force.x") * 0.1 * 2.5
        if name == "rolling-ball" and form == "reduced":
            power = _drive_force(prepared, q, u, "table.motor_torque") * SCENES[name]().rate
        size = max(1.0, abs(energies(prepared, t, q, u)[0]), abs(power))
        assert change == pytest.approx(power, abs=2e-6 * size)


def _drive_force(prepared: Prepared, q: FloatArray, u: FloatArray, path: str) -> float:
    from atwood.simulation.dynamics.reactions import ReactionSolver

    solver = ReactionSolver(prepared.assembly, prepared.time, q, u)
    values, _ = solver.at(np.array([prepared.time]), q[:, None], u[:, None])
    index = [one.path for one in prepared.assembly.reactions].index(path)
    return float(values[index, 0])


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", GENERAL)
def test_reduced_and_maximal_accelerations_are_the_same_motion(name: str) -> None:
    prepared = prepare(SCENES[name](), "reduced")
    assembly = prepared.assembly
    kept = np.asarray(prepared.plan.finding.kept, dtype=np.intp)
    for q, u in nearby_states(prepared, 3):
        t = np.array([0.6])
        if name not in ("driven-pendulum", "foucault-pendulum"):
            t = np.array([0.0])
        a, _, _ = accelerations_and_multipliers(assembly, "reduced", t, q[:, None], u[:, None], kept)
        big_q, big_u = maximal_state(assembly, t, q[:, None], u[:, None])
        every = np.asarray(prepare(SCENES[name](), "dae").plan.finding.kept, dtype=np.intp)
        big_a, _, _ = accelerations_and_multipliers(assembly, "dae", t, big_q, big_u, every)

        def along(h: FloatArray, t: Any = t, q: Any = q, u: Any = u, a: Any = a) -> FloatArray:
            step = float(h[0])
            q_then, u_then = moved(prepared, q, u, a[:, 0], step, float(t[0])), u + step * a[:, 0]
            return maximal_state(assembly, t + step, q_then[:, None], u_then[:, None])[1][:, 0]

        step = short(u, a)
        expected = difference_quotient(along, np.zeros(1), step=step)[:, 0]
        scale = max(1.0, float(np.max(np.abs(expected))), float(np.max(np.abs(u))) ** 2)
        assert np.max(np.abs(big_a[:, 0] - expected)) < 3e-8 * scale
