"""Parts, connections, a report, a run: the shortest way from parts to motion and forces."""

from atwood import Scene, report, simulate
from atwood_library import Ground, PointMass, Rod

scene = Scene()
ground = scene.add("ground", Ground())
rod = scene.add("rod", Rod(length="80 cm"))
bob = scene.add("bob", PointMass(mass=2.0))
scene.connect(ground.frame, rod.a)
scene.connect(rod.b, bob.point)
scene.start["rod.angle"] = "30 deg"

print(report(scene))
result = simulate(scene, t_end=2.0)
print(f"angle at the end  {result['rod.angle'][-1]:.9f} rad")
print(f"largest tension   {result['rod.tension'].max():.6f} N")
print(f"energy drift      {result.energy.max_drift:.1e}")
