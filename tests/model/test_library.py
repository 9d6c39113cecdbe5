"""Every component of the library keeps the house rules, and every law means the same on floats, expressions, sympy."""

import importlib
import inspect
import math
import pkgutil
import random
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
import sympy

import atwood as aw
import atwood_library
from atwood.consistency.trials import Body
from atwood.expr import Graph, evaluate
from atwood.model.declare.component import Binding, bind
from atwood.model.declare.connectors import Frame, Motion
from atwood.model.declare.law_results import BodyInertia, Load, Placement, PointInertia
from atwood.model.declare.laws import scalars
from atwood.model.values.space import FIXED_AXES, make_space, planar_axes
from atwood.model.values.units import parse_si_unit

ROOT = Path(atwood_library.__file__).parent
TETRAHEDRON = Path(__file__).parent / "tetrahedron.stl"
GROUPS = ("blocks", "contacts", "drives", "fields", "forces", "joints", "parts", "ropes", "sensors", "sources")


def library_modules() -> list:
    return [
        importlib.import_module(found.name)
        for found in pkgutil.walk_packages([str(ROOT)], "atwood_library.")
        if not found.ispkg
    ]


def components_of(module) -> list[type[aw.Component]]:
    return [
        value
        for value in vars(module).values()
        if inspect.isclass(value) and issubclass(value, aw.Component) and value.__module__ == module.__name__
    ]


OTHER = (".interfaces.", ".robots.", ".readers")
"""Modules of the library that declare no components of their own, or what readers of files make."""

MODULES = [module for module in library_modules() if not any(one in module.__name__ for one in OTHER)]
COMPONENTS = [cls for module in MODULES for cls in components_of(module) if not issubclass(cls, aw.Model)]


def test_there_is_a_library():
    assert len(COMPONENTS) >= 20


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_one_component_a_file_in_its_group(module):
    _, group, name = module.__name__.split(".")
    assert group in (*GROUPS, "scenes"), "a file of its own group"
    found = components_of(module)
    assert len(found) == 1
    assert found[0].__name__.lower() == name.replace("_", "")
    assert module.__doc__


@pytest.mark.parametrize("cls", COMPONENTS, ids=lambda cls: cls.__name__)
def test_everything_is_said(cls):
    assert cls.__doc__
    assert cls.__doc__ != aw.Component.__doc__
    assert getattr(atwood_library, cls.__name__, cls) is cls
    for spec in (*cls.parameter_specs().values(), *cls.signal_specs().values()):
        parse_si_unit(spec.unit.text)
        says_something(spec.doc)
    for connector in cls.connector_specs().values():
        says_something(connector.doc)
    for law in cls._laws.values():
        assert inspect.getdoc(getattr(cls, law.name)), law.name
        if law.kind == "observable":
            parse_si_unit(law.options.unit)
            says_something(law.options.doc)
        if law.kind == "constraint":
            parse_si_unit(law.options.unit)
            says_something(law.options.doc)
        if law.kind == "joint":
            names = {*cls.connector_specs(), "world"}
            assert {law.options.a, law.options.b} <= names
            assert set(law.options.solves) <= {one.name for one in cls.laws("constraint")}
            assert set(law.options.coordinates) <= {one.name for one in cls.laws("observable")}
        if law.kind == "event":
            says_something(law.options.message + ".")
            spec = cls.parameter_specs().get(law.options.target)
            targets = spec.choices if spec is not None else (law.options.target,)
            assert set(targets) <= {*cls.modes, "stop", ""}


def says_something(line: str) -> None:
    assert line.strip() == line
    assert len(line) >= 5
    assert line.endswith(".")
    assert "\n" not in line


# -- one law, three kinds of numbers ----------------------------------------------------------------------------------


class Numbers:
    """Numbers of one kind for names, drawn so that all three kinds get the same values."""

    def __init__(self, kind: str) -> None:
        self.kind, self.graph, self.values = kind, Graph(), {}

    def draw(self, name: str, low: float = -1.0, high: float = 1.0):
        value = random.Random(name).uniform(low, high)
        return self.named(name, value)

    def named(self, name: str, value: float):
        self.values[name] = value
        if self.kind == "float":
            return value
        if self.kind == "expression":
            return self.graph.symbol(name)
        return sympy.Symbol(name, real=True)

    def read(self, made) -> float:
        if self.kind == "expression":
            return evaluate([self.graph.convert(made)], {self.graph.symbol(k): v for k, v in self.values.items()})[0]
        if self.kind == "sympy":
            known = {sympy.Symbol(name, real=True): sympy.Float(value) for name, value in self.values.items()}
            return float(sympy.sympify(made).xreplace(known))
        return float(made)


def example(cls: type[aw.Component]) -> aw.Component:
    """A component with admissible values for everything that is required, and with one of each counted connector."""
    required = [spec for spec in cls.parameter_specs().values() if repr(spec.default) == "<required>"]
    values: dict = {spec.name: str(TETRAHEDRON) if spec.text else 1.5 for spec in required}
    values |= {spec.count: 2 for spec in cls.connector_specs().values() if spec.count}
    return cls(**values)


def binding_of(component: aw.Component, space_name: str, numbers: Numbers) -> Binding:
    space = make_space(space_name, (0.6, 0.0, 0.8))
    values = {}
    for name, spec in component.parameter_specs().items():
        value = component.parameters()[name]
        if value is None or spec.integer or spec.choices or spec.text or spec.function_of or spec.array:
            values[name] = value
        elif spec.direction:
            values[name] = aw.Vector(*value)
        elif spec.size is not None:
            made = [numbers.named(f"{name}{i}", one) for i, one in enumerate(value)]
            values[name] = aw.Vector(*made) if spec.size == 3 else tuple(made)
        else:
            values[name] = numbers.named(name, value if value != 0.0 else 0.75)
    for name in component.signal_specs():
        values[name] = numbers.draw(name)
    for name, state in component.state_specs().items():
        made = [numbers.draw(one) for one in state.names(component.parameters())]
        values[name] = tuple(made) if state.count else made[0]
    motions = {}
    for index, (name, connector) in enumerate(component.connectors().items()):
        turns = isinstance(connector, Frame) and space.has_rotation
        axes = space.axis_names
        place = [numbers.draw(f"{name}.p{axis}", 2.0 * index, 2.0 * index + 1.0) for axis in axes]
        angle = numbers.draw(f"{name}.angle") if turns else 0.0
        second = numbers.draw(f"{name}.second")
        motions[name] = Motion(
            position=space.vector(tuple(place)),
            velocity=space.vector(tuple(numbers.draw(f"{name}.v{axis}") for axis in axes)),
            acceleration=space.vector(tuple(numbers.draw(f"{name}.a{axis}") for axis in axes)),
            axes=planar_axes(angle) if turns else FIXED_AXES,
            angle=angle,
            angular_velocity=aw.Vector(0.0, -numbers.draw(f"{name}.w") if turns else 0.0, 0.0),
            angular_acceleration=aw.Vector(0.0, -numbers.draw(f"{name}.e") if turns else 0.0, 0.0),
            value=numbers.draw(f"{name}.value"),
            rate=numbers.draw(f"{name}.rate"),
            second_rate=lambda second=second: second,
            body=Body(
                numbers.draw(f"{name}.mass"),
                aw.Vector(*(numbers.draw(f"{name}.c{axis}") for axis in "xyz")),
                tuple(aw.Vector(*(numbers.draw(f"{name}.J{i}{j}") for j in "xyz")) for i in "xyz"),
            ),
        )
    names = list(component.connectors())
    return Binding(
        values=values,
        motions=motions,
        time=numbers.draw("time", 0.0, 2.0),
        space=space_name,
        line=space.line,
        line_signs={(a, b): 1.0 if i < j else -1.0 for i, a in enumerate(names) for j, b in enumerate(names)},
        reactions={name: numbers.draw(name) for name in reaction_names(component)},
        energies={
            **{name: numbers.draw(f"around.{name}") for name in ("kinetic", "potential", "power")},
            "mass": numbers.draw("around.mass", 1.0, 2.0),
            **{
                name: aw.Vector(*(numbers.draw(f"around.{name}.{axis}") for axis in "xyz"))
                for name in ("first_moment", "momentum", "angular_momentum", "moments", "products")
            },
        },
    )


def reaction_names(component: aw.Component) -> Iterator[str]:
    for law in component.laws("constraint"):
        yield from law.options.reactions
    for law in component.contact_laws().values():
        yield from law.options.reactions
    if any(law.options.rigid and law.options.reaction_doc for law in component.laws("joint")):
        yield from (f"{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz")
        yield "torque"


def flat_values(made) -> list:
    """All scalars of whatever a law returned."""
    match made:
        case PointInertia():
            assert len(made.points) == len(made.masses)
            return [mass for row in made.masses for mass in row]
        case BodyInertia():
            return [made.mass, *made.center_of_mass, made.moment]
        case aw.CoordinateLoad():
            return [made.value]
        case Load():
            return [*made.force, *made.torque]
        case Placement():
            return [*made.displacement, *angles_of(made.rotation)]
    return [one for item in scalars(made) for one in (flat_values(item) if nested(item) else [item])]


def angles_of(rotation) -> list:
    if rotation is None or rotation is aw.FREE:
        return []
    return [one.angle for one in rotation.turns] if isinstance(rotation, aw.Rotation) else [rotation]


def nested(item) -> bool:
    return isinstance(item, (PointInertia, BodyInertia, Load, aw.CoordinateLoad, Placement, aw.Vector, list, tuple))


def law_values(cls: type[aw.Component], space: str, kind: str) -> Mapping[str, list[float]]:
    numbers = Numbers(kind)
    component = example(cls)
    bound = bind(component, binding_of(component, space, numbers))
    found = {}
    for law in component._laws.values():
        if law.holds_in(space) and law.kind != "update":  # which is called on numbers alone
            coordinates = [numbers.draw(name) for name in getattr(law.options, "coordinates", ())]
            made = getattr(bound, law.name)
            made = flat_values(made(*coordinates) if callable(made) else made)
            found[f"{law.kind} {law.name} {len(found)}"] = [numbers.read(one) for one in made if one is not None]
    return found


@pytest.mark.sample(20)
@pytest.mark.parametrize("space", ["line", "plane", "space"])
@pytest.mark.parametrize("cls", COMPONENTS, ids=lambda cls: cls.__name__)
def test_laws_mean_the_same_on_floats_expressions_and_sympy(cls, space):
    floats = law_values(cls, space, "float")
    for kind in ("expression", "sympy"):
        others = law_values(cls, space, kind)
        assert list(others) == list(floats)
        for name, values in floats.items():
            assert all(math.isfinite(value) for value in values), name
            assert values == pytest.approx(others[name], rel=1e-12, abs=1e-12), (name, kind)
