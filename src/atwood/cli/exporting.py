"""`atwood export`: scenes as files of other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from atwood.arguments import FILE, optional
from atwood.cli.command import Request, command
from atwood.cli.output import print_json
from atwood.cli.scenes import prepare
from atwood.errors import UsageError
from atwood.exchange.c.export import export_c
from atwood.exchange.fmi.export import export_fmu
from atwood.pipeline import assemble


def write_export(request: Request) -> None:
    """Write SCENE for other tools: as C (--c DIR), or as a functional mock-up unit (--fmu FILE.fmu).

    Parameters
    ----------
    c
        A folder for its C: the scene with its method and a program that prints the motion.
    fmu
        A file for its FMU.
    """
    if request.c is None and request.fmu is None:
        raise UsageError("nothing says what to write", where="export", advice="Give --c DIR or --fmu FILE.fmu.")
    scene, name = prepare(request.scene, request.settings, request.start_values)
    assembly = assemble(scene, name=name, **request.of(assemble))
    written: list[Path] = []
    if request.c is not None:
        written += export_c(assembly, request.c, output=request.output)
    said: dict[str, Any] = {}
    notes: dict[Path, str] = {}
    if request.fmu is not None:
        made = export_fmu(assembly, request.fmu, fmi=request.fmi, output=request.output, platform=request.platform)
        written.append(made.file)
        said = {"kinds": made.kinds, "platforms": made.platforms, "reason": made.reason}
        notes[made.file] = f", for {' and '.join(made.kinds)}, {', '.join((*made.platforms, 'sources'))}"
        notes[made.file] += f"; no model exchange: {made.reason}" if made.reason else ""
    if request.as_json:
        print_json({"files": [str(one) for one in written], **said})
    else:
        for one in written:
            click.echo(f"{one} ({one.stat().st_size / 1000:.0f} kB){notes.get(one, '')}")


COMMAND = command(
    "export",
    write_export,
    assemble,
    export_c,
    export_fmu,
    leave=("name", "folder", "file"),
    more={"c": (optional(FILE), None), "fmu": (optional(FILE), None)},
)
