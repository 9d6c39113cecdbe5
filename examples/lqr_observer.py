"""A cart-pole held upright by a computer that measures place and angle: LQR and a Kalman filter of python-control.

Needs `pip install 'atwood[control]'`.
"""

import control
import numpy as np

from atwood import Component, Number, Scalar, Scene, discrete_state, linearize, parameter, signal, simulate, update
from atwood_library import Force, Ground, Link, Noise, Pivot, PointMass, Slider

UPRIGHT, PERIOD = 0.5 * np.pi, 0.02
MEASURED = ("rail.displacement", "hinge.angle")


def cart_pole() -> Scene:
    """Return a cart with a pole, a force on the cart as input, and another one that disturbs it."""
    scene = Scene()
    ground, rail = scene.add("ground", Ground()), scene.add("rail", Slider())
    cart, hinge = scene.add("cart", PointMass(mass=1.0)), scene.add("hinge", Pivot())
    pole = scene.add("pole", Link(length=0.5, mass=0.2, center=0.5, moment=0.0))
    push, gust = scene.add("push", Force()), scene.add("gust", Force())
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, cart.point)
    scene.connect(rail.b, hinge.a)
    scene.connect(hinge.b, pole.a)
    scene.connect(cart.point, push.point)
    scene.connect(cart.point, gust.point)
    return scene


class Computer(Component):
    """An observer with a state feedback: it keeps an estimate of the state, and puts out a force."""

    period: Number = parameter(PERIOD, unit="s", doc="Sample time.")
    place: Number = signal(unit="m", doc="Measured place of the cart.")
    angle: Number = signal(unit="rad", doc="Measured angle of the pole.")
    place_error: Number = signal(0.0, unit="m", doc="Error of that place.")
    angle_error: Number = signal(0.0, unit="rad", doc="Error of that angle.")
    states: int = parameter(4, integer=True, doc="States of the plant.")
    estimate: tuple[Scalar, ...] = discrete_state(0.0, unit="any", count="states", doc="Estimated deviations.")
    force: Scalar = discrete_state(0.0, unit="N", doc="Command.")

    @update(every="period", sets=("estimate", "force"), pure=True)
    def step(self) -> tuple[float, ...]:
        """Correct the estimate by what was measured, return it for the next sample, and the command until then."""
        measured = np.array([self.place + self.place_error, self.angle + self.angle_error - UPRIGHT])
        known = np.array(self.estimate)
        known = known + CORRECTION @ (measured - PLANT.C @ known)
        force = (-GAINS @ known).item()
        return (*(PLANT.A @ known + PLANT.B[:, 0] * force).tolist(), force)


# The linear model about the upright position, as the computer sees it: sampled, with the force held in between.
model = linearize(cart_pole(), at={"hinge.angle": UPRIGHT}, inputs=["push.value"], outputs=MEASURED)
PLANT = control.sample_system(model.to_control(), PERIOD, method="zoh")
GAINS, _, _ = control.dlqr(PLANT, np.diag([1.0, 10.0, 0.0, 0.0]), [[0.01]])
# The filter counts with a gust of 1 N and errors of 1 mm and 2 mrad.
CORRECTION, _, _ = control.dlqe(PLANT.A, PLANT.B, PLANT.C, [[1.0]], np.diag([1e-3, 2e-3]) ** 2)
feedback = PLANT.A - PLANT.B @ GAINS, PLANT.A @ (np.eye(4) - CORRECTION @ PLANT.C)
largest = [max(abs(np.linalg.eigvals(one))) for one in feedback]
print(f"states {', '.join(model.states)}")
print(f"largest multiplier a sample: of the feedback {largest[0]:.3f}, of the observer {largest[1]:.3f}")

scene = cart_pole()
computer = scene.add("computer", Computer())
for path, name in zip(MEASURED, ("place", "angle"), strict=True):
    part, quantity = path.split(".")
    scene.connect(scene.parts[part].output(quantity), computer.input(name))
for seed, (name, deviation) in enumerate([("place_error", 1e-3), ("angle_error", 2e-3)]):
    noise = scene.add(name, Noise(standard_deviation=deviation, bandwidth=20.0, seed=seed))
    scene.connect(noise.output("value"), computer.input(name))
wind = scene.add("wind", Noise(standard_deviation=1.0, bandwidth=2.0, seed=7))
scene.connect(wind.output("value"), scene.parts["gust"].input("value"))
scene.connect(computer.output("force"), scene.parts["push"].input("value"))
scene.start["hinge.angle"] = UPRIGHT + 0.2

result = simulate(scene, t_end=10.0, outputs=2001)
late = result.time > 4.0
for name, path, zero in (("place", MEASURED[0], 0.0), ("angle", MEASURED[1], UPRIGHT)):
    print(f"{name} after 4 s: root mean square {np.sqrt(np.mean((result[path][late] - zero) ** 2)):.1e}")
assert np.max(np.abs(result["hinge.angle"][late] - UPRIGHT)) < 0.1
assert all(one < 1.0 for one in largest)
