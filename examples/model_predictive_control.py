"""A cart-pole moved by a metre with a force of 2 N at most: model predictive control at sample times.

At each sample the forces of the next two seconds are found that cost least within their bounds, and the first of them
is put out (J. Rawlings, D. Mayne and M. Diehl, Model Predictive Control, 2017, sections 1.3 and 8.8). Needs
`pip install 'atwood[control]'`.
"""

import control
import numpy as np
from scipy.linalg import cholesky
from scipy.optimize import lsq_linear

from atwood import Component, Number, Scalar, Scene, discrete_state, linearize, parameter, signal, simulate, update
from atwood_library import Force, Ground, Link, Pivot, PointMass, Slider

UPRIGHT, PERIOD, SAMPLES, LIMIT = 0.5 * np.pi, 0.05, 40, 2.0
STATES = ("rail.displacement", "hinge.angle", "rail.speed", "hinge.angular_velocity")
TARGET = np.array([1.0, UPRIGHT, 0.0, 0.0])


def cart_pole() -> Scene:
    """Return a cart with a pole, and a force on the cart."""
    scene = Scene()
    ground, rail = scene.add("ground", Ground()), scene.add("rail", Slider())
    cart, hinge = scene.add("cart", PointMass(mass=1.0)), scene.add("hinge", Pivot())
    pole, push = scene.add("pole", Link(length=0.5, mass=0.2, center=0.5, moment=0.0)), scene.add("push", Force())
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, cart.point)
    scene.connect(rail.b, hinge.a)
    scene.connect(hinge.b, pole.a)
    scene.connect(cart.point, push.point)
    return scene


def prediction(plant: control.StateSpace) -> tuple[np.ndarray, np.ndarray]:
    """Return rows F and G such that ``|F x + G u|^2`` is the cost of forces u from the deviation x.

    Beyond the last sample the feedback without bounds is counted on, whose cost is that of the Riccati equation.
    """
    state_cost, force_cost = np.diag([10.0, 10.0, 0.1, 0.1]), np.array([[0.1]])
    _, beyond, _ = control.dlqr(plant, state_cost, force_cost)
    free, forced, rows = np.eye(4), np.zeros((4, SAMPLES)), []
    for k in range(SAMPLES):
        free, forced = plant.A @ free, plant.A @ forced
        forced[:, k] = plant.B[:, 0]
        root = cholesky(state_cost if k < SAMPLES - 1 else beyond)
        rows.append((root @ free, root @ forced))
    last = np.zeros((SAMPLES, 4)), np.sqrt(force_cost[0, 0]) * np.eye(SAMPLES)
    of_state, of_forces = (np.vstack(one) for one in zip(*rows, last, strict=True))
    return of_state, of_forces


model = linearize(cart_pole(), at={"hinge.angle": UPRIGHT}, inputs=["push.value"], outputs=STATES)
assert np.allclose(model.C, np.eye(4))  # the states are what is measured
OF_STATE, OF_FORCES = prediction(control.sample_system(model.to_control(), PERIOD, method="zoh"))


class Predictor(Component):
    """Finds the forces of the next samples by least squares within bounds, and puts out the first."""

    period: Number = parameter(PERIOD, unit="s", doc="Sample time.")
    place: Number = signal(unit="m", doc="Place of the cart.")
    angle: Number = signal(unit="rad", doc="Angle of the pole.")
    speed: Number = signal(unit="m/s", doc="Speed of the cart.")
    rate: Number = signal(unit="rad/s", doc="Angular velocity of the pole.")
    force: Scalar = discrete_state(0.0, unit="N", doc="Command.")

    @update(every="period", sets="force", pure=True)
    def step(self) -> float:
        """Return the command until the next sample."""
        deviation = np.array([self.place, self.angle, self.speed, self.rate]) - TARGET
        found = lsq_linear(OF_FORCES, -OF_STATE @ deviation, bounds=(-LIMIT, LIMIT), method="bvls")
        return float(found.x[0])


scene = cart_pole()
predictor = scene.add("predictor", Predictor())
for path, name in zip(STATES, ("place", "angle", "speed", "rate"), strict=True):
    part, quantity = path.split(".")
    scene.connect(scene.parts[part].output(quantity), predictor.input(name))
scene.connect(predictor.output("force"), scene.parts["push"].input("value"))
scene.start["hinge.angle"] = UPRIGHT

result = simulate(scene, t_end=8.0, outputs=801)
force, lean, place = result["predictor.force"], result["hinge.angle"] - UPRIGHT, result["rail.displacement"]
print(f"the force is at its bound for {np.mean(np.abs(force) > LIMIT - 1e-9) * result.time[-1]:.2f} s")
print(f"the pole leans by {np.max(np.abs(lean)):.3f} rad at most, and the cart ends at {place[-1]:.5f} m")
assert np.max(np.abs(force)) <= LIMIT
assert abs(place[-1] - 1.0) < 1e-2
