"""The energy of each component along a run: what it has, and where it came from."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from atwood.arguments import FILE, takes
from atwood.arrays import FloatArray
from atwood.display import count_of, fitted, listed
from atwood.errors import MissingQuantityError, suggestion_in_parts
from atwood.lazy_dataclasses import dataclass
from atwood.result.files import SavedResult, write_trajectories
from atwood.table import Shown, Table, table

_BALANCED = 1e-3
"""Of the energy that is exchanged: by less a part may fail to balance, and a constraint may put in, unnamed."""


@dataclass(frozen=True, eq=False)
class PartEnergy:
    """The energy of a component, or of a model with all that is in it, at the output times, J.

    What it has gained since the start is the work done on it through its connectors, and what is `supplied`, less what
    is `dissipated`, and the work of its constraints, in impacts too.

    Attributes
    ----------
    path
        Its path.
    kinetic, potential
        Kinetic and potential energy, its weight's included.
    gained
        What it has more of both together than at the start of the run, whether that is an output or not.
    work
        By the names of its connectors: the energy that came in through each since the start, the integral of
        ``force . velocity + torque . angular velocity``. Of a model, by those of its connectors, or of its parts, that
        others are connected to.
    supplied
        Work of its loads, and energy that came with time: by potentials that follow an input, by mass that changes.
    dissipated
        What its dampers took away.
    constraints
        Work of its constraints; zero for ideal ones that rest. Drives put in energy so, and constraints on velocities
        that ask for a speed where nothing else moves.
    impacts
        Work of its constraints in impacts; negative where energy is lost.
    is_unique
        Whether the work at its connectors is determined; not where constraints are redundant, or rigid parts share a
        load, and energy passes between them. The reactions are then those of least size.
    """

    path: str
    kinetic: FloatArray
    potential: FloatArray
    gained: FloatArray
    work: Mapping[str, FloatArray]
    supplied: FloatArray
    dissipated: FloatArray
    constraints: FloatArray
    impacts: FloatArray
    is_unique: bool = True

    @property
    def total(self) -> FloatArray:
        """Kinetic plus potential energy."""
        return self.kinetic + self.potential

    @property
    def error(self) -> FloatArray:
        """By how much it fails to balance: what it has gained less all that came in."""
        given = self.supplied - self.dissipated + self.constraints + self.impacts
        return np.asarray(self.gained - given - np.sum(list(self.work.values()), axis=0))

    def table(self) -> dict[str, FloatArray]:
        """Return all of it by name: ``kinetic``, ``work.a`` and so on."""
        names = ("kinetic", "potential", "gained")
        given = ("supplied", "dissipated", "constraints", "impacts", "error")
        work = {f"work.{name}": values for name, values in self.work.items()}
        return {**{one: getattr(self, one) for one in names}, **work, **{one: getattr(self, one) for one in given}}

    def __repr__(self) -> str:
        ends = {name: float(values[-1]) for name, values in self.table().items()}
        shown = (f"{name} {value:+.3g}" for name, value in ends.items() if name not in _STATES and value)
        return fitted(f"<{type(self).__name__} of {self.path}, J from start to end: {', '.join(shown) or 'nothing'}>")


_STATES = ("kinetic", "potential", "error")


class PartEnergies(Shown, Mapping[str, PartEnergy]):
    """The energies of all components of a run by path, and of all models within it.

    Parameters
    ----------
    time
        Output times, s.
    parts
        The components, in their order.
    models
        The models.
    exchanged
        What errors are compared with, J.
    uncertainty
        Estimated error of all integrals of power, J.
    """

    def __init__(
        self,
        time: FloatArray,
        parts: Mapping[str, PartEnergy],
        models: Mapping[str, PartEnergy],
        exchanged: float,
        uncertainty: float,
    ) -> None:
        self.time, self._parts, self._models = time, dict(parts), dict(models)
        self.exchanged, self.uncertainty = exchanged, uncertainty

    def __getitem__(self, path: str) -> PartEnergy:
        """Return the energy of a component or a model."""
        found = self._parts.get(path) or self._models.get(path)
        if found is None:
            raise MissingQuantityError(
                "there is no such component",
                where=str(path),
                advice=suggestion_in_parts(str(path), [*self._parts, *self._models]),
            )
        return found

    def __contains__(self, path: object) -> bool:
        return path in self._parts or path in self._models

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)

    @property
    def models(self) -> tuple[str, ...]:
        """Paths of the models, whose energies are sums; iteration gives the components alone."""
        return tuple(self._models)

    @property
    def worst(self) -> str:
        """Path of the component that fails most to balance."""
        return max(self._parts, key=lambda path: self._size(path, "error"))

    @property
    def max_error(self) -> float:
        """By how much that component fails to balance at most, relative to `exchanged`."""
        return self._size(self.worst, "error")

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Components at whose connectors the work is not unique."""
        return tuple(path for path, one in self._parts.items() if not one.is_unique)

    def _size(self, path: str, name: str) -> float:
        largest = float(np.max(np.abs(getattr(self._parts[path], name)), initial=0.0))
        return largest / self.exchanged if self.exchanged > 0.0 else largest

    def describe(self) -> str:
        """Return where energy comes in and goes, and which component does not balance, in words."""
        lines = []
        for name, words in (
            ("supplied", "its loads and inputs"),
            ("constraints", "its constraints"),
            ("dissipated", "its dampers"),
            ("impacts", "impacts"),
        ):
            for path, one in self._parts.items():
                if self._size(path, name) > _BALANCED:
                    done = float(getattr(one, name)[-1])
                    taken = name == "dissipated" or done < 0.0
                    lines.append(f"{path}: {abs(done):.3g} J {'go' if taken else 'come'} by {words}")
        if self.max_error > _BALANCED:
            lines.append(
                f"{self.worst} does not balance, by {self.max_error:.1e} of the {self.exchanged:.3g} J exchanged"
            )
        else:
            lines.append(
                f"every component balances to {self.max_error:.1e} of the {self.exchanged:.3g} J exchanged"
                + (f" ({self.worst} least)" if self.max_error > 0.0 else "")
            )
        if self.undetermined:
            whose = listed(self.undetermined)
            lines.append(f"work through the connectors of {whose} is not unique: their constraints are redundant")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return energies at the end, and what came in since the start, as plain data by component."""
        found: dict[str, Any] = {}
        for path, one in {**self._parts, **self._models}.items():
            ends = {name: float(values[-1]) for name, values in one.table().items() if name != "error"}
            error = float(np.max(np.abs(one.error), initial=0.0))
            found[path] = {**ends, "max_error": error, "is_unique": one.is_unique}
        return found

    def trajectories(self) -> SavedResult:
        """Return all energies by path, such as ``rod.energy.work.a``, to be plotted, saved or made a table of."""
        found, meanings = dict[str, FloatArray](), dict[str, str]()
        for path, one in {**self._parts, **self._models}.items():
            for name, values in one.table().items():
                found[f"{path}.energy.{name}"] = values
                meanings[f"{path}.energy.{name}"] = f"{_MEANINGS[name.partition('.')[0]]}."
        return SavedResult(self.time, found, dict.fromkeys(found, "J"), meanings)

    @takes(file=FILE)
    def save(self, file: str | os.PathLike[str]) -> Path:
        """Save all energies as NetCDF-3 (``.nc``), NumPy (``.npz``), MATLAB (``.mat``) or ``.csv``."""
        return write_trajectories(self.trajectories(), file)

    def plot(self, file: str | os.PathLike[str] | None = None) -> Any:
        """Draw the energies of the components above each other, and return the figure; see `atwood.plot_energies`."""
        return import_module("atwood.plotting.plots.energies").plot_energies(self, file)

    def tables(self) -> tuple[Table, ...]:
        """Return what each component gained from start to end, and where it came from."""
        names = ("gained", "supplied", "dissipated", "constraints", "impacts")
        rows = (
            (path, *(f"{getattr(one, name)[-1]:.3g}" for name in names), f"{self._size(path, 'error'):.1e}")
            for path, one in self._parts.items()
        )
        heads = ("component", "gained, J>", *(f"{name}>" for name in names[1:]), "error / exchanged>")
        return (table(heads, rows, "Energy by component, from start to end", [self.describe()]),)

    def __repr__(self) -> str:
        of = count_of(len(self), "component")
        return fitted(f"<{type(self).__name__} of {of}: {self.describe()}>")

    def _ipython_key_completions_(self) -> list[str]:
        return [*self._parts, *self._models]


_MEANINGS = {
    "kinetic": "Kinetic energy",
    "potential": "Potential energy",
    "gained": "Energy gained since the start",
    "work": "Energy that came in through a connector",
    "supplied": "Work of loads and inputs",
    "dissipated": "Energy that dampers took away",
    "constraints": "Work of constraints",
    "impacts": "Work of constraints in impacts",
    "error": "Failure to balance",
}
