"""The folder that a sweep keeps its results in, so that it goes on where it was cut off.

Values are one array on disk, which is read as it is needed and so may be larger than memory. A piece of runs is written
there, and then a file appears that says so: whole or not at all, with a checksum of the values. What a sweep is made of
stands in ``sweep.json``; a call that differs is refused.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.files import read_checked, write_atomically
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.serialization import to_data
from atwood.pipeline import scene_of
from atwood.result.about import versions
from atwood.study.sweeps.runs import DIED, Records, SweepRequest

_ABOUT, _VALUES, _PIECES = "sweep.json", "values.npy", "runs-*.npz"
_AGAIN = "Remove this file: its runs are then made again."


@dataclass(frozen=True, eq=False)
class Store:
    """A folder with the results of a sweep; see `open_store`."""

    folder: Path
    values: FloatArray

    def take_up(self, records: Records) -> None:
        """Record the runs that are there."""
        for file in sorted(self.folder.glob(_PIECES)):
            read_checked(file, lambda one: self._read(one, records), "piece of a sweep", _AGAIN)

    def _read(self, file: Path, records: Records) -> None:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as found:
            arrays = {name: found[name] for name in found.files}
        runs, said = arrays["runs"], json.loads(str(arrays["about"]))
        values = self.values[:, runs]
        if said["checksum"] != _checksum(values):
            raise ValueError("its values are not those that were written")
        part = Records(values, arrays["end_time"], arrays["steps"], arrays["status"].tolist())
        part.messages = {int(run): text for run, text in said["messages"].items()}
        part.reassembled = {int(run): text for run, text in said["reassembled"].items()}
        part.batched, part.seconds = said["batched"], said["seconds"]
        records.note(runs, part)

    def keep(self, runs: NDArray[np.intp], part: Records) -> None:
        """Write a piece, whose values are in place, unless some of its runs are to be made again."""
        if "interrupted" in part.status or any(text.startswith(DIED) for text in part.messages.values()):
            return
        self.values.flush()  # type: ignore[attr-defined]
        said = {"checksum": _checksum(part.values), "messages": part.messages, "reassembled": part.reassembled}
        about = json.dumps({**said, "batched": part.batched, "seconds": part.seconds})
        arrays = {"runs": runs, "end_time": part.end_time, "steps": part.steps, "status": np.array(part.status)}

        def write(file: Path) -> None:
            with file.open("wb") as stream:
                np.savez(stream, allow_pickle=False, **arrays, about=np.array(about))

        write_atomically(self.folder / f"runs-{int(runs[0]):010d}-{len(runs)}.npz", write)


def _checksum(values: NDArray[Any]) -> str:
    return hashlib.sha256(values.tobytes()).hexdigest()


def open_store(folder: Path, request: SweepRequest) -> Store:
    """Open the folder of a sweep, or make it; refuse one that holds something else."""
    about, shape = folder / _ABOUT, (len(request.paths), request.cases.count, len(request.times))
    now = _identity(request)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        is_empty = not any(folder.iterdir())
    except (OSError, ValueError) as error:
        raise UsageError(f"it cannot be a folder ({error})", where=str(folder), advice="Give another name.") from None
    if not about.is_file():
        leftover = all(one.name == _VALUES or one.name.startswith(".") for one in folder.iterdir())
        if not is_empty and not leftover:
            raise UsageError("this folder holds something else", where=str(folder), advice="Give one of its own.")
        values = np.lib.format.open_memmap(folder / _VALUES, "w+", np.float64, shape)
        write_atomically(about, lambda part: part.write_text(json.dumps(now, indent=1), encoding="utf-8"))
        return Store(folder, values)
    before = read_checked(about, lambda one: dict(json.loads(one.read_text("utf-8"))), "sweep", "Give another folder.")
    differing = [name for name in now if before.get(name) != now[name]]
    if differing:
        name = differing[0]
        said = f"the store holds a sweep with another {name}"
        if len(str(before.get(name))) + len(str(now[name])) < 80:
            said += f" ({before.get(name)}, and now {now[name]})"
        advice = "Give another folder, or remove this one if its results are not needed."
        raise UsageError(said, where=str(folder), advice=advice)
    found = read_checked(folder / _VALUES, lambda one: _mapped(one, shape), "array of values", "Remove the folder.")
    return Store(folder, found)


def _mapped(file: Path, shape: tuple[int, ...]) -> FloatArray:
    found = np.lib.format.open_memmap(file, "r+")
    if found.shape != shape or found.dtype != np.float64:
        raise ValueError(f"its shape is {found.shape} and not {shape}")
    return found


def _identity(request: SweepRequest) -> dict[str, Any]:
    """Return what makes a sweep this one and no other, in the order in which differences are told."""
    assembly, options = request.assembly, request.options
    for one in options.conditions:
        if not isinstance(one.given, str):
            advice = "Write the condition as text."
            raise UsageError(
                "a function in until cannot be told from another one in a store", where="until", advice=advice
            )
    kinds = {type(part.component) for part in assembly.flat.parts.values()}
    return {
        "version of Atwood": versions()["atwood"],
        "scene": _digest(json.dumps(to_data(scene_of(assembly))["scene"], sort_keys=True)),
        "class of a part": {f"{one.__module__}.{one.__qualname__}": _source(one) for one in sorted(kinds, key=str)},
        "form": f"{assembly.form} {assembly.level}".strip(),
        **{f"list of values of {axis.path}": _axis(request, k) for k, axis in enumerate(request.cases.axes)},
        "choice of what is varied": [[axis.path, axis.is_start] for axis in request.cases.axes],
        "shape": list(request.cases.shape),
        "list of quantities": list(request.paths),
        "t_end": options.t_end,
        "list of outputs": "the end" if request.only_end else _digest(request.times.tobytes()),
        "rtol": options.relative_tolerance,
        "solver": options.solver,
        "accuracy": options.accuracy,
        "max_steps": options.max_steps,
        "max_seconds": options.max_seconds,
        "condition": [one.text for one in options.conditions],
    }


def _axis(request: SweepRequest, k: int) -> str:
    values = request.cases.column(k)
    return _digest(values.tobytes() if values.dtype.kind == "f" else "\0".join(values.tolist()))


def _digest(what: str | bytes) -> str:
    return hashlib.sha256(what.encode() if isinstance(what, str) else what).hexdigest()[:16]


def _source(kind: type) -> str:
    try:
        return _digest(inspect.getsource(kind))
    except (OSError, TypeError):  # as of one that was typed in
        return ""
