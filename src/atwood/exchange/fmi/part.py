"""FMU: a part that another tool has made, by the Functional Mock-up Interface."""

from __future__ import annotations

import functools
import keyword
import re
import types
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar

from atwood.errors import ParameterError, SolveError, UnsupportedError, UsageError
from atwood.exchange.fmi.binary import Binary, Instance, describe
from atwood.exchange.fmi.history import History, Moment, Roles
from atwood.exchange.fmi.reading import REALS, Description, Variable
from atwood.expr import ExternalFunction, Scalar
from atwood.functions import external
from atwood.model.declare.component import Component
from atwood.model.declare.field_functions import discrete_state, parameter, signal, state
from atwood.model.declare.laws import derivative, event, observable, update

KINDS = ("model exchange", "co-simulation")
_NEVER = 1e12
"""The time of an event that there is not, s."""
_DOC = re.compile(r"\s+")


class FMU(Component):
    """A part that is an FMU, of FMI 2.0 or 3.0: its inputs are signals, its outputs quantities, by their names.

    **An FMU runs foreign code**, with all rights of the process: its binary is loaded when the part is made. A scene
    file that names one is read only with its path in `trust=`.

    A name that is none in Python has ``_`` in place of other characters: ``body.x[1]`` is ``body_x_1``. `fields` says
    which field a variable is, `left_out` what has no counterpart, and why. Real numbers, integers, truth values (0 and
    1) and enumerations (the number of the value) are numbers here. Arrays are one number each.

    Model exchange: its continuous states are states of the part, its rates are solved together with all others, and
    its events, by state and by time, are located. Inputs that are not continuous are left out.
    Co-simulation: it is sampled. Every `communication_step` it goes on with the inputs of the sample before.

    Parameters
    ----------
    file
        The path of the FMU.
    kind
        ``"model exchange"`` or ``"co-simulation"``; model exchange where it is offered, if not given.
    **values
        Parameters and inputs by name.

    Raises
    ------
    UsageError
        If the file cannot be read, or is no sound FMU.
    UnsupportedError
        If it has nothing for this computer, or does not offer the kind.
    ParameterError
        If a value is not admissible, or there is no parameter of that name.
    """

    synonyms = ("Functional Mock-up Unit", "FMI", "Co-simulation", "Model exchange")

    file: str = parameter(text=True, doc="Path of the FMU.")
    kind: str = parameter("any", choices=("any", *KINDS), doc="What it is used as; any: model exchange where offered.")

    fields: ClassVar[dict[str, str]] = {}
    """The field of each variable that has one."""
    left_out: ClassVar[dict[str, str]] = {}
    """Variables without a counterpart, with why."""
    _history: ClassVar[History | None] = None
    _of_file: ClassVar[str] = ""

    def __new__(cls, file: Any = None, kind: str = "any", **values: Any) -> Any:
        """Return an instance of the class of the file."""
        made: Any = object.__new__(cls._of_values({"file": file, "kind": kind}, ""))
        return made

    def __init__(self, file: Any = None, kind: str = "any", **values: Any) -> None:
        super().__init__(file=file, kind=kind, **values)

    @classmethod
    def _of_values(cls, values: Any, where: str) -> type[Component]:
        """Return the class of the file that values name, with its fields."""
        if cls is not FMU:
            return cls
        where = where or "FMU"
        path = Path(FMU._parameters["file"].check(values.get("file"), f"{where}.file")).expanduser().resolve()
        kind = FMU._parameters["kind"].check(values.get("kind", "any"), f"{where}.kind")
        try:
            found = path.stat()
        except OSError as error:
            raise UsageError(f"the FMU cannot be read ({error.strerror})", where=str(path)) from None
        return _class_of(path, kind, found.st_mtime_ns, found.st_size)

    @classmethod
    def _written_class(cls) -> type[Component]:
        """Return the class that stands in a file."""
        return FMU

    def __reduce__(self) -> tuple[Any, ...]:
        return _blank, (self.file, self.kind), self.__dict__

    def check_values(self) -> None:
        """Refuse another file in a part that was made from one."""
        if str(Path(self.file).expanduser().resolve()) != self._of_file:
            raise ParameterError(
                f"the part was made from {self._of_file}", where=f"{self.path}.file", advice="Make another FMU part."
            )


def _blank(file: str, kind: str) -> Any:
    made: Any = object.__new__(FMU._of_values({"file": file, "kind": kind}, ""))
    return made


@functools.lru_cache(maxsize=64)
def _class_of(path: Path, kind: str, _changed: int, _size: int) -> type[FMU]:
    """Return the class of an FMU, which is loaded."""
    description = describe(path)
    chosen = next(one for one in KINDS if one in description.identifiers) if kind == "any" else kind
    if chosen not in description.identifiers:
        raise UnsupportedError(
            f"it does not offer {chosen}, but {' and '.join(description.identifiers)}", where=str(path)
        )
    left_out = dict(description.left_out)
    roles = _roles(description, chosen == "model exchange", left_out)
    history = History(Binary(path, description, chosen), roles)
    fields = _names(roles)
    body: dict[str, Any] = {
        "__doc__": f"{description.name}, an FMU of FMI {description.version} as {chosen}.",
        "__module__": __name__,
        "synonyms": (),
        "fields": {one.name: fields[one] for one in fields},
        "left_out": left_out,
        "_history": history,
        "_of_file": str(path),
    }
    for one in roles.parameters:
        body[fields[one]] = _parameter(one)
    for one in roles.inputs:
        body[fields[one]] = signal(one.start or 0.0, unit=one.unit, doc=_doc(one))
    make = _exchange if chosen == "model exchange" else _sampled
    body.update(make(history, fields))
    name = re.sub(r"\W", "_", path.stem) or "FMU"
    return types.new_class(name if name.isidentifier() else f"FMU_{name}", (FMU,), {}, lambda space: space.update(body))


def _roles(description: Description, is_exchange: bool, left_out: dict[str, str]) -> Roles:
    inputs, outputs, parameters = [], [], []
    states = description.states if is_exchange else ()
    for one in description.variables:
        if one.causality == "input":
            if is_exchange and (one.type not in REALS or one.variability != "continuous"):
                left_out[one.name] = "an input that is not continuous keeps its start value in model exchange"
            else:
                inputs.append(one)
        elif one.causality == "output" and one not in states:
            outputs.append(one)
        elif one.causality == "parameter":
            parameters.append(one)
        elif one.causality == "structuralParameter":
            left_out[one.name] = "a structural parameter keeps its start value"
    derivatives = description.derivatives if is_exchange else ()
    indicators = description.indicators if is_exchange else 0
    return Roles(states, derivatives, tuple(inputs), tuple(outputs), tuple(parameters), indicators)


def _names(roles: Roles) -> dict[Variable, str]:
    """Return the field of each variable, told apart from each other and from what every part has."""
    taken = {*dir(FMU), "moment", "next_event", "communication_step", "start_up", "time_event"}
    found: dict[Variable, str] = {}
    for one in (*roles.states, *roles.inputs, *roles.outputs, *roles.parameters):
        plain = re.sub(r"\W+", "_", one.name).strip("_") or "variable"
        name = plain if plain[0].isalpha() and plain.isascii() and not keyword.iskeyword(plain) else f"v_{plain}"
        number = 1
        fitting = name
        while fitting in taken or not fitting.isidentifier():
            number += 1
            fitting = f"{name}_{number}"
        taken.add(fitting)
        found[one] = fitting
    return found


def _doc(one: Variable) -> str:
    return _DOC.sub(" ", one.text).strip() or f"The variable {one.name}."


def _parameter(one: Variable) -> Any:
    return parameter(
        one.start or 0.0,
        unit=one.unit,
        doc=_doc(one),
        minimum=one.minimum,
        maximum=one.maximum,
        integer=one.type not in (*REALS, "Boolean"),
    )


def _numbers(part: Any, fields: dict[Variable, str], variables: Sequence[Variable]) -> tuple[Any, ...]:
    return tuple(getattr(part, fields[one]) for one in variables)


def _law(name: str, text: str, function: Callable[[Any], Any]) -> Any:
    """Return a function with the name that it has in a class."""
    function.__name__, function.__doc__ = name, text
    return function


def _functions(history: History) -> list[ExternalFunction]:
    """Return rates, outputs and event indicators as functions with their derivatives."""
    own = history.roles
    names = [*(one.name for one in (*own.derivatives, *own.outputs)), *(f"z{i + 1}" for i in range(own.indicators))]
    count = 2 + len(own.states) + len(own.inputs) + len(own.parameters)
    model = history.binary.description.name.replace(" ", "_")

    def slope(place: int, argument: int) -> ExternalFunction:
        name = f"{model}.{names[place]}.by{argument}"
        if argument == 0:  # the number of an event: nothing changes with it but at events
            return ExternalFunction(name, lambda *_: 0.0, is_smooth=True)
        return ExternalFunction(name, lambda *given: history.derivative(place, argument, given), is_smooth=True)

    return [
        ExternalFunction(
            f"{model}.{name}",
            lambda *given, place=place: history.values(given)[place],
            tuple(slope(place, argument) for argument in range(count)),
            is_smooth=True,
        )
        for place, name in enumerate(names)
    ]


def _exchange(history: History, fields: dict[Variable, str]) -> dict[str, Any]:
    """Return states and laws of model exchange."""
    own, functions = history.roles, _functions(history)
    instance = Instance(history.binary)
    instance.close()  # what cannot be made is refused here, and not in a run
    parameters = tuple(one.start or 0.0 for one in own.parameters)
    guess = tuple(one.start or 0.0 for one in own.states)
    first = history.happen(Moment(None, history.binary.description.start, guess, _starts(own.inputs)), parameters)[1]
    defaults = dict(zip(own.states, first.states, strict=True))

    def arguments(part: Any) -> tuple[Any, ...]:
        groups = (own.states, own.inputs, own.parameters)
        return (part.moment, part.time, *(value for group in groups for value in _numbers(part, fields, group)))

    def happen(part: Any, before: int | None, states: tuple[float, ...]) -> list[float]:
        moment = Moment(before, float(part.time), states, tuple(map(float, _numbers(part, fields, own.inputs))))
        number, after = history.happen(moment, tuple(map(float, _numbers(part, fields, own.parameters))))
        if after.discrete.terminates:
            raise SolveError(
                f"at t = {moment.t:.9g} the FMU asks to end the run", where=part.path, advice="End the run before."
            )
        following = _NEVER if after.discrete.next is None else after.discrete.next
        return [*after.states, float(number), following]

    def start_up(part: Any) -> list[float]:
        given = tuple(map(float, _numbers(part, fields, own.states)))
        found = happen(part, None, given)
        for place, one in enumerate(own.states):
            if one not in own.exact and given[place] != defaults[one]:
                found[place] = given[place]  # the scene has another start than what the FMU works out
        return found

    def at_event(part: Any, indicator: int | None) -> list[float]:
        given = tuple(map(float, arguments(part)))
        states = given[2 : 2 + len(own.states)] if indicator is None else history.beyond(indicator, given)
        return happen(part, int(given[0]), states)

    sets = (*(fields[one] for one in own.states), "moment", "next_event")
    body: dict[str, Any] = {
        "moment": discrete_state(0.0, doc="The number of the last event in the FMU's history."),
        "next_event": discrete_state(_NEVER, unit="s", doc="When the FMU has its next time event."),
    }
    for one in own.states:
        body[fields[one]] = state(defaults[one], unit=one.unit, doc=_doc(one), nominal=_nominal(one))
    if own.states:
        rates = _law("rates", "Return the rates.", lambda self: _called(functions[: len(own.states)], arguments(self)))
        body["rates"] = derivative(*(fields[one] for one in own.states))(rates)
    for place, one in enumerate(own.outputs, start=len(own.states)):
        body[fields[one]] = _output(one, fields[one], functions[place], arguments)
    body["start_up"] = update(sets=sets, when="no_times", pure=True)(_law("start_up", "Initialize it.", start_up))
    body["no_times"] = lambda self: ()
    names = ["time_event", *(f"state_event_{i + 1}" for i in range(own.indicators))]
    for place, name in enumerate(names):
        body[name] = _event(name, None if place == 0 else functions[place - 1 - own.indicators], arguments)
        after = _law(f"after_{name}", "Let the event happen.", _at(at_event, place - 1 if place else None))
        body[f"after_{name}"] = update(sets=sets, at=name, pure=True)(after)
    return body


def _at(happen: Callable[[Any, int | None], list[float]], indicator: int | None) -> Callable[[Any], list[float]]:
    return lambda part: happen(part, indicator)


def _event(name: str, function: ExternalFunction | None, arguments: Callable[[Any], tuple[Any, ...]]) -> Any:
    if function is None:
        law = _law(name, "Return how long ago it is.", lambda self: self.time - self.next_event)
        return event(message="the FMU has a time event", unit="s", direction=1)(law)
    law = _law(name, "Return the event indicator.", lambda self: external(function, *arguments(self)))
    return event(message="the FMU has an event")(law)


def _called(functions: Sequence[ExternalFunction], given: tuple[Any, ...]) -> list[Scalar]:
    return [external(one, *given) for one in functions]


def _output(one: Variable, name: str, function: ExternalFunction, arguments: Callable[[Any], tuple[Any, ...]]) -> Any:
    law = _law(name, _doc(one), lambda self: external(function, *arguments(self)))
    return observable(unit=one.unit, doc=_doc(one))(law)


def _nominal(one: Variable) -> float | None:
    return abs(one.nominal) if one.nominal else None


def _starts(variables: Sequence[Variable]) -> tuple[float, ...]:
    return tuple(one.start or 0.0 for one in variables)


def _sampled(history: History, fields: dict[Variable, str]) -> dict[str, Any]:
    """Return states and the update of co-simulation."""
    own = history.roles
    start = Moment(None, history.binary.description.start, (), _starts(own.inputs))
    first = history.happen(start, _starts(own.parameters))[1]

    def communicate(part: Any) -> list[float]:
        before = int(part.moment) - 1
        moment = Moment(
            None if before < 0 else before,
            float(part.time),
            (),
            tuple(map(float, _numbers(part, fields, own.inputs))),
        )
        number, after = history.happen(moment, tuple(map(float, _numbers(part, fields, own.parameters))))
        return [*after.outputs, float(number + 1)]

    body: dict[str, Any] = {
        "communication_step": parameter(
            history.binary.description.step or 0.01, unit="s", above=0.0, doc="Time from one exchange to the next."
        ),
        "moment": discrete_state(0.0, doc="One more than the number of the last step in the FMU's history."),
    }
    for one, value in zip(own.outputs, first.outputs, strict=True):
        body[fields[one]] = discrete_state(value, unit=one.unit, doc=_doc(one))
    sets = (*(fields[one] for one in own.outputs), "moment")
    law = _law("communicate", "Go on to now, and return the outputs.", communicate)
    body["communicate"] = update(every="communication_step", sets=sets, pure=True)(law)
    return body
