"""`atwood list`: the scenes there are."""

from __future__ import annotations

from atwood.cli.output import console, print_json
from atwood.cli.scenes import bundled_scenes

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
    out = console()
    if not scenes:
        out.print("No component library is installed.")
        return
    from rich.table import Table

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, summary in scenes.items():
        table.add_row(name, summary)
    out.print(table)


def _summary(kind: type) -> str:
    """Return the first line of what a class says about itself."""
    return (vars(kind)["__doc__"] or "").strip().split("\n")[0]
