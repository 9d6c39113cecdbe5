"""Motion in space that stays in a plane or on a line by symmetry: found where it does, and nowhere else."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

import atwood
from atwood import (
    BodyInertia,
    Component,
    Frame,
    Load,
    Point,
    Scalar,
    Scene,
    Vector,
    connector,
    force,
    inertia,
    parameter,
    potential,
    report,
    select,
    simulate,
)
from atwood.reporting import Offer
from atwood.simulation.initialization.start import find_start
from atwood.theory.symmetry.generic import LooseScene
from atwood_library import (
    Box,
    Cone,
    Cylinder,
    Damper,
    Disc,
    Force,
    Ground,
    Pivot,
    PointMass,
    RigidBody,
    Rod,
    Slider,
    Spherical,
    Spring,
    Weld,
)
from atwood_library.scenes import (
    SCENES,
    Chain,
    DoublePendulum,
    DrivenPendulum,
    FoucaultPendulum,
    FourBar,
    FreeBody,
    LagrangeTop,
    PendulumOnCart,
    SimplePendulum,
    SphericalPendulum,
)


def offers(scene: Scene) -> tuple[Offer, ...]:
    return report(scene).offers


def alone(part: Component, **start: float) -> Scene:
    """One part by itself, thrown."""
    scene = Scene(space="space")
    scene.add("part", part)
    scene.start.update({f"part.{path.replace('_', '.')}": value for path, value in start.items()})
    return scene


def thrown(vx: float, vy: float, vz: float) -> Scene:
    scene = alone(PointMass())
    for quantity, values in (("position", (0.0, 0.0, 0.0)), ("velocity", (vx, vy, vz))):
        scene.start.update({f"part.{quantity}.{axis}": v for axis, v in zip("xyz", values, strict=True)})
    return scene


def hung(body: Component, joint: Component, at: str, **start: float) -> Scene:
    """A body on a joint."""
    scene = Scene(space="space")
    ground, held, part = scene.add("ground", Ground()), scene.add("joint", joint), scene.add("part", body)
    scene.connect(ground.frame, held.connectors()["a"])
    scene.connect(held.connectors()["b"], part.connectors()[at])
    scene.start.update({path.replace("__", "."): value for path, value in start.items()})
    return scene


def on_springs(y: float) -> Scene:
    """A mass between two springs, of which one may be fastened aside."""
    scene = thrown(0.3, 0.0, 0.0)
    scene.start["part.position.z"] = -1.0
    for name, place in (("left", (-1.0, 0.0, 0.0)), ("right", (1.0, y, 0.3))):
        ground = scene.add(f"{name}_ground", Ground(position=place))
        spring = scene.add(name, Spring(stiffness=30.0, natural_length=0.5))
        damper = scene.add(f"{name}_damper", Damper(damping=0.2))
        for one in (spring, damper):
            scene.connect(ground.frame, one.connectors()["a"])
            scene.connect(one.connectors()["b"], scene["part"].connectors()["point"])
    return scene


def double_hinge(tilt: float) -> Scene:
    """Two cylinders on two hinges, of which the second may be tilted."""
    scene = hung(Cylinder(radius=0.1), Pivot(axis=(0.0, 1.0, 0.0)), "b", joint__angle=0.4)
    second = scene.add("second", Pivot(axis=(tilt, 1.0, 0.0)))
    lower = scene.add("lower", Cylinder(radius=0.1))
    scene.connect(scene["part"].connectors()["a"], second.a)
    scene.connect(second.b, lower.b)
    scene.start["second.angle"] = 0.3
    return scene


def pushed(value: Any) -> Scene:
    """A spherical pendulum in the plane, with a force along y as a function of time."""
    return _with_force((0.0, 1.0, 0.0), value)


class Gust(Component):
    """A force that only acts beyond a place along x."""

    ahead: float = parameter(0.0, unit="N", doc="Force along x.")
    aside: float = parameter(0.0, unit="N", doc="Force along y.")
    beyond: float = parameter(0.5, unit="m", doc="Place beyond which it acts.")
    at: Point = connector(Point, "Where it acts.")

    @force
    def blow(self) -> Iterable[Load]:
        """Return the force."""
        is_there = self.at.position.x > self.beyond
        yield Load(self.at, Vector(select(is_there, self.ahead, 0.0), select(is_there, self.aside, 0.0), 0.0))


class Patch(Component):
    """A force along y, or along x, that acts in a narrow place only."""

    ahead: float = parameter(0.0, unit="N", doc="Force along x.")
    aside: float = parameter(0.0, unit="N", doc="Force along y.")
    at: Point = connector(Point, "Where it acts.")

    @force
    def blow(self) -> Iterable[Load]:
        """Return the force."""
        share = atwood.exp(-(((self.at.position.x + 0.4) / 1e-3) ** 2))
        yield Load(self.at, Vector(self.ahead * share, self.aside * share, 0.0))


class Band(Component):
    """A band that only pulls."""

    stiffness: float = parameter(50.0, unit="N/m", doc="Force for a metre.")
    length: float = parameter(1.0, unit="m", doc="Length at which it begins to pull.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @potential
    def energy(self) -> Scalar:
        """Return the energy."""
        stretch = atwood.maximum(self.distance(self.a, self.b) - self.length, 0.0)
        return 0.5 * self.stiffness * stretch * stretch


def on_bands(y: float, length: float = 1.0) -> Scene:
    """A mass thrown between two bands on both sides."""
    scene = thrown(1.0, 0.0, 0.5)
    for name, place in (("left", (0.0, -1.0, 0.0)), ("right", (0.0, 1.0 + y, 0.0))):
        band = scene.add(name, Band(length=length))
        scene.connect(scene.add(f"{name}_ground", Ground(position=place)).frame, band.a)
        scene.connect(band.b, scene["part"].connectors()["point"])
    return scene


def aside(scene: Scene, azimuth: float, push: float = 0.0) -> Scene:
    """Two bobs on rods, let go in a vertical plane at an azimuth; the lower one may be thrown out of it."""
    scene.add("ground", Ground())
    before = scene["ground"].connectors()["frame"]
    c, s = math.cos(azimuth), math.sin(azimuth)
    for number, (r, z) in enumerate(((0.6, -0.8), (0.6 + 0.28, -0.8 - 0.96))):
        rod, bob = scene.add(f"rod{number}", Rod(length=1.0)), scene.add(f"bob{number}", PointMass(mass=1.0 + number))
        scene.connect(before, rod.a)
        scene.connect(rod.b, bob.point)
        before = bob.point
        start = {"position": (r * c, r * s, z), "velocity": (-number * push * s, number * push * c, 0.0)}
        for name, values in start.items():
            scene.start.update({f"bob{number}.{name}.{axis}": v for axis, v in zip("xyz", values, strict=True)})
    return scene


class Twist(Component):
    """A force square to the velocity, as that of a magnetic field along z."""

    strength: float = parameter(1e-6, unit="kg/s", doc="Charge times field.")
    at: Point = connector(Point, "Where it acts.")

    @force
    def deflect(self) -> Iterable[Load]:
        """Return the force."""
        v = self.at.velocity
        yield Load(self.at, force=Vector(self.strength * v.y, -self.strength * v.x, 0.0))


def with_part(part: Component) -> Scene:
    scene = SphericalPendulum(azimuth_rate=0.0)
    scene.connect(scene.add("extra", part).connectors()["at"], scene["bob"].connectors()["point"])
    return scene


def upright(spin: float) -> Scene:
    scene = LagrangeTop()
    scene.start.update({"top.spin.x": 0.0, "top.spin.y": 0.0, "top.spin.z": spin})
    for path in [one for one in scene.start if "rate" in one]:
        del scene.start[path]
    return scene


SKEW = RigidBody(mass=1.0, center=(0.0, 0.0, -0.5), moments=(0.1, 0.1, 0.05), products=(0.0, 0.0, 0.01))
EVEN = RigidBody(mass=1.0, center=(0.0, 0.0, -0.5), moments=(0.1, 0.1, 0.05), products=(0.0, 0.02, 0.0))
X_Z, ALONG_Z = "in the plane x-z", "on a line along z"

STAYS: dict[str, tuple[Callable[[], Scene], tuple[str, ...]]] = {
    "spherical pendulum": (lambda: SphericalPendulum(azimuth_rate=0.0), (X_Z,)),
    "simple pendulum": (lambda: SimplePendulum(space="space"), (X_Z,)),
    "double pendulum": (lambda: DoublePendulum(space="space"), (X_Z,)),
    "chain": (lambda: Chain(links=4, space="space"), (X_Z,)),
    "pendulum on a cart": (lambda: PendulumOnCart(space="space"), (X_Z,)),
    "driven pendulum": (lambda: DrivenPendulum(space="space"), (X_Z,)),
    "four-bar": (lambda: SCENES["four-bar"](space="space"), (X_Z,)),
    "slider-crank": (lambda: SCENES["slider-crank"](space="space"), (X_Z,)),
    "row of four-bars": (lambda: SCENES["four-bar-row"](space="space"), (X_Z,)),
    "Atwood's machine": (lambda: SCENES["atwood"](space="space"), (ALONG_Z, X_Z)),
    "fall": (lambda: thrown(0.0, 0.0, 2.0), (ALONG_Z, X_Z)),
    "throw": (lambda: thrown(1.0, 0.0, 2.0), (X_Z,)),
    "oblique throw": (lambda: thrown(1.0, 1.0, 2.0), ("in a plane square to (0.7071, -0.7071, 0)",)),
    "throw across": (lambda: thrown(0.0, 1.0, 2.0), ("in the plane y-z",)),
    "spinning wheel": (lambda: alone(Disc(thickness=0.1), spin_x=0.0, spin_y=3.0, spin_z=0.0), (X_Z,)),
    "hinge that bears the couple": (lambda: hung(SKEW.copy(), Pivot(), "frame", joint__angle=0.5), (X_Z,)),
    "hinge along x": (
        lambda: hung(EVEN.copy(), Pivot(axis=(1.0, 0.0, 0.0)), "frame", joint__angle=0.5),
        ("in the plane y-z",),
    ),
    "body on a ball": (lambda: hung(EVEN.copy(), Spherical(), "frame", part__theta=0.5, part__phi=0.0), (X_Z,)),
    "two springs": (lambda: on_springs(0.0), (X_Z,)),
    "two hinges": (lambda: double_hinge(0.0), (X_Z,)),
    "push in the plane": (lambda: _with_force((1.0, 0.0, 0.5), lambda t: select(t > 3.0, 5.0, 0.0)), (X_Z,)),
    "bouncing slide": (
        lambda: hung(Box(), Slider(axis=(0.0, 0.0, 1.0), stop_stiffness=1e3, lower_stop=-0.5), "frame"),
        (ALONG_Z, X_Z),
    ),
    "gust in the plane": (lambda: with_part(Gust(ahead=1.0)), (X_Z,)),
    "narrow gust in the plane": (lambda: with_part(Patch(ahead=1.0)), (X_Z,)),
    "bands on both sides": (lambda: on_bands(0.0), (X_Z,)),
    "slack bands on both sides": (lambda: on_bands(0.0, length=3.0), (X_Z,)),
    "pendulum aside": (lambda: aside(Scene(space="space"), 1.1), ("in a plane square to (0.8912, -0.4536, 0)",)),
    "top that falls": (lambda: upright(0.0), (X_Z,)),
}


def _with_force(direction: tuple[float, float, float], value: Any) -> Scene:
    scene = SphericalPendulum(azimuth_rate=0.0)
    scene.connect(scene.add("push", Force(direction=direction, value=value)).point, scene["bob"].connectors()["point"])
    return scene


@pytest.mark.sample(14)
@pytest.mark.parametrize("name", STAYS)
def test_what_stays_is_found(name: str) -> None:
    make, expected = STAYS[name]
    assert tuple(one.where for one in offers(make())) == expected


LEAVES: dict[str, Callable[[], Scene]] = {
    "Foucault's pendulum": FoucaultPendulum,
    "Foucault's pendulum, hardly turning": lambda: FoucaultPendulum(rate=1e-6),
    "top": LagrangeTop,
    "top that hardly spins": lambda: upright(1e-6),
    "pendulum that goes round": SphericalPendulum,
    "pendulum that hardly goes round": lambda: SphericalPendulum(azimuth_rate=1e-6),
    "tumbling body": FreeBody,
    "body that hardly tumbles": lambda: FreeBody(spin=(0.0, 1.0, 1e-7)),
    "body with a small product of inertia": lambda: hung(
        RigidBody(mass=1.0, center=(0.0, 0.0, -0.5), moments=(0.1, 0.1, 0.05), products=(1e-6, 0.0, 0.0)),
        Spherical(),
        "frame",
        part__theta=0.5,
        part__phi=0.0,
    ),
    "body with its weight a little aside": lambda: hung(
        RigidBody(mass=1.0, center=(0.0, 1e-6, -0.5), moments=(0.1, 0.1, 0.05)),
        Spherical(),
        "frame",
        part__theta=0.5,
        part__phi=0.0,
    ),
    "spring fastened aside": lambda: on_springs(1e-5),
    "tilted hinge": lambda: double_hinge(1e-5),
    "push by the clock": lambda: pushed(lambda t: select(t > 9.0, 1e-3, 0.0)),
    "short push": lambda: pushed(lambda t: atwood.exp(-(((t - 3.0) / 1e-3) ** 2))),
    "gust beyond a place": lambda: with_part(Gust(aside=1.0)),
    "narrow gust": lambda: with_part(Patch(aside=1.0)),
    "band a little aside": lambda: on_bands(1e-4),
    "slack band a little aside": lambda: on_bands(1e-4, length=3.0),
    "pendulum aside, thrown": lambda: aside(Scene(space="space"), 1.1, 1e-8),
    "fast wheel, pushed": lambda: _pushed_wheel(1e3, 1e-5),
    "gust far away": lambda: with_part(Gust(aside=1.0, beyond=1e3)),
    "field along z": lambda: with_part(Twist()),
    "universal shaft": lambda: SCENES["universal-shaft"](),
    "gyroscope": lambda: SCENES["gyroscope"](),
    "Bricard": lambda: SCENES["bricard"](),
    "platform": lambda: SCENES["stewart-platform"](),
    "rest": lambda: hung(Cone(), Pivot(), "tip", joint__angle=math.pi),
}


def _pushed_wheel(spin: float, push: float) -> Scene:
    scene = alone(Disc(thickness=0.1), spin_x=0.0, spin_y=spin, spin_z=0.0)
    scene.connect(
        scene.add("push", Force(direction=(0.0, 1.0, 0.0), value=push)).point, scene["part"].connectors()["frame"]
    )
    return scene


@pytest.mark.sample(14)
@pytest.mark.parametrize("name", LEAVES)
def test_what_leaves_is_not_offered(name: str) -> None:
    assert offers(LEAVES[name]()) == ()


SAME = [
    "simple pendulum",
    "double pendulum",
    "chain",
    "pendulum on a cart",
    "driven pendulum",
    "four-bar",
    "slider-crank",
    "row of four-bars",
    "Atwood's machine",
]
PLANAR = [
    "simple-pendulum",
    "double-pendulum",
    "chain",
    "pendulum-on-cart",
    "driven-pendulum",
    "four-bar",
    "slider-crank",
    "four-bar-row",
    "atwood",
]


@pytest.mark.parametrize(("name", "planar"), list(zip(SAME, PLANAR, strict=True)))
def test_the_library_s_own_scenes_cost_there_what_they_cost(name: str, planar: str) -> None:
    own = report(Chain(links=4) if planar == "chain" else SCENES[planar]())
    found = report(STAYS[name][0]())
    assert found.offers[0].states == own.states
    assert found.offers[0].operations == own.operations
    assert found.offers[0].to_dict()["states"] == own.states
    for form, count in own.states.items():
        assert count <= found.states[form]


@pytest.mark.sample(6)
@pytest.mark.parametrize("name", [*SAME, "spinning wheel", "body on a ball", "two springs", "two hinges", "fall"])
def test_the_motion_is_the_same(name: str) -> None:
    scene = STAYS[name][0]()
    there = offers(scene)[0].assembly
    assert there is not None
    span = min(0.5, float(scene.t_end))
    here, other = (simulate(x, t_end=span, rtol=1e-12, outputs=6) for x in (scene, there))
    axes = ("x", "z") if there.mechanism.space.name == "plane" else ("z",)
    paths = [path for path in here.paths if path in set(other.paths) and path.endswith((".angle", ".displacement"))]
    paths += [path for path in here.paths if path.endswith(tuple(f"position.{axis}" for axis in axes))]
    paths = [path for path in paths if path in set(other.paths)]
    assert paths
    for path in paths:
        size = max(1.0, float(np.max(np.abs(here[path]))))
        assert np.max(np.abs(here[path] - other[path])) < 1e-9 * size, path


def test_other_planes_are_said_in_words() -> None:
    (found,) = offers(STAYS["hinge along x"][0]())
    assert found.assembly is None
    assert not found.states
    assert "turned by 90 deg about z" in found.why_not
    assert "in the plane y-z" in str(report(STAYS["hinge along x"][0]()))


def test_a_body_whose_frame_is_turned_out_of_the_plane_is_not_taken_for_another() -> None:
    scene = alone(RigidBody(moments=(0.1, 0.2, 0.25)), spin_x=0.0, spin_y=0.0, spin_z=3.0)
    scene.start.update({"part.phi": 0.5 * math.pi, "part.theta": 0.5 * math.pi, "part.psi": 0.0})
    (found,) = offers(scene)
    assert (found.where, found.states) == (X_Z, {})
    assert found.why_not


class Odd(Component):
    """A body that is another one in a plane."""

    frame: Frame = connector(Frame, "Its frame.")

    @inertia
    def body(self) -> Iterable[BodyInertia]:
        """Return the inertia."""
        yield BodyInertia(self.frame, 1.0, Vector(0.0, 0.0, -0.3), 0.1, ((0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.2)))


def test_a_body_that_is_another_one_in_a_plane_is_not_offered() -> None:
    (found,) = offers(hung(Odd(), Pivot(), "frame", joint__angle=0.4))
    assert not found.states
    assert "moment of inertia of part" in found.why_not


def test_parts_of_space_alone_are_not_offered_in_a_plane() -> None:
    scene = SCENES["double-pendulum-3d"]()
    scene.start.update(dict.fromkeys(scene.start, 0.0))
    scene.start["joint1.angle_b"] = 0.5
    (found,) = offers(scene)
    assert (found.where, found.states) == (X_Z, {})
    assert "plane" in found.why_not


def test_the_report_says_what_would_be_saved() -> None:
    found = report(SphericalPendulum(azimuth_rate=0.0))
    text = " ".join(str(found).split())
    there, here = (sum(of["reduced"].values()) for of in (found.offers[0].operations, found.operations))
    assert "in the plane x-z" in text
    assert f"2 states instead of 6, {there} operations instead of {here}" in text
    assert found.to_dict()["offers"][0]["space"] == "plane"


def test_scenes_in_a_plane_are_not_looked_at() -> None:
    assert offers(SimplePendulum()) == ()


def test_welded_bodies_with_turns_may_be_offered() -> None:
    scene = hung(Box(length_x=0.8, length_y=0.1, length_z=0.1), Pivot(), "a", joint__angle=0.2)
    weld, disc = scene.add("weld", Weld(displacement=(0.0, 0.2, 0.0), angle=0.7)), scene.add("disc", Disc(mass=0.5))
    scene.connect(scene["part"].connectors()["b"], weld.a)
    scene.connect(weld.b, disc.frame)
    (found,) = offers(scene)
    assert found.states["reduced"] == 2
    rod = scene.add("rod", Rod(length=1.0))
    bob = scene.add("bob", PointMass())
    scene.connect(disc.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.guess.update({"bob.position.x": 1.0, "bob.position.y": 0.0, "bob.position.z": -0.9})
    assert offers(scene) == ()


@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e6])
def test_no_unit_of_length_decides(scale: float) -> None:
    lengths = {"crank_length": 1.0, "coupler_length": 2.5, "rocker_length": 2.0, "frame_length": 2.5}
    scene = FourBar(space="space", **{name: scale * length for name, length in lengths.items()})
    scene.gravity = 9.81 * scale
    assembly = atwood.assemble(scene)
    start = find_start(assembly)
    loose = LooseScene(assembly, start)
    still = np.zeros(len(loose.sizes))
    now, bodies = loose.at(0.0, start.coordinates, still)
    rows = np.concatenate([now.jacobian[loose.holonomic], *bodies.by_place]) * loose.sizes
    sizes, units = np.max(np.abs(rows), axis=1), loose.row_units(0.0, start.coordinates, rows, len(bodies.by_place) * 3)
    known = sizes > 1e-9 * scale  # of the constraints some hold what stays in the plane anyway
    assert np.array_equal(units[known], sizes[known])
    assert np.all(units[~known] > 1e-6 * scale)
    assert [one.space for one in report(scene).offers] == ["plane"]
