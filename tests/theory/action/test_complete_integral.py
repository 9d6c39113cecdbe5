"""W and S as sums: against books, the equation of Hamilton and Jacobi itself, and runs, along which betas stay."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

from atwood import Scene, UnsupportedError, equations, hamiltonian, separation, simulate
from atwood.theory.action.separation import Separation
from atwood.theory.hamiltonian.phase_space import vanishes
from atwood_library import Charge, Ground, PointMass, PointOnSurface, Potential
from atwood_library.scenes import SCENES

POLAR = {"x": "r*cos(phi)", "z": "r*sin(phi)"}
PARABOLIC = {"x": "xi*eta", "z": "(xi**2 - eta**2)/2"}
ELLIPTIC = {"x": "cosh(u)*cos(v)", "z": "sinh(u)*sin(v)"}
PROLATE = {"x": "sinh(u)*sin(v)*cos(phi)", "y": "sinh(u)*sin(v)*sin(phi)", "z": "cosh(u)*cos(v)"}
SPHERE = {"x": "r*sin(theta)*cos(phi)", "y": "r*sin(theta)*sin(phi)", "z": "r*cos(theta)"}


def of_body(new: Mapping[str, str]) -> dict[str, str]:
    return {f"body.position.{axis}": one for axis, one in new.items()}


def elliptic(place: Mapping[str, float]) -> dict[str, float]:
    w = np.arccosh(place["x"] + 1j * place["z"])
    return {"u": float(w.real), "v": float(w.imag)}


def prolate(place: Mapping[str, float]) -> dict[str, float]:
    w = np.arccosh(place["z"] + 1j * np.hypot(place["x"], place["y"]))
    return {"u": float(w.real), "v": float(w.imag), "phi": float(np.arctan2(place["y"], place["x"]))}


BACK: dict[str, Callable[[Mapping[str, float]], dict[str, float]]] = {
    "own": dict,
    "polar": lambda at: {"r": np.hypot(at["x"], at["z"]), "phi": np.arctan2(at["z"], at["x"])},
    "parabolic": lambda at: (lambda xi: {"xi": xi, "eta": at["x"] / xi})(np.sqrt(np.hypot(at["x"], at["z"]) + at["z"])),
    "elliptic": elliptic,
    "prolate": prolate,
    "sphere": lambda at: (lambda r: {"r": r, "theta": np.arccos(at["z"] / r), "phi": np.arctan2(at["y"], at["x"])})(
        np.sqrt(at["x"] ** 2 + at["y"] ** 2 + at["z"] ** 2)
    ),
}


def moving(scene: Scene, place: Mapping[str, float], speed: Mapping[str, float]) -> Scene:
    scene.start.update({f"body.position.{x}": value for x, value in place.items()})
    scene.start.update({f"body.velocity.{x}": value for x, value in speed.items()})
    return scene


def field(law: str, space: str = "plane", **options: Any) -> Scene:
    scene = Scene(space=space, **{"gravity": 0.0, **options})
    held, body = scene.add("field", Potential(energy_function=law)), scene.add("body", PointMass(mass=1.2))
    scene.connect(held.point, body.point)
    return scene


def two_centres(space: str = "plane") -> Scene:
    scene = Scene(gravity=0.0, space=space)
    body = scene.add("body", PointMass(mass=1.1))
    for k, (place, strength) in enumerate(((1, 1), (-1, 2))):
        square = f"(x - {place})**2 + z**2" if space == "plane" else f"x**2 + y**2 + (z - {place})**2"
        held = scene.add(f"centre{k}", Potential(energy_function=f"-{strength}/sqrt({square})"))
        scene.connect(held.point, body.point)
    if space == "space":
        return moving(scene, {"x": 0.5, "y": 0.4, "z": 0.7}, {"x": -0.3, "y": 0.9, "z": 0.4})
    return moving(scene, {"x": 0.9, "z": 0.7}, {"x": -1.1, "z": 1.5})


def kepler(space: str = "plane", **options: Any) -> Scene:
    place, speed = {"x": 0.6, "z": 0.3}, {"x": -0.4, "z": 1.1}
    if space == "space":
        place["y"], speed["y"] = 0.2, 0.5
    return moving(SCENES["kepler"](space=space, mass=1.3, strength=1.1, **options), place, speed)


CASES: dict[str, tuple[Callable[[], Scene], str, dict[str, str], int]] = {
    "kepler in the plane": (kepler, "polar", POLAR, 0),
    "kepler in parabolic coordinates": (kepler, "parabolic", PARABOLIC, 0),
    "kepler in space": (lambda: kepler("space"), "sphere", SPHERE, 0),
    "a hyperbola": (lambda: kepler(eccentricity=1.5), "polar", POLAR, 0),
    "stark": (lambda: kepler(gravity=0.4), "parabolic", PARABOLIC, 2),
    "two centres": (two_centres, "elliptic", ELLIPTIC, 2),
    "two centres in space": (lambda: two_centres("space"), "prolate", PROLATE, 2),
    "oscillators": (
        lambda: moving(field("0.7*x**2 + 1.1*z**2"), {"x": 0.5, "z": 0.3}, {"x": 0.4, "z": 0.7}),
        "own",
        {},
        0,
    ),
    "an oscillator in polar coordinates": (
        lambda: moving(field("0.7*(x**2 + z**2)"), {"x": 0.5, "z": 0.3}, {"x": 0.4, "z": 0.7}),
        "polar",
        POLAR,
        0,
    ),
    "a uniform field": (
        lambda: moving(field("0", gravity=9.81), {"x": 0.5, "z": 0.3}, {"x": 0.4, "z": 7.0}),
        "own",
        {},
        0,
    ),
}


def along(name: str) -> tuple[Separation, list[dict[Any, float]], Scene]:
    """Return a separation, and states of a run in its coordinates, t included, between two turning points."""
    make, kind, new, _ = CASES[name]
    scene = make()
    found = separation(scene, of_body(new) if new else None)
    run = simulate(scene, t_end=0.25, rtol=1e-13, solver="taylor", outputs=6)
    h = hamiltonian(scene)
    states = []
    places = {path: sympy.sympify(new[path[-1]]) if new else sympy.Symbol(path[-1]) for path in h.paths}
    mass = scene["body"].mass
    for k, t in enumerate(run.time):
        at = BACK[kind]({path[-1]: float(run[path][k]) for path in h.paths})
        where = {q: at[str(q)] for q in found.coordinates}
        p_old = {path: mass * float(run[path.replace("position", "velocity")][k]) for path in h.paths}
        for q, p in zip(found.coordinates, found.momenta, strict=True):
            where[p] = sum(p_old[x] * float(places[x].diff(q).xreplace(where)) for x in h.paths)
        states.append({**where, sympy.Symbol("t"): float(t)})
    return found, states, scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CASES)
def test_constants_and_betas_stay_along_a_run(name: str) -> None:
    found, states, _ = along(name)
    complete = found.complete
    assert sum(one.function().has(sympy.Integral) for one in complete.parts) == CASES[name][3]
    momenta = dict(zip(found.coordinates, found.momenta, strict=True))
    known = []
    for state in states:
        held = {**found.values, **state}
        for constant, whole in complete.constants.items():
            held[constant] = float(whole.xreplace(held))
        known.append(held)
    for constant in complete.constants:
        assert known[-1][constant] == pytest.approx(known[0][constant], rel=1e-9, abs=1e-10)
    fixed = {one: known[0][one] for one in (*complete.constants, *found.values)}
    for constant in complete.constants:
        moved = []
        for held in known:
            total = sum(held[q] for q, p in complete.ignorable if p == constant)
            total -= float(complete.energy.diff(constant).xreplace(fixed)) * held[sympy.Symbol("t")]
            for one in complete.parts:
                function = one.function(constant).xreplace(fixed)
                sign = np.sign(held[momenta[one.coordinate]])
                assert sign == np.sign(known[0][momenta[one.coordinate]])
                total += sign * difference(function, one.coordinate, known[0][one.coordinate], held[one.coordinate])
            moved.append(total)
        assert np.ptp(moved) < 1e-8
    assert known[-1][sympy.Symbol("t")] > 0.2


def difference(function: Any, q: Any, start: float, end: float) -> float:
    """Return by how much a sum of functions and integrals grows."""
    total = 0.0
    for one in sympy.Add.make_args(function):
        if one.has(sympy.Integral):
            total += float(
                mpmath.quad(sympy.lambdify(q, one.atoms(sympy.Integral).pop().function, "mpmath"), [start, end])
            )
        else:
            total += float(one.xreplace({q: sympy.Float(end)}).evalf() - one.xreplace({q: sympy.Float(start)}).evalf())
    return total


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CASES)
def test_the_equation_of_hamilton_and_jacobi_holds(name: str) -> None:
    """``H(q, dW/dq) = E``, with W differentiated, at 50 digits."""
    found, states, _ = along(name)
    complete = found.complete
    w = complete.characteristic
    held = {**found.values, **states[2]}
    for constant, whole in complete.constants.items():
        held[constant] = whole.xreplace(held)
    exact = {one: sympy.Float(float(value), 60) for one, value in held.items() if one not in found.momenta}
    exact |= {p: exact.get(p, sympy.Float(0)) for _, p in complete.ignorable}
    exact |= {p: sympy.Float(float(held[p]), 60) for _, p in complete.ignorable}
    slopes = {p: w.diff(q).doit(integrals=False) for q, p in zip(found.coordinates, found.momenta, strict=True)}
    h = found.expression
    value = h.xreplace({p: slopes[p].xreplace(exact) for p in found.momenta}).xreplace(exact).evalf(50)
    assert abs(value - complete.energy.xreplace(exact)) < 1e-45 * (1 + abs(value))


def test_geodesics_of_a_spheroid() -> None:
    """``p_u^2 = (2 m E - p_v^2/(a sin u)^2)(a^2 cos^2 u + c^2 sin^2 u)``: along the quadrature beta stays (Jacobi)."""
    scene = Scene(space="space", gravity=0.0)
    parts = {"ground": Ground(), "surface": PointOnSurface(scale=1.0), "bead": PointMass(mass=1.3)}
    for name, part in parts.items():
        scene.add(name, part)
    scene.connect(scene.ground.frame, scene.surface.a)
    scene.connect(scene.surface.b, scene.bead.point)
    scene.set("surface.surface", ("sin(p)*cos(q)", "sin(p)*sin(q)", "2*cos(p)"))
    start = {"parameter_1": 1.0, "parameter_2": 0.0, "rate_1": 0.4, "rate_2": 0.8}
    scene.start.update({f"surface.{one}": value for one, value in start.items()})
    found = separation(scene)
    u, _ = found.coordinates
    E, p_v = sympy.symbols("E p_v")
    [own] = found.complete.parts
    a, m = sympy.symbols("a m")
    book = (2 * m * E * a**2 - p_v**2 / sympy.sin(u) ** 2) * (sympy.cos(u) ** 2 + 4 * sympy.sin(u) ** 2)
    assert vanishes([own.quadrature.square - book]).holds
    run = simulate(scene, t_end=0.5, rtol=1e-12, solver="taylor", outputs=5)
    held = {**found.values, u: run["surface.parameter_1"][0], p_v: 1.3 * 0.8 * np.sin(1.0) ** 2}
    held[E] = 0.65 * (0.16 * (np.cos(1.0) ** 2 + 4.0 * np.sin(1.0) ** 2) + 0.64 * np.sin(1.0) ** 2)
    slope = found.betas[p_v].atoms(sympy.Integral).pop().function.xreplace({**held, u: u})
    for place, azimuth in zip(run["surface.parameter_1"], run["surface.parameter_2"], strict=True):
        turned = mpmath.quad(sympy.lambdify(u, slope, "mpmath"), [1.0, place])
        assert azimuth + float(turned) == pytest.approx(0.0, abs=1e-9)


def test_the_actions_of_sommerfeld() -> None:
    """``J_r = -L + m k/sqrt(-2 m E)``, ``J_theta = L - |p_phi|``, over 2 pi (Goldstein, section 10.8); oscillators."""
    found = separation(kepler("space"), of_body(SPHERE))
    r, theta, alpha, E, p_phi = sympy.symbols("r theta alpha_theta E p_phi")
    eq = equations(kepler("space"))
    m = eq.symbol("body.mass")
    k = -sympy.Mul(*(eq.symbol(f"force.{one}") for one in ("charge_a", "charge_b", "coulomb_constant")))
    whole = {m: sympy.Rational(13, 10), alpha: 2, E: -sympy.Rational(1, 3), p_phi: 1}
    whole |= {one: sympy.Float(value, 60) for one, value in found.values.items() if one != m}
    expected = 2 * sympy.pi * (m * k / sympy.sqrt(-2 * m * E) - sympy.sqrt(alpha))
    assert abs((found.actions[r] - expected).xreplace(whole).evalf(50)) < 1e-45
    assert vanishes([found.actions[theta] - 2 * sympy.pi * (sympy.sqrt(alpha) - p_phi)]).holds
    numeric = found.motion("theta", *numbers(found))
    here = {**found.values, **state_of(found)}
    for constant, value in found.constants.items():
        here[constant] = float(value.xreplace(here))
    assert numeric.action == pytest.approx(float(found.actions[theta].xreplace(here)), rel=1e-9)


def state_of(found: Separation) -> dict[Any, float]:
    return {one: found.complete.parts[0].quadrature.values[one] for one in (*found.coordinates, *found.momenta)}


def numbers(found: Separation) -> tuple[list[float], list[float]]:
    state = state_of(found)
    return [state[one] for one in found.coordinates], [state[one] for one in found.momenta]


def test_oscillators_and_a_throw_as_functions_of_time() -> None:
    found, _, scene = along("oscillators")
    x, m, t = sympy.Symbol("x"), scene["body"].mass, sympy.Symbol("t")
    whole = found.motions[x].xreplace(found.values)
    E, since = sympy.Symbol("E_x"), sympy.Symbol("t_x")
    assert vanishes([whole + sympy.sqrt(E / 0.7) * sympy.cos(sympy.sqrt(1.4 / m) * (t - since))]).bound < 1e-14
    thrown = along("a uniform field")[0]
    eq = equations(CASES["a uniform field"][0]())
    g, mass, E_z = eq.symbol("gravity"), eq.symbol("body.mass"), sympy.Symbol("E_z")
    expected = E_z / (mass * g) - g * (t - sympy.Symbol("t_z")) ** 2 / 2
    assert vanishes([thrown.motions[sympy.Symbol("z")] - expected]).proven
    px = sympy.Symbol("p_x")
    assert vanishes([thrown.betas[px] - (x - px * t / mass)]).proven


def test_two_bodies_have_the_energy_of_their_distance() -> None:
    scene = SCENES["two-body"](space="plane")
    m1, m2 = (equations(scene).symbol(f"body{k}.mass") for k in (1, 2))
    old = {}
    for axis, along_it in POLAR.items():
        way = sympy.sympify(along_it)
        old[f"body1.position.{axis}"] = sympy.Symbol(axis.upper()) - m2 / (m1 + m2) * way
        old[f"body2.position.{axis}"] = sympy.Symbol(axis.upper()) + m1 / (m1 + m2) * way
    found = separation(scene, old)
    X, pX, t = sympy.symbols("X p_X t")
    assert vanishes([found.betas[pX] - (X - pX * t / (m1 + m2))]).proven
    assert {str(one) for one in found.constants} == {"p_X", "p_Z", "p_phi", "E_r"}


def test_a_top_keeps_a_quadrature_of_its_cubic() -> None:
    """``p_theta^2 = 2 I (E' - m g l cos) - (p_phi - p_psi cos)^2/sin^2`` (Goldstein, equation 5.62)."""
    scene = SCENES["lagrange-top"]()
    found = separation(scene)
    theta, p_phi, p_psi, E = sympy.symbols("theta p_phi p_psi E_theta")
    [part] = found.complete.parts
    eq = equations(scene, orientation="euler-zxz")
    names = {str(one): one for one in eq.values}
    I, m, g, l = (names[one] for one in ("I_1", "m", "g", "c_z"))
    about = I + m * l**2
    expected = 2 * about * (E - m * g * l * sympy.cos(theta))
    expected -= (p_phi - p_psi * sympy.cos(theta)) ** 2 / sympy.sin(theta) ** 2
    assert vanishes([part.quadrature.square - expected]).proven


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("scene", "new", "left"),
    [
        (SCENES["kepler"](), {}, r"/sqrt\(x\*\*2 \+ z\*\*2\)"),
        (SCENES["kepler"](gravity=0.3), POLAR, r"g\*m\*\*2\*r\*\*3\*sin\(phi\)"),
        (field("x**2 + z**2 + 0.1*x*z"), {}, r"x\*z"),
    ],
)
def test_what_does_not_separate_names_what_is_left_over(scene: Scene, new: dict[str, str], left: str) -> None:
    found = separation(scene, of_body(new) if new else None)
    assert not found.separates
    with pytest.raises(UnsupportedError, match=left):
        assert found.complete
    assert "left over" in found.sentence


def test_a_charge_in_a_magnetic_field_in_two_gauges() -> None:
    """In polar coordinates with the symmetric gauge, and in those of Landau: circles of the cyclotron's frequency."""
    gauges = (lambda x, y, z, t: (-0.4 * z, 0.0, 0.4 * x), POLAR), (lambda x, y, z, t: (-0.8 * z, 0.0, 0.0), {})
    for gauge, new in gauges:
        scene = Scene(gravity=0.0)
        charge, body = scene.add("charge", Charge(charge=1.5)), scene.add("body", PointMass(mass=1.2))
        scene.connect(charge.point, body.point)
        scene.set("charge.vector_potential", gauge)
        moving(scene, {"x": 1.0, "z": 0.2}, {"x": 0.3, "z": 0.5})
        found = separation(scene, of_body(new) if new else None)
        [part] = found.complete.parts
        [energy] = [one for one in found.constants if str(one).startswith("E")]
        period = part.quadrature.turn(energy)
        here = part.quadrature.values
        assert float(period.xreplace(here)) == pytest.approx(2.0 * np.pi * 1.2 / (1.5 * 0.8), rel=1e-9)


def test_turned_moved_and_scaled_scenes_have_the_same_integral() -> None:
    plain = separation(kepler(), of_body(POLAR))
    turned = {"x": "r*cos(phi + 0.7)", "z": "r*sin(phi + 0.7)"}
    other = separation(kepler(), of_body(turned))
    there = {**plain.values, sympy.Symbol("E"): -0.3, sympy.Symbol("p_phi"): 0.6}
    off = plain.actions[sympy.Symbol("r")] - other.actions[sympy.Symbol("r")]
    assert abs(float(off.xreplace(there))) < 1e-12
    renamed = separation(kepler(), {"body.position.x": "s*cos(a)", "body.position.z": "s*sin(a)"})
    assert set(map(str, renamed.constants)) == {"p_a", "E"}


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("law", "place", "speed"),
    [
        ("-0.7*x**2", -0.5, 0.1),
        ("-0.7*x**2", 0.5, 0.1),
        ("0.7/x**2 + 0.4*x**2", -0.9, 0.1),
        ("1/sin(x)**2", -0.6, -0.1),
        ("1/sin(x)**2", 6.9, -0.1),
    ],
)
def test_a_coordinate_stays_on_its_side_as_a_function_of_time(law: str, place: float, speed: float) -> None:
    """Since a turning point the motion is that of a run which begins there."""
    scene = moving(field(law, space="line"), {"x": place}, {"x": speed})
    found = separation(scene)
    [(q, x)] = found.motions.items()
    [constant] = found.constants
    values = {**found.values, constant: 1.2 * speed**2 / 2 + float(sympy.sympify(law).subs("x", place))}
    made = sympy.lambdify(sympy.Symbol("t"), x.xreplace(values).xreplace({sympy.Symbol(f"t_{q}"): 0.0}))
    run = simulate(moving(scene, {"x": float(made(0.0))}, {"x": 0.0}), t_end=0.4, rtol=1e-12, outputs=5)
    assert np.allclose([made(t) for t in run.time], run["body.position.x"], rtol=1e-8)


def test_a_bead_goes_on_through_the_bottom_of_a_cycloid() -> None:
    """``W' = p`` on both sides of it, and J of a closed form is ``2 pi (E + m g a)/omega``, ``omega^2 = g/(4 a)``."""
    found = separation(SCENES["bead-on-wire"](shape="cycloid"))
    [part] = found.complete.parts
    values = {**found.values, next(iter(found.constants)): -0.3}
    momentum = sympy.lambdify(part.coordinate, sympy.sqrt(part.quadrature.square).xreplace(values), "mpmath")
    across = float(mpmath.quad(momentum, [-0.2, 0.2]))
    assert difference(part.function().xreplace(values), part.coordinate, -0.2, 0.2) == pytest.approx(across)
    expected = 2.0 * np.pi * (-0.3 + 9.81) / np.sqrt(9.81 / 4.0)
    assert [float(one.xreplace(values)) for one in found.actions.values()] in ([], [pytest.approx(expected)])
