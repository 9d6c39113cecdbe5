"""`atwood phase`: the motions of one degree of freedom over coordinate and speed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from atwood.cli.output import print_json, writer
from atwood.cli.scenes import prepare, read_bounds

__all__ = ["show_phase_portrait"]


def show_phase_portrait(
    scene: str,
    settings: Sequence[str],
    coordinates: str | None,
    speeds: str | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Show the phase portrait of a scene; see the options of `atwood phase`."""
    from atwood.pipeline import assemble
    from atwood.theory.flow import phase_portrait

    if plot is not None:
        from atwood.plotting.canvas import check_picture

        check_picture(plot)
    made, name = prepare(scene, settings, ())
    model = assemble(made, name=name)
    found = phase_portrait(
        model,
        coordinates=None if coordinates is None else read_bounds(coordinates, "--coordinates"),
        speeds=None if speeds is None else read_bounds(speeds, "--speeds"),
    )
    if plot is not None:
        from atwood.plotting.plots.phase import plot_phase_portrait

        plot_phase_portrait(found, plot)
    if as_json:
        print_json({**found.to_data(), "scene": name})
        return
    out = writer()
    out.show(*found.tables())
    if plot is None:
        out.line(("Draw it with --plot phase.png.", "dim"))
    out.files(plotted=plot)
