"""Drag: the resistance of air or water to a moving point."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import (
    Component,
    Load,
    Number,
    Point,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    dot,
    force,
    is_zero,
    observable,
    parameter,
    select,
    sqrt,
)


class Drag(Component):
    """A drag against the velocity relative to a wind that may vary, linear and quadratic in the speed.

    ``F = -(b + k |w|) w`` with the velocity w relative to the wind, ``k = 1/2 rho A c_d`` (Batchelor, An Introduction
    to Fluid Dynamics, chapter 5). It has one derivative where the point is at rest, which is all that solvers need.
    """

    synonyms = ("Air resistance", "Viscous drag")

    linear: Number = parameter(
        0.0, unit="N*s/m", minimum=0.0, doc="Force for one metre a second, where it is slow.", symbol="b"
    )
    quadratic: Number | None = parameter(
        None,
        unit="N*s^2/m^2",
        minimum=0.0,
        doc="Force for one metre a second, where it is fast; half density times area times c_d if not given.",
        symbol="b_2",
    )
    density: Number = parameter(1.225, unit="kg/m^3", minimum=0.0, doc="Density of the medium.")
    area: Number = parameter(0.0, unit="m^2", minimum=0.0, doc="Area that faces the stream.")
    drag_coefficient: Number = parameter(1.0, minimum=0.0, doc="Drag coefficient c_d of that area.", symbol="C_D")
    wind: Triple = parameter(
        (0.0, 0.0, 0.0),
        unit="m/s",
        size=3,
        doc="Velocity of the medium in world axes; in a plane or on a line, only what lies there.",
        symbol="w",
    )
    wind_field: Any = parameter(
        (0.0, 0.0, 0.0),
        unit="m/s",
        size=3,
        function_of={"x": "m", "y": "m", "z": "m", "t": "s"},
        doc="Velocity of the medium besides, as a function of place and time.",
    )
    point: Point = connector(Point, "The point that feels the drag.")

    def coefficient(self) -> Scalar:
        """Return the coefficient of the square of the speed."""
        if self.quadratic is not None:
            return self.quadratic
        return 0.5 * self.density * self.area * self.drag_coefficient

    def relative_velocity(self) -> Vector:
        """Return the velocity relative to the medium."""
        r, field = self.point.position, self.wind_field
        wind = as_vector(self.wind) + field(r.x, r.y, r.z, self.time)
        if self.on_a_line:
            wind = self.line * dot(wind, self.line)
        elif not self.in_space:
            wind = Vector(wind.x, 0.0, wind.z)
        relative: Vector = self.point.velocity - wind
        return relative

    def resistance(self) -> Vector:
        """Return the force."""
        w, coefficient = self.relative_velocity(), self.coefficient()
        factor: Scalar = self.linear
        if not is_zero(coefficient):
            square = dot(w, w)
            moves = square > 0.0
            # The root's derivative has no value at rest, where the product with w has the derivative zero.
            factor = factor + coefficient * select(moves, sqrt(select(moves, square, 1.0)), 0.0)
        force: Vector = -(w * factor)
        return force

    @force
    def drag(self) -> Iterable[Load]:
        """Return the load."""
        yield Load(self.point, self.resistance())

    @observable(unit="N", doc="Force in world axes.")
    def force(self) -> Vector:
        """Return the force."""
        return self.resistance()

    @observable(unit="W", doc="Power that the drag takes out of the motion of its point.")
    def power(self) -> Scalar:
        """Return minus the force times the velocity of the point."""
        return -dot(self.resistance(), self.point.velocity)
