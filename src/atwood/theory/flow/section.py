"""`poincare_section`: where motions pass through a surface."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import BY_PATH, TEXT, command, each, optional, takes
from atwood.arrays import FloatArray
from atwood.display import count_of, data_of, fitted
from atwood.errors import SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assemble, simulate
from atwood.simulation.problem.arguments import RTOL, SOLVER, T_END


@dataclass(frozen=True, eq=False)
class PoincareSection:
    """The points at which motions pass through a surface.

    Attributes
    ----------
    surface
        What was given for it.
    values
        Quantities by path, shape (points,), in SI units.
    units
        Their units.
    time
        When, s.
    start
        Number of the start of each point's motion.
    scene
        Name of the scene.
    """

    surface: str
    values: Mapping[str, FloatArray]
    units: Mapping[str, str]
    time: FloatArray
    start: NDArray[np.intp]
    scene: str

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, path: str) -> FloatArray:
        return self.values[path]

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        return data_of(self, "scene", "surface", "time", "start", "values", "units")

    def __repr__(self) -> str:
        points = f"{count_of(len(self), 'point')} of {count_of(int(np.max(self.start, initial=-1)) + 1, 'motion')}"
        return fitted(f"<PoincareSection of {self.scene}, {self.surface}: {points}, {', '.join(self.values)}>")


_START = replace(
    BY_PATH, word="PATH=VALUE,...", typed=lambda text: dict(one.strip().split("=", 1) for one in text.split(","))
)


@command("section")
@takes(
    scene=SCENE,
    surface=TEXT,
    quantities=each(TEXT, "paths of quantities, at least one, as a list of texts", least=1),
    starts=optional(each(_START, "start values by path, one mapping for each motion")),
    t_end=T_END,
    rtol=RTOL,
    solver=SOLVER,
)
def poincare_section(
    scene: Model | Assembly,
    surface: str,
    quantities: Sequence[str],
    *,
    starts: Iterable[Mapping[str, Any]] | None = None,
    t_end: float | str | None = None,
    rtol: float = 1e-10,
    solver: str = "auto",
) -> PoincareSection:
    """Return where motions pass through a surface in phase space.

    Passages are found as events are, to rounding in time, and the quantities are those of the state there.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    surface
        Such as ``"rod1.angle rises above 0"``; see `until` of `atwood.simulate`.
    quantities
        What to look at there, by path; angles count their turns.
    starts
        Start values of several motions, as changes of the scene's own; that alone if not given.
    t_end, rtol, solver
        See `atwood.simulate`.

    Returns
    -------
    PoincareSection
        The points.

    Raises
    ------
    UsageError
        If there is no such quantity.
    SolveError
        If a motion does not get to its end.
    """
    assembly = scene if isinstance(scene, Assembly) else assemble(scene)
    own = [assembly] if starts is None else [assembly.with_values(start=dict(one)) for one in starts]
    times, numbers, units = list[FloatArray](), list[int](), dict[str, str]()
    found: dict[str, list[FloatArray]] = {path: [] for path in quantities}
    for k, one in enumerate(own):
        result = simulate(one, t_end=t_end, rtol=rtol, outputs=2, solver=solver, record=surface)
        if result.status not in ("finished", "stopped"):
            raise SolveError(
                f"motion {k} does not get to its end: {result.message}", where=assembly.flat.name, advice=""
            )
        passed = [event.time for event in result.events if not event.part and event.law == " ".join(surface.split())]
        at = np.searchsorted(result.time, passed)
        times.append(result.time[at])
        numbers += [k] * len(at)
        for path in quantities:
            found[path].append(result[path][at])
            units[path] = result.unit(path)
    if not own:
        raise UsageError("there is no start", where=assembly.flat.name, advice="Give at least one in `starts`.")
    values = {path: np.concatenate(parts) for path, parts in found.items()}
    shown = " ".join(surface.split())
    start = np.array(numbers, dtype=np.intp)
    return PoincareSection(shown, values, units, np.concatenate(times), start, assembly.flat.name)
