"""Scenes with impacts, dry friction and clutches whose answers are known: by hand, or from an analysis that is named.

Each row gives what was found and what is known, in units of its scene, so that they are the same in every view.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from tests.simulation.contacts.test_woodpecker import ON_THE_CYCLE, Woodpecker

import atwood as aw
from atwood import simulate
from atwood_library import (
    BallContact,
    Box,
    BoxContact,
    DistanceContact,
    Ground,
    Inertia,
    Link,
    LossyGear,
    Mass1D,
    Pivot,
    PointContact,
    PointMass,
    Pulley,
    RotationalFriction,
    RotationalSource,
    RotationalSpringDamper,
    RotationalStop,
    RoughPulley,
    Sphere,
    Spring,
    SurfaceContact,
    VertexContact,
)

from .views import Draft, G, View

TURN = 2.0 * math.pi
Pairs = list[tuple[str, float, float]]
"""What was found and what is known, with what it is."""


@dataclass(frozen=True)
class Row:
    """A scene of the table, with the error that it may have."""

    check: Callable[[View, str], Pairs]
    off: float = 1e-9


class Run:
    """A run of a draft, with its quantities and times in units of its scene."""

    def __init__(self, draft: Draft, form: str, end: float, **options: object) -> None:
        self.draft, self.view, self.form = draft, draft.view, form
        end *= self.view.time
        self.result = simulate(draft.build(), form=form, t_end=end, rtol=1e-10, outputs=[0.0, end], **options)

    def times(self, *kinds: str, law: str = "") -> list[float]:
        """Return times of events of some kinds, of all gaps and slips or of one."""
        found = [one for one in self.result.events if one.kind in kinds and law in ("", one.law)]
        return [one.time / self.view.time for one in found]

    def last(self, path: str) -> float:
        """Return the last value of a quantity."""
        part, _, rest = path.partition(".")
        return float(self.result[f"{self.draft.name(part)}.{rest}"][-1])

    def at_last(self, part: str, x: float, y: float, z: float) -> float:
        """Return how far a part is along a direction."""
        place = np.array(self._vector(f"{part}.position")) / self.view.size
        origin = self.view.move * np.array([1.0, float(self.draft.in_space), 1.0])
        return float((place - origin) @ self.draft.way(x, y, z))

    def speed_at_last(self, part: str, x: float, y: float, z: float) -> float:
        """Return the speed of a part along a direction."""
        return float(np.array(self._vector(f"{part}.velocity")) @ self.draft.way(x, y, z)) / self.view.speed

    def _vector(self, path: str) -> list[float]:
        return [self.last(f"{path}.{axis}") if self.draft.in_space or axis != "y" else 0.0 for axis in "xyz"]


def _on_plane(view: View, part: aw.Component, contact: aw.Component, space: str = "plane") -> Draft:
    """Return a part, m, on a plane of the ground by a contact, c."""
    draft = Draft(view, space=space)
    where = view.point(0.0, 0.0, 0.0, draft.in_space)
    draft.parts = {"ground": Ground(position=where), "m": part, "c": contact}
    ends = {"PointContact": "point", "BallContact": "ball", "VertexContact": "body", "BoxContact": "box"}
    own = "m.point" if isinstance(part, PointMass) else "m.a" if isinstance(part, Link) else "m.frame"
    draft.joins = [("ground.frame", "c.plane"), (own, f"c.{ends[type(contact).__name__]}")]
    return draft


def _up(view: View, angle: float = 0.0, in_space: bool = False) -> tuple[float, float, float]:
    return view.way(-math.sin(angle), 0.0, math.cos(angle), in_space)


# -- impacts --------------------------------------------------------------------------------------------------------


def ball(view: View, form: str) -> Pairs:
    """A ball falls from 1 m and bounces with 0.9 of its speed."""
    draft = _on_plane(view, PointMass(mass=2.0), PointContact(normal=_up(view), restitution=0.9))
    draft.place("m", 0.0, 0.0, 1.0)
    draft.throw("m", 0.0, 0.0, 0.0)
    run = Run(draft, form, 10.0)
    return [
        ("10th impact", run.times("impact")[9], 5.4302180026),
        ("rests", run.times("rests")[-1], 8.5789491787),
        ("height", run.at_last("m", 0.0, 0.0, 1.0), 0.0),
    ]


def box(view: View, form: str) -> Pairs:
    """Unfolded, the way of a ball in a box is straight."""
    draft = Draft(view, gravity=0.0)
    draft.parts = {"m": PointMass(mass=1.0)}
    walls = ((0, 0, 1, 0), (1, 0, -1, 0), (0, 0, 0, 1), (0, 0.7, 0, -1))
    for name, (x, z, a, b) in zip("abcd", walls, strict=True):
        contact = PointContact(normal=view.way(a, 0.0, b), radius=0.05 * view.size, restitution=1.0)
        draft.parts |= {f"ground_{name}": Ground(position=view.point(x, 0.0, z)), name: contact}
        draft.joins += [(f"ground_{name}.frame", f"{name}.plane"), ("m.point", f"{name}.point")]
    draft.place("m", 0.3, 0.0, 0.2)
    draft.throw("m", 1.1, 0.0, 0.7)
    run = Run(draft, form, 4321.0)
    return [
        ("impacts", float(len(run.times("impact"))), 10_322.0),
        ("x", run.at_last("m", 1.0, 0.0, 0.0), 0.5),
        ("z", run.at_last("m", 0.0, 0.0, 1.0), 0.4),
    ]


def housner(view: View, form: str) -> Pairs:
    """G. Housner's block (Bull. Seism. Soc. Am. 53, 1963): each impact leaves 1 - 3/2 sin^2(alpha) of the rate."""
    size = view.size
    contact = BoxContact(normal=_up(view), length=0.5 * size, height=2.0 * size, friction=10.0)
    draft = _on_plane(view, Box(mass=1.0, length_x=0.5 * size, length_z=2.0 * size), contact)
    draft.start = {"m.angle": 0.15 + view.turn, "m.angular_velocity.y": 0.0}
    draft.start |= {"c.corner[0].gap": 0.0, "c.corner[0].slip": 0.0}
    run = Run(draft, form, 9.0)
    impacts = run.times("impact")
    return [
        ("impact", impacts[0], 0.5999358452),
        ("4th impact", impacts[3], 2.9278155896),
        ("rests", run.times("rests")[-1], 8.690777316623845),
    ]


def _in_a_row(view: View, count: int, lower: float, restitution: float, apart: float, speed: float) -> Draft:
    """Return masses on a line, of which the first moves towards the others."""
    draft = Draft(view, space="line", gravity=0.0)
    own = {"axis": view.way(1.0, 0.0, 0.0)} if view.turn else {}
    origin = {"origin": view.point(0.0, 0.0, 0.0)} if view.turn else {}
    draft.parts = {f"m{i:02d}": Mass1D(mass=1.0, **own, **origin) for i in range(count)}
    for i in range(count - 1):
        draft.parts[f"c{i:02d}"] = DistanceContact(lower=lower * view.size, restitution=restitution)
        draft.joins += [(f"m{i:02d}.flange", f"c{i:02d}.a"), (f"m{i + 1:02d}.flange", f"c{i:02d}.b")]
    for i in range(count):
        away = apart * i if apart > lower else apart * i - 0.5 * (i == 0)
        draft.start[f"m{i:02d}.displacement"] = view.size * (away + view.move)
        draft.start[f"m{i:02d}.speed"] = view.speed * speed * (i == 0)
    return draft


def cradle(view: View, form: str) -> Pairs:
    """Newton's cradle, with impacts together and one by one."""
    known = {"together": (-0.6, 0.4, 0.4, 0.4, 0.4), "one_by_one": (0.0, 0.0, 0.0, 0.0, 1.0)}
    found: Pairs = []
    for impacts, speeds in known.items():
        run = Run(_in_a_row(view, 5, 0.1, 1.0, 0.1, 1.0), form, 1.0, impacts=impacts)
        found += [
            (f"{impacts}, {i}", run.last(f"m{i:02d}.speed") / view.speed, speed) for i, speed in enumerate(speeds)
        ]
    return found


def engine(view: View, form: str) -> Pairs:
    """An engine runs into ten wagons like it, each with a slack of 0.1 before it."""
    run = Run(_in_a_row(view, 11, 1.0, 0.0, 1.1, 3.0), form, 2.0)
    return [
        ("all move", run.times("impact")[-1], 1.8333333333),
        ("speed", run.last("m10.speed") / view.speed, 3.0 / 11.0),
    ]


def play(view: View, form: str) -> Pairs:
    """Two rotors with a play of 0.2, which leaves 0.6 of the speed."""
    draft = Draft(view)
    draft.parts = {name: Inertia(moment=moment * view.size**2) for name, moment in (("a", 1.0), ("b", 2.0))}
    draft.parts["play"] = RotationalStop(lower=-0.1, upper=0.1, restitution=0.6)
    draft.joins = [("a.flange", "play.a"), ("b.flange", "play.b")]
    draft.start = {"a.angle": view.turn + view.move, "b.angle": view.turn + view.move}
    draft.start |= {"a.angular_velocity": 5.0 / view.time, "b.angular_velocity": 0.0}
    return [("6th impact", Run(draft, form, 1.3).times("impact")[5], 1.2060082305)]


def _at_a_surface(view: View, contact: SurfaceContact, place: tuple[float, float, float], speed: float) -> Draft:
    """Return a point mass at a surface, which is thrown to the right."""
    draft = Draft(view)
    draft.parts = {"ground": Ground(position=view.point(0.0, 0.0, 0.0)), "m": PointMass(mass=1.0), "c": contact}
    draft.joins = [("ground.frame", "c.a"), ("m.point", "c.b")]
    draft.place("m", *place)
    draft.throw("m", speed, 0.0, 0.0)
    return draft


def circle(view: View, form: str) -> Pairs:
    """A ball bounces within a circle, with 0.9 of its speed."""
    contact = SurfaceContact(function=f"{0.25 * view.size**2!r} - x**2 - z**2", restitution=0.9)
    draft = _at_a_surface(view, contact, (0.1, 0.0, 0.0), 0.3)
    return [("6th impact", Run(draft, form, 2.2).times("impact")[5], 2.1345199766)]


def bead(view: View, form: str) -> Pairs:
    """A bead leaves a sphere."""
    draft = _at_a_surface(view, SurfaceContact(function=f"x**2 + z**2 - {view.size**2!r}"), (0.0, 0.0, 1.0), 0.5)
    return [("leaves", Run(draft, form, 1.0).times("opens")[0], 0.7542388380)]


def ladder(view: View, form: str) -> Pairs:
    """A ladder leaves the wall, without friction."""
    draft = Draft(view)
    draft.parts = {"ground": Ground(position=view.point(0.0, 0.0, 0.0)), "m": Link(length=2.0 * view.size, mass=1.0)}
    for name, normal, end in (("floor", (0.0, 0.0, 1.0), "m.a"), ("wall", (1.0, 0.0, 0.0), "m.b")):
        draft.parts[name] = VertexContact(normal=view.way(*normal))
        draft.joins += [("ground.frame", f"{name}.plane"), (end, f"{name}.body")]
    draft.start = {"m.angle": 0.5 * math.pi + 0.3 + view.turn, "m.angular_velocity": 0.0}
    draft.start |= {"floor.gap": 0.0, "wall.gap": 0.0}
    run = Run(draft, form, 0.7)
    return [("leaves", run.times("opens")[0], 0.6505624421), ("events", float(len(run.result.events)), 1.0)]


# -- friction -------------------------------------------------------------------------------------------------------


def _on_slope(view: View, angle: float, speed: float, across: float | None = None, friction: float = 0.4) -> Draft:
    space = "plane" if across is None else "space"
    contact = PointContact(normal=_up(view, angle, space == "space"), friction=friction)
    draft = _on_plane(view, PointMass(mass=2.0), contact, space)
    draft.place("m", 0.0, 0.0, 0.0)
    draft.throw("m", speed * math.cos(angle), across or 0.0, speed * math.sin(angle))
    return draft


def slope(view: View, form: str) -> Pairs:
    """A block slides up a slope of 0.3 rad, and stays for 1e4 s."""
    run = Run(_on_slope(view, 0.3, 1.0), form, 1e4)
    slowing = G * (math.sin(0.3) + 0.4 * math.cos(0.3))
    return [
        ("place", run.at_last("m", math.cos(0.3), 0.0, math.sin(0.3)), 0.07521292466074),
        ("sticks", run.times("sticks")[0], 1.0 / slowing),
    ]


def slope_and_back(view: View, form: str) -> Pairs:
    """A block slides up a slope of 0.6 rad, and back."""
    run = Run(_on_slope(view, 0.6, 1.0), form, 0.3364573836)
    along = math.cos(0.6), 0.0, math.sin(0.6)
    return [("place", run.at_last("m", *along), 0.0), ("speed", run.speed_at_last("m", *along), -0.5119431119)]


def across(view: View, form: str) -> Pairs:
    """A puck slides across a slope whose tangent is the friction: speed and its part downwards add up to the same."""
    run = Run(_on_slope(view, 0.3, 0.0, 2.0, math.tan(0.3)), form, 1.0)
    down, side = run.speed_at_last("m", math.cos(0.3), 0.0, math.sin(0.3)), run.speed_at_last("m", 0.0, 1.0, 0.0)
    return [("speed", math.hypot(down, side), 1.0081781882)]


def spring(view: View, form: str) -> Pairs:
    """A mass on a spring stops where friction holds it."""
    draft = _on_plane(view, PointMass(mass=2.0), PointContact(normal=_up(view), friction=0.3))
    draft.parts["spring"] = Spring(stiffness=50.0 / view.size)
    draft.joins += [("ground.frame", "spring.a"), ("m.point", "spring.b")]
    draft.place("m", 1.0, 0.0, 0.0)
    draft.throw("m", 0.0, 0.0, 0.0)
    run = Run(draft, form, 5.0)
    return [
        ("sticks", run.times("sticks")[-1], 2.5132741229),
        ("place", run.at_last("m", 1.0, 0.0, 0.0), 0.05824),
    ]


def belt(view: View, form: str) -> Pairs:
    """A mass on a belt sticks and slips."""
    contact = PointContact(normal=_up(view), friction=0.4, static_friction=0.6, surface_velocity=0.2 * view.speed)
    draft = _on_plane(view, PointMass(mass=1.0), contact)
    draft.parts["wall"] = Ground(position=view.point(-5.0, 0.0, 0.0))
    draft.parts["spring"] = Spring(stiffness=100.0 / view.size, natural_length=5.0 * view.size)
    draft.joins += [("wall.frame", "spring.a"), ("m.point", "spring.b")]
    draft.place("m", 0.0, 0.0, 0.0)
    draft.throw("m", 0.2, 0.0, 0.0)
    periods = np.diff(Run(draft, form, 3.0).times("slips"))
    return [("period", float(one), 0.6693570623) for one in periods]


def rolling(view: View, form: str) -> Pairs:
    """A ball that slides comes to roll."""
    radius = 0.1 * view.size
    contact = BallContact(normal=_up(view), friction=0.2, radius=radius)
    draft = _on_plane(view, Sphere(mass=1.0, radius=radius), contact)
    draft.place("m", 0.0, 0.0, 0.1)
    draft.throw("m", 8.0, 0.0, 0.0)
    draft.start["m.angular_velocity.y"] = 0.0
    run = Run(draft, form, 2.0)
    return [("rolls", run.times("sticks")[0], 1.1649919907), ("speed", run.speed_at_last("m", 1, 0, 0), 5.7142857143)]


def cue_ball(view: View, form: str) -> Pairs:
    """A billiard ball with spin comes to roll: friction keeps its direction while it slips."""
    radius = 0.0286 * view.size
    contact = BallContact(normal=_up(view, 0.0, True), friction=0.25, radius=radius)
    draft = _on_plane(view, Sphere(mass=1.0, radius=radius), contact, "space")
    draft.place("m", 0.0, 0.0, 0.0286)
    draft.throw("m", 2.0, 0.0, 0.0)
    spin = np.array(draft.way(30.0, 40.0, 10.0)) / view.time
    draft.start |= {f"m.angular_velocity.{axis}": float(value) for axis, value in zip("xyz", spin, strict=True)}
    run = Run(draft, form, 0.5)
    return [
        ("rolls", run.times("sticks")[0], 0.1411949146),
        ("along", run.speed_at_last("m", 1.0, 0.0, 0.0), 1.7554285714),
        ("across", run.speed_at_last("m", 0.0, 1.0, 0.0), -0.2451428571),
    ]


def stick(view: View, form: str) -> Pairs:
    """A stick that falls from 0.1 rad slips."""
    draft = _on_plane(view, Link(length=view.size, mass=1.0), VertexContact(normal=_up(view), friction=0.25))
    draft.start = {"m.angle": 0.5 * math.pi + 0.1 + view.turn, "m.angular_velocity": 0.0, "c.gap": 0.0, "c.slip": 0.0}
    return [("slips", Run(draft, form, 0.6).times("slips")[0], 0.4962296185)]


def capstan(view: View, form: str) -> Pairs:
    """Masses of 1 and 3 kg on a rope that slips over half a turn."""
    draft = Draft(view)
    rope = RoughPulley(length=3.0 * view.size, friction=0.2)
    draft.parts = {"ground": Ground(position=view.point(0.0, 0.0, 0.0)), "pulley": Pulley(), "rope": rope}
    draft.joins = [("ground.frame", "pulley.center"), ("pulley.groove", "rope.over")]
    for name, mass, depth in (("a", 1.0, 1.0), ("b", 3.0, 2.0)):
        draft.parts[name] = PointMass(mass=mass)
        draft.joins.append((f"{name}.point", f"rope.{name}"))
        draft.place(name, 0.0, 0.0, -depth)
        draft.throw(name, 0.0, 0.0, 0.0)
    return [("acceleration", Run(draft, form, 0.5).speed_at_last("b", 0.0, 0.0, -1.0) / 0.5, 2.2651934046)]


def pendulum(view: View, form: str) -> Pairs:
    """A pendulum with a torque of friction of 0.5 in its hinge sticks for good."""
    draft = Draft(view)
    rub = RotationalFriction(sliding=f"{0.5 * view.size!r}", against="ground")
    draft.parts = {
        "ground": Ground(position=view.point(0.0, 0.0, 0.0)),
        "pivot": Pivot(),
        "link": Link(length=view.size, mass=0.0),
        "bob": PointMass(mass=1.0),
        "rub": rub,
    }
    draft.joins = [
        ("ground.frame", "pivot.a"),
        ("pivot.b", "link.a"),
        ("link.b", "bob.point"),
        ("pivot.shaft", "rub.b"),
    ]
    draft.start = {"pivot.angle": 1.5 - 0.5 * math.pi + view.turn, "pivot.angular_velocity": 0.0}
    run = Run(draft, form, 15.0)
    assert run.result.events[-1].kind == "sticks"
    return [("sticks", run.times("sticks")[-1], 13.6445534015)]


def woodpecker(view: View, form: str) -> Pairs:
    """The woodpecker toy (C. Glocker, *Dynamik von Starrkoerpersystemen mit Reibung und Stoessen*, 1995)."""
    draft = Draft(view, gravity=0.0)  # weights are those of the part
    draft.parts = {
        "sleeve": Mass1D(mass=3e-4, axis=view.way(0.0, 0.0, 1.0), origin=view.point(0.0, 0.0, 0.0)),
        "tilt": Inertia(moment=5e-9 * view.size**2),
        "bird": Inertia(moment=7e-7 * view.size**2),
        "toy": Woodpecker(size=view.size),
    }
    draft.joins = [("sleeve.slide", "toy.y"), ("tilt.flange", "toy.sleeve"), ("bird.flange", "toy.bird")]
    draft.start = {"sleeve.displacement": view.size * view.move, "toy.lower": 0.0, "tilt.angular_velocity": 0.0}
    units = {"sleeve.speed": view.speed, "bird.angle": 1.0, "bird.angular_velocity": 1.0 / view.time}
    draft.start |= {path: value * units[path] for path, value in ON_THE_CYCLE.items()}
    run = Run(draft, form, 0.146)
    (again,) = run.times("sticks", law="slip_lower")
    fallen = run.last("sleeve.displacement") / view.size - view.move
    return [("period", again, 0.1459760651), ("fall", fallen, -0.0194453793)]


def painleve(view: View, form: str) -> Pairs:
    """Painleve's rod of 2 m, 1 rad to the floor, jams at once where its foot slides first."""
    draft = _on_plane(view, Link(length=2.0 * view.size, mass=1.0), VertexContact(normal=_up(view), friction=1.6))
    draft.start = {"m.angle": 1.0 + view.turn, "m.angular_velocity": 0.0, "c.gap": 0.0, "c.slip": -view.speed}
    jams = Run(draft, form, 0.01).times("jams")
    return [("jams", jams[0] if jams else math.inf, 0.0), ("how often", float(len(jams)), 1.0)]


# -- the Modelica Standard Library ----------------------------------------------------------------------------------


def _train(view: View, moments: Mapping[str, float], speeds: Mapping[str, float]) -> Draft:
    """Return rotors at one angle; moments of inertia have the square of lengths, torques lengths."""
    draft = Draft(view)
    draft.parts = {name: Inertia(moment=moment * view.size**2) for name, moment in moments.items()}
    for name, speed in speeds.items():
        draft.start |= {f"{name}.angle": view.turn + view.move, f"{name}.angular_velocity": speed / view.time}
    return draft


def _push(draft: Draft, name: str, rotor: str, torque: Callable[[aw.Scalar], aw.Scalar]) -> None:
    unit, time = draft.view.size, draft.view.time
    draft.parts[name] = RotationalSource(value=lambda t: unit * torque(t / time), against="ground")
    draft.joins.append((f"{rotor}.flange", f"{name}.b"))


def _level(view: View, level: Callable[[aw.Scalar], aw.Scalar]) -> Callable[[aw.Scalar], aw.Scalar]:
    return lambda t: level(t / view.time)


def coupled_clutches(view: View, form: str) -> Pairs:
    """Modelica.Mechanics.Rotational.Examples.CoupledClutches: when its clutches stick and slip."""
    names = [f"J{i}" for i in range(4)]
    draft = _train(view, dict.fromkeys(names, 1.0), {name: 10.0 * (name == "J0") for name in names})
    _push(draft, "motor", "J0", lambda t: 10.0 * aw.sin(TURN * 5.0 * t))
    levels: tuple[Callable[[aw.Scalar], aw.Scalar], ...] = (
        lambda t: aw.sin(TURN * 0.2 * t + 0.5 * math.pi),
        lambda t: aw.select(t < 0.4, 0.0, 1.0),
        lambda t: aw.select(t < 0.9, 0.0, 1.0),
    )
    for i, level in enumerate(levels):
        draft.parts[f"clutch{i}"] = RotationalFriction(
            sliding=f"{10.0 * view.size!r}", peak=1.1, level=_level(view, level)
        )
        draft.joins += [(f"J{i}.flange", f"clutch{i}.a"), (f"J{i + 1}.flange", f"clutch{i}.b")]
    found = [one for one in Run(draft, form, 1.2).times("sticks", "slips") if one > 0.5 and abs(one - 0.9) > 1e-6]
    known = [0.7096214747, 0.7916623592, 0.8311085061, 0.9068501928, 1.0002958599, 1.1439674925]
    return _all(found, known)


def friction(view: View, form: str) -> Pairs:
    """Modelica.Mechanics.Rotational.Examples.Friction: a clutch sticks and slips, a brake stops, both stick."""
    draft = _train(view, {"J1": 1.0, "J2": 0.05, "J3": 1.0}, {"J1": 90.0, "J2": 90.0, "J3": 100.0})
    _push(draft, "motor", "J3", lambda t: aw.select(t < 0.5, 200.0 * aw.sin(100.0 * t), 0.0))
    unit = view.size
    draft.parts |= {
        "clutch": RotationalFriction(sliding=f"{80.0 * unit!r}"),
        "spring": RotationalSpringDamper(stiffness=160.0 * unit, damping=unit * view.time),
        "brake": RotationalFriction(
            sliding=f"{800.0 * unit!r}", against="ground", level=_level(view, lambda t: aw.select(t < 0.5, 0.0, 1.0))
        ),
    }
    draft.joins += [("J3.flange", "clutch.a"), ("J2.flange", "clutch.b"), ("J2.flange", "spring.a")]
    draft.joins += [("J1.flange", "spring.b"), ("J1.flange", "brake.b")]
    found = [one.time / view.time for one in Run(draft, form, 2.0).result.events]
    known = [0.0067797089, 0.0593392840, 0.1092898268, 0.5342483385, 0.6406139408, 1.6636414428]
    return _all([one for one in found if abs(one - 0.5) > 1e-6], known)


def lossy_gear(view: View, form: str) -> Pairs:
    """Modelica.Mechanics.Rotational.Examples.LossyGearDemo1: a gear that locks itself."""
    draft = _train(view, {"J1": 1.0, "J2": 1.5}, {"J2": 0.0})
    draft.start = {path: 0.0 if path.endswith("angle") else value for path, value in draft.start.items()}
    draft.parts["gear"] = LossyGear(ratio=2.0, efficiency_a="0.5", efficiency_b="0.5")
    draft.joins = [("J1.flange", "gear.a"), ("J2.flange", "gear.b")]
    _push(draft, "drive", "J1", lambda t: 10.0 * aw.sin(TURN * t))
    _push(draft, "load", "J2", lambda t: -10.0 + 2.5 * t)
    found = Run(draft, form, 0.5).times("sticks", "slips")
    return _all(found, [0.0804771339, 0.1995199008, 0.3713427780, 0.4645394616])


def _all(found: list[float], known: list[float]) -> Pairs:
    """Return all times; how many there are counts, too."""
    count = [("events", float(len(found)), float(len(known)))]
    return count + [(f"event {i + 1}", one, other) for i, (one, other) in enumerate(zip(found, known, strict=False))]


ROWS: Mapping[str, Row] = {
    "ball": Row(ball),
    "box": Row(box),
    "slope": Row(slope, 1e-12),
    "slope and back": Row(slope_and_back),
    "across a slope": Row(across),
    "spring": Row(spring),
    "belt": Row(belt),
    "rolling": Row(rolling),
    "cue ball": Row(cue_ball),
    "ladder": Row(ladder),
    "bead": Row(bead),
    "stick": Row(stick),
    "capstan": Row(capstan),
    "housner": Row(housner),
    "cradle": Row(cradle),
    "engine": Row(engine),
    "play": Row(play),
    "pendulum": Row(pendulum),
    "circle": Row(circle),
    "woodpecker": Row(woodpecker, 1e-8),
    "painleve": Row(painleve),
    "coupled clutches": Row(coupled_clutches),
    "friction": Row(friction),
    "lossy gear": Row(lossy_gear),
}
