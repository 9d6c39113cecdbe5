"""CoordinateLagrangian: a Lagrangian, or an energy, as a function of joint coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from atwood import Component, Scalar, Shaft, Slide, connector, lagrangian, observable, parameter

_ARGUMENTS = {
    **{f"angle_{n}": "rad" for n in (1, 2, 3)},
    **{f"rate_{n}": "rad/s" for n in (1, 2, 3)},
    **{f"displacement_{n}": "m" for n in (1, 2, 3)},
    **{f"speed_{n}": "m/s" for n in (1, 2, 3)},
    "t": "s",
}


class CoordinateLagrangian(Component):
    """A Lagrangian that is a function of joint coordinates, of their rates and of time.

    It reads up to three angles and three displacements. It adds to that of the bodies, which may be none if it gives
    every coordinate an inertia. Each coordinate feels ``dL/dq - d/dt dL/dq'`` (Goldstein, section 1.4); without rates
    in it, it is minus a potential energy. A formula names what it reads: ``"0.5*rate_1**2 - displacement_1*angle_1"``.
    """

    synonyms = ("Potential of joint coordinates", "Generalized force law")

    shafts: int = parameter(1, minimum=0, maximum=3, integer=True, doc="How many angles.")
    slides: int = parameter(0, minimum=0, maximum=3, integer=True, doc="How many displacements.")
    function: Any = parameter(0.0, unit="J", function_of=_ARGUMENTS, doc="The Lagrangian.")
    shaft: Sequence[Shaft] = connector(Shaft, "Joints that turn: angle_1, angle_2, angle_3.", count="shafts")
    slide: Sequence[Slide] = connector(Slide, "Joints that slide: displacement_1, ... .", count="slides")

    @lagrangian
    def law(self) -> Scalar:
        """Return the Lagrangian."""
        values: list[Scalar] = []
        for held in (self.shaft, self.slide):
            for quantity in ("value", "rate"):
                found = [getattr(one, quantity) for one in held]
                values += [*found, *[0.0] * (3 - len(found))]
        return self.function(*values, self.time)

    @observable(unit="J", doc="Value of the Lagrangian.")
    def value(self) -> Scalar:
        """Return its value."""
        return self.law()
