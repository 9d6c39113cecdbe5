"""`atwood linearize`, `atwood modes` and `atwood equilibria`: what the equations say near a state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from atwood.cli.output import print_json, warn, writer
from atwood.cli.scenes import pairs, prepare, read_bounds, warn_of_radians
from atwood.errors import UsageError

if TYPE_CHECKING:
    from atwood.model.compose.composite import Model
    from atwood.theory.linearization import LinearModel, NormalModes

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
    from atwood.theory.linearization import linearize

    model, name = prepare(scene, settings, ())
    found = linearize(model, at=_state(model, at), inputs=inputs, outputs=outputs, form=form)
    if bode is not None:
        from atwood.plotting.plots.linear import plot_bode

        plot_bode(found, bode)
    if as_json:
        print_json({**found.to_data(), "scene": name})
        return
    _print_model(found, name)
    if bode is not None:
        writer().line((f"plotted: {bode}", "dim"))


def _print_model(found: LinearModel, name: str) -> None:
    from atwood.theory.linearization.linear_model import complex_text

    out = writer()
    out.line((name, "bold"), (f" ({found.form}), linear about a {found.kind}", ""))
    stable = "no deviation grows" if found.is_stable else "some deviations grow"
    zeros = f"; {found.spectrum.zeros} times 0" if found.spectrum.zeros else ""
    out.pairs(
        [
            ("states", ", ".join(found.states)),
            ("inputs", ", ".join(found.inputs) or "none: name some with --input"),
            ("outputs", ", ".join(found.outputs) or "none: name some with --output"),
            ("eigenvalues", ", ".join(complex_text(value) for value in found.spectrum.others) + f" 1/s{zeros}"),
            ("stability", stable),
        ]
    )
    if len(found.states) <= _SHOWN:
        for matrix, rows, columns in (
            ("A", found.states, found.states),
            ("B", found.states, found.inputs),
            ("C", found.outputs, found.states),
            ("D", found.outputs, found.inputs),
        ):
            if rows and columns:
                entries = getattr(found, matrix)
                out.line(("", ""))
                out.table(
                    [matrix, *(f"{one}>" for one in columns)],
                    [[row, *(f"{x:.6g}" for x in values)] for row, values in zip(rows, entries, strict=True)],
                )
    else:
        out.line((f"Matrices of {len(found.states)} states: --json writes them.", "dim"))


_SHOWN = 8
"""Matrices of more states are not shown on a terminal."""


def show_modes(scene: str, settings: Sequence[str], at: Sequence[str], plot: Path | None, as_json: bool) -> None:
    """Show the normal modes of a scene; see the options of `atwood modes`."""
    from atwood.theory.linearization import equilibria, normal_modes

    model, name = prepare(scene, settings, ())
    state = _state(model, at)
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
    for one in found:
        _print_modes(one, name)
    if plot is not None:
        writer().line((f"plotted: {plot}", "dim"))


def _plot_modes(found: NormalModes, file: Path) -> None:
    """Draw every mode in a picture of its own: numbered, where there are several."""
    from atwood.plotting.mode_shapes import plot_mode

    if len(found) > _PICTURES:
        warn(f"only the first {_PICTURES} of {len(found)} modes are drawn")
    for mode in range(min(len(found), _PICTURES)):
        target = file if len(found) == 1 else file.with_name(f"{file.stem}-{mode}{file.suffix}")
        plot_mode(found, mode, target)


_PICTURES = 12


def _print_modes(found: NormalModes, name: str) -> None:
    from atwood.theory.linearization.normal_modes import shape_text

    out = writer()
    out.line((name, "bold"), (f": {len(found)} modes about {_values(found.values)}", ""))
    rows = []
    for k, shape in enumerate(found.shapes):
        omega, growth = found.angular_frequencies[k], found.growth_rates[k]
        rows.append([str(k), f"{omega:.9g}", f"{found.frequencies[k]:.6g}", f"{growth:.6g}", shape_text(shape)])
    out.table(["mode", "rad/s>", "Hz>", "growth, 1/s>", "shape"], rows)
    for group in found.spaces:
        if len(group) > 1:
            text = ", ".join(map(str, group))
            out.line((f"Modes {text} have equal eigenvalues: any combination of them is a mode.", "dim"))


def _values(values: Mapping[str, float], most: int = 6) -> str:
    shown = [f"{path} = {value:.6g}" for path, value in list(values.items())[:most]]
    return ", ".join(shown) + (", ..." if len(values) > most else "")


def show_equilibria(
    scene: str,
    settings: Sequence[str],
    region: Sequence[str],
    along: str | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Show the equilibria of a scene; see the options of `atwood equilibria`."""
    from atwood.theory.linearization import equilibria

    model, name = prepare(scene, settings, ())
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
    out = writer()
    out.line((name, "bold"), (f": {len(found)} equilibri{'um' if len(found) == 1 else 'a'}", ""))
    kinds = [one.stability + (f", family of {one.family}" if one.family else "") for one in found]
    rows = [[kind, f"{one.growth_rate:.6g}", _values(one.values)] for kind, one in zip(kinds, found, strict=True)]
    out.table(["", "growth, 1/s>", "where"], rows)


def _show_branches(
    model: Model, name: str, along: str, region: dict[str, Any], plot: Path | None, as_json: bool
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
    out.line((name, "bold"), (f": {len(found.branches)} branches of equilibria over {path}", ""))
    rows = []
    for branch in found.branches:
        shares = f"{int(branch.stable.sum())} of {len(branch.stable)} points stable"
        ends = ", ".join(f"{one} {x[0]:.5g} to {x[-1]:.5g}" for one, x in list(branch.values.items())[:3])
        rows.append([f"{branch.parameter[0]:.6g} to {branch.parameter[-1]:.6g}", ends, shares])
    out.table([path, "coordinates at the ends", ""], rows)
    for kind, points in (("fold", found.folds), ("branch point", found.crossings)):
        for one in points:
            out.line((f"{kind} at {path} = {one.parameter:.10g}: {_values(one.values)}", ""))
    if plot is not None:
        out.line((f"plotted: {plot}", "dim"))


def _region(region: Sequence[str]) -> dict[str, Any]:
    return {path: read_bounds(text, path) for path, text in pairs(region, "--region")}
