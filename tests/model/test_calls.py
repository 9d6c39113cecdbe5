"""The fields of a component say how it is called: signatures and docstrings."""

import inspect
import pydoc

import pytest

import atwood_library
from atwood import Component, Model, Point, Scene, connector, parameter, signal
from atwood_library import Ground, Pivot, Rod, Spring
from atwood_library.scenes import SCENES, DoublePendulum

CLASSES = [one for one in vars(atwood_library).values() if isinstance(one, type) and issubclass(one, Component)]


class Needy(Component):
    """It needs a number."""

    size: float = parameter(unit="m", minimum=0.5, doc="How large it is.")
    push: float = signal(2.0, unit="N", doc="How it is pushed.")
    end: Point = connector(Point, "Its end.")


class OfItsOwn(Spring):
    """Its own way to be called."""

    def __init__(self, hardness: float) -> None:
        super().__init__(stiffness=1e3 * hardness)


def shown(thing: object) -> str:
    return pydoc.render_doc(thing, renderer=pydoc.plaintext)


@pytest.mark.parametrize("kind", [*CLASSES, *SCENES.values()], ids=lambda one: one.__name__)
def test_what_a_class_is_called_with_is_in_its_signature(kind: type[Component]) -> None:
    found = inspect.signature(kind)
    named = {*kind.parameter_specs(), *kind.signal_specs(), *getattr(kind, "_prototypes", {})}
    assert set(found.parameters) == named
    assert all(one.kind is inspect.Parameter.KEYWORD_ONLY for one in found.parameters.values())
    needed = {name for name, one in found.parameters.items() if one.default is inspect.Parameter.empty}
    made = {name: one.default for name, one in found.parameters.items() if name in kind.parameter_specs()}
    if not needed and not issubclass(kind, Model):
        assert kind(**made).parameters() == kind().parameters()


def test_help_shows_units_defaults_and_meanings() -> None:
    text = shown(Spring)
    assert "Spring(*, stiffness: 'Number' = 1.0, natural_length: 'Number' = 0.0" in text
    assert "stiffness : N/m, at least 0, default 1.0\n |      Force for an extension by one metre." in text
    assert "acts : {'restoring', 'repelling'}, default 'restoring'" in text
    assert "a : Point\n |      One end." in text
    assert "tension : N\n |      Tension; negative when the spring pushes." in text
    assert "linear in its extension" in text
    assert "motor : N*m, input, default 0.0" in shown(Pivot)
    assert "tension : N" in shown(Rod)
    assert "rod1 : Rod" in shown(DoublePendulum)


def test_what_must_be_given_has_no_default() -> None:
    assert str(inspect.signature(Needy)) == "(*, size: float, push: float = 2.0)"
    assert "size : m, at least 0.5, required" in Needy.__doc__


def test_who_has_an_init_of_its_own_says_how_it_is_called() -> None:
    assert list(inspect.signature(OfItsOwn).parameters) == ["hardness"]
    assert list(inspect.signature(Component).parameters) == ["unnamed", "values"]
    assert list(inspect.signature(Ground).parameters) == ["position", "angle", "axis"]
    assert next(iter(inspect.signature(Scene).parameters)) == "space"


def test_sections_that_a_docstring_has_are_its_own() -> None:
    class Told(Spring):
        """Told.

        Parameters
        ----------
        stiffness
            As the maker says.
        """

    assert Told.__doc__.count("Parameters\n") == 1
    assert "Connectors" in Told.__doc__


def test_a_class_is_declared_without_making_them() -> None:
    class Quick(Spring):
        """Quick."""

    assert vars(Quick)["__doc__"] == "Quick."
    assert "__signature__" not in vars(Quick)
