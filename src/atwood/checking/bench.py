"""A test bench: bodies on all connectors of a component, so that it can be run in both forms."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood.consistency.trials import Pose, Trial
from atwood.model.compose.scene import Scene
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Frame, Groove, JointCoordinate, Point, Shaft, Slide, connector
from atwood.model.declare.field_functions import parameter
from atwood.model.declare.law_results import BodyInertia, Placement, PointInertia
from atwood.model.declare.laws import Law, constraint, inertia, joint, observable
from atwood.model.values.rotation import normals, turn
from atwood.model.values.space import Vector, as_vector, dot


class Weight(Component):
    """What has a mass, and one end."""

    mass: float = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    end: Point = connector(Point, "The point.")

    @observable(unit="m", doc="Position.")
    def position(self) -> Vector:
        """Return the position."""
        return self.end.position

    @observable(unit="m/s", doc="Velocity.")
    def velocity(self) -> Vector:
        """Return the velocity."""
        return self.end.velocity


class Ball(Weight):
    """A point mass."""

    @inertia
    def material_point(self) -> Iterable[PointInertia]:
        """Return the inertia."""
        yield PointInertia((self.end,), ((self.mass,),))


class PulleyBall(Ball):
    """A point mass that carries the groove of a pulley."""

    end: Groove = connector(Groove, "The groove.")


class Block(Weight):
    """A rigid body."""

    size: float = parameter(1.0, unit="m", above=0.0, doc="Radius of gyration, about.")
    end: Frame = connector(Frame, "The frame.")

    @inertia
    def rigid_body(self) -> Iterable[BodyInertia]:
        """Return the inertia."""
        j = self.mass * self.size * self.size
        tensor = ((1.1 * j, 0.1 * j, 0.0), (0.1 * j, 0.9 * j, 0.05 * j), (0.0, 0.05 * j, 1.2 * j))
        yield BodyInertia(self.end, self.mass, Vector(0.1 * self.size, 0.0, -0.2 * self.size), 0.9 * j, tensor)

    @observable(unit="rad", doc="Angle.", spaces=("plane",))
    def angle(self) -> Any:
        """Return the angle."""
        return self.end.angle

    @observable(unit="1", doc="Axis along x.", spaces=("space",))
    def x_axis(self) -> Vector:
        """Return the axis."""
        return self.end.axes[0]

    @observable(unit="1", doc="Axis along z.", spaces=("space",))
    def z_axis(self) -> Vector:
        """Return the axis."""
        return self.end.axes[2]

    @observable(unit="rad/s", doc="Angular velocity.", spaces=("plane", "space"))
    def angular_velocity(self) -> Vector:
        """Return the angular velocity."""
        return self.end.angular_velocity

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane",))
    def angular_speed(self) -> Any:
        """Return the rate of the angle."""
        return -self.end.angular_velocity.y


class Mount(Component):
    """A frame that is fixed to the world."""

    place: tuple[float, float, float] = parameter((0.0, 0.0, 0.0), unit="m", size=3, doc="Where it is.")
    end: Frame = connector(Frame, "The frame.")

    @joint("world", "end", rigid=True, spaces=("line", "plane", "space"))
    def fixation(self) -> Placement:
        """Place the frame."""
        return Placement(as_vector(self.place), 0.0)


class Axle(Component):
    """A hinge about y that offers its angle."""

    a: Frame = connector(Frame, "The frame that carries it.")
    b: Frame = connector(Frame, "The frame that turns.")
    held: Shaft = connector(Shaft, "The angle.", of="angle")
    spaces = ("plane", "space")

    @constraint(reaction="force", unit="N", doc="Force on b.")
    def together(self) -> Vector:
        """Return the distance."""
        return self.b.position - self.a.position

    @constraint(reaction=("lock_1", "lock_2"), unit="N*m", doc="Torque on b.", spaces=("space",))
    def parallel(self) -> tuple[Any, Any]:
        """Return by how much the axes differ."""
        return dot(self.a.axes[2], self.b.axes[1]), dot(self.a.axes[0], self.b.axes[1])

    @joint("a", "b", coordinates=("angle",), solves=("together", "parallel"), spaces=("plane", "space"))
    def swing(self, angle: Any) -> Placement:
        """Place b."""
        return Placement(Vector(), turn((0.0, -1.0, 0.0), angle) if self.in_space else angle, axes="a")

    @observable(unit="rad", doc="Angle.", periodic=True, rate="rate")
    def angle(self) -> Any:
        """Return the angle."""
        from atwood.expr import atan2

        if not self.in_space:
            return self.b.angle - self.a.angle
        return atan2(dot(self.b.axes[0], self.a.axes[2]), dot(self.b.axes[0], self.a.axes[0]))

    @observable(unit="rad/s", doc="Rate of the angle.")
    def rate(self) -> Any:
        """Return the rate."""
        spin = self.b.angular_velocity - self.a.angular_velocity
        return -dot(spin, self.a.axes[1]) if self.in_space else -spin.y


class Rail(Component):
    """A guide that offers its displacement."""

    a: Frame = connector(Frame, "The frame that carries it.")
    b: Point = connector(Point, "The point that moves.")
    axis: tuple[float, float, float] = parameter((1.0, 0.0, 0.0), direction=True, doc="Direction of the rail.")
    held: Slide = connector(Slide, "The displacement.", of="way")

    @constraint(reaction=("side_1", "side_2"), unit="N", doc="Force on b.", spaces=("plane", "space"))
    def guide(self) -> tuple[Any, Any]:
        """Return the distance from the rail along its normals."""
        arm = self.a.to_frame(self.b.position - self.a.position)
        first, second = normals(as_vector(self.axis))
        return dot(arm, first), dot(arm, second)

    @joint("a", "b", coordinates=("way",), solves=("guide",), spaces=("line", "plane", "space"))
    def slide(self, way: Any) -> Placement:
        """Place b."""
        return Placement(as_vector(self.axis) * way, axes="a")

    @observable(unit="m", doc="Displacement.", rate="speed")
    def way(self) -> Any:
        """Return the displacement."""
        return dot(self.b.position - self.a.position, self.a.to_world(as_vector(self.axis)))

    @observable(unit="m/s", doc="Rate of the displacement.")
    def speed(self) -> Any:
        """Return the speed along the rail of a mount that is at rest."""
        return dot(self.b.velocity - self.a.velocity, self.a.to_world(as_vector(self.axis)))


def on_bench(trial: Trial, name: str = "part") -> Scene:
    """Return a scene in which a component has a body on each of its connectors, near where a trial has them."""
    space, component = trial.space, trial.component.copy()
    line = tuple(space.line) if space.line is not None else (1.0, 0.0, 0.0)
    scene = Scene(space=space.name, gravity=3.0, line_axis=line)
    scene.add(name, component)
    for signal, (value, _) in trial.inputs.items():
        if not callable(trial.part.signals.get(signal)):
            setattr(component, signal, value)
    joints = [law for law in component.laws("joint") if law.holds_in(space.name)]
    poses = trial.joined(joints[0], 0.0) if len(joints) == 1 and not joints[0].options.rigid else trial.poses
    held = {end for law in component.laws("joint") for end in (law.options.a, law.options.b)}
    loose = not component.laws("constraint")
    for number, (end, one) in enumerate(component.connectors().items()):
        if isinstance(one, JointCoordinate):
            if end in trial.joint_references:
                _joint_reference(scene, number, one)
            continue
        kind = Block if isinstance(one, Frame) else PulleyBall if isinstance(one, Groove) else Ball
        body = scene.add(f"body{number}", _sized(kind, trial, number))
        scene.connect(one, body.end)
        carried = any(law.options.b == end for law in joints)
        rigid = any(law.options.rigid and end in (law.options.a, law.options.b) for law in joints)
        target = scene.start if loose and not rigid and end not in held else scene.guess
        _place(target, f"body{number}", poses[end], trial, isinstance(one, Frame) and not carried)
        if target is scene.start:
            _move(scene, f"body{number}", end, trial, isinstance(one, Frame))
    _start_joint(scene, name, joints, trial)
    return scene


def _sized(kind: type[Component], trial: Trial, number: int) -> Any:
    mass = 1.0 + 0.3 * number
    return kind(mass=mass, size=0.5 * trial.length) if kind is Block else kind(mass=mass)


def _joint_reference(scene: Scene, number: int, one: JointCoordinate) -> None:
    """Give a part a joint to take hold of."""
    mount = scene.add(f"mount{number}", Mount(place=(5.0 * number, 0.0, 0.0)))
    is_shaft = isinstance(one, Shaft)
    line = scene.line_axis if scene.space == "line" else (1.0, 0.0, 0.0)
    held: Any = scene.add(f"joint{number}", Axle() if is_shaft else Rail(axis=line))
    body: Any = scene.add(f"body{number}", Block() if is_shaft else Ball())
    scene.connect(mount.end, held.a)
    scene.connect(held.b, body.end)
    scene.connect(held.held, one)


def _place(target: Any, body: str, pose: Pose, trial: Trial, with_turn: bool) -> None:
    for axis in _axes(trial):
        target[f"{body}.position.{'xyz'[axis]}"] = float(pose.position[axis])
    if with_turn and trial.space.is_planar:
        target[f"{body}.angle"] = pose.angle
    elif with_turn and trial.space.is_spatial:
        for name, axis_of in (("x_axis", pose.axes[0]), ("z_axis", pose.axes[2])):
            for i, component in enumerate(axis_of):
                target[f"{body}.{name}.{'xyz'[i]}"] = float(component)


def _move(scene: Scene, body: str, end: str, trial: Trial, turns: bool) -> None:
    for axis in _axes(trial):
        scene.start[f"{body}.velocity.{'xyz'[axis]}"] = float(trial.velocities[end][axis])
    if turns and trial.space.is_planar:
        scene.start[f"{body}.angular_speed"] = -float(trial.angular_velocities[end].y)
    elif turns and trial.space.is_spatial:
        for i, component in enumerate(trial.angular_velocities[end]):
            scene.start[f"{body}.angular_velocity.{'xyz'[i]}"] = float(component)


def _axes(trial: Trial) -> tuple[int, ...]:
    """Return along which axes positions are said at the start; on a line one of them tells."""
    if trial.space.line is None:
        return trial.space.reported_axes
    sizes = [abs(float(c)) for c in trial.space.line]
    return (sizes.index(max(sizes)),)


def _start_joint(scene: Scene, name: str, joints: list[Law], trial: Trial) -> None:
    """Start the joint of a component at its coordinates, with their rates."""
    laws = {law.name: law for law in trial.component.laws("observable") if law.holds_in(trial.space.name)}
    for law in joints[:1]:
        for coordinate in law.options.coordinates:
            if coordinate in laws:
                value, rate = trial.coordinates[coordinate]
                scene.start[f"{name}.{coordinate}"] = value
                if laws[coordinate].options.rate in laws:
                    scene.start[f"{name}.{laws[coordinate].options.rate}"] = rate
