"""The same mechanisms in other packages: chains of N point masses on massless rods, in their planes."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

__all__ = [
    "drake_plant",
    "exudyn_accelerations",
    "exudyn_tree",
    "kane_chain",
    "mujoco_chain",
    "mujoco_model",
    "pinocchio_chain",
    "pinocchio_model",
]

_TINY = 1e-14
"""Moment of inertia of a point, where a package refuses none, kg m^2."""


@cache
def kane_chain(links: int, length: float, mass: float) -> Callable[[float, Any], Any]:
    """Return the rates of a chain by sympy: Kane's method, lambdify, a solve by NumPy."""
    import sympy as sp
    from sympy.physics import mechanics as me

    q, u = (me.dynamicsymbols(" ".join(f"{x}{i}" for i in range(links)), seq=True) for x in "qu")
    l, m, g = sp.symbols("l m g")
    frame, point = me.ReferenceFrame("N"), me.Point("O")
    point.set_vel(frame, 0)
    masses, loads = [], []
    for i in range(links):
        rod = frame.orientnew(f"R{i}", "Axis", [q[i], -frame.y])
        rod.set_ang_vel(frame, -u[i] * frame.y)
        bob = point.locatenew(f"P{i}", -l * rod.z)
        bob.v2pt_theory(point, frame, rod)
        masses.append(me.Particle(f"B{i}", bob, m))
        loads.append((bob, -m * g * frame.z))
        point = bob
    kane = me.KanesMethod(frame, q_ind=q, u_ind=u, kd_eqs=[q[i].diff() - u[i] for i in range(links)])
    kane.kanes_equations(masses, loads)
    numbers = sp.lambdify([*q, *u, l, m, g], [kane.mass_matrix, kane.forcing], cse=True)

    def rates(t: float, y: Any) -> Any:
        matrix, force = numbers(*y, length, mass, 9.81)
        return np.concatenate([y[links:], np.linalg.solve(matrix, force)[:, 0]])

    return rates


def mujoco_model(mujoco: Any, links: int, length: float, mass: float, step: float, method: str) -> Any:
    """Return MuJoCo's model of a chain, without contacts."""
    bodies = ""
    for i in range(links):
        place = f"0 0 {-length if i else 0.0!r}"
        bodies += f'<body pos="{place}"><joint type="hinge" axis="0 -1 0"/>'
        bodies += f'<inertial pos="0 0 {-length!r}" mass="{mass!r}" diaginertia="{_TINY} {_TINY} {_TINY}"/>'
    text = (
        f'<mujoco><option timestep="{step!r}" integrator="{method}" gravity="0 0 -9.81">'
        '<flag contact="disable"/></option><compiler angle="radian"/><worldbody>'
        f"{bodies}{'</body>' * links}</worldbody></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(text)


def mujoco_chain(mujoco: Any, links: int) -> Callable[[], float]:
    """Return what measures the seconds of one step of MuJoCo (Euler, no contacts), many from one call."""
    model = mujoco_model(mujoco, links, 1.0 / links, 1.0 / links, 1e-5, "Euler")
    data = mujoco.MjData(model)
    data.qpos[0] = 1.0

    def measure() -> float:
        began = time.perf_counter()
        mujoco.mj_step(model, data, nstep=2000)
        return (time.perf_counter() - began) / 2000

    return measure


def pinocchio_model(pinocchio: Any, links: int, length: float, mass: float) -> Any:
    """Return Pinocchio's model of a chain."""
    model, joint = pinocchio.Model(), 0
    for i in range(links):
        place = pinocchio.SE3(np.eye(3), np.array([0.0, 0.0, -length if i else 0.0]))
        joint = model.addJoint(joint, pinocchio.JointModelRY(), place, f"j{i}")
        bob = pinocchio.Inertia(mass, np.array([0.0, 0.0, -length]), np.zeros((3, 3)))
        model.appendBodyToJoint(joint, bob, pinocchio.SE3.Identity())
    return model


def pinocchio_chain(pinocchio: Any, links: int) -> Callable[[], float]:
    """Return what measures the seconds of Pinocchio's articulated-body algorithm, called from Python."""
    model = pinocchio_model(pinocchio, links, 1.0 / links, 1.0 / links)
    data, q, v, tau = model.createData(), np.full(links, 0.1), np.full(links, 0.2), np.zeros(links)

    def measure() -> float:
        began = time.perf_counter()
        for _ in range(1000):
            pinocchio.aba(model, data, q, v, tau)
        return (time.perf_counter() - began) / 1000

    return measure


def drake_plant(drake: Any, links: int, length: float, mass: float) -> Any:
    """Return Drake's continuous plant of a chain."""
    plant = drake.MultibodyPlant(time_step=0.0)
    point = drake.RotationalInertia(_TINY, _TINY, _TINY)
    bob = drake.SpatialInertia.MakeFromCentralInertia(mass, [0.0, 0.0, -length], point)
    above = plant.world_frame()
    for i in range(links):
        body = plant.AddRigidBody(f"b{i}", bob)
        place = drake.RigidTransform([0.0, 0.0, -length if i else 0.0])
        hinge = plant.AddFrame(drake.FixedOffsetFrame(f"h{i}", above, place))
        plant.AddJoint(drake.RevoluteJoint(f"j{i}", hinge, body.body_frame(), [0.0, -1.0, 0.0]))
        above = body.body_frame()
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -9.81])
    plant.Finalize()
    return plant


def exudyn_tree(exudyn: Any, links: int, length: float, mass: float, start: float) -> Any:
    """Return Exudyn's system with a kinematic tree, all links at one angle at the start."""
    from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree

    mbs = exudyn.SystemContainer().AddSystem()
    initial = np.zeros(links)
    initial[0] = -start  # it turns the other way round y
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=np.zeros(links),
            initialCoordinates=initial,
            initialCoordinates_t=np.zeros(links),
            numberOfODE2Coordinates=links,
        )
    )
    turns, offsets = exudyn.Matrix3DList(), exudyn.Vector3DList()
    inertias, centres = exudyn.Matrix3DList(), exudyn.Vector3DList()
    for i in range(links):
        turns.Append(np.eye(3))
        offsets.Append(np.array([0.0, 0.0, -length if i else 0.0]))
        inertias.Append(np.zeros((3, 3)))
        centres.Append(np.array([0.0, 0.0, -length]))
    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exudyn.JointType.RevoluteY] * links,
            linkParents=list(range(-1, links - 1)),
            jointTransformations=turns,
            jointOffsets=offsets,
            linkInertiasCOM=inertias,
            linkCOMs=centres,
            linkMasses=[mass] * links,
            gravity=[0.0, 0.0, -9.81],
            baseOffset=[0.0, 0.0, 0.0],
        )
    )
    mbs.Assemble()
    return mbs


def exudyn_accelerations(exudyn: Any, links: int) -> Callable[[], float]:
    """Return what measures the seconds of one evaluation in Exudyn: a step of Euler's explicit method, many a run."""
    mbs, steps = exudyn_tree(exudyn, links, 1.0 / links, 1.0 / links, 1.0), 1000 if links < 50 else 50
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = steps * 1e-6
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.explicitIntegration.computeEndOfStepAccelerations = False
    settings.solutionSettings.writeSolutionToFile = False

    def measure() -> float:
        began = time.perf_counter()
        mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.ExplicitEuler)
        return (time.perf_counter() - began) / steps

    return measure
