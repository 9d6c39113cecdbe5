"""`atwood linearize`, `atwood modes` and `atwood equilibria`: what the equations say near a state."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from atwood.cli.output import print_json, warn, writer
from atwood.cli.scenes import pairs, prepare, read_bounds, warn_of_radians
from atwood.errors import UsageError

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly
    from atwood.model.compose.composite import Model
    from atwood.theory.linearization import NormalModes

__all__ = ["show_equilibria", "show_linear_model", "show_modes"]


def _state(scene: Model, texts: Sequence[str]) -> dict[str, str] | None:
    """Return the values of ``--at``; None if there are none, for the scene's own start."""
    if not texts:
        return None
    found = dict(pairs(texts, "--at"))
    for path, value in found.items():
        warn_of_radians(scene, path, [value], "--at", value)
    return {} if found == {"rest": "yes"} else found


def show_linear_model(
    scene: str,
    settings: Sequence[str],
    at: Sequence[str],
    inputs: Sequence[str],
    outputs: Sequence[str],
    form: str,
    bode: Path | None,
    as_json: bool,
) -> None:
    """Show the linear model of a scene; see the options of `atwood linearize`."""
    from atwood.pipeline import assemble
    from atwood.theory.linearization import linearize

    model, name = prepare(scene, settings, ())
    found = linearize(assemble(model, name=name), at=_state(model, at), inputs=inputs, outputs=outputs, form=form)
    if bode is not None:
        from atwood.plotting.plots.linear import plot_bode

        plot_bode(found, bode)
    if as_json:
        print_json({**found.to_data(), "scene": name})
        return
    out = writer()
    out.show(*found.tables())
    out.files(plotted=bode)


def show_modes(scene: str, settings: Sequence[str], at: Sequence[str], plot: Path | None, as_json: bool) -> None:
    """Show the normal modes of a scene; see the options of `atwood modes`."""
    from atwood.pipeline import assemble
    from atwood.theory.linearization import equilibria, normal_modes

    made, name = prepare(scene, settings, ())
    state, model = _state(made, at), assemble(made, name=name)
    if state is None:
        try:
            found = [normal_modes(model)]
        except UsageError as error:
            found = [one.modes for one in equilibria(model) if one.stable]
            if not found:
                raise error
    else:
        found = [normal_modes(model, at=state)]
    if plot is not None:
        _plot_modes(found[0], plot)
    if as_json:
        print_json({"scene": name, "modes": [one.to_data() for one in found]})
        return
    out = writer()
    out.show(*(one for group in found for one in group.tables()))
    out.files(plotted=plot)


def _plot_modes(found: NormalModes, file: Path) -> None:
    """Draw every mode in a picture of its own: numbered, where there are several."""
    from atwood.plotting.mode_shapes import plot_mode

    if len(found) > _PICTURES:
        warn(f"only the first {_PICTURES} of {len(found)} modes are drawn")
    for mode in range(min(len(found), _PICTURES)):
        target = file if len(found) == 1 else file.with_name(f"{file.stem}-{mode}{file.suffix}")
        plot_mode(found, mode, target)


_PICTURES = 12


def show_equilibria(
    scene: str,
    settings: Sequence[str],
    region: Sequence[str],
    along: str | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Show the equilibria of a scene; see the options of `atwood equilibria`."""
    from atwood.pipeline import assemble
    from atwood.theory.linearization import equilibria

    made, name = prepare(scene, settings, ())
    model = assemble(made, name=name)
    bounds = _region(region)
    if along is not None:
        _show_branches(model, name, along, bounds, plot, as_json)
        return
    if plot is not None:
        raise UsageError("there is nothing to draw", where="--plot", advice="Give --along PATH=FROM:TO too.")
    found = equilibria(model, region=bounds or None)
    if as_json:
        print_json({"scene": name, "equilibria": found.to_data()})
        return
    writer().show(*found.tables())


def _show_branches(
    model: Assembly, name: str, along: str, region: dict[str, Any], plot: Path | None, as_json: bool
) -> None:
    from atwood.theory.linearization import equilibrium_branches

    ((path, text),) = pairs([along], "--along")
    low, _, high = text.partition(":")
    try:
        span = float(low), float(high)
    except ValueError:
        raise UsageError(f"{text!r} is no range", where=path, advice="Write --along PATH=FROM:TO, SI units.") from None
    found = equilibrium_branches(model, path, span, region=region or None)
    if plot is not None:
        from atwood.plotting.plots.linear import plot_branches

        plot_branches(found, file=plot)
    if as_json:
        print_json({**found.to_data(), "scene": name})
        return
    out = writer()
    out.show(*found.tables())
    out.files(plotted=plot)


def _region(region: Sequence[str]) -> dict[str, Any]:
    return {path: read_bounds(text, path) for path, text in pairs(region, "--region")}
