"""Small displacements of a configuration in minimal coordinates, and their image in maximal ones.

Displacements that meet the constraints are ``ds = S z``, and speeds ``du = U v + U_s z``: the columns of S and U belong
to independent coordinates and speeds, from which the others follow (coordinate partitioning; Wehage and Haug, J. Mech.
Design 104, 1982). The dae form and reactions take the image of these in maximal coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, jvp
from atwood.forms.quantities import to_maximal
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import least_squares
from atwood.simulation.dynamics.redundancy import choose_dependent_coordinates
from atwood.theory.linear.variations import Flow, LinearScene, Variation


@dataclass(frozen=True, eq=False)
class Minimal:
    """What follows from minimal states: columns are z, v and inputs, in this order.

    Attributes
    ----------
    displacements, speeds
        Numbers of the independent ones.
    shift
        All displacements from them, shape (displacements, columns).
    speed
        All speeds, shape (speeds, columns).
    """

    displacements: tuple[int, ...]
    speeds: tuple[int, ...]
    shift: FloatArray
    speed: FloatArray

    @property
    def states(self) -> int:
        """Number of minimal states."""
        return len(self.displacements) + len(self.speeds)

    @property
    def state(self) -> FloatArray:
        """Displacements and speeds from them."""
        return np.concatenate([self.shift, self.speed])

    def reduced(self, field: FloatArray) -> FloatArray:
        """Return the rows of a field of displacements and speeds that belong to the minimal states."""
        rows = [*self.displacements, *(len(self.shift) + k for k in self.speeds)]
        return np.asarray(field[rows])


def find_minimal(scene: LinearScene, flow: Flow, kept: Sequence[int], like: Minimal | None = None) -> Minimal:
    """Choose minimal states."""
    now, inputs = flow.variation, len(scene.inputs)
    count, speeds = len(scene.tangents), len(scene.sizes)
    constraints = scene.equations.constraints
    holding = [i for i in kept if constraints[i].holonomic]
    by_s, _, _, by_w = (one[holding] for one in now.along("value"))
    rate_s, rate_u, _, rate_w = (one[list(kept)] for one in now.along("rate"))
    if like is not None:
        free, free_speeds = like.displacements, like.speeds
    else:
        chosen = choose_dependent_coordinates(by_s, scene.displacement_sizes) if holding else ()
        same = _same_speeds(scene, chosen) if len(holding) == len(kept) else None
        follow = same if same is not None else choose_dependent_coordinates(rate_u, scene.sizes) if len(kept) else ()
        free, free_speeds = _others(count, chosen), _others(speeds, follow)
    dependent, dependent_speeds = _others(count, free), _others(speeds, free_speeds)
    total = len(free) + len(free_speeds) + inputs
    shift, speed = np.zeros((count, total)), np.zeros((speeds, total))
    shift[list(free), range(len(free))] = 1.0
    columns = slice(total - inputs, total)
    if dependent:
        known = by_s[:, list(free)] @ shift[list(free)]
        known[:, columns] += by_w
        shift[list(dependent)] = -np.linalg.solve(by_s[:, list(dependent)], known)
    speed[list(free_speeds), range(len(free), len(free) + len(free_speeds))] = 1.0
    if dependent_speeds:
        known = rate_u[:, list(free_speeds)] @ speed[list(free_speeds)] + rate_s @ shift
        known[:, columns] += rate_w
        speed[list(dependent_speeds)] = -np.linalg.solve(rate_u[:, list(dependent_speeds)], known)
    return Minimal(free, free_speeds, shift, speed)


def _others(count: int, chosen: Sequence[int]) -> tuple[int, ...]:
    return tuple(k for k in range(count) if k not in set(chosen))


def speed_of(scene: LinearScene) -> dict[int, int]:
    """Return the number of the speed that is the rate of each displacement, of those that have one."""
    e = scene.equations
    number = {speed: i for i, speed in enumerate(e.speeds)}
    return {k: number[e.rates[i]] for i, k in scene.tangents.plain if e.rates[i] in number}


def _same_speeds(scene: LinearScene, dependent: Sequence[int]) -> tuple[int, ...] | None:
    """Return the speeds of dependent displacements, so that states come in pairs; None if these have none."""
    of = speed_of(scene)
    for orientation, numbers in scene.tangents.orientation_coordinates:
        of |= dict(zip(numbers, orientation.speeds, strict=False))
    return tuple(sorted(of[k] for k in dependent)) if all(k in of for k in dependent) else None


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
    return {"q": q, "u": u, "a": jvp(u, scene.equations.course)}


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
    """Return the image of minimal states in maximal coordinates, the constraints kept there, and accelerations."""
    now = flow.variation
    places = _places(scene, now)
    big = LinearScene(scene.assembly, "dae", scene.inputs)
    q, u = places.values["q"], places.values["u"]
    kept = big.rank(float(now.t), q).kept
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
    """Return the variation of generalized accelerations that the equations of the dae form give."""
    columns = image.state.shape[1]
    own, by_own = accelerations[:, :columns], accelerations[:, columns:]
    right = (image.acceleration - own) / image.sizes[:, None]
    return least_squares(by_own / image.sizes[:, None], right)
