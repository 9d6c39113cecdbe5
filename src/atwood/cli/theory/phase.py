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
    from atwood.theory.flow import phase_portrait
    from atwood.theory.linearization.linear_model import complex_text

    if plot is not None:
        from atwood.plotting.canvas import check_picture

        check_picture(plot)
    model, name = prepare(scene, settings, ())
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
    out.line((name, "bold"), (f": {found.speed} over {found.coordinate}", ""))
    if found.everywhere_at_rest:
        out.line(("It can stay at rest everywhere.", ""))
    elif not found.rest_points:
        low, high = found.window.across
        out.line((f"It can stay at rest nowhere from {low:.4g} to {high:.4g} {found.units[0]}.", ""))
    else:
        rows = [
            [one.kind, f"{one.coordinate:.9g}", ", ".join(complex_text(value) for value in one.eigenvalues)]
            for one in found.rest_points
        ]
        out.table(["at rest", f"{found.coordinate}, {found.units[0]}>", "eigenvalues, 1/s"], rows)
    if plot is not None:
        out.line((f"plotted: {plot}", "dim"))
    else:
        out.line(("Draw it with --plot phase.png.", "dim"))
