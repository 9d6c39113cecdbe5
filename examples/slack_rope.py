"""A bob on a string: pushed hard enough to rise, not hard enough to go round, it falls and jerks the string taut."""

from atwood import Scene, simulate
from atwood_library import Ground, PointMass, Rope

scene = Scene()
ground = scene.add("ground", Ground())
string = scene.add("string", Rope(length=1.0, when_slack="slack"))
bob = scene.add("bob", PointMass(mass=1.0))
scene.connect(ground.frame, string.a)
scene.connect(string.b, bob.point)
scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": 6.0})

result = simulate(scene, t_end=2.0)
for happening in result.events:
    print(happening.describe())
print(f"work of the jerks {result.energy.work[-1]:.6f} J of {result.energy.total[0]:.6f} J")
