"""`atwood export`: scenes as files of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from atwood.arguments import FILE, optional
from atwood.cli.command import Request, command
from atwood.cli.output import print_json
from atwood.cli.scenes import prepare
from atwood.errors import UsageError
from atwood.exchange.c.export import export_c
from atwood.pipeline import assemble


def write_export(request: Request) -> None:
    """Write SCENE for other tools: as C (--c DIR).

    Parameters
    ----------
    c
        A folder for its C: the scene with its method and a program that prints the motion.
    """
    if request.c is None:
        raise UsageError("nothing says what to write", where="export", advice="Give --c DIR.")
    scene, name = prepare(request.scene, request.settings, request.start_values)
    assembly = assemble(scene, name=name, **request.of(assemble))
    written: list[Path] = []
    if request.c is not None:
        written += export_c(assembly, request.c, output=request.output)
    if request.as_json:
        print_json({"files": [str(one) for one in written], "bytes": sum(one.stat().st_size for one in written)})
    else:
        for one in written:
            click.echo(f"{one} ({one.stat().st_size / 1000:.0f} kB)")


COMMAND = command(
    "export",
    write_export,
    assemble,
    export_c,
    leave=("name", "folder"),
    more={"c": (optional(FILE), None)},
)
