"""Variations in maximal coordinates of a motion in generalized ones: for the dae form, and for reactions."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, jvp
from atwood.forms.places import to_maximal
from atwood.late import dataclass
from atwood.numerics.solutions import least_squares
from atwood.theory.linear.minimal import Minimal
from atwood.theory.linear.variations import Flow, LinearScene, Variation

__all__ = ["Image", "image_of", "pulled_back"]


@dataclass(frozen=True, eq=False)
class Image:
    """What maximal coordinates do when minimal states and inputs vary.

    Attributes
    ----------
    flow
        The flow of the dae form at the same state.
    state
        Displacements and speeds, shape (displacements and speeds, columns of `Minimal`).
    inputs
        Number of inputs, whose columns are the last ones.
    sizes
        Size of a displacement along each maximal speed.
    """

    flow: Flow
    state: FloatArray
    inputs: int
    sizes: FloatArray

    @property
    def acceleration(self) -> FloatArray:
        """Variation of the accelerations."""
        return self._of(self.flow.acceleration)

    @property
    def multiplier(self) -> FloatArray:
        """Variation of the multipliers."""
        return self._of(self.flow.multiplier)

    def _of(self, rows: FloatArray) -> FloatArray:
        size = len(self.state)
        found: FloatArray = rows[:, :size] @ self.state
        if self.inputs:
            found[:, -self.inputs :] += rows[:, size + 1 :]
        return found


@dataclass(frozen=True, eq=False)
class _Places:
    """Maximal coordinates, speeds and accelerations as functions of a state in generalized ones, with derivatives."""

    values: dict[str, FloatArray]
    by: dict[tuple[str, str], FloatArray]


def _expressions(scene: LinearScene) -> dict[str, list[Expression]]:
    program = to_maximal(scene.assembly, "regular")
    q, u = (list(group.expressions) for group in program.outputs)
    e = scene.equations
    along: dict[Expression, Expression | float] = {e.time: 1.0}
    along |= dict(zip(e.coordinates, e.rates, strict=True))
    along |= dict(zip(e.speeds, e.accelerations, strict=True))
    return {"q": q, "u": u, "a": jvp(u, along)}


def _places(scene: LinearScene, now: Variation) -> _Places:
    found = _expressions(scene)
    parts = [scene.differentiated(name, expressions) for name, expressions in found.items()]
    program = scene.program("to maximal coordinates, varied", found, parts)
    kernel = scene.assembly.kernel(program)
    values = scene.evaluate(kernel, program, (np.array([now.t]), now.q, now.u, now.a, now.multipliers))
    by: dict[tuple[str, str], FloatArray] = {}
    for part in parts:
        by |= scene.matrices(part, values)
    return _Places(values, by)


def image_of(scene: LinearScene, flow: Flow, minimal: Minimal) -> tuple[Image, tuple[int, ...], FloatArray]:
    """Return the image of minimal states in maximal coordinates, the constraints kept there, and accelerations.

    Parameters
    ----------
    scene, flow, minimal
        The scene in generalized coordinates, its flow at the state, and the minimal states.

    Returns
    -------
    image
        What maximal coordinates do.
    kept
        Independent constraints of the dae form.
    accelerations
        Variation of the maximal accelerations that minimal states give by themselves, and per generalized
        acceleration: shape (maximal speeds, columns), (maximal speeds, speeds) side by side.
    """
    now = flow.variation
    places = _places(scene, now)
    big = LinearScene(scene.assembly, "dae", scene.inputs)
    q, u = places.values["q"], places.values["u"]
    kept = big.rank(now.t, q).kept
    big_flow = big.flow(now.t, q, u, kept)
    inverse = big.tangents.inverse(q)
    inputs = len(scene.inputs)
    s, v = minimal.shift, minimal.speed

    def along(name: str) -> FloatArray:
        found: FloatArray = places.by[name, "q"] @ (now.basis @ s) + places.by[name, "u"] @ v
        if inputs:
            found[:, -inputs:] += places.by[name, "w"]
        return found

    state = np.concatenate([inverse @ along("q"), along("u")])
    return Image(big_flow, state, inputs, big.sizes), kept, np.hstack([along("a"), places.by["a", "a"]])


def pulled_back(image: Image, accelerations: FloatArray) -> FloatArray:
    """Return the variation of generalized accelerations that the equations of the dae form give.

    Parameters
    ----------
    image, accelerations
        What `image_of` gave.

    Returns
    -------
    numpy.ndarray
        Shape (speeds, columns of `Minimal`).
    """
    columns = image.state.shape[1]
    own, by_own = accelerations[:, :columns], accelerations[:, columns:]
    right = (image.acceleration - own) / image.sizes[:, None]
    return least_squares(by_own / image.sizes[:, None], right)
