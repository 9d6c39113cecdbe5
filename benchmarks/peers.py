"""The same mechanisms in other packages."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

__all__ = ["kane_double_pendulum", "mujoco_chain", "pinocchio_chain"]


@cache
def kane_double_pendulum() -> Callable[[float, Any], Any]:
    """Return the rates of the double pendulum (m = l = 1) by sympy: Kane's method, lambdify, a solve by NumPy."""
    import sympy as sp
    from sympy.physics import mechanics as me

    q, u = me.dynamicsymbols("q0 q1"), me.dynamicsymbols("u0 u1")
    g = sp.Symbol("g")
    frame, point = me.ReferenceFrame("N"), me.Point("O")
    point.set_vel(frame, 0)
    masses, loads = [], []
    for i in range(2):
        rod = frame.orientnew(f"R{i}", "Axis", [q[i], -frame.y])
        rod.set_ang_vel(frame, -u[i] * frame.y)
        bob = point.locatenew(f"P{i}", -rod.z)
        bob.v2pt_theory(point, frame, rod)
        masses.append(me.Particle(f"B{i}", bob, sp.Integer(1)))
        loads.append((bob, -g * frame.z))
        point = bob
    kane = me.KanesMethod(frame, q_ind=q, u_ind=u, kd_eqs=[q[i].diff() - u[i] for i in range(2)])
    kane.kanes_equations(masses, loads)
    numbers = sp.lambdify([*q, *u, g], [kane.mass_matrix, kane.forcing], cse=True)

    def rates(t: float, y: Any) -> Any:
        mass, force = numbers(*y, 9.81)
        return np.concatenate([y[2:], np.linalg.solve(mass, force)[:, 0]])

    return rates


def mujoco_chain(mujoco: Any, links: int) -> Callable[[], float]:
    """Return what measures the seconds of one step of MuJoCo (Euler, no contacts), many from one call."""
    import time

    length, bodies = 1.0 / links, ""
    for i in range(links):
        place = f"0 0 {-length if i else 0.0}"
        bodies += f'<body pos="{place}"><joint type="hinge" axis="0 -1 0"/>'
        bodies += f'<inertial pos="0 0 {-length}" mass="{1.0 / links}" diaginertia="1e-9 1e-9 1e-9"/>'
    text = (
        '<mujoco><option timestep="1e-5"><flag contact="disable"/></option><worldbody>'
        f"{bodies}{'</body>' * links}</worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[0] = 1.0

    def measure() -> float:
        began = time.perf_counter()
        mujoco.mj_step(model, data, nstep=2000)
        return (time.perf_counter() - began) / 2000

    return measure


def pinocchio_chain(pinocchio: Any, links: int) -> Callable[[], float]:
    """Return what measures the seconds of Pinocchio's articulated-body algorithm, called from Python."""
    import time

    model, joint = pinocchio.Model(), 0
    length = 1.0 / links
    for i in range(links):
        place = pinocchio.SE3(np.eye(3), np.array([0.0, 0.0, -length if i else 0.0]))
        joint = model.addJoint(joint, pinocchio.JointModelRY(), place, f"j{i}")
        bob = pinocchio.Inertia(1.0 / links, np.array([0.0, 0.0, -length]), np.zeros((3, 3)))
        model.appendBodyToJoint(joint, bob, pinocchio.SE3.Identity())
    data, q, v, tau = model.createData(), np.full(links, 0.1), np.full(links, 0.2), np.zeros(links)

    def measure() -> float:
        began = time.perf_counter()
        for _ in range(1000):
            pinocchio.aba(model, data, q, v, tau)
        return (time.perf_counter() - began) / 1000

    return measure
