"""Contact, impact and dry friction beside MuJoCo, Drake, Exudyn and pymunk: milliseconds for an error.

A block that slides up a slope and stays, a ball that bounces, a ball that slides and then rolls: the place at the end
against closed forms, at fixed steps of each package and at tolerances of Atwood. A case that a package has no law for
is left out.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from timing import best_of, options, peer, print_table, save

from atwood import Scene, assemble, simulate
from atwood_library import BallContact, Ground, PointContact, PointMass, RigidBody

G, SLOPE, FRICTION, ROLLING, RESTITUTION, RADIUS = 9.81, 0.3, 0.4, 0.2, 0.9, 0.1
ENDS = {"slope": 10.0, "bounce": 3.0, "roll": 2.0}
STEPS = (1e-2, 1e-3, 1e-4)
Run = Callable[[float], tuple[float, float]]


def answers() -> dict[str, float]:
    """Return the places at the ends: along the slope, above the floor, along the floor."""
    slope = 0.5 / (G * (math.sin(SLOPE) + FRICTION * math.cos(SLOPE)))
    t, speed = math.sqrt(2.0 / G), math.sqrt(2.0 * G) * RESTITUTION
    while t + 2.0 * speed / G < ENDS["bounce"]:
        t, speed = t + 2.0 * speed / G, speed * RESTITUTION
    late = ENDS["bounce"] - t
    rolls = 2.0 * 8.0 / (7.0 * ROLLING * G)
    run = 8.0 * rolls - 0.5 * ROLLING * G * rolls**2 + 40.0 / 7.0 * (ENDS["roll"] - rolls)
    return {"slope": slope, "bounce": speed * late - 0.5 * G * late**2, "roll": run}


def timed(work: Callable[[], object], place: Callable[[], float]) -> tuple[float, float]:
    """Return the seconds of a run and the place at its end."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began, float(place())


# -- Atwood -------------------------------------------------------------------------------------------------------


def atwood_runs() -> dict[str, Run]:
    """Return Atwood's runs, each of a tolerance: a call of `simulate` on what is assembled, outputs at the ends."""

    def on_slope() -> tuple[Scene, str]:
        scene, (c, s) = Scene(gravity=G), (math.cos(SLOPE), math.sin(SLOPE))
        ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=2.0))
        contact = scene.add("c", PointContact(normal=(-s, 0.0, c), friction=FRICTION))
        scene.connect(ground.frame, contact.plane)
        scene.connect(mass.point, contact.point)
        scene.start.update({"m.position.x": 0.0, "m.position.z": 0.0, "m.velocity.x": c, "m.velocity.z": s})
        return scene, "m.position.x"

    def bouncing() -> tuple[Scene, str]:
        scene = Scene(gravity=G)
        ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
        contact = scene.add("c", PointContact(restitution=RESTITUTION))
        scene.connect(ground.frame, contact.plane)
        scene.connect(mass.point, contact.point)
        scene.start.update({"m.position.x": 0.0, "m.position.z": 1.0, "m.velocity.x": 0.0, "m.velocity.z": 0.0})
        return scene, "m.position.z"

    def rolling() -> tuple[Scene, str]:
        scene = Scene(gravity=G)
        ground = scene.add("ground", Ground())
        body = scene.add("m", RigidBody(mass=1.0, moments=(0.4 * RADIUS**2,) * 3))
        contact = scene.add("c", BallContact(radius=RADIUS, friction=ROLLING))
        scene.connect(ground.frame, contact.plane)
        scene.connect(body.frame, contact.ball)
        still = dict.fromkeys(("angle", "velocity.z", "angular_velocity.y", "position.x"), 0.0)
        scene.start.update({f"m.{name}": value for name, value in still.items()})
        scene.start.update({"m.velocity.x": 8.0, "m.position.z": RADIUS})
        return scene, "m.position.x"

    def run_of(name: str, make: Callable[[], tuple[Scene, str]], share: float) -> Run:
        scene, path = make()
        assembly, end = assemble(scene), ENDS[name]

        def run(rtol: float) -> tuple[float, float]:
            kept: list[Any] = []
            work = lambda: kept.append(simulate(assembly, t_end=end, rtol=rtol, outputs=[0.0, end]))  # noqa: E731
            return timed(work, lambda: kept[-1][path][-1] * share)

        return run

    return {
        "slope": run_of("slope", on_slope, 1.0 / math.cos(SLOPE)),
        "bounce": run_of("bounce", bouncing, 1.0),
        "roll": run_of("roll", rolling, 1.0),
    }


# -- other packages, each at a fixed step -------------------------------------------------------------------------


def mujoco_runs(mujoco: Any) -> dict[str, Run]:
    """Return MuJoCo's: elliptic cones, contacts as stiff as the step allows; restitution by damping of the contact."""
    damping = -math.log(RESTITUTION) / math.hypot(math.pi, math.log(RESTITUTION))

    def run_of(name: str, gravity: str, body: str, place: int, start: Sequence[float], high: float) -> Run:
        def run(step: float) -> tuple[float, float]:
            stiff = (0.1 / step) ** 2
            solref = f"{-stiff!r} {-2.0 * damping * math.sqrt(stiff)!r}" if name == "bounce" else f"{2.0 * step!r} 1"
            text = (
                f'<mujoco><option timestep="{step!r}" gravity="{gravity}" cone="elliptic" integrator="implicitfast"/>'
                f'<default><geom condim="3" solref="{solref}" solimp="0.99 0.999 0.0001"/></default><worldbody>'
                f'<geom type="plane" size="100 100 1" friction="{FRICTION if name == "slope" else ROLLING} 0 0"/>'
                f'<body pos="0 0 {high!r}"><freejoint/>{body}</body></worldbody></mujoco>'
            )
            model = mujoco.MjModel.from_xml_string(text)
            data = mujoco.MjData(model)
            data.qvel[:] = start
            work = lambda: mujoco.mj_step(model, data, nstep=round(ENDS[name] / step))  # noqa: E731
            return timed(work, lambda: data.qpos[place] - (high - 1.0 if name == "bounce" else 0.0))

        return run

    tilted, down = f"{-G * math.sin(SLOPE)!r} 0 {-G * math.cos(SLOPE)!r}", f"0 0 {-G!r}"
    box = f'<geom type="box" size=".2 .2 .1" mass="2" friction="{FRICTION} 0 0"/>'
    ball = f'<geom type="sphere" size="{RADIUS}" mass="1" friction="{ROLLING} 0 0"/>'
    return {
        "slope": run_of("slope", tilted, box, 0, [1.0, 0, 0, 0, 0, 0], 0.1),
        "bounce": run_of("bounce", down, ball, 2, [0.0] * 6, 1.0 + RADIUS),
        "roll": run_of("roll", down, ball, 0, [8.0, 0, 0, 0, 0, 0], RADIUS),
    }


def drake_runs(drake: Any) -> dict[str, Run]:
    """Return Drake's: discrete, point contact, its convex solver; it has no restitution."""

    def run_of(name: str, gravity: Sequence[float], friction: float, high: float, speed: float) -> Run:
        def run(step: float) -> tuple[float, float]:
            builder, coulomb = drake.DiagramBuilder(), drake.CoulombFriction(friction, friction)
            given = {"contact_model": "point", "discrete_contact_approximation": "sap", "stiction_tolerance": 1e-6}
            plant, _ = drake.AddMultibodyPlant(drake.MultibodyPlantConfig(time_step=step, **given), builder)
            plant.mutable_gravity_field().set_gravity_vector(gravity)
            world, at, none = plant.world_body(), drake.RigidTransform, drake.RigidTransform()
            plant.RegisterCollisionGeometry(world, none, drake.HalfSpace(), "floor", coulomb)
            if name == "slope":
                body = plant.AddRigidBody("b", drake.SpatialInertia.SolidBoxWithMass(2.0, 0.4, 0.4, 0.2))
                feet = [(x, y, 1e-3 - high) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
                shape = drake.Sphere(1e-3)
            else:
                body = plant.AddRigidBody("b", drake.SpatialInertia.SolidSphereWithMass(1.0, RADIUS))
                feet, shape = [(0.0, 0.0, 0.0)], drake.Sphere(RADIUS)
            for i, foot in enumerate(feet):
                plant.RegisterCollisionGeometry(body, at(foot), shape, f"s{i}", coulomb)
            plant.Finalize()
            simulator = drake.Simulator(builder.Build())
            context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
            plant.SetFreeBodyPose(context, body, at([0.0, 0.0, high]))
            plant.SetFreeBodySpatialVelocity(context, body, drake.SpatialVelocity([0, 0, 0], [speed, 0, 0]))
            simulator.Initialize()
            return timed(
                lambda: simulator.AdvanceTo(ENDS[name]),
                lambda: plant.EvalBodyPoseInWorld(context, body).translation()[0],
            )

        return run

    return {
        "slope": run_of("slope", [-G * math.sin(SLOPE), 0.0, -G * math.cos(SLOPE)], FRICTION, 0.1, 1.0),
        "roll": run_of("roll", [0.0, 0.0, -G], ROLLING, RADIUS, 8.0),
    }


def exudyn_runs(exudyn: Any) -> dict[str, Run]:
    """Return Exudyn's: friction with sticking bristles of one coordinate, restitution between spheres."""
    import exudyn.utilities as of

    def settings(end: float, step: float) -> Any:
        chosen = exudyn.SimulationSettings()
        chosen.timeIntegration.numberOfSteps, chosen.timeIntegration.endTime = round(end / step), end
        chosen.timeIntegration.verboseMode, chosen.solutionSettings.writeSolutionToFile = 0, False
        chosen.solutionSettings.sensorsWritePeriod = end
        return chosen

    def slope(step: float) -> tuple[float, float]:
        system = exudyn.SystemContainer().AddSystem()
        earth = system.AddNode(of.NodePointGround())
        node = system.AddNode(of.Node1D(referenceCoordinates=[0], initialCoordinates=[0], initialVelocities=[1]))
        system.AddObject(of.Mass1D(mass=2.0, nodeNumber=node))
        marks = [system.AddMarker(of.MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in (earth, node)]
        system.AddLoad(of.LoadCoordinate(markerNumber=marks[1], load=-2.0 * G * math.sin(SLOPE)))
        data = system.AddNode(of.NodeGenericData(initialCoordinates=[1, 0, 0], numberOfDataCoordinates=3))
        system.AddObject(
            of.CoordinateSpringDamperExt(
                markerNumbers=marks,
                nodeNumber=data,
                stickingStiffness=1e6,
                stickingDamping=1e3,
                dynamicFrictionForce=FRICTION * 2.0 * G * math.cos(SLOPE),
                frictionProportionalZone=0.0,
            )
        )
        system.Assemble()
        chosen, place = settings(ENDS["slope"], step), exudyn.OutputVariableType.Coordinates
        return timed(lambda: system.SolveDynamic(chosen), lambda: system.GetNodeOutput(node, place))

    def bounce(step: float) -> tuple[float, float]:
        system = exudyn.SystemContainer().AddSystem()
        floor = system.AddMarker(of.MarkerBodyRigid(bodyNumber=system.CreateGround(referencePosition=[0, 0, -RADIUS])))
        ball = system.CreateMassPoint(mass=1.0, referencePosition=[0, 0, 1.0 + RADIUS], gravity=[0, 0, -G])
        marks = [floor, system.AddMarker(of.MarkerBodyPosition(bodyNumber=ball))]
        data = system.AddNode(of.NodeGenericData(initialCoordinates=[0.1, 0, 0, 0], numberOfDataCoordinates=4))
        system.AddObject(
            of.ObjectContactSphereSphere(
                markerNumbers=marks,
                nodeNumber=data,
                spheresRadii=[RADIUS, RADIUS],
                contactStiffness=(0.1 / step) ** 2,
                restitutionCoefficient=RESTITUTION,
                impactModel=2,
            )
        )
        system.Assemble()
        chosen, place = settings(ENDS["bounce"], step), exudyn.OutputVariableType.Position
        return timed(
            lambda: system.SolveDynamic(chosen), lambda: system.GetObjectOutputBody(ball, place, [0, 0, 0])[2] - RADIUS
        )

    return {"slope": slope, "bounce": bounce}


def pymunk_runs(pymunk: Any) -> dict[str, Run]:
    """Return pymunk's (Chipmunk): impulses by step, 50 iterations."""

    def run_of(name: str, gravity: tuple[float, float], friction: float, high: float, speed: float) -> Run:
        def run(step: float) -> tuple[float, float]:
            space = pymunk.Space()
            space.gravity, space.iterations, space.collision_slop = gravity, 50, 0.0
            floor = pymunk.Segment(space.static_body, (-100, 0), (100, 0), 0)
            floor.friction = floor.elasticity = 1.0
            body = pymunk.Body(1.0, math.inf if name == "slope" else 0.4 * RADIUS**2)
            body.position, body.velocity = (0.0, high), (speed, 0.0)
            shape = pymunk.Poly.create_box(body, (0.4, 0.2)) if name == "slope" else pymunk.Circle(body, RADIUS)
            shape.friction, shape.elasticity = friction, RESTITUTION if name == "bounce" else 0.0
            space.add(floor, body, shape)

            def work() -> None:
                for _ in range(round(ENDS[name] / step)):
                    space.step(step)

            return timed(work, lambda: body.position.y - RADIUS if name == "bounce" else body.position.x)

        return run

    tilted = -G * math.sin(SLOPE), -G * math.cos(SLOPE)
    return {
        "slope": run_of("slope", tilted, FRICTION, 0.1, 1.0),
        "bounce": run_of("bounce", (0.0, -G), ROLLING, 1.0 + RADIUS, 0.0),
        "roll": run_of("roll", (0.0, -G), ROLLING, RADIUS, 8.0),
    }


PEERS: tuple[tuple[str, str, Callable[[Any], dict[str, Run]]], ...] = (
    ("MuJoCo", "mujoco", mujoco_runs),
    ("Drake", "pydrake.all", drake_runs),
    ("Exudyn", "exudyn", exudyn_runs),
    ("pymunk", "pymunk", pymunk_runs),
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    given = options(__doc__, arguments)
    warnings.simplefilter("ignore", DeprecationWarning)
    known, steps = answers(), STEPS[: 1 if given.quick else None]
    runs = [("Atwood", atwood_runs(), (1e-6, 1e-10))]
    runs += [(name, make(found), steps) for name, module, make in PEERS if (found := peer(module)) is not None]
    measured: dict[str, dict[str, list[tuple[float, float, float]]]] = {name: {} for name in known}
    for name, answer in known.items():
        rows: list[list[object]] = []
        for package, of_package, settings in runs:
            if name not in of_package:
                continue
            for setting in settings:
                run = of_package[name]
                place = run(setting)[1]
                seconds = best_of({"run": lambda run=run, setting=setting: run(setting)[0]}, min(given.repeat, 3))[
                    "run"
                ]
                rows.append([package, setting, 1e3 * seconds, abs(place - answer)])
                measured[name].setdefault(package, []).append((setting, seconds, abs(place - answer)))
        print_table(f"{name}, to {ENDS[name]:g} s", ("package", "step or rtol", "ms", "error, m"), rows)
    save(given.json, {"contact_peers": measured})


if __name__ == "__main__":
    main()
