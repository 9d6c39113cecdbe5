"""`atwood run`: from a scene to its motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from atwood.arguments import FLAG, TEXT, one_of
from atwood.cli.command import PICTURE, Request, command, written_as
from atwood.cli.errors import INTERRUPTED
from atwood.cli.output import print_json, progress_bar, warn
from atwood.cli.scenes import check_applies, prepare
from atwood.errors import AtwoodError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import replace
from atwood.pipeline import assemble, simulate
from atwood.result.result import Result
from atwood.stages import watching

_OF_ASSEMBLY = ("form", "level", "orientation")


def run_scene(request: Request) -> None:
    """Simulate SCENE, and show where it ends and how accurate that is."""
    if request.view is not None:
        from atwood.plotting.camera import as_camera

        as_camera(request.view)
        if request.draw is None:
            raise UsageError("there is nothing to draw", where="--view", advice="Say where to with --draw FILE.")
    with watching():  # from the scene on
        result = run_of(request)
    _keep(result, request)
    if request.as_json:
        print_json(run_data(result, request))
    else:
        from atwood.cli.summary import print_summary

        print_summary(result, request)
    if result.status == "interrupted":
        warn(f"Interrupted at t = {result.time[-1]:.6g} s.")
        click.get_current_context().exit(INTERRUPTED)


def run_of(request: Request) -> Result:
    """Return the run of a scene; what came before an error is kept where that was asked for."""
    scene, name = prepare(request.scene, request.settings, request.start_values)
    check_applies(scene, request.form, request.level, request.orientation)
    assembly = assemble(scene, name=name, **request.of(assemble))
    if getattr(request, "view", None) is not None:
        from atwood.plotting.camera import check_view

        check_view(assembly.mechanism.space.name, request.view)
    monitor = None
    if getattr(request, "conserved", False):
        from atwood.theory.symmetry.conserved import conserved

        monitor = conserved(assembly)
    t_start, t_end = assembly.flat.t_start, assembly.flat.t_end if request.t_end is None else request.t_end

    def share(t: float) -> tuple[float, str]:
        return (t - t_start) / (t_end - t_start), f"t = {t:.3g} s"

    try:
        with progress_bar(request.progress and t_end > t_start, name, share) as progress:
            return simulate(assembly, **request.of(simulate, _OF_ASSEMBLY), monitor=monitor, progress=progress)
    except AtwoodError as error:
        _keep_what_came_before(error, request)
        raise


def _keep(result: Result, request: Request) -> None:
    """Save, plot and draw a run, if that was asked for."""
    by_part = request.energy == "parts"
    if request.save is not None and by_part:
        _save_with_energies(result, request.save)
    elif request.save is not None:
        result.save(request.save)
    if request.plot is not None and by_part:
        from atwood.plotting.plots.energies import plot_energies

        plot_energies(result, request.plot)
    elif request.plot is not None:
        result.plot(file=request.plot)
    if request.draw is not None:
        _draw(result, request.draw, request.view)


def _save_with_energies(result: Result, file: Path) -> None:
    """Save all trajectories, and the energies of components with them."""
    from atwood.result.about import describe_all
    from atwood.result.files import SavedResult, write_trajectories

    more = result.energy.parts.trajectories()
    units = {path: result.unit(path) for path in result.paths} | dict(more.units)
    meanings = {path: result.describe(path) for path in result.paths} | dict(more.meanings)
    found = {**result.table(), **more.quantities}
    write_trajectories(SavedResult(result.time, found, units, meanings, describe_all(result)), file)


def _keep_what_came_before(error: AtwoodError, request: Request) -> None:
    """Save, plot and draw what came before an error, if that was asked for, and say so."""
    made = getattr(error, "run", None)
    if not hasattr(request, "save"):
        return
    files = [str(file) for file in (request.save, request.plot, request.draw) if file is not None]
    if made is None or not files:
        return
    result = Result(made)
    try:
        _keep(result, request)
    except AtwoodError as other:  # the first error says more
        warn(f"What came before could not be kept: {other}")
        return
    warn(f"What came before, up to t = {result.time[-1]:.6g} s, is in {' and '.join(files)}.")


def _check_results(file: Path) -> None:
    from atwood.result.files import check_target

    check_target(file)


def _check_drawing(file: Path) -> None:
    from atwood.plotting.canvas import ANIMATED, SUFFIXES, check_picture
    from atwood.plotting.moving import check_moving

    check_moving(file) if file.suffix.lower() in ANIMATED else check_picture(file, (*SUFFIXES, *ANIMATED))


def _draw(result: Result, file: Path, view: str | None) -> None:
    """Draw the mechanism at a few times, or moving; the suffix says which."""
    from atwood.plotting import animate, plot_mechanism
    from atwood.plotting.canvas import ANIMATED

    if file.suffix.lower() in ANIMATED:
        animate(result, file, view=view)
    else:
        plot_mechanism(result, file, view=view)


def run_data(result: Result, request: Request) -> dict[str, Any]:
    """Return a run as plain data."""
    from atwood.result.about import describe_run

    data = describe_run(result)
    asked = {**data.pop("asked"), "set": list(request.settings)}
    assembly = result.assembly
    coordinates = [one.name for one in assembly.own_equations.names]
    if request.energy == "parts":
        data["energy"] |= {"parts": result.energy.parts.to_dict()}
    return {
        **{key: data.pop(key) for key in ("scene", "form", "level")},
        "degrees_of_freedom": degrees_of_freedom(result),
        "coordinates": coordinates,
        "speeds": [one.name for one in assembly.own_equations.speed_names],
        "multipliers": multiplier_labels(result),
        "states": result.first_plan.program.size,
        "solver": data.pop("solver"),
        "immobile": None if result.immobile is None else result.immobile.to_dict(),
        "placement": result.initialization.to_dict(),
        "start": result.at(0),
        "end": result.at(-1),
        "energy": data.pop("energy"),
        "constraint_max": data.pop("constraint_max"),
        **data,
        **({} if request.accuracy is None else {"accuracy": result.accuracy.to_data()}),
        "asked": asked,
        **({"timings": dict(result.timings)} if request.timings else {}),
    }


def degrees_of_freedom(result: Result) -> int:
    """Return the degrees of freedom of the scene at its start."""
    plan = result.first_plan
    return len(plan.assembly.own_equations.speeds) - plan.finding.rank


def multiplier_labels(result: Result) -> list[str]:
    """Return the constraints whose multipliers are in the solver's vector, by label."""
    assembly: Assembly = result.assembly
    plan = result.first_plan
    if assembly.form == "reduced":
        return []
    constraints = assembly.own_equations.constraints
    return [constraints[i].label for i in plan.finding.kept]


_MORE = {
    "conserved": (FLAG, False),
    "energy": (one_of(("total", "parts")), "total"),
    "timings": (FLAG, False),
    "plot": PICTURE,
    "save": written_as(_check_results),
    "progress": (FLAG, True),
    "draw": written_as(_check_drawing),
    "view": (replace(TEXT, word="AZ,EL"), None),
}
COMMAND = command("run", run_scene, simulate, assemble, leave=("name", "samples"), more=_MORE)
