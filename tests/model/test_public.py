"""What `import atwood` gives, and that it is enough to write components with."""

import subprocess
import sys

import pytest

import atwood
from atwood.expr import Graph
from atwood.model.local.bound import ParameterTable
from atwood.model.local.flatten import flatten
from atwood.model.local.laws import localize

from .things import Bob

HEAVY = ("sympy", "scipy", "matplotlib", "sksundae", "networkx", "rich", "click", "llvmlite")


def fresh_python(code: str) -> str:
    path = [entry for entry in sys.path if entry]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = {path!r}\n{code}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_importing_is_light():
    assert fresh_python(f"import atwood; print([name for name in {HEAVY!r} if name in sys.modules])") == "[]"


def test_every_public_name_is_there():
    assert sorted(set(atwood.__all__)) == sorted(atwood.__all__)
    for name in atwood.__all__:
        assert getattr(atwood, name) is not None
        assert name in dir(atwood)
    assert set(atwood._LATER) < set(atwood.__all__)
    assert atwood.__version__[0].isdigit()
    with pytest.raises(AttributeError, match="nonsense"):
        _ = atwood.nonsense


@pytest.mark.parametrize("name", atwood._RENAMED)
def test_earlier_names_work_and_warn(name):
    with pytest.warns(DeprecationWarning, match=atwood._RENAMED[name]):
        assert getattr(atwood, name) is getattr(atwood, atwood._RENAMED[name])


def test_public_names_stay_what_they_are_when_everything_is_loaded():
    """A module of the package must not take the place of a function of the same name."""
    code = """
import types, atwood, atwood.reporting.mechanism, atwood.pipeline, atwood.study
from atwood.reporting import MechanismReport
print([name for name in atwood.__all__ if isinstance(getattr(atwood, name), types.ModuleType)])
"""
    assert fresh_python(code) == "[]"


def test_every_public_thing_says_what_it_is():
    for name in atwood.__all__:
        thing = getattr(atwood, name)
        if callable(thing) and getattr(thing, "__module__", "").startswith("atwood."):
            assert thing.__doc__, name


USER_COMPONENT = '''
from atwood import Component, Point, connector, observable, parameter, potential


class CubicSpring(Component):
    """A spring that gets stiffer: potential energy k x^2/2 + h x^4/4."""

    stiffness: float = parameter(1.0, unit="N/m", minimum=0.0, doc="Stiffness at rest.")
    hardening: float = parameter(1.0, unit="N/m^3", doc="How it gets stiffer.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @potential
    def energy(self):
        x = self.distance(self.a, self.b)
        return 0.5 * self.stiffness * x**2 + 0.25 * self.hardening * x**4

    @observable(unit="m", doc="Length.")
    def length(self):
        return self.distance(self.a, self.b)
'''


def make_spring_scene():
    space = {"__name__": "user"}
    exec(USER_COMPONENT, space)
    scene = atwood.Scene()
    spring = scene.add("spring", space["CubicSpring"](stiffness="2 N/cm", hardening=3))
    bob = scene.add("bob", Bob())
    scene.connect(spring.b, bob.point)
    return scene


def localized(scene):
    flat = flatten(scene)
    table = ParameterTable(Graph(), flat.space)
    return localize(flat, table, {}, None), table


def test_a_component_of_twenty_lines():
    assert len([line for line in USER_COMPONENT.splitlines() if line.strip()]) <= 20
    parts, table = localized(make_spring_scene())
    (energy,) = parts["spring"].potentials
    values = dict(table.values)
    for name, one in parts["spring"].connectors.items():
        values |= dict(zip(one.position, (0.0, 0.0) if name == "a" else (3.0, 4.0), strict=True))
    from atwood.expr import evaluate

    assert evaluate([energy], values)[0] == pytest.approx(0.5 * 200 * 25 + 0.25 * 3 * 625)
    assert {symbol.name for symbol in table.values} == {"spring.stiffness", "spring.hardening", "bob.mass"}


def test_a_law_that_fails_names_the_part_and_itself():
    class Broken(atwood.Component):
        point: atwood.Point = atwood.connector(atwood.Point, "Somewhere.")
        kind: str = atwood.parameter("x", choices=("x", "y"), doc="What is wrong with it.")

        @atwood.potential
        def energy(self):
            return self.point.velocty if self.kind == "x" else self.point.acceleration.x

    for kind, words in (("x", "velocty"), ("y", "may not read its acceleration")):
        scene = atwood.Scene()
        scene.add("odd", Broken(kind=kind))
        with pytest.raises(atwood.DeclarationError, match=words) as caught:
            localized(scene)
        assert caught.value.where.startswith("odd.")


def test_a_constraint_must_name_its_reactions():
    class Odd(atwood.Component):
        point: atwood.Point = atwood.connector(atwood.Point, "Somewhere.")

        @atwood.constraint(reaction="force", doc="Force.")
        def pinned(self):
            return [self.point.position.x, self.point.position.z]

    scene = atwood.Scene()
    scene.add("odd", Odd())
    with pytest.raises(atwood.DeclarationError, match="returns 2 scalars and names 1"):
        localized(scene)
