"""An epicyclic gear with three planets in a ring that stands still: one state, and a planet's rim draws its path."""

import math
import sys
from pathlib import Path

import atwood
from atwood_library import Disc, Gear, Ground, Pivot, RigidBody, Torque, Weld

SUN, PLANET = 24, 12  # teeth
RING = SUN + 2 * PLANET
TOOTH = 0.005  # radius for one tooth, m

scene = atwood.Scene(space="plane", gravity=0.0)
ground, ring = scene.add("ground", Ground()), scene.add("ring", Disc(mass=1.0, radius=0.27, inner_radius=RING * TOOTH))
carrier = scene.add("carrier", RigidBody(mass=0.5, moments=(0.001, 0.002, 0.001)))
sun = scene.add("sun", Disc(mass=1.0, radius=SUN * TOOTH))
motor = scene.add("motor", Torque(value=0.2))
# Seen from the carrier, both the sun and the ring turn.
at_ring, at_sun = scene.add("at_ring", Pivot()), scene.add("at_sun", Pivot())
scene.connect(ground.frame, ring.frame)
scene.connect(carrier.frame, at_ring.a)
scene.connect(at_ring.b, ground.frame)
scene.connect(carrier.frame, at_sun.a)
scene.connect(at_sun.b, sun.frame)
scene.connect(motor.frame, sun.frame)
for number in range(3):
    turn, arm = 2.0 * math.pi * number / 3.0, (SUN + PLANET) * TOOTH
    place = (arm * math.cos(turn), 0.0, arm * math.sin(turn))
    spoke, axle = scene.add(f"spoke{number}", Weld(displacement=place)), scene.add(f"axle{number}", Pivot())
    planet = scene.add(f"planet{number}", Disc(mass=0.3, radius=PLANET * TOOTH))
    tip = scene.add(f"tip{number}", Weld(displacement=(PLANET * TOOTH, 0.0, 0.0)))
    scene.connect(carrier.frame, spoke.a)
    scene.connect(spoke.b, axle.a)
    scene.connect(axle.b, planet.frame)
    scene.connect(planet.frame, tip.a)
    inner = scene.add(f"inner{number}", Gear(ratio=-SUN / PLANET))
    scene.connect(inner.a, axle.shaft)
    scene.connect(inner.b, at_sun.shaft)
    if number == 0:  # with one planet in mesh, the others are
        outer = scene.add("outer", Gear(ratio=RING / PLANET))
        scene.connect(outer.a, axle.shaft)
        scene.connect(outer.b, at_ring.shaft)

result = atwood.simulate(scene, t_end=1.52, rtol=1e-10, outputs=401)
turns, carried = result["sun.angle"][-1], result["carrier.angle"][-1]
print(f"{len(result.assembly.reduced.speeds)} degree of freedom, {len(result.assembly.reduced.coordinates)} coordinate")
print(f"the sun turns {turns / carried:.9f} times as fast as the carrier; by teeth {1 + RING / SUN}")
print(f"torque at a planet from the sun {result['inner1.torque_a'][0]:+.5f} N m, energy {result.energy.max_drift:.0e}")

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs" / "images"
folder.mkdir(parents=True, exist_ok=True)
atwood.plot_mechanism(result, folder / "planetary_gear.png", times=[result.time[-1]], trace="tip0.b")
