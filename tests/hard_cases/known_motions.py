"""Motions without closed loops whose values are known to many digits: in space, in fields, at rest, in chaos."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from atwood import Model, NormalModes, Scene, normal_modes
from atwood_library import Charge, FrameSensor, Ground, PointMass, Ramp, RotaryDrive, Spring
from atwood_library.scenes import (
    Chain,
    DoubleAtwood,
    DoublePendulum,
    FreeBody,
    Kepler,
    LagrangeTop,
    RotatingHoopDriven,
    SphericalPendulum,
)

from .case import Case
from .known import known, path, vector
from .known_problems import case

SPINS = {
    "generic": (1.0, 0.0, 1.0),
    "near_separatrix": (1.73205, 0.0, 1.0),
    "separatrix_sech": (math.sqrt(3.0), 0.0, 1.0),
    "tennis_racket_perturbed": (1e-6, 1.0, 0.0),
}
TOPS = {"released_30deg_spin10": (math.pi / 6.0, 0.0, 50.0), "loops": (math.pi / 4.0, -2.0, 40.0)}
SPHERES = {
    "moderate": (math.pi / 3.0, 2.0),
    "near_vertical_fast": (math.pi / 2.0, 0.05),
    "conical_perturbed": (math.pi / 4.0, 3.8),
}


def top(inclination: float, precession: float, own: float) -> Scene:
    """Return a top by its three rates; its axis starts at (0, -sin, cos) as in the known values."""
    scene = LagrangeTop(inclination=inclination)
    scene.start["top.phi"], scene.start["top.psi"] = -0.5 * math.pi, 0.5 * math.pi
    scene.start["top.spin.x"] = 0.0
    scene.start["top.spin.y"] = precession * math.sin(inclination)
    scene.start["top.spin.z"] = own + precession * math.cos(inclination)
    return scene


SPACE = (
    *(
        case(
            "euler_top",
            which,
            "coordinates" if which == "generic" else "separatrices and chaos",
            lambda spin=spin: FreeBody(spin=spin),
            {"omega": vector("body.spin"), "axis": vector("body.z_axis")},
            "Orientations have no three coordinates without singular places; near the separatrix errors grow by e each "
            "1 to 2 s until it turns over.",
            "Landau and Lifshitz, Mechanics, section 37, with 45 digits",
            name=f"free body, {which.replace('_', ' ').replace(' sech', '')}",
            until=10.0 if which == "separatrix_sech" else math.inf,
            better="Both: quaternions without drift, and explicit methods.",
            limits={"reduced": 1e-5, "dae": 1e-4} if which != "generic" else {},
        )
        for which, spin in SPINS.items()
    ),
    *(
        case(
            "lagrange_top",
            which,
            "coordinates",
            lambda start=start: top(*start),
            {"axis": vector("top.z_axis")},
            "Fast spin and slow precession; the axis passes the vertical, where Euler angles are singular.",
            "Landau and Lifshitz, section 35; Goldstein, chapter 5",
            name=f"heavy top, {which.replace('_', ' ')}",
            better="Both: quaternions without drift, and explicit methods.",
        )
        for which, start in TOPS.items()
    ),
    *(
        case(
            "spherical_pendulum",
            which,
            "coordinates",
            lambda start=start: SphericalPendulum(inclination=start[0], azimuth_rate=start[1]),
            {"position": vector("bob.position"), "velocity": vector("bob.velocity")},
            "Spherical angles have no value at the lowest point, which it passes nearby.",
            "Landau and Lifshitz, section 14; Whittaker",
            name=f"spherical pendulum, {which.replace('_', ' ')}",
            better="Both: coordinates are Cartesian, and regular everywhere.",
            options={"rtol": 1e-10},
            limits={"dae": 1e-5, "reduced": 1e-5},
        )
        for which, start in SPHERES.items()
    ),
)


def charge(values: Mapping[str, Any]) -> Scene:
    """Return a charged mass in uniform fields."""
    scene = Scene(space="space", gravity=0.0)
    bx, by, bz = values["magnetic"]
    ex, ey, ez = values["electric"]
    source = scene.add("source", Charge(charge=values["charge"]))
    body = scene.add("body", PointMass(mass=values["mass"]))
    scene.set("source.scalar_potential", lambda x, y, z: -(ex * x + ey * y + ez * z))
    scene.set(
        "source.vector_potential",
        lambda x, y, z: (0.5 * (by * z - bz * y), 0.5 * (bz * x - bx * z), 0.5 * (bx * y - by * x)),
    )
    scene.connect(source.point, body.point)
    for axis, place, speed in zip("xyz", values["place"], values["velocity"], strict=True):
        scene.start.update({f"body.position.{axis}": place, f"body.velocity.{axis}": speed})
    return scene


FIELDS_OF: Mapping[str, Mapping[str, Any]] = {
    "uniform_B_helix": {
        "charge": 1.0,
        "mass": 1.0,
        "magnetic": (0.0, 0.0, 2.0),
        "electric": (0.0, 0.0, 0.0),
        "place": (0.0, 0.0, 0.0),
        "velocity": (1.0, 0.0, 0.5),
    },
    "crossed_cycloid": {
        "charge": 1.0,
        "mass": 1.0,
        "magnetic": (0.0, 0.0, 1.0),
        "electric": (0.0, 0.5, 0.0),
        "place": (0.0, 0.0, 0.0),
        "velocity": (0.0, 0.0, 0.0),
    },
    "oblique_E_parallel_part": {
        "charge": -1.5,
        "mass": 0.7,
        "magnetic": (0.3, -0.4, 1.2),
        "electric": (0.2, 0.1, -0.05),
        "place": (1.0, 2.0, 3.0),
        "velocity": (0.4, -0.3, 0.8),
    },
}


def foucault(rate: float, frequency: float, amplitude: float) -> Scene:
    """Return small swings on a platform that turns, without the centrifugal force: a spring that pulls it back too.

    In a frame at rest that is a mass on a spring of sqrt(frequency^2 + rate^2).
    """
    scene = Scene(space="space", gravity=0.0)
    ground, body = scene.add("ground", Ground()), scene.add("body", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=frequency**2 + rate**2, natural_length=0.0))
    clock, turning = scene.add("clock", Ramp(slope=rate)), scene.add("turning", RotaryDrive(axis=(0.0, 0.0, 1.0)))
    view = scene.add("view", FrameSensor())
    scene.connect(clock.output("value"), turning.input("rotation"))
    scene.connect(ground.frame, turning.a)
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, body.point)
    scene.connect(view.frame, turning.b)
    scene.connect(view.point, body.point)
    scene.start.update({"body.position.x": amplitude, "body.position.y": 0.0, "body.position.z": 0.0})
    scene.start.update({"body.velocity.x": 0.0, "body.velocity.y": rate * amplitude, "body.velocity.z": 0.0})
    return scene


PLATFORMS = {
    "paris_pantheon": (7.292115e-5 * math.sin(math.radians(48.846)), math.sqrt(9.81 / 67.0), 3.0),
    "exaggerated": (0.05 * math.sin(math.radians(30.0)), math.sqrt(9.81), 0.01),
}
HOOPS = {"rate 3": 3.0, "rate 4.43": 4.4294469180700204, "rate 6": 6.0, "rate 12": 12.0}

FIELDS = (
    *(
        case(
            "charged_particle",
            which,
            "long",
            lambda values=values: charge(values),
            {"x": path("body.position.x"), "y": path("body.position.y"), "z": path("body.position.z")},
            "Forces that depend on velocities and do no work; dozens of turns.",
            "Landau and Lifshitz, The Classical Theory of Fields, sections 21 and 22",
            name=f"charge in fields, {which.replace('_', ' ')}",
        )
        for which, values in FIELDS_OF.items()
    ),
    *(
        case(
            "foucault",
            which,
            "long",
            lambda values=values: foucault(*values),
            {"x": path("view.position.x"), "y": path("view.position.y")},
            "A weak effect that adds up over many swings, seen from a frame that turns.",
            "Landau and Lifshitz, section 39, problem 3",
            name=f"small swings on a turning platform, {which.replace('_', ' ')}",
        )
        for which, values in PLATFORMS.items()
    ),
    *(
        case(
            "bead_on_hoop",
            which,
            "driven",
            lambda rate=rate: RotatingHoopDriven(radius=0.5, rate=rate, inclination=math.pi - 2.5),
            {
                "theta": path("hoop.angle", -1.0, math.pi),
                "thetadot": path("hoop.angular_velocity", -1.0),
                "drive_torque_per_m": path("drive.motor_torque"),
            },
            "A drive whose torque is the reaction; at 4.43 rad/s the lowest place has no frequency.",
            "closed form by elliptic functions",
            name=f"bead on a hoop that is turned at {rate:.3g} rad/s",
        )
        for which, rate in HOOPS.items()
    ),
    *(
        case(
            "kepler",
            which,
            "scales",
            lambda which=which: Kepler(eccentricity=float(which)),
            {axis: path(f"body.{name}") for axis, name in zip(("x", "y"), ("position.x", "position.z"), strict=True)},
            "At e = 0.99 it is 199 times as fast near the centre as far away; errors of phase grow with every turn.",
            "Kepler's equation",
            name=f"Kepler's ellipse of eccentricity {which}, 16 turns",
            better="Both: step sizes follow; series take a third to a fifth of the steps.",
        )
        for which in ("0.5", "0.9", "0.99")
    ),
)


def double_pendulum(angle: float) -> Scene:
    """Return a double pendulum let go with both rods at an angle."""
    scene = DoublePendulum()
    scene.start.update({"rod1.angle": angle, "rod2.angle": angle})
    return scene


CHAOS = tuple(
    case(
        "double_pendulum_chaotic",
        which,
        "separatrices and chaos",
        lambda angle=angle: double_pendulum(angle),
        {"theta1": path("rod1.angle"), "theta2": path("rod2.angle")},
        f"An early error has grown by {growth:.0e} at the end.",
        "two independent solutions with 28 digits",
        name=f"double pendulum from {angle:.3g} rad for {until:g} s",
        until=until,
        options={"rtol": 1e-13},
        ways={
            "reduced, Taylor series": {"solver": "taylor"},
            "reduced, explicit": {"solver": "explicit"},
            "dae": {"form": "dae", "rtol": 1e-12},
        },
        asked=1e-15 * growth * 1e3,
        limits={"dae": 1e-11 * growth * 1e2},
        better="Reduced, with Taylor series: its errors are near those of rounding, times their growth.",
    )
    for which, angle, until, growth in (
        ("pi/2_pi/2", 0.5 * math.pi, 20.0, 9.4e5),
        ("3.0_3.0", 3.0, 5.0, 2.8e4),
    )
)


def atwood_machine(mass1: float, mass2: float, mass3: float, pulley: float = 0.0) -> Scene:
    """Return a double Atwood machine whose moving pulley may have a mass."""
    scene = DoubleAtwood(mass1=mass1, mass2=mass2, mass3=mass3)
    if pulley:
        weight = scene.add("weight", PointMass(mass=pulley))
        scene.connect(weight.point, scene.pulley2.center)
    return scene


MACHINES = {
    "4-3-1": (4.0, 3.0, 1.0),
    "1-2-3": (1.0, 2.0, 3.0),
    "8-5-3_pulley2": (8.0, 5.0, 3.0, 2.0),
    "balanced 4-... (a1=0)": (8.0 / 3.0, 2.0, 1.0),
    "tiny_mass": (1.0, 1e-6, 3.0),
}


def springs(masses: tuple[float, ...], stiffness: tuple[float, ...]) -> Scene:
    """Return masses on a line between two walls."""
    scene = Scene(space="line", gravity=0.0)
    ends = [scene.add("left", Ground()).frame]
    for k, mass in enumerate(masses):
        ends.append(scene.add(f"mass{k}", PointMass(mass=mass)).point)
        scene.start[f"mass{k}.position.x"] = float(k + 1)
    ends.append(scene.add("right", Ground(position=(float(len(ends)), 0.0, 0.0))).frame)
    for k, value in enumerate(stiffness):
        spring = scene.add(f"spring{k}", Spring(stiffness=value, natural_length=1.0))
        scene.connect(ends[k], spring.a)
        scene.connect(spring.b, ends[k + 1])
    return scene


def hanging(links: int) -> Scene:
    """Return a chain of equal links with gravity 1, so that its frequencies are those over sqrt(g/l)."""
    scene = Chain(links=links, mass=1.0, length=float(links))
    scene.set("gravity", 1.0)
    for k in range(links):
        scene.start[f"rod[{k}].angle"] = 0.0
    return scene


OSCILLATORS: Mapping[str, Any] = {
    "two_mass_three_spring_equal": lambda: springs((1.0, 1.0), (1.0, 1.0, 1.0)),
    "two_mass_three_spring_general": lambda: springs((2.0, 3.0), (100.0, 40.0, 70.0)),
    "two_mass_three_spring_stiff": lambda: springs((1.0, 1.0), (1.0, 1e6, 1.0)),
    "double_pendulum_equal_1_1": lambda: DoublePendulum(mass1=1.0, mass2=1.0, length1=1.0, length2=1.0),
    "double_pendulum_general": lambda: DoublePendulum(mass1=3.0, mass2=0.5, length1=0.8, length2=1.7),
    **{f"mass_chain_fixed_fixed_N{n}": lambda n=n: springs((1.0,) * n, (1.0,) * (n + 1)) for n in (3, 10, 50)},
    **{f"nlink_pendulum_N{n}": lambda n=n: hanging(n) for n in (2, 3, 5, 10)},
}


def modes(scene: Model) -> NormalModes:
    """Return the small oscillations about where it hangs."""
    hangs = {name: 0.0 for name in scene.start if name.endswith(".angle")}
    return normal_modes(scene, at=hangs or None)


def frequencies(which: str) -> Any:
    """Return the largest relative error of the frequencies."""
    exact = np.array(known("normal_modes", which)[0.0]["omega"])
    return lambda found: float(np.max(np.abs(np.sort(found.angular_frequencies) / exact - 1.0)))


AT_REST = (
    *(
        case(
            "double_atwood",
            which,
            "at rest",
            lambda masses=masses: atwood_machine(*masses),
            {
                "a1": path("m1.acceleration.z", -1.0),
                "a2": path("m2.acceleration.z", -1.0),
                "a3": path("m3.acceleration.z", -1.0),
                "upper": path("rope1.tension"),
                "lower": path("rope2.tension"),
            },
            "Ropes over pulleys are linear constraints; one mass may be a millionth of the other.",
            "balance of each mass, in fractions",
            name=f"double Atwood machine, {which.split('_')[0].split(' ')[0]}",
            options={"rtol": 1e-10, "t_end": 0.1},
            asked=1e-9,
            better="Both: the constraints are eliminated exactly, or kept.",
        )
        for which, masses in MACHINES.items()
    ),
    *(
        Case(
            name=f"small oscillations, {which.replace('_', ' ')}",
            kind="at rest",
            hard="Eigenvalues of a mechanism whose constraints have none, from far apart to close together.",
            better="One form: the equations are differentiated exactly.",
            source="closed forms; zeros of Laguerre's polynomials for the chain of links",
            scene=make,
            asked=(1e-8, "relative error of each frequency"),
            error=frequencies(which),
            ways={"linear model": {}},
            run=modes,
            quick="50" not in which,
        )
        for which, make in OSCILLATORS.items()
    ),
)

CASES = (*SPACE, *FIELDS, *CHAOS, *AT_REST)
