"""`atwood page` and `atwood diagram`: scenes in the browser."""

from __future__ import annotations

import webbrowser
from collections.abc import Sequence
from pathlib import Path

import click

from atwood.arguments import FILE, FLAG, optional, whole
from atwood.cli.command import Request, command
from atwood.cli.output import print_json
from atwood.cli.running import run_of
from atwood.cli.scenes import prepare
from atwood.errors import UsageError
from atwood.pipeline import assemble, simulate
from atwood.plotting.diagram import diagram
from atwood.plotting.pages.page import Page, check_page, page


def write_page(request: Request) -> None:
    """Write a page on which SCENE moves: live where the browser can solve its equations, else as it was simulated.

    Parameters
    ----------
    mode
        Show this small oscillation, by its number in `atwood modes`, instead of the motion from the start.
    recorded
        Only play what was simulated, even where the page could be live.
    open
        Show the page in the browser.
    """
    target = Path(f"{Path(request.scene).stem}.html") if request.file is None else request.file
    check_page(target)
    shown = request.show or ()
    if request.mode is None:
        made = page(
            run_of(request),
            target,
            show=shown,
            sliders=request.sliders or (),
            live="never" if request.recorded else "auto",
        )
    else:
        made = _mode(request, shown).save(target)
    if request.as_json:
        print_json({"file": str(target), "mode": made.mode, "reason": made.reason, "bytes": target.stat().st_size})
    else:
        why = f", recorded: {made.reason}" if made.reason else ", live"
        click.echo(f"{target} ({target.stat().st_size / 1000:.0f} kB){why}")
    if request.open:
        webbrowser.open(target.absolute().as_uri())


def _mode(request: Request, shown: Sequence[str]) -> Page:
    """Return the page of a small oscillation about the start, or about the first stable equilibrium."""
    from atwood.cli.theory import modes_of_scene
    from atwood.plotting.pages.modes import mode_page

    scene, name = prepare(request.scene, request.settings, request.start_values)
    found = modes_of_scene(assemble(scene, name=name, **request.of(assemble)))
    return mode_page(found[0], request.mode, shown)


def draw(request: Request) -> None:
    """Draw which parts of SCENE are connected where, which joints bodies hang on, and which close loops.

    Parameters
    ----------
    draw
        Where to (``.svg``).
    """
    if request.draw is None:
        raise UsageError("there is nowhere to draw it", where="--draw", advice="Give a file, such as --draw scene.svg.")
    scene, name = prepare(request.scene, request.settings, request.start_values)
    diagram(assemble(scene, name=name, **request.of(assemble)), request.draw)
    if request.as_json:
        print_json({"file": str(request.draw)})
    else:
        click.echo(f"{request.draw}")


_PAGE = {
    "mode": (optional(whole("the number of a mode", 0)), None),
    "recorded": (FLAG, False),
    "open": (FLAG, False),
    "progress": (FLAG, True),
}
COMMANDS = {
    "page": command(
        "page",
        write_page,
        simulate,
        assemble,
        page,
        leave=("name", "samples", "live"),
        more=_PAGE,
        names={"file": "--output,-o"},
    ),
    "diagram": command("diagram", draw, assemble, leave=("name",), more={"draw": (FILE, None)}),
}
