"""SampledFeedback: a linear feedback of several measurements, worked out at sample times."""

from __future__ import annotations

from typing import Any

from atwood import Component, Number, ParameterError, Scalar, discrete_state, parameter, signal, update


class SampledFeedback(Component):
    """A linear feedback of up to six measurements, ``y = -sum of gain (u - target)``, worked out at sample times.

    A regulator by states: with the gains of a linear-quadratic regulator, of poles that were placed, or of a hand.
    """

    synonyms = ("State feedback", "LQR", "Linear-quadratic regulator", "Discrete.StateSpace")

    gains: Any = parameter((1.0,), array=True, doc="One for each measurement, in their order.")
    targets: Any = parameter((0.0,), array=True, doc="What each measurement is to be; zero for those not given.")
    period: Number = parameter(0.02, unit="s", doc="Sample time.", symbol="T")
    u_1: Number = signal(0.0, unit="any", doc="First measurement.")
    u_2: Number = signal(0.0, unit="any", doc="Second measurement.")
    u_3: Number = signal(0.0, unit="any", doc="Third measurement.")
    u_4: Number = signal(0.0, unit="any", doc="Fourth measurement.")
    u_5: Number = signal(0.0, unit="any", doc="Fifth measurement.")
    u_6: Number = signal(0.0, unit="any", doc="Sixth measurement.")
    y: Scalar = discrete_state(0.0, unit="any", doc="The command.")

    def check_values(self) -> None:
        """Refuse more gains than there are measurements, and more targets than gains."""
        for name, most in (("gains", 6), ("targets", len(self.gains))):
            given = getattr(self, name)
            if len(given) > most or isinstance(given[0], tuple):
                raise ParameterError(f"it is not a row of {most} numbers at most", where=f"{self.path}.{name}")

    @update(every="period", sets="y", pure=True)
    def work_out(self) -> float:
        """Return the command."""
        measured = (self.u_1, self.u_2, self.u_3, self.u_4, self.u_5, self.u_6)
        targets = (*self.targets, *(0.0 for _ in self.gains))
        command: float = -sum(k * (u - r) for k, u, r in zip(self.gains, measured, targets, strict=False))
        return command
