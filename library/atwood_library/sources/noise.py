"""Noise: a random function of time of limited bandwidth."""

from __future__ import annotations

import math

from atwood import Component, Number, Scalar, cos, observable, parameter

_WORD = 2**64


def _share(seed: int, counter: int) -> float:
    """Return a number in [0, 1) for a seed and a counter: SplitMix64 (Steele, Lea and Flood, OOPSLA 2014), mixed twice.

    Integers alone are used, so that it is the same everywhere.
    """
    word = seed % _WORD
    for step in (1, counter + 1):
        word = (word + step * 0x9E3779B97F4A7C15) % _WORD
        word = (word ^ (word >> 30)) * 0xBF58476D1CE4E5B9 % _WORD
        word = (word ^ (word >> 27)) * 0x94D049BB133111EB % _WORD
        word ^= word >> 31
    return (word >> 11) * 2.0**-53


class Noise(Component):
    """A random function of time whose power is spread evenly over the frequencies from 0 to a bandwidth.

    It is a sum of harmonic functions, one in each of as many equal bands, of random frequency within its band and
    random phase (M. Shinozuka and C.-M. Jan, J. Sound Vib. 25, 1972). So it is smooth, does not repeat itself, and is
    the same function for every solver, step, form and process. Its standard deviation over all times is that given;
    over a short time it is another one. Values of few terms are bounded, of many nearly of a normal distribution.

    Its `value` is connected to an input and takes the input's unit.
    """

    synonyms = ("BandLimitedWhiteNoise", "UniformNoise", "NormalNoise", "Random disturbance", "Coloured noise")

    standard_deviation: Number = parameter(
        1.0, unit="any", minimum=0.0, doc="Standard deviation, in the unit of the input.", symbol="sigma"
    )
    bandwidth: Number = parameter(1.0, unit="Hz", above=0.0, doc="Largest frequency.", symbol="B")
    offset: Number = parameter(0.0, unit="any", doc="Mean value, in the unit of the input.")
    seed: int = parameter(0, integer=True, minimum=0, doc="Which random function it is.")
    terms: int = parameter(32, integer=True, minimum=4, maximum=1000, doc="Number of harmonic functions.")

    @observable(unit="any", doc="Value of the function, in the unit of the input.")
    def value(self) -> Scalar:
        """Return the value."""
        count, total = self.terms, 0.0
        turns = 2.0 * math.pi * self.bandwidth * self.time
        for k in range(count):
            frequency = (k + _share(self.seed, 2 * k)) / count
            total = total + cos(frequency * turns + 2.0 * math.pi * _share(self.seed, 2 * k + 1))
        return self.offset + self.standard_deviation * math.sqrt(2.0 / count) * total
