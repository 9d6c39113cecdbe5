"""What an FMU computes as a function of numbers: its discrete states are those that a history of events has made.

An FMU remembers. A law may not: solvers call it at times in any order, twice, and for other parameters. So every event
(in co-simulation every step) is noted with the state that it had, and has a number, which is a discrete state of the
part. An instance that is asked for another number than it is at goes on to it, or is made anew and led there.
"""

from __future__ import annotations

import ctypes
import math
import threading
from collections import OrderedDict
from collections.abc import Sequence

from atwood.errors import SolveError
from atwood.exchange.fmi.binary import Binary, Discrete, Instance
from atwood.exchange.fmi.reading import REALS, Variable
from atwood.lazy_dataclasses import dataclass

_MOST_INSTANCES = 8
"""So many instances, each with parameters of its own, are kept."""
_STEP = 2.0**-17
"""Of central differences, relative: about the cube root of rounding."""

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class Moment:
    """An event, or a step of co-simulation.

    Attributes
    ----------
    before
        The number of the moment before it; None for the start.
    t
        Its time, s.
    states, inputs
        What they were.
    """

    before: int | None
    t: float
    states: Numbers
    inputs: Numbers


@dataclass(frozen=True)
class After:
    """What a moment has made: continuous states, outputs, and what the iteration at the event said."""

    states: Numbers
    outputs: Numbers
    discrete: Discrete


@dataclass(frozen=True)
class Roles:
    """The variables of an FMU by what the part does with them."""

    states: tuple[Variable, ...]
    derivatives: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    indicators: int

    @property
    def exact(self) -> tuple[Variable, ...]:
        """States whose start may be set; others are worked out by the FMU."""
        return tuple(one for one in self.states if one.initial in ("exact", "approx"))


class History:
    """An FMU as a function of numbers."""

    def __init__(self, binary: Binary, roles: Roles) -> None:
        self.binary, self.roles = binary, roles
        self.is_exchange = binary.kind == "model exchange"
        self._inputs, self._outputs = binary.groups(roles.inputs), binary.groups(roles.outputs)
        self._parameters, self._exact = binary.groups(roles.parameters), binary.groups(roles.exact)
        self._lock = threading.RLock()
        self._instances: OrderedDict[Numbers, tuple[Instance, int | None]] = OrderedDict()
        self._known: tuple[tuple[float, ...], list[float]] | None = None
        start = Moment(None, binary.description.start, (), tuple(one.start or 0.0 for one in roles.inputs))
        self._moments, self._numbers = [start], {start: 0}

    # -- moments ------------------------------------------------------------------------------------------------

    def happen(self, moment: Moment, parameters: Numbers) -> tuple[int, After]:
        """Return the number of a moment, and what it makes."""
        with self._lock:
            number = self._numbers.get(moment)
            if number is None:
                number = len(self._moments)
                self._moments.append(moment)
                self._numbers[moment] = number
            if moment.before is not None:
                self._at(parameters, moment.before)
            else:
                self._drop(parameters)
            return number, self._led(parameters, number)

    def _drop(self, parameters: Numbers) -> None:
        known = self._instances.pop(parameters, None)
        if known is not None:
            known[0].close()

    def _at(self, parameters: Numbers, number: int) -> Instance:
        """Return the instance with some parameters, at a moment."""
        instance, now = self._instances.get(parameters, (None, None))
        if instance is not None and now == number:
            return instance
        way: list[int] = []
        before: int | None = number
        while before is not None and before != now:
            if not 0 <= before < len(self._moments):
                raise SolveError(
                    "its discrete states were made in another process, and are not known here",
                    where=str(self.binary.path),
                    advice="Run the scene again.",
                )
            way.append(before)
            before = self._moments[before].before
        if before is None:
            self._drop(parameters)
        for one in reversed(way):
            self._led(parameters, one)
        return self._instances[parameters][0]

    def _led(self, parameters: Numbers, number: int) -> After:
        """Let the moment happen to the instance that is just before it."""
        moment, self._known = self._moments[number], None
        instance, _ = self._instances.pop(parameters, (None, None))
        try:
            if instance is None:
                instance = Instance(self.binary)
                discrete = self._begun(instance, moment, parameters)
            elif self.is_exchange:
                discrete = self._event(instance, moment)
            else:
                assert moment.before is not None
                instance.step(self._moments[moment.before].t, moment.t)
                instance.set(self._inputs, moment.inputs)
                discrete = Discrete(False, None)
            states = instance.numbers("GetContinuousStates", len(self.roles.states)) if self.is_exchange else []
            outputs = [0.0] * len(self.roles.outputs)
            if states is None or not instance.get(self._outputs, outputs):
                raise SolveError(f"at t = {moment.t:.9g} it has no values", where=str(self.binary.path))
        except Exception:
            if instance is not None:
                instance.close()
            raise
        self._instances[parameters] = instance, number
        while len(self._instances) > _MOST_INSTANCES:
            self._instances.popitem(last=False)[1][0].close()
        return After(tuple(states), tuple(outputs), discrete)

    def _begun(self, instance: Instance, moment: Moment, parameters: Numbers) -> Discrete:
        def given() -> None:
            instance.set(self._parameters, parameters)
            instance.set(self._inputs, moment.inputs)
            if moment.states and self.is_exchange:
                exact = set(self.roles.exact)
                pairs = zip(self.roles.states, moment.states, strict=True)
                instance.set(self._exact, [value for one, value in pairs if one in exact])

        instance.begin(moment.t, given)
        return instance.settle() if self.is_exchange else Discrete(False, None)

    def _event(self, instance: Instance, moment: Moment) -> Discrete:
        self._set(instance, moment.t, moment.states, moment.inputs)
        self._completed(instance)
        instance.must("EnterEventMode")
        return instance.settle()

    def _completed(self, instance: Instance) -> None:
        kind = ctypes.c_int if self.binary.version == 2 else ctypes.c_bool
        flags = [kind(0), kind(0)]
        instance.must("CompletedIntegratorStep", kind(0), *map(ctypes.byref, flags))

    def _set(self, instance: Instance, t: float, states: Sequence[float], inputs: Sequence[float]) -> None:
        instance.must("SetTime", ctypes.c_double(t))
        if states:
            row = (ctypes.c_double * len(states))(*states)
            instance.must("SetContinuousStates", row, ctypes.c_size_t(len(states)))
        instance.set(self._inputs, inputs)

    # -- continuous time ----------------------------------------------------------------------------------------

    def values(self, arguments: Numbers) -> list[float]:
        """Return rates, outputs and event indicators from number of the moment, time, states, inputs and parameters.

        They are nan where the FMU discards the state, so that a solver tries a shorter step.
        """
        with self._lock:
            if self._known is not None and self._known[0] == arguments:
                return self._known[1]
            instance = self._set_to(arguments)
            own = self.roles
            name = "GetDerivatives" if self.binary.version == 2 else "GetContinuousStateDerivatives"
            rates = instance.numbers(name, len(own.states))
            outputs = [0.0] * len(own.outputs)
            there = instance.get(self._outputs, outputs)
            indicators = instance.numbers("GetEventIndicators", own.indicators)
            size = len(own.states) + len(own.outputs) + own.indicators
            if rates is None or indicators is None or not there:
                return [math.nan] * size
            found = [*rates, *outputs, *indicators]
            self._known = arguments, found
            return found

    def _set_to(self, arguments: Numbers) -> Instance:
        number, t, states, inputs, parameters = self.split(arguments)
        instance = self._at(parameters, number)
        self._set(instance, t, states, inputs)
        return instance

    def split(self, arguments: Numbers) -> tuple[int, float, Numbers, Numbers, Numbers]:
        """Return number of the moment, time, states, inputs and parameters."""
        n, m = len(self.roles.states), len(self.roles.inputs)
        number, t, *rest = arguments
        return int(number), t, tuple(rest[:n]), tuple(rest[n : n + m]), tuple(rest[n + m :])

    def derivative(self, place: int, argument: int, arguments: Numbers) -> float:
        """Return the derivative of one of the values by one of the arguments.

        It is the FMU's directional derivative, where it has these, by states and inputs; else a central difference.
        """
        known = self._by_fmu(place, argument, arguments)
        if known is not None:
            return known
        value = arguments[argument]
        variables = [None, None, *self.roles.states, *self.roles.inputs, *self.roles.parameters]
        one = variables[argument]
        usual = 1.0 if one is None or one.nominal is None else abs(one.nominal)
        width = _STEP * max(abs(value), usual)
        above, below = value + width, value - width
        high = self.values((*arguments[:argument], above, *arguments[argument + 1 :]))[place]
        low = self.values((*arguments[:argument], below, *arguments[argument + 1 :]))[place]
        return (high - low) / (above - below)

    def _by_fmu(self, place: int, argument: int, arguments: Numbers) -> float | None:
        own = self.roles
        known = [*own.states, *own.inputs]
        unknown = [*own.derivatives, *own.outputs]
        if self.binary.kind not in self.binary.description.has_jvp or not 2 <= argument < 2 + len(known):
            return None
        if place >= len(unknown) or known[argument - 2].size > 1 or unknown[place].size > 1:
            return None
        if known[argument - 2].type not in REALS or unknown[place].type not in REALS:
            return None
        with self._lock:
            instance, self._known = self._set_to(arguments), None
            by = (ctypes.c_uint * 1)(known[argument - 2].reference)
            of = (ctypes.c_uint * 1)(unknown[place].reference)
            found = instance.directional(of, by, 1)
        return None if found is None else found[0]

    def beyond(self, indicator: int, arguments: Numbers) -> Numbers:
        """Return the states moved along their rates, by about rounding, until an indicator has crossed zero.

        An event is located to a tolerance, on either side; an FMU does what it does at an event only beyond it.
        """
        number, t, states, inputs, parameters = self.split(arguments)
        n = len(states)
        place = n + len(self.roles.outputs) + indicator
        found = self.values(arguments)
        rates, unit = found[:n], max(abs(t), 1e-6) * 2.0**-52

        def moved(by: float) -> Numbers:
            return tuple(x + by * rate for x, rate in zip(states, rates, strict=True))

        def value(by: float) -> float:
            return self.values((float(number), t + by, *moved(by), *inputs, *parameters))[place]

        trend = value(unit * 2.0**24) - value(-unit * 2.0**24)
        by = 0.0
        for power in range(40):
            if value(by) * trend > 0.0:
                return moved(by)
            by = unit * 2.0**power
        return states
