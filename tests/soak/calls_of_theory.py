"""The functions above the pipeline and the methods of what they return: sound arguments, and the kind of each."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import atwood
import atwood_library
from atwood_library.scenes import SCENES

from .call import Call


@functools.cache
def pendulum() -> Any:
    return SCENES["simple-pendulum"]()


@functools.cache
def double() -> Any:
    return SCENES["double-pendulum"]()


@functools.cache
def arm() -> atwood.Scene:
    """Return a pendulum with a motor, which has an input."""
    scene = atwood.Scene(t_end=0.2)
    ground, hinge, link = (
        scene.add("ground", atwood_library.Ground()),
        scene.add("hinge", atwood_library.Pivot(motor=0.0)),
        scene.add("link", atwood_library.Link()),
    )
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, link.a)
    scene.start.update({"hinge.angle": 0.3, "hinge.angular_velocity": 0.0})
    return scene


@functools.cache
def run() -> Any:
    return atwood.simulate(pendulum(), t_end=0.3, outputs=7)


@functools.cache
def model() -> Any:
    return atwood.linearize(
        arm(), at={"hinge.angle": -1.5707963267948966}, inputs=["hinge.motor"], outputs=["link.angle"]
    )


@functools.cache
def modes() -> Any:
    return atwood.normal_modes(pendulum(), at={"rod.angle": 0.0})


@functools.cache
def kepler() -> Any:
    return atwood.reduced(pendulum())


@functools.cache
def bracketed() -> Any:
    return atwood.hamiltonian(double())


_PATH = {"path": ("quantity", "parameter", "part")}
_SCENE = {"scene": "object"}
_AT = {"at": "optional object"}
_BAD_AT: dict[str, tuple[Any, ...]] = {
    "at": ({"rod.angle": "x"}, {3: 1.0}, {"rod9.angle": 1.0}, {"rod.angle": "1 kg"}),
}
_SAID_AT = {"at": ("rod.angle", "rod9", "3", "quantity")}
_LONG = {"t_end": "time", "rtol": "share"}


def calls() -> Iterator[Call]:
    """Yield the calls."""
    yield from _linear()
    yield from _flow()
    yield from _mechanics()
    for one in _methods():  # methods are called millions of times: Python looks at the names
        yield replace(one, has_names=False)


def _linear() -> Iterator[Call]:
    scene = {"scene": pendulum()}
    yield Call(
        "linearize",
        atwood.linearize,
        {**scene, "at": {"rod.angle": 0.0}},
        {**_SCENE, **_AT, "inputs": "some texts", "outputs": "some texts", "form": "word"},
        _BAD_AT,
        {**_SAID_AT, "inputs": ("no.such", "input"), "outputs": ("no.such", "quantity")},
    )
    yield Call(
        "normal_modes", atwood.normal_modes, {**scene, "at": {"rod.angle": 0.0}}, {**_SCENE, **_AT}, _BAD_AT, _SAID_AT
    )
    region: dict[str, tuple[Any, ...]] = {
        "region": ({"rod.angle": 3}, {"rod.angle": (1.0, 0.0)}, {"rod9.angle": (0, 1)}, {3: (0, 1)})
    }
    said = {"region": ("rod.angle", "rod9", "3")}
    yield Call("equilibria", atwood.equilibria, scene, {**_SCENE, "region": "optional object"}, region, said)
    yield Call(
        "equilibrium_branches",
        atwood.equilibrium_branches,
        {**scene, "path": "length", "span": (1.0, 2.0)},
        {**_SCENE, "path": "needed text", "span": "object", "region": "optional object"},
        {
            "path": ("rod.lenght",),
            "span": ((1.0,), (2.0, 1.0), (1.0, "x"), (1.0, np.nan), (1.0, 1.0)),
            **region,
        },
        {**_PATH, "span": ("length",), **said},
    )
    yield Call(
        "root_locus",
        atwood.root_locus,
        {**scene, "path": "length", "values": [1.0, 2.0], "at": {"rod.angle": 0.0}},
        {**_SCENE, "path": "needed text", "values": "object", **_AT},
        {"path": ("rod.lenght",), "values": ([], [1.0, "x"], [np.nan], [-1.0]), **_BAD_AT},
        {**_PATH, **_SAID_AT, "values": ("length",)},
    )
    yield Call(
        "trim",
        atwood.trim,
        {"scene": arm(), "at": {"hinge.angle": 0.3}, "inputs": ["hinge.motor"]},
        {**_SCENE, **_AT, "inputs": "some texts", "free": "some texts"},
        {"at": ({"hinge.angle": "x"}, {3: 1.0}, {"rod9.angle": 1.0})},
        {
            "at": ("hinge.angle", "rod9", "3", "quantity"),
            "inputs": ("no.such", "input"),
            "free": ("no.such", "coordinate"),
        },
    )
    yield Call(
        "solve_initial_values",
        atwood.solve_initial_values,
        {**scene, "unknowns": ["rod.angle"], "conditions": {"bob.position.x": 0.5}},
        {**_SCENE, "unknowns": "some texts", "conditions": "mapping"},
        {"conditions": ({"bob9.position.x": 1.0}, {"bob.position.x": "x"}, {3: 1.0}, {"bob.position.x": "1 kg"})},
        {
            "unknowns": ("no.such", "no part", "quantity", "no parameter"),
            "conditions": ("bob.position.x", "bob9", "3", "condition"),
        },
    )


def _flow() -> Iterator[Call]:
    scene = {"scene": pendulum(), "t_end": 0.1}
    run_of = {**_SCENE, **_LONG, "solver": "word"}
    yield Call("tangent_flow", atwood.tangent_flow, {**scene, "outputs": 3}, {**run_of, "outputs": "times"})
    yield Call(
        "lyapunov_exponents",
        atwood.lyapunov_exponents,
        scene,
        {**run_of, "count": "optional whole", "settle": "optional size"},
        {"count": (10**6,)},
        {"count": ("exponents",)},
    )
    yield Call(
        "poincare_section",
        atwood.poincare_section,
        {**scene, "t_end": 2.0, "surface": "rod.angle crosses 0", "quantities": ["rod.angle", "rod.angular_velocity"]},
        {**run_of, "surface": "needed text", "quantities": "some texts", "starts": "optional object"},
        {
            "surface": ("x", "rod9.angle crosses 0", "rod.angle crosses", "rod.angle crosses x"),
            "quantities": ([],),
            "starts": ([3], [{"rod.angle": "x"}], [{"rod9.angle": 1.0}], []),
        },
        {"surface": ("crosses", "quantity"), "quantities": ("no.such",), "starts": ("rod.angle", "rod9", "start")},
    )
    yield Call(
        "phase_portrait",
        atwood.phase_portrait,
        {"scene": pendulum()},
        {**_SCENE, "coordinates": "optional object", "speeds": "optional object"},
        {"coordinates": ((1.0, 0.0), (1.0,), ("a", "b"), (0.0, np.nan)), "speeds": ((1.0, 0.0), (0.0, np.inf))},
    )


def _mechanics() -> Iterator[Call]:
    scene, energies = {"scene": pendulum()}, {"hamiltonian": bracketed()}
    words = {"orientation": "optional word"}
    yield Call("equations", atwood.equations, scene, {**_SCENE, "form": "optional word", "parameters": "word", **words})
    yield Call("dynamics", atwood.dynamics, scene, {**_SCENE, "form": "optional word", **words})
    yield Call("hamiltonian", atwood.hamiltonian, scene, {**_SCENE, "parameters": "word", **words})
    yield Call(
        "conserved",
        atwood.conserved,
        scene,
        {**_SCENE, "symmetries": "some objects", **words},
        {"symmetries": ([3], ["x"])},
    )
    yield Call(
        "action",
        atwood.action,
        {**scene, "t_end": 0.1},
        {**_SCENE, **_LONG, "path": "optional object"},
        {"path": ({"rod.angle": 3j}, {"rod9.angle": 1.0}, {3: 1.0}, {})},
        {"path": ("rod.angle", "rod9", "3")},
    )
    yield Call("action_angle", atwood.action_angle, scene, _SCENE)
    yield Call(
        "boundary_value_motions",
        atwood.boundary_value_motions,
        {**scene, "end": {"rod.angle": 0.5}, "t_end": 0.5},
        {**_SCENE, "end": "mapping", "t_end": "time", "start": "optional object"},
        {"end": ({"rod.angle": "x"}, {"rod9.angle": 1.0}, {3: 1.0}, {}), "start": ({"rod.angle": "x"}, {3: 1.0})},
        {"end": ("rod.angle", "rod9", "3"), "start": ("rod.angle", "3")},
    )
    yield Call(
        "reduced",
        atwood.reduced,
        {"scene": pendulum()},
        {**_SCENE, "coordinate": "optional word", **words},
        said_as={"coordinate": ("wrod",)},
    )
    yield Call(
        "routhian",
        atwood.routhian,
        {"scene": SCENES["kepler"]()},
        {**_SCENE, "ignorable": "some objects", **words},
        {"ignorable": (["no.such"], [3])},
        {"ignorable": ("no.such",)},
    )
    yield Call(
        "separation",
        atwood.separation,
        {"scene": SCENES["kepler"]()},
        {**_SCENE, "coordinates": "optional object"},
        {"coordinates": ({3: 1.0}, {"x": "x"})},
        {"coordinates": ("coordinate",)},
    )
    said_h = {"hamiltonian": ("phase space",)}
    both = {"f": 1, "g": 1, **energies}
    kinds = {"f": "expression", "g": "expression", "hamiltonian": "object"}
    yield Call("poisson_bracket", atwood.poisson_bracket, both, kinds, said_as=said_h)
    yield Call(
        "poisson_brackets",
        atwood.poisson_brackets,
        {"functions": [1], **energies},
        {"functions": "some objects"},
        {"functions": (["(", 3],)},
    )
    yield Call(
        "total_derivative", atwood.total_derivative, {"f": 1, **energies}, {"f": "expression", "hamiltonian": "object"}
    )
    pairs = {"coordinates": "some objects", "momenta": "some objects"}
    good = {"coordinates": bracketed().coordinates, "momenta": bracketed().momenta, **energies}
    yield Call(
        "fundamental_brackets", atwood.fundamental_brackets, good, {**pairs, "hamiltonian": "object"}, said_as=said_h
    )
    transformed = tuple(
        {f"{letter}{k}": one for k, one in enumerate(old)}
        for letter, old in (("Q", bracketed().coordinates), ("P", bracketed().momenta))
    )
    yield Call(
        "canonical_transformation",
        atwood.canonical_transformation,
        {"coordinates": transformed[0], "momenta": transformed[1], **energies},
        {**pairs, "hamiltonian": "object", "inverse": "optional object"},
        said_as=said_h,
    )
    yield Call(
        "generated_transformation",
        atwood.generated_transformation,
        {
            "function": "theta_1*P1 + theta_2*P2",
            "kind": 2,
            "coordinates": ["Q1", "Q2"],
            "momenta": ["P1", "P2"],
            **energies,
        },
        {**pairs, "function": "expression", "kind": "whole", "hamiltonian": "object"},
        {"kind": (0, 5)},
        said_h,
    )
    yield Call(
        "point_transformation",
        atwood.point_transformation,
        {**scene, "old": {"rod.angle": "2*s"}, "coordinates": ["s"]},
        {**_SCENE, "old": "mapping", "coordinates": "some objects"},
        {"old": ({"rod9.angle": "s"}, {3: "s"}, {"rod.angle": "("}, {}), "coordinates": ([3], ["s", "s"])},
        {"old": ("rod.angle", "rod9", "3"), "coordinates": ("coordinate",)},
    )
    yield Call(
        "compare_long",
        atwood.compare_long,
        {**scene, "periods": 10},
        {
            **_SCENE,
            "periods": "whole",
            "period": "optional positive",
            "max_seconds": "optional positive",
            "name": "text",
            "progress": "callback",
        },
    )
    yield Call("check", atwood.check, {"component": atwood_library.Rod}, {"component": "object", "run": "flag"})


def _methods() -> Iterator[Call]:
    state = {"q": [0.1, 0.2], "u": [0.2, 0.3]}
    numbers = {"q": "numbers", "u": "numbers", "t": "optional number"}
    functions = atwood.dynamics(double())
    for name in ("bias", "forward_dynamics"):
        kinds = {**numbers, **({"tau": "some numbers"} if name == "forward_dynamics" else {"out": "array out"})}
        yield Call(f"Dynamics.{name}", getattr(functions, name), state, kinds)
    yield Call(
        "Dynamics.inverse_dynamics", functions.inverse_dynamics, {**state, "a": [0.0, 0.0]}, {**numbers, "a": "numbers"}
    )
    yield Call(
        "Dynamics.mass_matrix", functions.mass_matrix, {"q": [0.1, 0.2]}, {"q": "numbers", "t": "optional number"}
    )
    yield Call(
        "Dynamics.jacobian",
        functions.jacobian,
        {"q": [0.1, 0.2], "path": "bob1.position"},
        {"q": "numbers", "path": "needed text"},
        {"path": ("bob9.position", "rod1.tension")},
        {"path": ("quantity", "rod1")},
    )
    energy = bracketed()
    for name in ("gradient", "rates", "velocities_at", "time_derivative"):
        yield Call(
            f"Hamiltonian.{name}",
            getattr(energy, name),
            {"q": [0.1, 0.2], "p": [0.2, 0.1]},
            {"q": "numbers", "p": "numbers", "t": "optional number"},
        )
    yield Call(
        "LinearModel.frequency_response",
        model().frequency_response,
        {},
        {"angular_frequencies": "array"},
        {"angular_frequencies": (["x"], [np.nan])},
        {"angular_frequencies": ("frequenc",)},
    )
    yield Call(
        "NormalModes.motion",
        modes().motion,
        {"mode": 0},
        {"mode": "index", "amplitude": "positive", "frames": "whole"},
        {"frames": (1,)},
    )
    yield Call("ReducedMotion.at", kepler().at, {}, {"times": "array"}, said_as={"times": ("time",)})
    yield Call("ReducedMotion.effective_potential", kepler().effective_potential, {}, {"values": "array"})
    yield Call("Result.error", run().error, {}, {"path": "needed text"}, {"path": ("x", "")}, {"path": ("quantity",)})
    yield Call("Result.to_dataframe", run().to_dataframe, {}, {"paths": "texts"}, said_as={"paths": ("quantity",)})
    yield Call("Conserved.along", atwood.conserved(pendulum()).along, {}, {"result": "object"})
    yield Call(
        "load_sweep",
        atwood.load_sweep,
        {},
        {"file": "file"},
        said_as={"file": ("director", "suffix", "name", "no such")},
    )
    yield Call(
        "Comparison.save", _compared().save, {}, {"file": "file"}, said_as={"file": ("director", "suffix", "name")}
    )
    said = {"file": ("director", "no such file", "suffix", "name")}
    for function, shown, of in (
        (atwood.plot_bode, "model", model()),
        (atwood.plot_nyquist, "model", model()),
        (atwood.plot_energies, "result", run()),
        (atwood.plot_mode, "modes", modes()),
        (atwood.plot_effective_potential, "motion", kepler()),
    ):
        yield Call(function.__name__, function, {shown: of}, {shown: "object", "file": "picture"}, said_as=said)
    yield Call("plot_mode", atwood.plot_mode, {"modes": modes()}, {"mode": "index"})
    yield Call(
        "Symmetry",
        atwood.Symmetry,
        {"generator": {"rod.angle": 1.0}},
        {"generator": "mapping", "f": "expression", "name": "needed text", "unit": "unit"},
        {"generator": ({}, {3: 1.0}, {"rod.angle": "("})},
        {"generator": ("rod.angle", "3")},
    )


def _compared() -> Any:
    from .calls import compared

    return compared()
