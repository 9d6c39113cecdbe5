"""Scenes: the model that is simulated, with its gravity and its start values by path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping
from typing import Any, Self

from atwood.arguments import check, show
from atwood.display import fitted, listed
from atwood.errors import AtwoodError, StartError
from atwood.model.compose.composite import Model
from atwood.model.declare.field_functions import Number, Triple, parameter
from atwood.model.declare.fields import ParameterSpec
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.values.letters import LETTERS
from atwood.model.values.units import parse_unit, split_quantity


class _Beginning:
    """What a scene says about its start; a plain class, so that type checkers see no parameters in it."""

    start: MutableMapping[str, Any] = {}  # noqa: RUF012 - each scene has a copy
    guess: MutableMapping[str, Any] = {}  # noqa: RUF012
    symbols: MutableMapping[str, Any] = {}  # noqa: RUF012


class Scene(_Beginning, Model):
    """The model that is simulated: a model with its space, its gravity and its start.

    Axes: x right, y into the page, z up; a planar scene lives in the x-z plane, gravity is along -z
    unless `gravity_direction` says otherwise. A scene can be
    declared as a class, like any model, or put together step by step::

        scene = Scene()
        ground = scene.add("ground", Ground())
        rod = scene.add("rod", Rod(length=1.0))
        scene.connect(ground.frame, rod.a)
        scene.start["rod.angle"] = 0.5

    As a part of another scene it is a model like any other; of its own settings only its start is then used.

    Attributes
    ----------
    start
        What holds exactly at the start, by path: any mix of coordinates, positions and velocities. A value is a
        number in SI units, text with a unit (``"30 deg"``), or a parameter of the scene. Every scene has its own,
        which begins as that of its class.
    guess
        What holds roughly at the start; used where the start leaves a choice.
    symbols
        Letters in formulas, by path: ``{"hoop.angle": "theta", "hoop.radius": "a"}``. Of a part it is what stands
        below its letters: ``{"crank": "c"}``.
    """

    space: str = parameter("plane", choices=("line", "plane", "space"), doc="What the scene lives in.")
    line_axis: Triple = parameter(
        (1.0, 0.0, 0.0), size=3, structural=True, doc="Direction of the line, for a scene on a line."
    )
    gravity: Number = parameter(9.81, unit="m/s^2", doc="Acceleration of free fall, along -z.")
    gravity_direction: Triple = parameter(
        (0.0, 0.0, -1.0),
        direction=True,
        doc="Where gravity pulls; in a plane or on a line, only what lies there counts.",
    )
    gravity_potential: Any = parameter(
        None,
        unit="J/kg",
        function_of={"x": "m", "y": "m", "z": "m", "t": "s"},
        doc="Energy of a kilogram in a field of gravity that varies, besides: '-3.986e14/sqrt(x**2 + y**2 + z**2)'.",
    )
    t_start: Number = parameter(0.0, unit="s", doc="Time of the start.")
    t_end: Number = parameter(10.0, unit="s", doc="Time of the end, unless a run is given another.")

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name, kind in _SAID.items():
            if not isinstance(getattr(cls, name), Mapping):
                raise StartError(f"{name!r} must say {kind.what} by path", where=cls.__name__, advice=kind.advice)
            kind(getattr(cls, name), cls.__name__)

    def _assemble(self) -> None:
        # Its own copy of the class's values for each scene: what is added in `build` or later belongs to it alone.
        for name, kind in _SAID.items():
            object.__setattr__(self, name, kind(getattr(type(self), name)))
        super()._assemble()

    def _start_values(self) -> Mapping[str, MutableMapping[str, Any]]:
        return {name: getattr(self, name) for name in _SAID}

    def _facts(self) -> Iterator[tuple[str, str]]:
        yield from super()._facts()
        for name, values in self._start_values().items():
            if values:
                yield name, listed((f"{path} = {value}" for path, value in values.items()), 4)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _SAID:
            object.__setattr__(self, name, _SAID[name](value, self.path))
        else:
            super().__setattr__(name, value)

    def copy(self) -> Self:
        """Return a scene with the same settings and its own parts and start."""
        twin = super().copy()
        for name, kind in _SAID.items():
            object.__setattr__(twin, name, kind(getattr(self, name)))
        return twin


_NUMBER = ParameterSpec(0.0, "1", "A start value.")

_NOTHING = 1e-100
"""Values of starts below this are zero: nothing divides by them, and other numbers of any unit are larger."""


class StartValues(MutableMapping[str, Any]):
    """Start values by path: numbers in SI units, text with a unit, or parameters of the scene.

    Parameters
    ----------
    values
        The values to begin with.
    where
        What an error names before the path of the value.

    Raises
    ------
    StartError
        If a path is no text, or a value is not a finite number.
    """

    __slots__ = ("_values",)
    what, advice = "values", "Write {'rod.angle': 0.5}."

    def __init__(self, values: Mapping[str, Any] | None = None, where: str = "") -> None:
        given = {} if values is None else values
        if not isinstance(given, Mapping):
            raise StartError(f"{show(given)} does not say {self.what} by path", where=where, advice=self.advice)
        self._values: dict[str, Any] = {key: self.checked(key, value, where) for key, value in given.items()}

    def __getitem__(self, path: str) -> Any:
        return self._values[path]

    def __setitem__(self, path: str, value: Any) -> None:
        self._values[path] = self.checked(path, value, "")

    def __delitem__(self, path: str) -> None:
        del self._values[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return fitted(repr(self._values))

    @staticmethod
    def checked(path: Any, value: Any, where: str) -> Any:
        """Return a start value as it is kept, or refuse it."""
        return _checked(path, value, where)


class SymbolsByPath(StartValues):
    """Letters in formulas by path."""

    __slots__ = ()
    what, advice = "letters", "Write {'rod.angle': 'theta'}."

    @staticmethod
    def checked(path: Any, value: Any, where: str) -> Any:
        """Return a letter as it is kept, or refuse it."""
        return check(LETTERS, {path: value}, "symbols", where)[path]


_SAID = {"start": StartValues, "guess": StartValues, "symbols": SymbolsByPath}
"""What a scene says by path, in dictionaries of its own."""


def _checked(path: Any, value: Any, where: str) -> Any:
    """Return a start value as it is kept: a float, text that reads as a quantity, or a deferred value."""
    if not isinstance(path, str) or not path.strip():
        raise StartError(f"{show(path)} is no path", where=where, advice="Write paths like 'rod.angle'.")
    full = f"{where}.{path}" if where else path
    if isinstance(value, ParameterExpression):
        return value
    if isinstance(value, (list, tuple)):
        advice = f"Give its components, {path}.x and so on, each with a number."
        raise StartError("a start value is one number", where=full, advice=advice)
    number = value
    if isinstance(value, str):
        split = split_quantity(value)
        if split is None:
            raise StartError(f"{value!r} is not a number", where=full, advice="Write text like '30 deg' or '5 cm'.")
        number, unit_text = split
        try:
            parse_unit(unit_text)
        except AtwoodError as error:
            raise StartError(error.message, where=full, advice=error.advice) from None
    if not isinstance(value, str) and isinstance(number, (int, float)) and abs(number) < _NOTHING:
        number = 0.0  # what rounding has left of a state of another run; its square is no number, and it says no more
    try:
        checked = _NUMBER.check(number, full)
    except AtwoodError as error:
        raise StartError(error.message, where=full, advice="Give a number in SI units, or text with a unit.") from None
    return value if isinstance(value, str) else checked
