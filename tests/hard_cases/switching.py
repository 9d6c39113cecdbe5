"""What is not smooth, where runs begin, and what drives them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import quad

from atwood import Result, Scene
from atwood_library import Drive, Ground, PointMass, PointToPoint, Rope, Sine, Slider, Spring
from atwood_library.scenes import FourBar, SimplePendulum

from .case import Case
from .measures import formula, largest

G = 9.81


def event_error(result: Result, *times: float) -> float:
    """Return how far the first events are from when they are known to happen, s."""
    found = [one.time for one in result.events]
    if len(found) < len(times):
        return math.inf
    return max(abs(a - b) for a, b in zip(found, times, strict=False))


def swung_rope(speed: float) -> Scene:
    """Return a bob on a rope of 1 m that is pushed at its lowest place."""
    scene = Scene(t_end=1.6)
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rope(length=1.0, when_slack="slack"))
    bob = scene.add("bob", PointMass(mass=1.0))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.velocity.x": speed})
    scene.guess["bob.position.z"] = -1.0
    return scene


def slack_and_taut(speed: float) -> tuple[float, float]:
    """Return when the rope goes slack, and when it comes taut again.

    It is slack where the weight alone bends the path as much: at the angle a from upright with 3 cos a = v^2/g - 2. The
    parabola from there meets the circle again after t = 4 v sin(a)/g with the speed v^2 = g cos a there.
    """
    above = (speed**2 / G - 2.0) / 3.0
    angle = math.pi - math.acos(above)
    up = quad(lambda q: 1.0 / math.sqrt(speed**2 - 2.0 * G * (1.0 - math.cos(q))), 0.0, angle, epsabs=1e-14)[0]
    free = 4.0 * math.sqrt(G * above) * math.sqrt(1.0 - above**2) / G
    return up, up + free


def bouncing(stiffness: float) -> Scene:
    """Return a carriage between two stiff stops."""
    scene = Scene(space="line", gravity=0.0, t_end=2.0)
    ground = scene.add("ground", Ground())
    guide = scene.add("guide", Slider(lower_stop=-0.5, upper_stop=0.5, stop_stiffness=stiffness))
    body = scene.add("body", PointMass(mass=1.0))
    scene.connect(ground.frame, guide.a)
    scene.connect(guide.b, body.point)
    scene.start.update({"guide.displacement": 0.0, "guide.speed": 3.0})
    return scene


def between_stops(stiffness: float) -> Any:
    """Return the place of the carriage: half an oscillation in each stop, even motion between."""
    w, speed = math.sqrt(stiffness), 3.0
    half = 1.0 / speed + math.pi / w  # from the middle to the same place on the way back

    def place(t: Any) -> Any:
        turns, rest = np.divmod(np.asarray(t), half)
        free = np.where(rest < 0.5 / speed, speed * rest, speed * (half - rest))
        inside = (rest > 0.5 / speed) & (rest < 0.5 / speed + math.pi / w)
        value = np.where(inside, 0.5 + speed / w * np.sin(w * (rest - 0.5 / speed)), free)
        return np.where(turns % 2 == 0, value, -value)

    return place


def several_at_once(count: int) -> Scene:
    """Return equal bobs on equal ropes that all go slack at the same time."""
    scene = Scene(t_end=1.0)
    for k in range(count):
        ground = scene.add(f"ground{k}", Ground(position=(3.0 * k, 0.0, 0.0)))
        rope, bob = scene.add(f"rope{k}", Rope(length=1.0, when_slack="slack")), scene.add(f"bob{k}", PointMass())
        scene.connect(ground.frame, rope.a)
        scene.connect(rope.b, bob.point)
        scene.start.update({f"bob{k}.position.x": 3.0 * k, f"bob{k}.velocity.x": 6.0})
        scene.guess[f"bob{k}.position.z"] = -1.0
    return scene


def dropped(height: float) -> Scene:
    """Return a bob on a slack rope, at a height below the ground where it hangs."""
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0), t_end=1.0)
    ground = scene.add("ground", Ground())
    rope = scene.add("rope", Rope(length=1.0, when_slack="slack", starts="slack"))
    bob = scene.add("bob", PointMass(mass=1.0))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start.update({"bob.position.z": -height, "bob.velocity.z": 0.0})
    return scene


NON_SMOOTH = (
    Case(
        name="rope that goes slack and comes taut",
        kind="non-smooth",
        hard="The constraint comes and goes; coming taut takes an impact.",
        better="Both: events are found on the solution's polynomial.",
        source="energy, a parabola and a circle",
        scene=lambda: swung_rope(6.0),
        asked=(1e-7, "times of the two events, s"),
        error=lambda result: event_error(result, *slack_and_taut(6.0)),
        options={"rtol": 1e-10},
    ),
    *(
        Case(
            name=f"stops of {stiffness:.0e} N/m".replace("e+0", "e").replace("e+", "e"),
            kind="non-smooth",
            hard="A force sets in within a step, eight times.",
            better="Both: where a stop begins is an event.",
            source="half oscillations and even motion",
            scene=lambda stiffness=stiffness: bouncing(stiffness),
            asked=(1e-5, "place at all outputs, m"),
            error=formula("guide.displacement", between_stops(stiffness)),
            options={"rtol": 1e-10},
        )
        for stiffness in (1e4, 1e8)
    ),
    Case(
        name="three ropes that go slack at once",
        kind="non-smooth",
        hard="Several events at one time: each has a mode of its own.",
        better="Both.",
        source="energy, a parabola and a circle",
        scene=lambda: several_at_once(3),
        asked=(1e-7, "times of all events, s"),
        error=lambda result: event_error(result, *sorted([time for time in slack_and_taut(6.0) for _ in range(3)])),
        options={"rtol": 1e-10, "t_end": 1.6},
        quick=False,
    ),
    Case(
        name="rope that comes taut at the start",
        kind="non-smooth",
        hard="The bob is at the end of its slack rope, at rest: the event is at the start itself.",
        better="Both.",
        source="it hangs",
        scene=lambda: dropped(1.0),
        asked=(1e-8, "place at all outputs, m"),
        error=formula("bob.position.z", lambda t: -1.0 + 0.0 * t),
        options={"rtol": 1e-10},
    ),
    Case(
        name="bob dropped on a slack rope",
        kind="non-smooth",
        hard="It falls freely, and hangs after one impact, which takes all its energy.",
        better="Both.",
        source="free fall",
        scene=lambda: dropped(0.2),
        asked=(1e-8, "place at all outputs, m, and time of the event, s"),
        error=largest(
            formula("bob.position.z", lambda t: np.maximum(-0.2 - 0.5 * G * t * t, -1.0)),
            lambda result: event_error(result, math.sqrt(1.6 / G)),
        ),
        options={"rtol": 1e-10},
    ),
)


def inconsistent() -> Scene:
    """Return a pendulum whose bob is said to be where its rod cannot reach."""
    scene = SimplePendulum(length=1.0)
    scene.start = {"bob.position.x": 0.9, "bob.position.z": -0.9}
    return scene


def inconsistent_speed() -> Scene:
    """Return a four-bar whose links are said to turn as they cannot."""
    scene = FourBar()
    scene.start["rocker.angular_velocity"] = 50.0
    return scene


def open_loop() -> Scene:
    """Return a four-bar whose links are too short."""
    return FourBar(crank_length=0.2, coupler_length=0.5, rocker_length=0.3, frame_length=2.5)


def in_line() -> Scene:
    """Return a parallelogram that starts with all bars in line."""
    scene = FourBar(crank_length=1.0, coupler_length=2.0, rocker_length=1.0, frame_length=2.0)
    scene.start.update({"crank.angle": 0.0, "crank.angular_velocity": 1.0})
    scene.guess.update({"coupler.angle": 0.0, "rocker.angle": 0.0})
    return scene


def refusal(name: str, hard: str, make: Any, said: str) -> Case:
    """Return a case that is refused before it runs."""
    return Case(
        name=name,
        kind="starts",
        hard=hard,
        better="Neither: it is refused before it runs, by name.",
        source="its geometry",
        scene=make,
        asked=(0.0, "that it is refused"),
        refused=said,
    )


STARTS = (
    Case(
        name="let go at an unstable equilibrium",
        kind="starts",
        hard="Nothing moves until rounding does; a method that errs falls early.",
        better="Both stay, as the start is exact.",
        source="it stays",
        scene=lambda: SimplePendulum(release_angle=math.pi),
        asked=(1e-6, "angle, rad"),
        error=formula("rod.angle", lambda t: math.pi + 0.0 * t),
        options={"t_end": 2.0, "rtol": 1e-10},
    ),
    refusal("start out of reach", "Coordinates that contradict each other.", inconsistent, "bob|rod"),
    refusal("start with speeds that do not fit", "One freedom, two speeds.", inconsistent_speed, "velocit|speed|rate"),
    refusal("loop that cannot close", "Links that are too short.", open_loop, "gap|close"),
    refusal("start at a singular position", "Where it goes is not determined.", in_line, "singular position"),
)


def driven_spring(jumps: bool) -> Scene:
    """Return a mass on a spring whose far end is moved: with jumps in acceleration, or at its own frequency."""
    scene = Scene(space="line", gravity=0.0, t_end=4.0 if jumps else 100.0)
    ground, drive = scene.add("ground", Ground()), scene.add("drive", Drive())
    source = (
        PointToPoint(travel=1.0, largest_rate=0.8, largest_acceleration=2.0, start_time=0.25)
        if jumps
        else Sine(amplitude=0.01, angular_frequency=OWN)
    )
    motion, mass = scene.add("motion", source), scene.add("mass", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=OWN**2, natural_length=1.0))
    scene.connect(motion.output("value"), drive.input("motion"))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, spring.a)
    scene.connect(spring.b, mass.point)
    scene.start.update({"mass.position.x": 1.0, "mass.velocity.x": 0.0})
    return scene


OWN = 5.0
"""Frequency of the mass on its spring, rad/s."""


def resonance(t: Any) -> Any:
    """Return x'' + w^2 x = w^2 a sin(w t) from rest: a growing oscillation."""
    return 1.0 + 0.005 * (np.sin(OWN * t) - OWN * t * np.cos(OWN * t))


def carried(t: Any) -> Any:
    """Return the mass behind a base whose acceleration is 2, 0 and -2 m/s^2 by turns.

    Each jump of the base's acceleration by a adds a (1 - cos(w s))/w^2 to how far the mass lags behind it.
    """
    t = np.asarray(t)
    base, lag = np.zeros_like(t), np.zeros_like(t)
    for when, jump in ((0.25, 2.0), (0.65, -2.0), (1.5, -2.0), (1.9, 2.0)):
        s = np.maximum(t - when, 0.0)
        base += 0.5 * jump * s * s
        lag += jump * (1.0 - np.cos(OWN * s)) / OWN**2
    return 1.0 + base - lag


DRIVEN = (
    Case(
        name="jumps in a drive's acceleration",
        kind="driven",
        hard="Steps across a jump lose their order.",
        better="Both: times at which a law changes are found before, and no step crosses them.",
        source="an oscillation for each jump",
        scene=lambda: driven_spring(jumps=True),
        asked=(1e-7, "place at all outputs, m"),
        error=formula("mass.position.x", carried),
        options={"rtol": 1e-10},
    ),
    Case(
        name="resonance for 80 periods",
        kind="driven",
        hard="Errors of phase feed the amplitude, which has grown 250 times the drive's at the end.",
        better="Reduced: errors of phase are smaller.",
        source="closed form",
        scene=lambda: driven_spring(jumps=False),
        asked=(1e-4, "place at all outputs, m"),
        error=formula("mass.position.x", resonance),
        options={"rtol": 1e-10},
    ),
)

CASES = (*NON_SMOOTH, *STARTS, *DRIVEN)
