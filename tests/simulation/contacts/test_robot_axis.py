"""One axis of Modelica's robot, with friction at its motor, against matrix exponentials from one change to the next."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from tests.references.modelica.robot import one_axis

from atwood import simulate

END, STEP = 1.4981, 1e-4
RATIO, STIFFNESS, DAMPING, LOAD, ROTOR, MOST, VISCOUS = 210.0, 8.0, 0.01, 1.14**2 * 15.0, 0.0013, 0.5, 0.1 / 130.0
K, W, D = 1.1616, 5500.0, 0.6
UP, SLOW, GAINING = 3.0 / 10.0, math.radians(120.0) / 3.0, RATIO * 10.0
INTEGRAL, VOLTAGE, CURRENT, ANGLE, SPEED, PLACE, LOADED, GOAL, GOING, GAIN, ONE = range(11)
UNIT = np.eye(11)
SPRING = STIFFNESS * (RATIO * UNIT[PLACE] - UNIT[ANGLE]) + DAMPING * (RATIO * UNIT[LOADED] - UNIT[SPEED])
PUSH = K * UNIT[CURRENT] + SPRING
"""The torques on the rotor but for friction, as rows."""


def motion(way: int) -> np.ndarray:
    """Return the matrix of the motion while the rotor sticks (0), or slips one way or the other."""
    a = np.zeros((11, 11))
    behind = 5.0 * (UNIT[GOAL] - UNIT[ANGLE]) + UNIT[GOING] - UNIT[SPEED]
    a[INTEGRAL] = behind / 0.05
    a[VOLTAGE] = (UNIT[CURRENT] - 0.5 * (behind + UNIT[INTEGRAL])) * W / (0.04 * D)
    a[CURRENT] = -(5.0 * UNIT[VOLTAGE] + 250.0 * UNIT[CURRENT] + K * UNIT[SPEED]) * 2.0 * D * W / 250.0
    a[ANGLE], a[PLACE], a[GOAL], a[GOING] = UNIT[SPEED], UNIT[LOADED], UNIT[GOING], UNIT[GAIN]
    a[LOADED] = -RATIO * SPRING / LOAD
    if way:
        a[SPEED] = (PUSH - VISCOUS * UNIT[SPEED] - way * MOST * UNIT[ONE]) / ROTOR
    return a


def set_goal(z: np.ndarray, t: float, phase: int) -> None:
    """Set where the rotor should be, its rate and second rate."""
    first, between, last = min(t, UP), min(max(t - UP, 0.0), SLOW - UP), min(max(t - SLOW, 0.0), UP)
    z[GOAL] = GAINING * (0.5 * first * first + UP * between + UP * last - 0.5 * last * last)
    z[GOING], z[GAIN] = GAINING * (first - last), GAINING * (1.0, 0.0, -1.0, 0.0)[phase]


def piece_by_piece() -> tuple[list[float], np.ndarray]:
    """Return when the friction changes, and the state at the end."""
    z, t, way, found = UNIT[ONE].copy(), 0.0, 0, list[float]()
    steps = {one: expm(motion(one) * STEP) for one in (-1, 0, 1)}

    def room(state: np.ndarray) -> float:
        """Return what is positive until friction changes."""
        return float(way * state[SPEED] if way else MOST - abs(PUSH @ state))

    for phase, until in enumerate((UP, SLOW, SLOW + UP, END)):
        while t < until:
            set_goal(z, t, phase)
            a, span = motion(way), min(STEP, until - t)
            after = (steps[way] if span == STEP else expm(a * span)) @ z
            if room(after) > 0.0:
                z, t = after, until if span < STEP else t + span
                continue
            at = z
            span = brentq(lambda h: room(expm(a * h) @ at), 1e-9 * STEP, span, xtol=1e-16, rtol=1e-14)  # noqa: B023
            z, t = expm(a * span) @ z, t + span
            found.append(t)
            torque = float(PUSH @ z)
            if way:
                z[SPEED] = 0.0
            way = 0 if way and abs(torque) < MOST else int(math.copysign(1.0, torque))
    return found, z


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_an_axis_of_modelica_s_robot_slips_turns_round_and_sticks(form: str) -> None:
    changes, end = piece_by_piece()
    result = simulate(one_axis(), form=form, t_end=END, rtol=1e-11, outputs=[0.0, END])
    assert [one.kind for one in result.events] == ["slips", "reverses", "sticks", "slips", "sticks", "slips"]
    assert [one.time for one in result.events] == pytest.approx(changes, abs=1e-9)
    quantities = "controller1.integral motor1.voltage motor1.current rotor1.angle rotor1.angular_velocity load.angle"
    found = [float(result[path][-1]) for path in quantities.split()]
    assert found == pytest.approx(end[:6].tolist(), rel=1e-8, abs=1e-9)
