"""A block that is set on its corner rocks, and comes to rest: impacts, friction, and impacts that accumulate."""

import atwood
from atwood import Scene
from atwood_library import Box, BoxContact, Ground

scene = Scene()
ground, block = scene.add("ground", Ground()), scene.add("block", Box(mass=1.0, length_x=0.5, length_z=2.0))
floor = scene.add("floor", BoxContact(length=0.5, height=2.0, friction=0.6))
scene.connect(ground.frame, floor.plane)
scene.connect(block.frame, floor.box)
scene.start.update({"block.angle": 0.15, "block.angular_velocity.y": 0.0})
scene.start.update({"floor.corner[0].gap": 0.0, "floor.corner[0].slip": 0.0})

result = atwood.simulate(scene, t_end=9.0, rtol=1e-10)
for event in result.events:
    if event.kind in ("rests", "jams") or (event.kind == "impact" and event.time < 4.0):
        print(event.describe())
print(result.energy)
