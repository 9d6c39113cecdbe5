"""`moved`: a scene shifted, turned and carried along evenly, with the start that follows from that."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arguments import Kind, Refused, number, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import StartError, UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.model.local.flatten import FlatScene, Part
from atwood.pipeline import SCENE, assemble_flat, assembly_of, simulate
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.arguments import FORM, RTOL, T_END
from atwood.theory.formulas.described import Described

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_VECTORS = ("position", "velocity", "x_axis", "y_axis", "z_axis", "angular_velocity")
"""Quantities of parts in world axes."""

_ALIKE, _SAME = 1e-6, 1e-7
"""Relative to the scene's size: what is no farther apart after a hundredth of its time moves alike; of a start's value:
what is so near is the same."""

_LEANS = 1e-12
"""What a unit vector may lean out of a plane by rounding."""


def _triple(value: Any) -> FloatArray:
    given = [float(one) for one in value.split(",")] if isinstance(value, str) else value
    found = np.array([float(one) for one in given])
    if found.shape != (3,) or not np.all(np.isfinite(found)):
        raise Refused
    return found


def _direction(value: Any) -> FloatArray:
    found = _triple(value)
    if not np.linalg.norm(found) > 0.0:
        raise Refused
    return found


_TRIPLE = Kind("three numbers, x, y and z", _triple, "X,Y,Z", _triple)


@dataclass(frozen=True, eq=False)
class MovedScene(Described):
    """A scene after a transformation of the Galilei group, ``r -> R r + d + v (t - t0)``, beside the scene itself.

    Attributes
    ----------
    assembly
        The moved scene, ready to be run and asked like any other.
    rotation
        R, by rows.
    shift, velocity
        d, m, and v, m/s.
    difference
        How far the motion of the moved scene is from the moved motion, at most, relative to the size of the scene.
    duration
        For how long they were compared, s.
    """

    assembly: Assembly
    rotation: FloatArray
    shift: FloatArray
    velocity: FloatArray
    difference: float
    duration: float

    def __repr__(self) -> str:
        return f"<MovedScene: the same motion to {self.difference:.2g} for {self.duration:g} s>"


@takes(
    scene=SCENE,
    by=_TRIPLE,
    turned=number("an angle, rad"),
    axis=replace(_TRIPLE, read=_direction),
    velocity=_TRIPLE,
    form=optional(FORM),
    t_end=T_END,
    rtol=RTOL,
)
def moved(
    scene: Model | Assembly,
    *,
    by: Sequence[float] = (0.0, 0.0, 0.0),
    turned: float = 0.0,
    axis: Sequence[float] = (0.0, -1.0, 0.0),
    velocity: Sequence[float] = (0.0, 0.0, 0.0),
    form: str | None = None,
    t_end: float | str | None = None,
    rtol: float = 1e-9,
) -> MovedScene:
    """Return a scene shifted, turned and carried along evenly as a whole, and compare its motion with the moved one.

    Its frames in the world, its gravity and its start are moved with it. By Galilei's principle it then moves alike;
    what does not, as a force in the world's axes, is refused by name.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    by
        The shift d, m.
    turned, axis
        The rotation R: its angle, rad, and its axis; counter-clockwise in a plane if not given.
    velocity
        The velocity v of the boost, m/s; for scenes that nothing holds in the world, whose frames stand still.
    form, t_end, rtol
        Of the runs that are compared; see `atwood.simulate`.

    Raises
    ------
    UsageError
        If it would leave the plane or the line that the scene lives in.
    UnsupportedError
        If a part stands still in the world, and there is a velocity; or the scene does not move alike.
    """
    from scipy.spatial.transform import Rotation  # half a second of imports

    assembly = assembly_of(scene, form=form)
    flat, space = assembly.flat, assembly.mechanism.space
    n = np.array(axis, dtype=float)
    turn = Rotation.from_rotvec(turned * n / np.linalg.norm(n))
    r, d, v = turn.as_matrix(), np.array(by, dtype=float), np.array(velocity, dtype=float)
    basis = np.array([[one.x, one.y, one.z] for one in space.basis])
    if max(np.max(np.abs(one - basis.T @ basis @ one)) for one in (r @ basis.T, d, v)) > _LEANS:
        told = "Turn a plane about y; shift along the scene's own axes."
        raise UsageError(f"it would leave the {space.name}", where=flat.name, advice=told)
    held = next((path for path, one in flat.parts.items() if _in_world(one)), None)
    if held is not None and np.any(v):
        told = "Boost what floats freely."
        raise UnsupportedError("it stands still in the world, and so is not carried along", where=held, advice=told)
    if flat.gravity_potential is not None:
        raise UnsupportedError("a field of gravity that varies is not moved", where=f"{flat.name}.gravity_potential")
    parts = {path: _moved_part(one, turn, d) for path, one in flat.parts.items()}
    x, y, z = map(float, r @ flat.gravity_direction)
    there = replace(flat, parts=parts, gravity_direction=(x, y, z), start={}, guess={})
    try:
        made = assemble_flat(_started(assembly, there, r, d, v, -turned * n[1] / np.linalg.norm(n)), form=assembly.form)
        find_start(made)
    except StartError as error:
        told = "A part that is joined to the world says itself how it moves there."
        raise UnsupportedError("its moved start is none of the moved scene", where=error.where, advice=told) from error
    return MovedScene(made, r, d, v, *_compared(assembly, made, (r, d, v), t_end, rtol))


def _in_world(part: Part) -> bool:
    """Return whether a part joins something to the world."""
    return any("world" in (law.options.a, law.options.b) for law in part.component.laws("joint"))


def _moved_part(part: Part, turn: Rotation, d: FloatArray) -> Part:
    """Return a part with its places in the world moved, and what is joined to the world turned."""
    values = dict(part.values)
    for name, spec in part.component.parameter_specs().items() if _in_world(part) else ():
        if spec.place:
            values[name] = tuple(map(float, turn.apply(values[name]) + d))
        elif spec.direction and not spec.turning:
            values[name] = tuple(map(float, turn.apply(values[name])))
        elif spec.turning and "angle" in values:
            vector = (turn * turn.from_rotvec(values["angle"] * np.array(values[name]))).as_rotvec()
            size = float(np.linalg.norm(vector))
            if size > 0.0:
                sign = 1.0 if vector @ values[name] >= 0.0 else -1.0
                values["angle"], values[name] = sign * size, tuple(map(float, sign * vector / size))
            else:
                values["angle"] = 0.0
    return replace(part, values=values)


def _started(
    assembly: Assembly, there: FlatScene, r: FloatArray, d: FloatArray, v: FloatArray, turned: float
) -> FlatScene:
    """Return the moved scene with its start: vectors are moved, and what these leave open is what it was.

    Angles in a plane that are counted from the world's axes are found to be turned where the rest is in place.
    """
    known = assembly.start_observables
    own = {one.name for one in assembly.reduced.names} & known.keys() | assembly.flat.start.keys()
    vectors = _vectors(assembly)
    values = _values(assembly, [*dict.fromkeys([*own, *(path for several in vectors.values() for path in several)])])
    start: dict[str, float] = {}
    for whole, several in vectors.items():
        kind, given, rows = whole.rpartition(".")[2], np.zeros(3), list(assembly.mechanism.space.reported_axes)
        given[rows] = [values[path] for path in several]
        moved = r @ given + (d if kind == "position" else v if kind == "velocity" else 0.0)
        start |= zip(several, map(float, moved[rows]), strict=True)
    said = {path.removesuffix(".x_axis") for path in vectors}  # whose orientation is known
    left = own - start.keys()
    plain = {path: values[path] for path in values if path in left and path.rpartition(".")[0] not in said}
    turned *= assembly.mechanism.space.is_planar
    angles = {path for path in plain if known[path].unit == "rad"}
    bodies = {f"{path}.angle" for path, local in assembly.mechanism.locals_.items() if local.body_inertias}
    for absolute in (angles & bodies, angles, set[str]()):
        guess = plain | {path: plain[path] + turned for path in absolute}
        with suppress(StartError):
            found = _values(assemble_flat(replace(there, start=start, guess=guess)), list(guess))
            break
    else:
        raise StartError("there is no such start", where=assembly.flat.name)
    for path, value in found.items():
        for likely in (plain[path], plain[path] + turned):
            if abs(likely - value) <= _SAME * (1.0 + abs(value)):
                start[path] = likely
    return replace(there, start=start, guess=guess)


def _vectors(assembly: Assembly) -> dict[str, list[str]]:
    """Return the paths of the components of quantities in world axes, by their path without the axis."""
    axes = ["xyz"[k] for k in assembly.mechanism.space.reported_axes]
    known = [path.rpartition(".") for path in assembly.start_observables]
    wholes = dict.fromkeys(path for path, _, axis in known if axis in axes and path.rpartition(".")[2] in _VECTORS)
    return {path: [f"{path}.{axis}" for axis in axes] for path in wholes}


def _values(assembly: Assembly, paths: Sequence[str]) -> dict[str, float]:
    """Return quantities at the start."""
    begun, known = find_start(assembly), assembly.start_observables
    program = coordinate_program(assembly, "at the start", assembly.reduced, [known[path].value for path in paths])
    values = assembly.kernel(program)([begun.time], begun.coordinates, begun.speeds)[0]
    return dict(zip(paths, values, strict=True))


def _compared(
    one: Assembly, other: Assembly, by: tuple[FloatArray, FloatArray, FloatArray], t_end: Any, rtol: float
) -> tuple[float, float]:
    """Return how far two motions are apart after one is moved, relative to the size of the scene, and for how long."""
    (r, d, v), runs = by, [simulate(scene, t_end=t_end, rtol=rtol, outputs=101) for scene in (one, other)]
    count = min(len(run.time) for run in runs)
    t, length, worst = runs[0].time[:count], find_start(one).length, 0.0
    for path, several in _vectors(one).items():
        if path.endswith(".position"):
            rows = list(one.mechanism.space.reported_axes)
            places = np.zeros((2, 3, count))
            for place, run in zip(places, runs, strict=True):
                place[rows] = [run[name][:count] for name in several]
            moved = r @ places[0] + d[:, None] + v[:, None] * (t - t[0])
            apart = np.max(np.abs(places[1] - moved), axis=0) / length
            if not apart[1] <= _ALIKE:
                raise UnsupportedError(
                    f"it does not move alike: {t[1] - t[0]:.3g} s after the start it is off by {apart[1]:.2g}",
                    where=path.removesuffix(".position"),
                    advice="A law in the scene knows of the world's axes, as a force, a field or a rope may.",
                )
            worst = max(worst, float(np.max(apart)))
    return worst, float(t[-1] - t[0])
