"""Quantities over time by path: what a run and what is read from a file have in common."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from atwood.arguments import check, takes, whole
from atwood.arrays import FloatArray
from atwood.display import count_of, fitted, listed
from atwood.errors import MissingGroupError, MissingQuantityError, ResultError, suggestion, suggestion_in_parts
from atwood.model.declare.connectors import PATH, PATHS, Quantity
from atwood.table import Shown, Table, facts, table

if TYPE_CHECKING:
    import os

    from atwood.result.formats.dataset import Dataset


def output_number(index: int, count: int) -> int:
    """Return the number of an output time, or refuse one that there is not."""
    last = count - 1
    kind = whole(f"the number of an output time, 0 to {last}, or -1 to {-count} from the end", -count, last)
    return int(check(kind, index, "index", "at", ResultError))


class Trajectories(Shown, Mapping[str, FloatArray]):
    """A mapping from the paths of quantities to their values at the output times.

    ``result["bob2.position.x"]`` is an array, shape (times,); ``result.parts.bob2`` is the `Group` of all quantities
    of a component.
    """

    # Two runs are equal only if they are one: their arrays have no one truth value.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    if TYPE_CHECKING:  # a field in one, a property in another

        @property
        def time(self) -> FloatArray:
            """Output times, s."""

    @property
    @abstractmethod
    def paths(self) -> tuple[str, ...]:
        """Paths of all quantities."""

    @abstractmethod
    def unit(self, path: str) -> str:
        """Return the SI unit of a quantity."""

    @abstractmethod
    def describe(self, path: str) -> str:
        """Return one line of meaning of a quantity."""

    @abstractmethod
    def array(self, path: str) -> FloatArray:
        """Return a quantity at the output times, shape (times,).

        Raises
        ------
        ResultError
            If there is no such quantity.
        """

    # -- as a mapping ---------------------------------------------------------------------------------------------

    def __contains__(self, path: object) -> bool:
        return isinstance(path, (str, Quantity)) and str(path) in self.paths

    def __iter__(self) -> Iterator[str]:
        return iter(self.paths)

    def __len__(self) -> int:
        return len(self.paths)

    def __getitem__(self, path: str | Quantity) -> FloatArray:
        """Return a quantity at the output times, shape (times,)."""
        return self.array(str(check(PATH, path, "path", type(self).__name__)))

    def table(self, paths: Iterable[str] | None = None) -> dict[str, FloatArray]:
        """Return quantities at the output times by path; all when no paths are given."""
        return {path: self.array(path) for path in (self.paths if paths is None else paths)}

    def at(self, index: int) -> dict[str, float]:
        """Return all quantities at one output time, by its number; -1 for the end."""
        place = output_number(index, len(self.time))
        return {path: float(values[place]) for path, values in self.table().items()}

    # -- as tables ------------------------------------------------------------------------------------------------

    @abstractmethod
    def _about(self) -> Mapping[str, Any]:
        """Return what is known besides quantities, as plain data."""

    @takes(paths=PATHS)
    def to_dataframe(self, paths: Iterable[str] | None = None) -> Any:
        """Return a table of pandas: a row for each output time, a column for each quantity.

        Parameters
        ----------
        paths
            Which quantities; all when not given.

        Returns
        -------
        pandas.DataFrame
            With the index ``time``, s; ``attrs["units"]`` has the SI units by column.

        Raises
        ------
        UsageError
            If pandas is not installed (``pip install 'atwood[data]'``).
        """
        from atwood.result.formats.dataset import of_tables

        pandas, columns = of_tables("pandas"), self.table(paths)
        table = pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))
        table.attrs["units"] = {"time": "s", **{path: self.unit(path) for path in columns}}
        return table

    @takes(paths=PATHS)
    def to_xarray(self, paths: Iterable[str] | None = None) -> Any:
        """Return a dataset of xarray with the coordinate ``time``, and units and meanings as attributes.

        Parameters
        ----------
        paths
            Which quantities; all when not given.

        Returns
        -------
        xarray.Dataset
            Its variables have the paths of the quantities.

        Raises
        ------
        UsageError
            If xarray is not installed (``pip install 'atwood[data]'``).
        """
        from atwood.result.formats.dataset import to_xarray

        return to_xarray(self.as_dataset(paths))

    def as_dataset(self, paths: Iterable[str] | None = None) -> Dataset:
        """Return the quantities as arrays with names, units and dimensions, for files."""
        from atwood.result.formats.dataset import Dataset, Variable

        every = (
            Variable(path, ("time",), values, self.unit(path), self.describe(path))
            for path, values in self.table(paths).items()
        )
        time = Variable("time", ("time",), self.time, "s", "Time.", True)
        return Dataset("Atwood result", (time, *every), self._about())

    # -- by component ---------------------------------------------------------------------------------------------

    @property
    def parts(self) -> Group:
        """The quantities of each component by attributes: ``result.parts.bob2.position["x"]``."""
        return Group(self, "")

    @takes(path=PATH)
    def group(self, path: str) -> Group:
        """Return all quantities below a path, such as those of a component.

        Parameters
        ----------
        path
            Path of a component, or of a vector: ``"bob2"``, ``"rod[0]"``, ``"bob2.position"``.

        Raises
        ------
        ResultError
            If there is nothing below it.
        """
        found = Group(self, str(path))
        if not found:
            self._known(path if path in self else self._below(str(path)))
            raise ResultError("it is one quantity and no group", where=str(path), advice=f"Write [{str(path)!r}].")
        return found

    def _below(self, path: str) -> str:
        return next((one for one in self.paths if one.startswith(f"{path}.")), path)

    def _known(self, given: object) -> str:
        path: str = check(PATH, given, "path", type(self).__name__)
        if path in self:
            return path
        below = self._below(path)
        advice = suggestion_in_parts(path, self.paths)
        if below != path:
            advice = f"It has quantities below it, such as {below}: group({path!r}) has them all."
        raise MissingQuantityError("there is no such quantity", where=path, advice=advice)

    # -- showing --------------------------------------------------------------------------------------------------

    @abstractmethod
    def _facts(self) -> Iterator[tuple[str, str]]:
        """Yield what there is to say of the run in a few lines; the first is its title."""

    def tables(self) -> tuple[Table, ...]:
        """Return a few facts about the run."""
        (kind, title), *rest = self._facts()
        return (facts(rest, f"{kind} of {title}"),)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.paths)

    def plot(
        self, paths: Iterable[str] | None = None, file: str | os.PathLike[str] | None = None, x: str | None = None
    ) -> Any:
        """Plot quantities over time, or over another one, and return the figure; see `atwood.plot`.

        Parameters
        ----------
        paths
            Which quantities; the coordinates and the energy when not given.
        file
            Where to save the picture; its suffix says how.
        x
            The quantity that they are plotted over; time when not given.
        """
        # Views stand above results and are never imported from here, only looked up when a picture is wanted.
        return import_module("atwood.plotting.plots.quantities").plot(self, paths, file, x)


class Group(Mapping[str, FloatArray]):
    """The quantities below a path, by what follows it: ``group["position.x"]`` of ``bob2``.

    Attributes are the groups within it: ``result.parts.bob2.position``. Where a component has the name of a method of
    mappings, such as ``items``, `Trajectories.group` finds it.

    Parameters
    ----------
    whole
        What it is a group of.
    path
        The path; empty for the root.
    """

    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __init__(self, whole: Trajectories, path: str) -> None:
        self._whole = whole
        self._path = path
        self._prefix = f"{path}." if path else ""

    def __iter__(self) -> Iterator[str]:
        cut = len(self._prefix)
        return (path[cut:] for path in self._whole.paths if path.startswith(self._prefix))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._prefix + name in self._whole

    def __getitem__(self, name: str) -> FloatArray:
        """Return one of its quantities at the output times, shape (times,)."""
        return self._whole[self._prefix + str(check(PATH, name, "name", "Group"))]

    def _groups(self) -> list[str]:
        return list(dict.fromkeys(name.partition(".")[0] for name in self if "." in name))

    def __getattr__(self, name: str) -> Group:
        if name.startswith("_"):
            raise AttributeError(name)
        if any(one.startswith(f"{name}.") for one in self):
            return Group(self._whole, self._prefix + name)
        known = self._groups()
        advice = f'It is a quantity: write ["{name}"].' if name in self else suggestion(name, known)
        raise MissingGroupError("there is no such group of quantities", where=self._prefix + name, advice=advice)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in self._groups() if name.isidentifier())]

    def table(self) -> dict[str, FloatArray]:
        """Return all of its quantities at the output times, by what follows its path."""
        cut = len(self._prefix)
        return {path[cut:]: values for path, values in self._whole.table(self._prefix + name for name in self).items()}

    def __repr__(self) -> str:
        names = listed((f"{name} [{self._whole.unit(self._prefix + name)}]" for name in self), 24)
        return fitted(f"<Group {self._path}: {count_of(len(self), 'quantity', 'quantities')}: {names}>")

    def _repr_html_(self) -> str:
        paths = ((name, self._prefix + name) for name in self)
        rows = [(name, self._whole.unit(path), self._whole.describe(path)) for name, path in paths]
        return table(("quantity", "unit", "meaning"), rows, f"Quantities of {self._path}".strip()).html()

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)
