"""Formulas have the values of the expressions that they were written from, in Python and in sympy."""

import math
from typing import Any

import numpy as np
import pytest
import sympy

from atwood import (
    Component,
    Point,
    Scalar,
    Scene,
    Vector,
    absolute,
    assemble,
    atan2,
    connector,
    equations,
    exp,
    floor,
    force,
    log,
    maximum,
    minimum,
    norm,
    parameter,
    potential,
    select,
    sign,
    tanh,
)
from atwood.expr import evaluate
from atwood.model.declare.law_results import Load
from atwood.theory.equations.equations import EquationsOfMotion
from atwood.theory.formulas.printers import code
from atwood_library import PointMass

from ...helpers.smooth import SMOOTH as SCENES

CASES = [
    *((name, form, "quaternion") for name in SCENES for form in ("reduced", "dae")),
    ("lagrange-top", "reduced", "euler-zxz"),
    ("heavy-top", "reduced", "euler-xyz"),
]


def names_of(eq: EquationsOfMotion, seed: int = 5) -> tuple[dict[Any, float], dict[str, Any]]:
    """Return random values by expression, with quaternions of size one, and by the names of Python."""
    found, notation, random = eq.expressions, eq.notation, np.random.default_rng(seed)
    moving = (*found.coordinates, *found.velocities, *found.accelerations, *(c.multiplier for c in found.constraints))
    values = {symbol: float(random.uniform(0.3, 0.9)) for symbol in moving}
    for one in found.equations.orientation_coordinates:
        symbols = [found.coordinates[i] for i in one.coordinates]
        size = math.hypot(*(values[symbol] for symbol in symbols))
        values |= {symbol: values[symbol] / size for symbol in symbols} if one.is_homogeneous else {}
    values |= dict(zip(eq.assembly.parameters, eq.assembly.parameter_values.tolist(), strict=True))
    values[found.time] = eq.assembly.flat.t_start
    names: dict[str, Any] = {name: getattr(math, name) for name in code.MATH}
    names |= {code.letter(symbol): values[e] for e, symbol in notation.symbols.items()}
    names |= {code.letter(symbol, dots): values[e] for e, (symbol, dots) in notation.velocities.items()}
    names |= {"np": np, "solve": np.linalg.solve}
    return values, names


def pairs(eq: EquationsOfMotion) -> list[tuple[Any, Any]]:
    written, found = eq.written, eq.expressions
    made = [(written.kinetic, found.kinetic), (written.potential, found.potential), (written.rayleigh, found.rayleigh)]
    made += [*zip(written.rows, eq.residuals, strict=True), *zip(written.momenta, found.momenta, strict=True)]
    values = [one.rate if one.value is None else one.value for one in found.constraints]
    return [*made, *zip(written.constraints, values, strict=True)]


def check(eq: EquationsOfMotion) -> None:
    values, names = names_of(eq)
    shown = pairs(eq)
    for name, shared in eq.book.shared:
        names[code.formula(name)] = eval(code.formula(shared), names)
    for formula, expression in shown:
        mine, expected = eval(code.formula(formula), names), evaluate([expression], values)[0]
        size = sum(abs(eval(code.formula(type(formula)((term,))), names)) for term in formula.terms)
        assert mine == pytest.approx(expected, rel=1e-9, abs=1e-11 * max(size, 1e-3)), code.formula(formula)


@pytest.mark.sample(5)
@pytest.mark.parametrize(("name", "form", "orientation"), CASES)
def test_formulas_have_the_values_of_expressions(name: str, form: str, orientation: str) -> None:
    eq = equations(assemble(SCENES[name](), form=form, orientation=orientation))
    if eq._operations < 1200:
        check(eq)


class Everything(Component):
    """A point with forces of all functions that there are."""

    size: float = parameter(0.4, unit="m", above=0.0, doc="A length.")
    point: Point = connector(Point, "The point.")

    @potential
    def energy(self) -> Scalar:
        """Return a potential."""
        r = self.point.position
        x, z = r.x / self.size, r.z / self.size
        return exp(-x * x) + log(1.0 + z * z) + tanh(x) + atan2(z, x) + (1.0 + x * x) ** 1.5 + 2.0**x + norm(r)

    @force
    def pull(self) -> list[Load]:
        """Return a force."""
        x, z, v = self.point.position.x, self.point.position.z, self.point.velocity.x
        inside = (x < self.size) & ~(z < -self.size)
        along = minimum(x, z) + 2.0 * maximum(x, v) + absolute(v) + sign(v) * floor(3.0 * x)
        across = select(inside, x * v, -z) + select((x < 0.0) | (v <= 0.0), 1.0, 3.0) + (x < v) * 2.0
        late = select(self.time < 1.0, self.time, 2.0)
        return [Load(self.point, Vector(along, 0.0, across + late))]


@pytest.mark.parametrize("parameters", ["symbolic", "values"])
def test_of_every_function(parameters: str) -> None:
    scene = Scene()
    bob, law = scene.add("bob", PointMass(mass=2.0)), scene.add("law", Everything())
    scene.connect(bob.point, law.point)
    eq = equations(scene, parameters=parameters)
    check(eq)
    values, _ = names_of(eq)
    point = dict.fromkeys([sympy.Symbol("t")], 0.0)
    states = [*zip(eq.accelerations, map(values.get, eq.expressions.accelerations), strict=True)]
    states += [*zip(eq.velocities, map(values.get, eq.expressions.velocities), strict=True)]
    states += [*zip(eq.coordinates, map(values.get, eq.expressions.coordinates), strict=True), *eq.values.items()]
    for row, expression in zip(eq.rows, eq.residuals, strict=True):
        assert float(row.subs(states).subs(point)) == pytest.approx(evaluate([expression], values)[0], rel=1e-9)
    for text in (eq.latex(), eq.text(), eq.markdown()):
        assert text
    names: dict[str, Any] = {}
    exec(compile(eq.python(), "everything", "exec"), names)
    q, u = ([values[s] for s in symbols] for symbols in (eq.expressions.coordinates, eq.expressions.velocities))
    still = {**values, **dict.fromkeys(eq.expressions.accelerations, 0.0)}
    assert names["bias"](0.0, q, u) == pytest.approx(evaluate(list(eq.residuals), still), rel=1e-9)
