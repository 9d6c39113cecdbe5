"""The slider-crank with an elastic connecting rod, as one component that is given by its Lagrangian.

B. Simeon, Modelling a flexible slider crank mechanism by a mixed system of DAEs and PDEs, Mathematical Modelling of
Systems 2 (1996) 1-18; problem `crank` of the Test Set for Initial Value Problem Solvers, whose matrices are taken as
they are there: the axial block of the mass matrix without the factor 1/15 of quadratic elements, and pi with seven
decimals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood import Component, Scalar, Scene, Shaft, Slide, connector, constraint, cos, lagrangian, sin
from atwood_library import Ground, Link, Pivot, PointMass, Slider

from .known import Found, path

PI = 3.1415927
CRANK, ROD, RATE = 0.15, 0.30, 150.0
ROD_MASS, BLOCK_MASS, ROD_MOMENT = 0.151104, 0.075552, 0.0045339259
_WIDE, _DENSITY, _YOUNG = 0.008, 7870.0, 2e11
_VOLUME, _STIFF = _WIDE**2 * ROD, _YOUNG * _WIDE**2 / ROD

MASS = _DENSITY * _VOLUME * np.array([[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 8, 1], [0, 0, 1, 2]])
_BENDING = PI**4 * (_WIDE / ROD) ** 2
STIFFNESS = _STIFF * np.array(
    [[_BENDING / 24, 0, 0, 0], [0, _BENDING * 2 / 3, 0, 0], [0, 0, 16 / 3, -8 / 3], [0, 0, -8 / 3, 7 / 3]]
)
_B13, _B14, _B24 = -16 / PI**3, 8 / PI**3 - 1 / PI, 0.5 / PI
SKEW = _DENSITY * _VOLUME * np.array([[0, 0, _B13, _B14], [0, 0, 0, _B24], [-_B13, 0, 0, 0], [-_B14, -_B24, 0, 0]])
ALONG = _DENSITY * _VOLUME * np.array([0, 0, 2 / 3, 1 / 6])
ACROSS = _DENSITY * _VOLUME * np.array([2 / PI, 0, 0, 0])
ALONG_ARM = ROD * _DENSITY * _VOLUME * np.array([0, 0, 1 / 3, 1 / 6])
ACROSS_ARM = ROD * _DENSITY * _VOLUME * np.array([1 / PI, -0.5 / PI, 0, 0])
"""Integrals of the shapes over the rod: M, K, B, c1, c2, c12 and c21 of the problem, times the density."""


def _sum(weights: Sequence[float], values: Sequence[Scalar]) -> Scalar:
    total: Scalar = 0.0
    for weight, value in zip(weights, values, strict=True):
        if weight:
            total = total + float(weight) * value
    return total


class FlexibleRod(Component):
    """An elastic rod on a crank that turns evenly: two shapes of bending, and two of stretching."""

    rod: Shaft = connector(Shaft, "The angle of the rod.")
    block: Slide = connector(Slide, "The place of the block.")
    bend_1: Slide = connector(Slide, "First shape of bending.")
    bend_2: Slide = connector(Slide, "Second shape of bending.")
    middle: Slide = connector(Slide, "Stretch in the middle.")
    end: Slide = connector(Slide, "Stretch at the end.")

    def shapes(self) -> list[Slide]:
        """Return the elastic coordinates."""
        return [self.bend_1, self.bend_2, self.middle, self.end]

    @lagrangian
    def law(self) -> Scalar:
        """Return the kinetic less the elastic energy of the rod, without what the block adds."""
        q, v = [one.value for one in self.shapes()], [one.rate for one in self.shapes()]
        w, apart = self.rod.rate, RATE * self.time - self.rod.value
        pull = [_sum(row, q) for row in MASS]
        moment = ROD_MOMENT + _sum([1.0] * 4, [a * b for a, b in zip(q, pull, strict=True)]) + 2.0 * _sum(ALONG_ARM, q)
        turning = _sum(ACROSS_ARM, v) + _sum([1.0] * 4, [a * _sum(row, v) for a, row in zip(q, SKEW, strict=True)])
        coupled = 0.5 * ROD * ROD_MASS * cos(apart) + sin(apart) * _sum(ACROSS, q) + cos(apart) * _sum(ALONG, q)
        carried = cos(apart) * _sum(ACROSS, v) - sin(apart) * _sum(ALONG, v)
        kinetic = 0.5 * moment * w * w + w * turning + CRANK * RATE * (w * coupled + carried)
        kinetic = kinetic + 0.5 * _sum([1.0] * 4, [a * _sum(row, v) for a, row in zip(v, MASS, strict=True)])
        return kinetic - 0.5 * _sum([1.0] * 4, [a * _sum(row, q) for a, row in zip(q, STIFFNESS, strict=True)])

    @constraint(reaction="lambda1", unit="N", doc="Multiplier of the block's guide.")
    def guided(self) -> Scalar:
        """Return how far the end of the rod is from the line of the block."""
        return CRANK * sin(RATE * self.time) + (ROD + self.end.value) * sin(self.rod.value)

    @constraint(reaction="lambda2", unit="N", doc="Multiplier of the joint of rod and block.")
    def joined(self) -> Scalar:
        """Return how far the block is from the end of the rod."""
        reach = CRANK * cos(RATE * self.time) + (ROD + self.end.value) * cos(self.rod.value)
        return self.block.value - reach


ELASTIC = ("bend_1", "bend_2", "middle", "end")
START = {"bend_1": (0.0, 0.444896105), "bend_2": (0.0, 0.00463434311)}
START |= {"middle": (1.03339863e-05, -1.78591076e-06), "end": (1.69327969e-05, -2.68938672e-06)}


def flexible_slider_crank() -> Scene:
    """Return the mechanism: coordinates are joints of massless bodies, the block has its mass."""
    scene = Scene(gravity=0.0, t_end=0.1)
    ground, law = scene.add("ground", Ground()), scene.add("law", FlexibleRod())
    hinge, arm = scene.add("hinge", Pivot()), scene.add("arm", Link(length=ROD, mass=0.0))
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, arm.a)
    scene.connect(hinge.shaft, law.rod)
    for name in ("block", *ELASTIC):
        slider, body = scene.add(name, Slider()), scene.add(f"{name}_mass", PointMass(mass=0.0))
        scene.connect(ground.frame, slider.a)
        scene.connect(slider.b, body.point)
        scene.connect(slider.carriage, getattr(law, name))
    scene.block_mass.mass = BLOCK_MASS
    for name, (place, rate) in START.items():
        scene.start.update({f"{name}.displacement": place, f"{name}.speed": rate})
    scene.guess.update({"hinge.angle": 0.0, "hinge.angular_velocity": -75.0, "block.displacement": 0.45})
    return scene


QUANTITIES: dict[str, Found] = {
    "phi2": path("hinge.angle"),
    "x3": path("block.displacement"),
    "q1": path("bend_1.displacement"),
    "q4": path("end.displacement"),
}
