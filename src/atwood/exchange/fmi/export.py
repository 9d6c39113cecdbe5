"""`export_fmu`: a scene as a functional mock-up unit."""

from __future__ import annotations

import hashlib
import os
import warnings
import zipfile
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from atwood.arguments import FILE, PATHS, each, one_of, optional, takes, whole
from atwood.errors import UsageError
from atwood.exchange.c.export import exported
from atwood.exchange.c.tables import quoted
from atwood.exchange.c.text import SceneText, with_name
from atwood.exchange.fmi.build import PLATFORMS, compiled, own_platform, place_of
from atwood.exchange.fmi.description import build_xml, description, structure, variables_of
from atwood.exchange.fmi.equations import dependencies, tangent_programs
from atwood.expr import Program
from atwood.files import check_directory, write_atomically
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE
from atwood.plotting.live.mode import ModeText
from atwood.plotting.live.parameters import live_parameters
from atwood.simulation.problem.arguments import FORM

_STAMP = 1980, 1, 1, 0, 0, 0
"""The time of what is in the archive, so that one scene makes one file."""


@dataclass(frozen=True)
class ExportedFMU:
    """What was written.

    Attributes
    ----------
    file
        The FMU.
    kinds
        ``"model exchange"`` and ``"co-simulation"``, or the latter alone.
    platforms
        For which there are binaries; sources are always inside.
    reason
        Why there is no model exchange; empty where there is.
    """

    file: Path
    kinds: tuple[str, ...]
    platforms: tuple[str, ...]
    reason: str


@takes(
    scene=SCENE,
    file=FILE,
    fmi=whole("the version of FMI, 3 or 2", 2, 3),
    form=optional(FORM),
    output=optional(PATHS),
    platform=optional(each(one_of(PLATFORMS), "names of platforms, such as 'x86_64-linux'")),
)
def export_fmu(
    scene: Model | Assembly,
    file: str | os.PathLike[str],
    *,
    fmi: int = 3,
    form: str | None = None,
    output: Sequence[str] | None = None,
    platform: Sequence[str] | None = None,
) -> ExportedFMU:
    """Write a scene as a functional mock-up unit (FMU), which other tools simulate.

    Variables have the paths of the scene, with units; states are continuous-time states, parameters tunable, signals
    that nothing drives inputs, quantities outputs.  On what outputs and rates depend is read from the equations.  An
    FMU is for model exchange, where whoever imports it solves its equations, with directional derivatives (and adjoint
    ones in FMI 3.0), and for co-simulation, where it solves them itself by the method of order 8(5,3).  Where states
    depend on each other (loops that are kept by projection, constraints on velocities), and where there are contacts or
    events that set states, it is for co-simulation alone.

    Parameters
    ----------
    scene
        A scene, or an assembly of one.
    file
        Where to write it (``.fmu``).
    fmi
        The version of the interface: 3 or 2.
    form
        See `assemble`.
    output
        Paths of the quantities that are outputs; all if not given.
    platform
        For which processors and systems there are binaries, as FMI 3.0 calls them; this one if not given.  Those of
        others need the extra ``fmi`` (ziglang).  An empty list: sources alone.

    Returns
    -------
    ExportedFMU
        What was written.

    Raises
    ------
    UnsupportedError
        If the scene needs what is not exported; see `export_c`.
    ParameterError
        If there is no such quantity.
    UsageError
        If the file cannot be written, or there is no compiler for a platform that was asked for, or it fails.

    Warns
    -----
    UserWarning
        If no platform was named and no compiler is found: then there are sources alone.
    """
    target = Path(file)
    if target.suffix.lower() != ".fmu":
        raise UsageError(f"the suffix {target.suffix!r} is not that of an FMU", where=str(target), advice="Use .fmu.")
    check_directory(target)
    text = exported(scene, form, output, _tangents)
    inputs = _inputs(text.mode)
    reason = _why_alone(text)
    both = not reason
    sources = _sources(text, fmi, inputs)
    token = "{" + hashlib.sha256("".join(sources.values()).encode()).hexdigest()[:32] + "}"
    main = f"fmi{fmi}.c"
    sources[main] = f'#define TOKEN "{token}"\n{sources[main]}'
    variables = variables_of(text, both and fmi == 3)
    depends = None if text.modes else structure(text, dependencies(text.mode, inputs), inputs)
    said = description(text, token, variables, depends, both, fmi)
    content: dict[str, str | bytes] = {"modelDescription.xml": said}
    content |= {f"sources/{name}": one for name, one in sources.items()}
    if fmi == 3:
        content["sources/buildDescription.xml"] = build_xml(text)
    units = [main, *(one for one in text.modes if one.endswith(".c"))]
    binaries = _binaries(text.name, sources, units, fmi, platform)
    content |= {place_of(text.name, one, fmi): binary for one, binary in binaries.items()}
    write_atomically(target, lambda part: _pack(part, content))
    kinds = ("model exchange", "co-simulation") if both else ("co-simulation",)
    return ExportedFMU(target, kinds, tuple(binaries), reason)


def _why_alone(text: SceneText) -> str:
    """Return why a scene is for co-simulation alone; empty where it is for model exchange, too."""
    return "each of its modes has states of its own" if text.modes else _why_kept(text.mode)


def _why_kept(mode: ModeText) -> str:
    if "nearer" in mode.programs:
        return "its states depend on each other, which steps keep so"
    if "contacts" in mode.data:
        return "gaps and slips hold by turns, which steps find"
    if "sides" in mode.data:
        return "its laws compare what moves, on whose sides steps keep"
    if any(event["updates"] for event in mode.data["events"]):
        return "its events set states, which steps find"
    return ""


def _tangents(mode: ModeText) -> dict[str, Program]:
    return {} if _why_kept(mode) else tangent_programs(mode, _inputs(mode))


def _inputs(mode: ModeText) -> list[int]:
    """Return the numbers of inputs among all parameters."""
    known = live_parameters(mode.assembly)
    return [mode.data["numbers"][one["path"]] for one in known if one["kind"] == "input"]


def _sources(text: SceneText, fmi: int, inputs: Sequence[int]) -> dict[str, str]:
    """Return the files in C."""
    room = files("atwood.exchange.fmi")
    of_parameters = [text.mode.data["numbers"][one["path"]] for one in text.parameters]
    numbers = ", ".join(str(of_parameters.index(one)) for one in inputs) or "0"
    why = _why_alone(text)
    table = f"#define INPUTS {len(inputs)}\n#define EXCHANGES {int(not why)}\n#define ALONE {quoted(why)}\n"
    if not why:
        table += f"static const int input_numbers[] = {{{numbers}}};\n"
    shared = room.joinpath("fmu.c").read_text(encoding="utf-8").replace("/* inputs */\n", table)
    shared = with_name(shared, text.name)
    both, own = (room.joinpath(name).read_text(encoding="utf-8") for name in ("fmi.c", f"fmi{fmi}.c"))
    scene = {f"{text.name}.h": text.header, f"{text.name}.c": text.source, **text.modes}
    return {**scene, "fmu.c": shared, "fmi.c": both, f"fmi{fmi}.c": own}


def _binaries(
    name: str, sources: dict[str, str], units: Sequence[str], fmi: int, platform: Sequence[str] | None
) -> dict[str, bytes]:
    """Return the binaries by platform."""
    own = own_platform()
    wanted = ([] if own is None else [own]) if platform is None else list(dict.fromkeys(platform))
    found: dict[str, bytes] = {}
    for one in wanted:
        place_of(name, one, fmi)
        binary = compiled(name, sources, units, one)
        if binary is not None:
            found[one] = binary
        elif platform is not None:
            raise UsageError(
                "there is no compiler for it", where=one, advice="Install ziglang (pip install atwood[fmi])."
            )
    if platform is None and not found:
        message = "no C compiler is found, so that the FMU has sources alone: set CC, or pip install atwood[fmi]"
        warnings.warn(message, stacklevel=3)
    return found


def _pack(target: Path, content: dict[str, str | bytes]) -> None:
    with zipfile.ZipFile(target, "w") as archive:
        for name, one in content.items():
            info = zipfile.ZipInfo(name, _STAMP)
            info.external_attr = (0o755 if name.startswith("binaries") else 0o644) << 16
            archive.writestr(info, one, zipfile.ZIP_DEFLATED)
