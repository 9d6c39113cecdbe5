"""The double pendulum: from parts to motion, in both forms, with a picture."""

import sys
from pathlib import Path

import atwood
from atwood import Scene
from atwood.plotting import plot_mechanism
from atwood_library import Ground, PointMass, Rod

scene = Scene()
ground = scene.add("ground", Ground())
rod1 = scene.add("rod1", Rod(length=1.0))
bob1 = scene.add("bob1", PointMass(mass=1.0))
rod2 = scene.add("rod2", Rod(length="80 cm"))
bob2 = scene.add("bob2", PointMass(mass=0.5))
scene.connect(ground.frame, rod1.a)
scene.connect(rod1.b, bob1.point)
scene.connect(rod1.b, rod2.a)
scene.connect(rod2.b, bob2.point)
scene.start["rod1.angle"] = "120 deg"
scene.start["rod2.angle"] = "100 deg"
scene.start["rod1.angular_velocity"] = 0.0
scene.start["rod2.angular_velocity"] = 0.0

print(atwood.report(scene, "double pendulum"))

reduced, dae = (
    atwood.simulate(atwood.assemble(scene, form=form, name="double pendulum"), t_end=3.0) for form in ("reduced", "dae")
)
print()
for path in ("bob2.position.x", "bob2.position.z", "rod1.tension", "rod2.tension"):
    print(f"{path:<16} at t = 3 s: reduced {reduced[path][-1]:.6f}, dae {dae[path][-1]:.6f} {dae.unit(path)}")

print()
print(atwood.compare(scene, t_end=3.0, rtols=(1e-4, 1e-6, 1e-8), name="double pendulum"))

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs" / "images"
folder.mkdir(parents=True, exist_ok=True)
plot_mechanism(reduced, folder / "double_pendulum.png", times=[0.0, 0.45, 0.9, 1.2])
