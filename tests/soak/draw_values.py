"""Random numbers, bodies and joints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .description import Array, Body, Signal, normals, rotation


@dataclass
class Chance:
    """Random choices for one scene, in its space; a third of the scenes have round numbers and simple axes."""

    random: np.random.Generator
    space: str = field(init=False)
    is_round: bool = field(init=False)

    def __post_init__(self) -> None:
        self.space = str(self.random.choice(["space", "plane", "line"], p=[0.6, 0.3, 0.1]))
        self.is_round = bool(self.random.random() < 0.3)

    def number_of_bodies(self) -> int:
        """Return one to ten, mostly few."""
        return int(self.random.choice(np.arange(1, 11), p=[0.24, 0.26, 0.2, 0.12, 0.06, 0.04, 0.03, 0.02, 0.02, 0.01]))

    def pick(self, words: str) -> str:
        """Return one of some words."""
        return str(self.random.choice(words.split()))

    def sign(self) -> float:
        """Return one or minus one."""
        return float(self.random.choice([-1.0, 1.0]))

    def size(self, typical: float) -> float:
        """Return a positive number about as large as a typical one."""
        found = typical * float(np.exp(self.random.uniform(-0.9, 0.9)))
        return round(found, 1) + 0.1 if self.is_round else found

    def up(self) -> Array:
        """Return the direction up, as far as there is one."""
        return np.array([1.0, 0.0, 0.0]) if self.space == "line" else np.array([0.0, 0.0, 1.0])

    def place(self, reach: float) -> Array:
        """Return a random vector."""
        found = reach * self.random.uniform(-1.0, 1.0, 3)
        if self.is_round:
            found = np.round(found, 1) * self.random.integers(0, 2, 3)
        kept = {"space": (1, 1, 1), "plane": (1, 0, 1), "line": (1, 0, 0)}[self.space]
        return found * np.array(kept)

    def axis(self) -> Array:
        """Return a direction that the space has."""
        if self.space == "line":
            return np.array([1.0, 0.0, 0.0])
        if self.is_round:
            found = np.eye(3)[self.random.integers(3)]
            return found * self.sign() if self.space == "space" or found[1] == 0.0 else np.array([0.0, 0.0, 1.0])
        found = self.random.normal(size=3) * (np.array([1, 0, 1]) if self.space == "plane" else 1.0)
        return found / np.linalg.norm(found)

    def turning_axis(self) -> Array:
        """Return an axis to turn about."""
        return self.axis() if self.space == "space" else np.array([0.0, self.sign(), 0.0])

    def turn(self) -> Array:
        """Return a random rotation, as far as the space has any."""
        if self.space == "line" or self.random.random() < (0.7 if self.is_round else 0.15):
            return np.eye(3)
        if self.is_round:
            quarter = rotation(self.turning_axis(), 0.5 * np.pi * float(self.random.integers(1, 4)))
            return np.round(quarter)
        return rotation(self.turning_axis(), float(self.random.uniform(-np.pi, np.pi)))

    def small_turn(self) -> Array:
        """Return a rotation by less than a radian."""
        if self.space == "line":
            return np.eye(3)
        return rotation(self.turning_axis(), float(self.random.uniform(-0.8, 0.8)))

    def body(self, name: str, point: bool) -> Body:
        """Return a body at no place in particular, with random speeds."""
        mass, zero = self.size(1.0), np.zeros(3)
        velocity = self.random.normal(size=3)
        if point:
            return Body(name, mass, zero, velocity)
        corners = 0.6 * self.random.uniform(-1.0, 1.0, (6, 3))
        corners = corners - corners.mean(axis=0)
        tensor = mass / 6.0 * sum(np.eye(3) * (c @ c) - np.outer(c, c) for c in corners)
        if self.is_round:
            tensor = np.diag(np.round(np.diag(tensor), 2) + 0.01)
        center = zero if self.random.random() < 0.4 else self.place(0.3)
        spin = 1.5 * self.random.normal(size=3)
        return Body(name, mass, zero, velocity, center, tensor, np.eye(3), spin)

    def signal(self, size: float) -> Signal:
        """Return a smooth function of time."""
        if self.random.random() < 0.4:
            return Signal(offset=size * float(self.random.uniform(-1.0, 1.0)))
        offset, amplitude = size * self.random.uniform(-1.0, 1.0, 2)
        return Signal(float(offset), 0.0, float(amplitude), self.size(3.0), float(self.random.uniform(0.0, 6.0)))

    def load(self, sort: str, gap: float) -> dict[str, Any]:
        """Return the parameters of a force between points that are so far apart."""
        three = self.random.uniform(0.5, 4.0, (4, 3))
        zero = np.zeros(3)
        return {
            "spring": lambda: {
                "stiffness": self.size(8.0),
                "natural_length": 0.0 if self.random.random() < 0.3 else gap * float(self.random.uniform(0.5, 1.5)),
            },
            "damper": lambda: {"damping": self.size(0.8)},
            "drag": lambda: {"linear": self.size(0.3), "quadratic": self.size(0.2), "wind": 2.0 * self.place(1.0)},
            "force": lambda: {"direction": self.axis(), "value": self.signal(5.0)},
            "torque": lambda: {"axis": self.turning_axis(), "value": self.signal(2.0)},
            "torsion_damper": lambda: {"damping": self.size(0.3), "axis": self.turning_axis()},
            "torsion_spring": lambda: {
                "stiffness": self.size(3.0),
                "natural_angle": float(self.random.uniform(-0.3, 0.3)),
                "axis": self.turning_axis(),
            },
            "bushing": lambda: {
                "stiffness": 5.0 * three[0],
                "damping": 0.2 * three[1],
                "free_displacement": self.place(0.2),
                "turning_stiffness": three[2],
                "turning_damping": 0.05 * three[3],
                "free_rotation": zero if self.space != "space" else 0.2 * self.random.uniform(-1.0, 1.0, 3),
            },
            "central_gravity": lambda: {"gravitational_parameter": self.size(2.0), "attracts": "point"},
        }[sort]()


def joint_at(chance: Chance, sort: str) -> tuple[dict[str, Any], Array, Array]:
    """Return a joint's parameters, and where its frame b is in its frame a: a displacement and a rotation."""
    still, eye = np.zeros(3), np.eye(3)
    axis = chance.turning_axis() if sort in ("pivot", "rotary_drive", "rolling_disc") else chance.axis()
    angle = float(chance.random.uniform(-1.4, 1.4))
    shift = float(chance.random.uniform(-0.8, 0.8))
    n1, n2 = normals(axis)
    turned = rotation(axis, angle)
    flat = chance.place(0.8) if chance.space == "space" else still
    flat = flat - axis * (axis @ flat)
    loaded = chance.random.random() < 0.3

    def hinge(stiffness: str = "stiffness", damping: str = "damping", end: str = "") -> dict[str, Any]:
        return {
            stiffness: chance.size(4.0),
            "natural_angle" + end: float(chance.random.uniform(-1, 1)),
            damping: chance.size(0.2),
            "motor" + end: chance.signal(1.0),
        }

    slide: dict[str, Any] = {
        "stiffness": chance.size(10.0),
        "natural_length": float(chance.random.uniform(-0.5, 0.5)),
        "damping": chance.size(0.4),
        "actuator": chance.signal(3.0),
    }
    plate: dict[str, Any] = {
        "stiffness": chance.size(10.0),
        "damping": chance.size(0.4),
        "actuator_1": chance.signal(3.0),
        "actuator_2": chance.signal(3.0),
    }
    ball: dict[str, Any] = {
        "stiffness": chance.size(3.0),
        "damping": chance.size(0.2),
        **({f"motor_{a}": chance.signal(1.0) for a in "xyz"} if chance.space == "space" else {}),
    }
    if sort == "pivot":
        if chance.space == "line":
            return {}, still, eye
        return {"axis": axis, **(hinge() if loaded else {})}, still, turned
    if sort == "slider":
        return {"axis": axis, **(slide if loaded else {})}, axis * shift, eye
    if sort == "cylindrical":
        loads = {**slide, **hinge("torsional_stiffness", "torsional_damping")}
        return {"axis": axis, **(loads if loaded else {})}, axis * shift, turned
    if sort == "screw":
        pitch = chance.size(0.8) * chance.sign()
        lead = pitch * angle / (2.0 * np.pi)
        return {"axis": axis, "pitch": pitch, **(hinge() if loaded else {})}, axis * lead, turned
    if sort in ("spherical", "constant_velocity"):
        if sort == "spherical":
            return ball if loaded else {}, still, chance.turn()
        bend = chance.random.normal(size=2)
        tilt = np.array([*(bend / np.linalg.norm(bend)), 0.0])
        return ball if loaded else {}, still, rotation(tilt, 0.5 * angle)
    if sort == "universal":
        loads = {**hinge("stiffness_a", "damping_a", "_a"), **hinge("stiffness_b", "damping_b", "_b")}
        tilt = rotation(axis, angle) @ rotation(n1, 0.6 * float(chance.random.uniform(-1.0, 1.0)))
        return {"axis_a": axis, "axis_b": n1, **(loads if loaded else {})}, still, tilt
    if sort == "planar":
        loads = {**plate, **hinge("torsional_stiffness", "torsional_damping")}
        return {"axis": axis, **(loads if loaded else {})}, flat, turned
    if sort == "point_on_line":
        return {"axis": axis, **(slide if loaded else {})}, axis * shift, chance.turn()
    if sort == "point_on_plane":
        return {"axis": axis, **(plate if loaded else {})}, flat, chance.turn()
    if sort == "point_on_circle":
        radius = chance.size(0.8)
        at = radius * (np.cos(angle) * n1 + np.sin(angle) * n2)
        return {"axis": axis, "radius": radius, **(hinge() if loaded else {})}, at, chance.turn()
    if sort == "rod":
        length = chance.size(1.0)
        mass = chance.size(0.5) if chance.random.random() < 0.3 else 0.0
        direction = chance.axis() * chance.sign()
        return {"length": length, "mass": mass}, length * direction, chance.turn()
    if sort == "weld":
        return {}, still, eye
    if sort == "drive":
        motion = chance.signal(0.4)
        return {"axis": axis, "motion": motion}, axis * motion.at(0.0), eye
    if sort == "rotary_drive":
        motion = chance.signal(1.0)
        return {"axis": axis, "rotation": motion}, still, rotation(axis, motion.at(0.0))
    return _rolling_at(chance, sort, axis)


def _rolling_at(chance: Chance, sort: str, axis: Array) -> tuple[dict[str, Any], Array, Array]:
    normal = chance.axis()
    n1, n2 = normals(normal)
    radius = chance.size(0.4)
    place = n1 * float(chance.random.uniform(-1, 1)) + n2 * float(chance.random.uniform(-1, 1))
    if chance.space == "plane":
        place = np.array([-normal[2], 0.0, normal[0]]) * float(chance.random.uniform(-1, 1))
    turned = chance.turn()
    values = {"radius": radius, "normal": normal}
    if sort == "rolling_sphere":
        return values, place + radius * normal, turned
    for _ in range(30):  # a disc that lies nearly flat is no good start
        lean = float(normal @ turned @ axis)
        if abs(lean) < 0.8:
            return {**values, "axis": axis}, place + radius * np.sqrt(1.0 - lean * lean) * normal, turned
        turned = rotation(n1, 0.7) @ turned @ rotation(chance.axis(), 0.9)
    raise AssertionError("no place for the disc")
