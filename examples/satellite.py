"""Satellites held upright by the gradient of gravity: libration, and what tumbles, on one circular orbit."""

import math
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import atwood
from atwood_library import CentralGravity, Ground, RigidBody

MU, RADIUS = 3.986004418e14, 6.878e6  # m^3/s^2, m
MOMENTS = (5.0, 60.0, 58.0)  # kg m^2 about the vertical, the orbit's normal, the way of flight
RATE = math.sqrt(MU / RADIUS**3)


def satellite(pitch: float) -> atwood.Scene:
    """Return a satellite that is turned by a pitch angle, rad, and turns with its orbit, in the plane of the orbit."""
    scene = atwood.Scene(space="plane", gravity=0.0)
    earth, craft = scene.add("earth", Ground()), scene.add("craft", RigidBody(mass=500.0, moments=MOMENTS))
    pull = CentralGravity(gravitational_parameter=MU, attracts="body")
    scene.add("pull", pull)
    scene.connect(earth.frame, scene.pull.source)
    scene.connect(scene.pull.frame, craft.frame)
    scene.start.update({"craft.position.x": RADIUS, "craft.velocity.z": RATE * RADIUS})
    scene.start.update({"craft.angle": pitch, "craft.angular_speed": RATE})
    return scene


figure, axes = plt.subplots(figsize=(8.0, 4.2), layout="constrained")
small = RATE * math.sqrt(3.0 * (MOMENTS[2] - MOMENTS[0]) / MOMENTS[1])
for degrees in (2.0, 30.0, 60.0, 85.0):
    result = atwood.simulate(satellite(math.radians(degrees)), t_end=6.0 * math.pi / RATE, rtol=1e-11, outputs=1201)
    place = np.unwrap(np.arctan2(result["craft.position.z"], result["craft.position.x"]))
    pitch = np.degrees(result["craft.angle"] - place)
    down = np.nonzero((pitch[:-1] > 0.0) & (pitch[1:] <= 0.0))[0]
    times = result.time[down] + pitch[down] / (pitch[down] - pitch[down + 1]) * np.diff(result.time)[down]
    swings = 2.0 * math.pi / np.mean(np.diff(times)) / small
    print(f"from {degrees:4.0f} degrees: {swings:.5f} of the frequency of small librations")
    axes.plot(result.time * RATE / (2.0 * math.pi), pitch, label=f"released at {degrees:.0f}°")
axes.set(xlabel="orbits", ylabel="pitch from the vertical, degrees")
axes.grid(alpha=0.3)
axes.legend(loc="upper right", ncols=4, fontsize="small")
axes.set_ylim(-95.0, 110.0)

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs" / "images"
folder.mkdir(parents=True, exist_ok=True)
figure.savefig(folder / "satellite.png", dpi=120)
