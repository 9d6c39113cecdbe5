"""Signals: what a sensor measures drives a force, here as a spring and a damper that hold a cart."""

from atwood import Component, Number, Point, Scalar, Scene, connector, observable, parameter, simulate
from atwood_library import Force, Ground, PointMass, Slider


class Controller(Component):
    """Measures a point along x and says which force would bring it to its target."""

    gain: Number = parameter(20.0, unit="N/m", doc="Force for a deviation by one metre.")
    damping: Number = parameter(4.0, unit="N*s/m", doc="Force against a speed of one metre a second.")
    target: Number = parameter(1.0, unit="m", doc="Where the point should be.")
    point: Point = connector(Point, "The point that is measured.")

    @observable(unit="N", doc="Force that is asked for.")
    def command(self) -> Scalar:
        """Return the force."""
        return self.gain * (self.target - self.point.position.x) - self.damping * self.point.velocity.x


scene = Scene()
ground = scene.add("ground", Ground())
rail = scene.add("rail", Slider())
cart = scene.add("cart", PointMass(mass=1.0))
controller = scene.add("controller", Controller())
motor = scene.add("motor", Force(direction=(1.0, 0.0, 0.0)))
scene.connect(ground.frame, rail.a)
scene.connect(rail.b, cart.point)
scene.connect(cart.point, controller.point)
scene.connect(cart.point, motor.point)
scene.connect(controller.output("command"), motor.input("value"))

result = simulate(scene, t_end=4.0)
print(f"the cart stands at {result['cart.position.x'][-1]:.6f} m")
print(f"work of the motor {result.energy.work[-1]:.9f} J, balance drift {result.energy.max_drift:.1e}")
