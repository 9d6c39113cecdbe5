"""The public functions, each with sound arguments, and of what kind each argument is."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import atwood
import atwood_library
from atwood import solids

from . import calls_of_theory
from .call import Call


@functools.cache
def scene_class() -> Any:
    from atwood_library.scenes import SCENES

    return SCENES["double-pendulum"]


@functools.cache
def result() -> Any:
    return atwood.simulate(scene_class()(), t_end=0.3, outputs=7)


@functools.cache
def saved() -> Any:
    import tempfile

    with tempfile.TemporaryDirectory() as directory:
        return atwood.load_result(result().save(Path(directory, "run.npz")))


@functools.cache
def swept() -> Any:
    return atwood.sweep(scene_class()(), {"mass1": [1.0, 2.0]}, t_end=0.1)


@functools.cache
def compared() -> Any:
    return atwood.compare(scene_class()(), t_end=0.1, rtols=[1e-4], forms=["reduced"], outputs=3)


def calls() -> Iterator[Call]:
    """Yield all calls."""
    yield from _runs()
    yield from _reading()
    yield from _pictures()
    yield from _scenes()
    yield from _declaring()
    yield from _mathematics()
    yield from _bodies()
    yield from _parts()
    yield from calls_of_theory.calls()


_RUN = {
    "scene": "object",
    "form": "optional word",
    "level": "optional word",
    "t_end": "time",
    "rtol": "share",
    "solver": "word",
    "max_steps": "optional whole",
    "max_seconds": "optional positive",
    "progress": "callback",
}


def _runs() -> Iterator[Call]:
    scene = scene_class()()
    yield Call(
        "assemble",
        atwood.assemble,
        {"scene": scene},
        {"scene": "object", "form": "word", "level": "word", "orientation": "word", "name": "text"},
    )
    yield Call(
        "simulate",
        atwood.simulate,
        {"scene": scene, "t_end": 0.01},
        {
            **_RUN,
            "orientation": "optional word",
            "outputs": "times",
            "max_step": "optional positive",
            "first_step": "optional positive",
            "impacts": "word",
            "samples": "whole",
            "structure": "flag",
            "atol": "optional positive",
            "accuracy": "optional error",
            "nominal": "mapping",
            "order": "optional order",
            "step": "optional positive",
            "monitor": "optional object",
            "until": "stop condition",
            "record": "stop condition",
        },
        also={"nominal": ({"rod1.angle": "x"}, {"rod1.angle": -1.0}, {"rod1.angle": "1 m"}, {3: 1.0}, {"rod9": 1.0})},
        said_as={"until": ("crosses",), "record": ("crosses",), "nominal": ("rod1.angle", "3", "rod9")},
    )
    yield Call(
        "sweep",
        atwood.sweep,
        {"scene": scene, "vary": {"mass1": [1.0, 2.0]}, "t_end": 0.01},
        {
            **_RUN,
            "vary": "mapping",
            "start": "mapping",
            "combine": "word",
            "quantities": "texts",
            "outputs": "optional times",
            "threads": "optional whole",
            "executor": "optional object",
            "store": "optional folder",
            "design": "optional word",
            "runs": "optional whole",
            "seed": "optional whole",
            "accuracy": "optional error",
            "until": "stop condition",
            "name": "text",
        },
        also={
            "vary": ({"mass1": "x"}, {"mass1": [None]}, {"mass1": 3}, {3: [1.0]}, {"mass1": []}, {"mass1": {1.0}}),
            "start": ({"rod1.angle": [None]}, {"rod1.angle": "x"}, {None: [1.0]}, {"rod1.angle": [1j]}),
        },
        said_as={
            "vary": ("mass1", "3"),
            "start": ("rod1.angle", "None"),
            "quantities": ("no.such",),
            "until": ("crosses",),
        },
    )
    yield Call(
        "compare",
        atwood.compare,
        {"scene": scene, "t_end": 0.01, "rtols": [1e-4], "forms": ["reduced"], "outputs": 3},
        {
            "scene": "object",
            "t_end": "time",
            "rtols": "object",
            "forms": "texts",
            "levels": "texts",
            "outputs": "whole",
            "max_seconds": "optional positive",
            "total_seconds": "optional positive",
            "name": "text",
            "progress": "callback",
        },
        also={"rtols": ([], [2.0], ["x"], [None]), "forms": ([], ["redcued"]), "levels": (["ggll"],)},
    )
    yield Call("report", atwood.report, {"scene": scene}, {"scene": "object", "name": "text", "orientation": "word"})
    yield Call(
        "Assembly.with_values",
        atwood.assemble(scene).with_values,
        {},
        {"values": "mapping", "start": "mapping", "guess": "mapping"},
        also={"values": ({"mass1": "x"}, {3: 1.0}, {"mass1": None}), "start": ({"rod1.angle": "x"}, {None: 1.0})},
        said_as={"values": ("mass1", "3"), "start": ("rod1.angle", "None")},
    )


def _reading() -> Iterator[Call]:
    for name, one in (("Result", result()), ("SavedResult", saved())):
        said = {"path": ("quantity",), "paths": ("quantity",), "index": ("output",)}
        for method in ("array", "unit", "describe", "samples", "__getitem__"):
            if hasattr(one, method):
                found = getattr(one, method)
                yield Call(f"{name}.{method}", found, {}, {"path": "needed text"}, {"path": ("x", "")}, said)
        yield Call(f"{name}.table", one.table, {}, {"paths": "texts"}, said_as=said)
        yield Call(f"{name}.at", one.at, {}, {"index": "index"}, said_as=said)
    yield Call("save_result", atwood.save_result, {"result": result(), "file": "@run.npz"}, _SAVE, _SUFFIX, _SAID)
    yield Call("Result.save", result().save, {"file": "@run.csv"}, _SAVED, _SUFFIX, _SAID)
    yield Call("load_result", atwood.load_result, {}, {"file": "file"}, _SUFFIX, _SAID)
    yield Call("Result", atwood.Result, {}, {"run": "object"})
    for method in ("__getitem__", "end", "grid", "axis"):
        yield Call(
            f"Sweep.{method}",
            getattr(swept(), method),
            {},
            {"path": "needed text"},
            {"path": ("x",)},
            {"path": ("varied", "quantity")},
        )
    yield Call("Sweep.save", swept().save, {}, {"file": "file"}, _SUFFIX, _SAID)


_SAVE = {"result": "object", "file": "file", "paths": "texts"}
_SAVED = {"file": "file", "paths": "texts"}
_SUFFIX = {"file": ("name-without-suffix", "x.xyz")}
_SAID = {
    "file": ("director", "no such file", "suffix", "name"),
    "path": ("director", "no such file"),
    "paths": ("quantity",),
    "trace": ("connector",),
}


def _pictures() -> Iterator[Call]:
    shown = {"result": result()}
    also = {"times": ([], ["x"], [None], [1e9], [np.nan], "x"), "trace": (["x"],), "view": ("3", (1.0,), (0.0, 100.0))}
    said = {**_SAID, "times": ("t =",), "seconds": ("frames",)}
    drawn = {"paths": "texts", "file": "picture", "x": "optional word"}
    yield Call("plot", atwood.plot, shown, {"result": "object", **drawn}, said_as=said)
    yield Call("Result.plot", result().plot, {}, drawn, said_as=said, has_names=False)
    yield Call(
        "plot_mechanism",
        atwood.plot_mechanism,
        shown,
        {"result": "object", "file": "picture", "times": "mapping", "view": "optional object", "trace": "texts"},
        also,
        said,
    )
    yield Call(
        "animate",
        atwood.animate,
        {**shown, "file": "@motion.gif", "seconds": 0.1},
        {
            "result": "object",
            "file": "file",
            "seconds": "optional positive",
            "frames_per_second": "positive",
            "trace": "texts",
        },
        {**also, "seconds": (1e9,), "frames_per_second": (1e9,)},
        said,
    )
    comparison = {"comparison": compared()}
    yield Call(
        "plot_comparison", atwood.plot_comparison, comparison, {"comparison": "object", "file": "picture"}, said_as=said
    )
    sweep = {"sweep": swept()}
    yield Call(
        "plot_sweep", atwood.plot_sweep, sweep, {"sweep": "object", "paths": "texts", "file": "picture"}, said_as=said
    )


def _scenes() -> Iterator[Call]:
    scene, rod = scene_class()(), atwood_library.Rod(length=1.0)
    yield Call("to_data", atwood.to_data, {}, {"scene": "object"})
    yield Call(
        "from_data",
        atwood.from_data,
        {},
        {"data": "mapping"},
        {"data": ({}, {"format": 3}, {1: 2})},
        {"data": ("data",)},
    )
    yield Call(
        "save_scene",
        atwood.save_scene,
        {"scene": scene, "path": "@scene.json"},
        {"scene": "object", "path": "file"},
        said_as=_SAID,
    )
    yield Call("load_scene", atwood.load_scene, {}, {"path": "file"}, said_as=_SAID)
    yield Call(
        "Scene.add",
        atwood.Scene().add,
        {"name": "rod", "part": rod},
        {"name": "needed text", "part": "object"},
        {"name": ("", "a b", "add", "1a"), "part": ([3], [rod, rod])},
        {"part": ("rod",)},
    )
    yield Call(
        "Scene.connect",
        scene.connect,
        {"a": scene["rod1"].a, "b": scene["rod2"].b},
        {"a": "object", "b": "object"},
        said_as={"a": ("connector",), "b": ("connector",)},
    )
    yield Call(
        "Scene.replace",
        scene.replace,
        {"name": "rod1", "part": rod},
        {"name": "needed text", "part": "object"},
        {"name": ("rod3",)},
        {"part": ("rod1",), "name": ("part",)},
    )
    yield Call(
        "Scene.set",
        scene.set,
        {"path": "mass1", "value": 1.0},
        {"path": "needed text", "value": "positive"},
        {"path": ("mas1", "", "rod9.length")},
        {"value": ("mass1",), "path": ("parameter", "part")},
    )
    yield Call(
        "Scene[...]", scene.__getitem__, {}, {"path": "needed text"}, {"path": ("rod9", "")}, {"path": ("part",)}
    )
    yield Call(
        "Scene.start[...]",
        lambda path, value: atwood.Scene().start.__setitem__(path, value),
        {"path": "a", "value": 1.0},
        {"path": "needed text", "value": "number"},
        {"path": ("",), "value": (1e308, "1e308 rad", "1 zz")},
        {"path": ("path",), "value": ("a",)},
        False,
    )
    yield Call(
        "Scene.start",
        lambda value: setattr(atwood.Scene(), "start", value),
        {},
        {"value": "mapping"},
        said_as={"value": ("start",)},
        has_names=False,
    )
    for kind, names in (("input", ("angle",)), ("output", ("tension",))):
        yield Call(
            f"Component.{kind}", getattr(rod, kind), {}, {"name": "needed text"}, {"name": names[:0]}, {"name": (kind,)}
        )
    for name in ("gravity", "t_end", "t_start"):
        yield Call(f"Scene({name})", atwood.Scene, {}, {name: "number"})
    yield Call("Scene", atwood.Scene, {}, {"space": "word", "line_axis": "vector"})


def _declaring() -> Iterator[Call]:
    yield Call(
        "parameter",
        atwood.parameter,
        {"doc": "A length."},
        {
            "unit": "unit",
            "doc": "needed text",
            "minimum": "optional number",
            "size": "optional whole",
            "integer": "flag",
            "choices": "words",
            "structural": "flag",
            "direction": "flag",
            "turning": "flag",
            "text": "flag",
        },
        {"doc": ("",), "choices": ("abc",)},
    )
    yield Call("signal", atwood.signal, {"doc": "A force."}, {"unit": "unit", "doc": "needed text"})
    yield Call(
        "connector",
        atwood.connector,
        {"kind": atwood.Point, "doc": "Where."},
        {"kind": "object", "doc": "needed text", "count": "text", "when": "mapping", "of": "needed text"},
    )
    yield Call("connect", atwood.connect, {"a": 1, "b": 2}, {})
    spaces = {"spaces": "words", "modes": "words"}
    yield Call(
        "constraint",
        atwood.constraint,
        {"reaction": "force", "doc": "The force."},
        {"reaction": "words", "unit": "unit", "doc": "needed text", "sign": "number", **spaces},
        {"spaces": (["plain"],)},
    )
    yield Call(
        "joint",
        atwood.joint,
        {"a": "a", "b": "b"},
        {
            "a": "needed text",
            "b": "needed text",
            "coordinates": "words",
            "solves": "words",
            "rigid": "flag",
            "reaction": "needed text",
            **spaces,
        },
        {"spaces": (["plain"],)},
    )
    yield Call(
        "observable",
        atwood.observable,
        {"unit": "m", "doc": "A length."},
        {"unit": "unit", "doc": "needed text", "periodic": "flag", "rate": "needed text", "spaces": "words"},
        {"spaces": (["plain"],), "doc": ("",)},
    )
    yield Call(
        "event",
        atwood.event,
        {"target": "stop", "message": "It stops."},
        {
            "target": "needed text",
            "message": "needed text",
            "unit": "unit",
            "direction": "direction",
            "impact": "flag",
            **spaces,
        },
        {"spaces": (["plain"],)},
    )
    for name in ("potential", "dissipation", "force", "inertia"):
        yield Call(name, getattr(atwood, name), {}, {"function": "callback"}, has_names=False)
    rod, body = atwood_library.Rod(length=1.0), atwood_library.RigidBody()
    yield Call("Load", atwood.Load, {"at": rod.a}, {"at": "object", "force": "vector", "torque": "vector"})
    yield Call(
        "PointInertia",
        atwood.PointInertia,
        {"points": [rod.a], "masses": [[1.0]]},
        {"points": "object", "masses": "object"},
        {"points": ([3],), "masses": ([1.0], [["x"]], [[1.0, 2.0]])},
    )
    yield Call(
        "BodyInertia",
        atwood.BodyInertia,
        {"frame": body.frame, "mass": 1.0, "center_of_mass": atwood.Vector(), "moment": 1.0},
        {
            "frame": "object",
            "mass": "scalar",
            "center_of_mass": "vector",
            "moment": "scalar",
            "tensor": "optional object",
        },
        {"frame": (rod.a,), "tensor": ([[1.0]],)},
    )
    yield Call(
        "Placement",
        atwood.Placement,
        {"displacement": atwood.Vector()},
        {"displacement": "vector", "axes": "word"},
        {"rotation": ("x",)},
    )
    sizes = {"length_x": "positive", "length_y": "positive", "length_z": "positive"}
    yield Call("Outline.box", atwood.Outline.box, dict.fromkeys(sizes, 1.0), sizes)
    yield Call(
        "Outline.revolved",
        atwood.Outline.revolved,
        {"profile": [(0.0, 0.0), (1.0, 1.0)]},
        {"profile": "object", "axis": "word", "is_ring": "flag"},
        {"profile": ([(1.0,)], [(1.0, "x")])},
    )
    yield Call(
        "Outline.mesh",
        atwood.Outline.mesh,
        {"vertices": np.eye(3), "triangles": [[0, 1, 2]]},
        {"vertices": "object", "triangles": "object"},
        {"triangles": ([[0, 1, 9]],)},
    )


def _mathematics() -> Iterator[Call]:
    for name in (
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sqrt",
        "exp",
        "log",
        "sinh",
        "cosh",
        "tanh",
        "absolute",
        "sign",
    ):
        bad = {
            "asin": (2.0,),
            "acos": (-1.5,),
            "sqrt": (-1.0,),
            "log": (0.0, -1.0),
            "exp": (1e4,),
            "sinh": (1e4,),
            "cosh": (1e4,),
        }
        yield Call(name, getattr(atwood, name), {}, {"x": "scalar"}, {"x": bad.get(name, ())}, {"x": (name,)}, False)
    for name in ("minimum", "maximum"):
        yield Call(
            name,
            getattr(atwood, name),
            {"a": 1.0, "b": 2.0},
            {"a": "scalar", "b": "scalar"},
            {},
            {"a": (name,), "b": (name,)},
            False,
        )
    yield Call(
        "atan2",
        atwood.atan2,
        {"y": 1.0, "x": 2.0},
        {"y": "scalar", "x": "scalar"},
        {},
        {"x": ("atan2",), "y": ("atan2",)},
        False,
    )
    yield Call("hypot", lambda x: atwood.hypot(x, 1.0), {}, {"x": "scalar"}, {}, {"x": ("hypot", "sqrt")}, False)
    yield Call(
        "select", atwood.select, {"condition": True, "a": 1.0, "b": 2.0}, {"condition": "condition"}, {}, {}, False
    )
    yield Call(
        "solve_linear",
        atwood.solve_linear,
        {"matrix": [[1.0]], "right": [1.0]},
        {"matrix": "object", "right": "object"},
        {"matrix": ([[0.0]], [["x"]], [1.0], [[1.0, 2.0]]), "right": (["x"], [1.0, 2.0])},
        {"matrix": ("linear system",), "right": ("linear system",)},
    )
    import sympy

    x = sympy.Symbol("x")
    yield Call(
        "formula",
        atwood.formula,
        {"expression": x, "arguments": [x]},
        {"expression": "object", "arguments": "object"},
        {"arguments": ([], ["y"], [3])},
        {"arguments": ("formula",), "expression": ("formula",)},
    )
    yield Call(
        "ExternalFunction",
        atwood.ExternalFunction,
        {"name": "f", "function": abs},
        {"name": "needed text", "function": "callback", "derivatives": "callback"},
    )
    yield Call("external", lambda function: atwood.external(function, 1.0), {}, {"function": "object"}, has_names=False)
    vector = atwood.Vector(1.0, 2.0, 3.0)
    for name in ("dot", "cross"):
        yield Call(
            name,
            getattr(atwood, name),
            {"a": vector, "b": vector},
            {"a": "vector", "b": "vector"},
            {},
            {"a": ("vector",), "b": ("vector",)},
            False,
        )
    yield Call("norm", atwood.norm, {}, {"a": "vector"}, {}, {"a": ("vector",)}, False)
    yield Call(
        "as_vector", atwood.as_vector, {}, {"value": "vector"}, said_as={"value": ("vector", "Vector")}, has_names=False
    )
    yield Call("Vector", atwood.Vector, {}, {"x": "scalar", "y": "scalar", "z": "scalar"}, has_names=False)
    for name, method in (("+", "__add__"), ("-", "__sub__")):
        yield Call(
            f"Vector {name}", getattr(vector, method), {}, {"other": "vector"}, {}, {"other": ("vector",)}, False
        )
    yield Call(
        "turn",
        atwood.turn,
        {"axis": (0.0, 0.0, 1.0), "angle": 1.0},
        {"axis": "vector", "angle": "scalar"},
        has_names=False,
    )
    yield Call("Rotation", atwood.Rotation, {}, {"turns": "mapping"}, {"turns": ([3],)}, has_names=False)
    yield Call("normals", atwood.normals, {}, {"axis": "vector"}, {"axis": ((0.0, 0.0, 0.0),)}, has_names=False)


def _bodies() -> Iterator[Call]:
    lengths = {
        "box": ("length_x", "length_y", "length_z"),
        "cylinder": ("radius", "length"),
        "tube": ("outer_radius", "inner_radius", "length"),
        "sphere": ("radius",),
        "disc": ("radius",),
        "rod": ("length",),
        "cone": ("radius", "length"),
        "ellipsoid": ("radius_x", "radius_y", "radius_z"),
    }
    for name, sizes in lengths.items():
        function = getattr(solids, name)
        good = {**{size: 1.0 - 0.5 * (size == "inner_radius") for size in sizes}, "mass": 1.0}
        words = {
            size: tuple({size.replace("_", " "), size.replace("_", " along "), *size.split("_")}) for size in sizes
        }
        import inspect

        if not set(sizes) <= set(inspect.signature(function).parameters):
            continue
        also = {"axis": ("w", 3, None, [])} if "axis" in inspect.signature(function).parameters else {}
        kinds = {
            **{size: "size" if "inner" in size else "positive" for size in sizes},
            "mass": "optional positive",
            **({"axis": "word"} if also else {}),
        }
        yield Call(f"solids.{name}", function, good, kinds, also, words)
    box = solids.box(1.0, 1.0, 1.0, mass=1.0)
    yield Call("solids.combine", lambda part: solids.combine(box, part), {}, {"part": "object"}, has_names=False)
    yield Call("solids.subtract", solids.subtract, {}, {"whole": "object"}, has_names=False)
    yield Call(
        "solids.point_mass", solids.point_mass, {"mass": 1.0}, {"mass": "number", "position": "vector"}, has_names=False
    )
    yield Call(
        "MassProperties",
        solids.MassProperties,
        {"mass": 1.0, "centre": (0, 0, 0), "inertia": np.eye(3)},
        {"mass": "number", "centre": "vector", "inertia": "object"},
        has_names=False,
    )
    yield Call(
        "MassProperties.placed",
        box.placed,
        {},
        {"rotation": "optional object", "translation": "vector"},
        has_names=False,
    )
    yield Call(
        "MassProperties.is_close",
        box.is_close,
        {"other": box},
        {"other": "object", "relative": "positive"},
        has_names=False,
    )
    yield Call("MassProperties.inertia_about", box.inertia_about, {}, {"point": "vector"}, has_names=False)
    yield Call("solids.read_stl", solids.read_stl, {}, {"path": "file"}, said_as=_SAID)
    yield Call("solids.stl_solid", solids.stl_solid, {"mass": 1.0}, {"path": "file"}, said_as=_SAID)
    yield Call(
        "solids.closed_mesh",
        solids.closed_mesh,
        {"corners": np.eye(3)},
        {"corners": "object"},
        {"corners": ([[1.0]],)},
        {"corners": ("mesh", "triangle")},
        False,
    )
    yield Call("solids.mesh_solid", solids.mesh_solid, {"mass": 1.0}, {"mesh": "object"}, has_names=False)


def _parts() -> Iterator[Call]:
    """Every parameter of every part of the library."""
    for name in atwood_library.__all__:
        part = getattr(atwood_library, name)
        if not (isinstance(part, type) and issubclass(part, atwood.Component)):
            continue
        specs = part.parameter_specs()
        needed = {
            one: (spec.choices or ("x.stl",) if spec.text else (1.0,))[0]
            for one, spec in specs.items()
            if repr(spec.default) == "<required>"
        }
        for parameter, spec in specs.items():
            good = {one: value for one, value in needed.items() if one != parameter}
            if spec.choices:
                kind = "word"
            elif spec.text:
                kind = "needed text"
            elif spec.array:
                kind = "array"
            elif spec.function_of:
                kind = "formula"
            elif spec.size is not None or spec.direction:
                kind = "axis" if spec.direction else "vector"
            else:
                kind = "number" if spec.default is not None else "optional number"
            yield Call(name, part, good, {parameter: kind})
