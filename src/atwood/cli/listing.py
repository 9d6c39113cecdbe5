"""`atwood list`: the scenes there are."""

from __future__ import annotations

from atwood.arguments import FLAG
from atwood.cli.command import Request, command
from atwood.cli.output import print_json, writer
from atwood.cli.parts import list_parts, said
from atwood.cli.scenes import bundled_scenes
from atwood.table import facts


def list_scenes(request: Request) -> None:
    """List the scenes of the installed libraries, or the parts that they are made of."""
    if request.parts:
        list_parts(request.as_json)
        return
    scenes = {name: said(kind)[0] for name, kind in bundled_scenes().items()}
    if request.as_json:
        print_json({"scenes": [{"name": name, "summary": summary} for name, summary in scenes.items()]})
        return
    if not scenes:
        writer().line(("No component library is installed.", ""))
        return
    writer().show(facts(scenes.items()))


COMMAND = command("list", list_scenes, argument="", more={"parts": (FLAG, False)})
