"""`atwood list`: the scenes there are."""

from __future__ import annotations

from atwood.cli.output import print_json, writer
from atwood.cli.scenes import bundled_scenes
from atwood.table import facts

__all__ = ["list_scenes"]


def list_scenes(as_json: bool) -> None:
    """Show the scenes of the installed libraries.

    Parameters
    ----------
    as_json
        Whether to write JSON.
    """
    scenes = {name: _summary(kind) for name, kind in bundled_scenes().items()}
    if as_json:
        print_json({"scenes": [{"name": name, "summary": summary} for name, summary in scenes.items()]})
        return
    if not scenes:
        writer().line(("No component library is installed.", ""))
        return
    writer().show(facts(scenes.items()))


def _summary(kind: type) -> str:
    """Return the first line of what a class says about itself."""
    return (vars(kind)["__doc__"] or "").strip().split("\n")[0]
