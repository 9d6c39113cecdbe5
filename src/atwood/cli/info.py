"""`atwood info`: the mechanism report."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.cli.output import print_json, writer
from atwood.cli.scenes import prepare

__all__ = ["show_info"]


def show_info(
    scene: str,
    settings: Sequence[str],
    starts: Sequence[str],
    as_json: bool,
    moved: bool = False,
    orientation: str = "quaternion",
) -> None:
    """Show what a scene is made of.

    Parameters
    ----------
    scene, settings, starts
        See `atwood.cli.scenes.prepare`.
    as_json
        Whether to write JSON.
    moved
        Whether to show, instead of the parameters, all that the start moved.
    orientation
        See `atwood.assemble`.
    """
    from atwood.reporting import report
    from atwood.reporting.text import described, parameters

    model, name = prepare(scene, settings, starts)
    found = report(model, name, orientation=orientation)
    if as_json:
        print_json(found.to_dict())
        return
    out = writer()
    out.show(described(found))
    out.line()
    if moved:
        out.line((str(found.initialization), ""))
    else:
        out.show(parameters(found))
