"""Optimal control: the force that swings a pole on a cart up in two seconds with the least squared force."""

import math

from atwood import Scene, optimize
from atwood_library import Force, Ground, Link, Pivot, PointMass, Slider

scene = Scene(t_end=2.0)
ground, rail, cart = scene.add("ground", Ground()), scene.add("rail", Slider()), scene.add("cart", PointMass(mass=1.0))
hinge, push = scene.add("hinge", Pivot()), scene.add("push", Force())
pole = scene.add("pole", Link(length=0.5, mass=0.3, center=0.5, moment=0.0))
scene.connect(ground.frame, rail.a)
scene.connect(rail.b, cart.point)
scene.connect(rail.b, hinge.a)
scene.connect(hinge.b, pole.a)
scene.connect(cart.point, push.point)
hanging, upright = -0.5 * math.pi, 0.5 * math.pi
scene.start.update({"rail.displacement": 0.0, "rail.speed": 0.0, "hinge.angle": hanging, "hinge.angular_velocity": 0.0})

found = optimize(
    scene,
    lambda seen: seen["push.value"] ** 2,
    inputs={"push.value": (-20.0, 20.0)},
    end={"rail.displacement": 1.0, "rail.speed": 0.0, "hinge.angle": upright, "hinge.angular_velocity": 0.0},
    bounds={"rail.displacement": (-2.0, 2.0)},
)
print(found.as_text())
print(f"the run ends {found.result['hinge.angle'][-1] - upright:.1e} rad beside upright")
