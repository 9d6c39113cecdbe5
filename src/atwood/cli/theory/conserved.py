"""`atwood conserved`: what is conserved along the motions of a scene."""

from __future__ import annotations

from collections.abc import Sequence

import click

from atwood.cli.output import print_json
from atwood.cli.scenes import prepare

__all__ = ["show_conserved"]


def show_conserved(scene: str, settings: Sequence[str], starts: Sequence[str], as_json: bool, orientation: str) -> None:
    """Write what a scene conserves to standard output."""
    from atwood.pipeline import assemble
    from atwood.theory.symmetries import conserved

    made, name = prepare(scene, settings, starts)
    found = conserved(assemble(made, orientation=orientation, name=name))
    if as_json:
        print_json(found.to_dict())
    else:
        click.echo(str(found))
