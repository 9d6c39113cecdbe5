"""The commands, with their arguments and options."""

from __future__ import annotations

import os
import sys
from typing import Any

import click

from atwood.cli.errors import FAILED, reporting_errors
from atwood.cli.options import (
    DIRECTORY,
    FILE,
    FORM,
    LEVEL,
    ORIENTATION,
    SCENE_HELP,
    SOLVER,
    options_of_any_scene,
    scene_options,
)
from atwood.errors import near_matches
from atwood.tolerances import tolerances

__all__ = ["main"]


def _version(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        import atwood

        click.echo(f"atwood {atwood.__version__}")
        ctx.exit()


_THEORY = ("conserved", "equations", "equilibria", "linearize", "modes", "phase")
"""Commands that are loaded when they are called, or listed."""


class _Commands(click.Group):
    """Commands whose output may have no place to go to."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return their names."""
        return sorted([*super().list_commands(ctx), *_THEORY])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that is called, or say which there are that are called nearly so."""
        near = near_matches(args[0], self.list_commands(ctx))
        if args[0] not in self.list_commands(ctx) and near:
            ctx.fail(f"No such command {args[0]!r}. Did you mean {' or '.join(map(repr, near))}?")
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command by its name."""
        if cmd_name not in _THEORY:
            return super().get_command(ctx, cmd_name)
        from atwood.cli.theory.commands import COMMANDS

        return COMMANDS[cmd_name]

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run; standard output that is full, or closed, ends it with an exit code and no traceback."""
        try:
            try:
                return super().main(*args, **extra)
            finally:
                sys.stdout.flush()
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left in its buffer goes nowhere
            if not isinstance(error, BrokenPipeError):
                problem = f"it cannot be written ({error.strerror or error})"
                click.echo(
                    f"Error: {error.filename or 'standard output'}: {problem}. Write to another place.", err=True
                )
            sys.exit(FAILED)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version, help="Show the version.")
def main() -> None:
    """Mechanics from parts: what moves, how it moves, and with which forces.

    \b
    atwood list                          the scenes there are
    atwood list --parts                  the parts they are made of
    atwood info four-bar                 bodies, joints, freedom, equations
    atwood info Pivot                    connectors, parameters, quantities
    atwood equations double-pendulum     its equations of motion, as in a textbook
    atwood conserved pendulum-on-cart    what its motion conserves
    atwood run double-pendulum           its motion and its forces
    atwood compare double-pendulum       what each form costs for which error
    atwood sweep double-pendulum --vary mass2=0.5:2:16
    atwood equilibria pendulum-on-cart   where it can stay at rest, and whether it does
    atwood modes double-pendulum         frequencies and shapes of small oscillations
    atwood linearize pendulum-on-cart    its linear model, for control
    atwood phase simple-pendulum         its motions over coordinate and speed
    atwood check my_parts.py             whether components of one's own are sound
    """  # noqa: D301 - click reads the backspace, not the two letters


@main.command("list", short_help="List the scenes of the installed libraries.")
@click.option("--parts", is_flag=True, help="List the parts instead: bodies, joints, forces, sensors.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output.")
@reporting_errors
def list_command(parts: bool, as_json: bool) -> None:
    """List the scenes of the installed libraries, or the parts that they are made of."""
    if parts:
        from atwood.cli.parts import list_parts

        list_parts(as_json)
        return
    from atwood.cli.listing import list_scenes

    list_scenes(as_json)


@main.command("info", short_help="Say what a scene is made of, before any run.", epilog=SCENE_HELP)
@scene_options
@click.option("--moved", is_flag=True, help="Show in full what the start moved from where it was guessed.")
@ORIENTATION
@reporting_errors
def info_command(
    scene: str, settings: tuple[str, ...], starts: tuple[str, ...], as_json: bool, moved: bool, orientation: str
) -> None:
    """Say what SCENE is made of: bodies, joints, freedom, constraints, and what its equations cost.

    With the name of a part, such as Pivot, or what textbooks or Modelica call it, such as Revolute: its connectors,
    parameters, inputs and quantities.
    """
    from atwood.cli.info import show_info
    from atwood.cli.parts import is_a_part, show_part

    if is_a_part(scene):
        show_part(scene, as_json, changed=bool(settings or starts or moved))
        return

    show_info(scene, settings, starts, as_json, moved, orientation)


@main.command("run", short_help="Simulate a scene.", epilog=SCENE_HELP)
@scene_options
@click.option("--form", type=FORM, default="reduced", show_default=True, help="Constraints eliminated, or kept.")
@click.option("--level", type=LEVEL, default="ggl", show_default=True, help="Level of the constraints of the dae form.")
@ORIENTATION
@click.option("--t-end", type=float, help="Time of the end, s; the scene's own if not given.")
@click.option(
    "--rtol", type=float, default=tolerances.RTOL, show_default=True, help="Relative tolerance of the solver."
)
@click.option("--atol", type=float, help="Absolute tolerance, as a share of the scene's sizes; as --rtol if not given.")
@click.option(
    "--solver",
    type=SOLVER,
    default="auto",
    show_default=True,
    help="IDA with compiled equations, or through scikit-sundae with equations in Python; or an explicit method: "
    "Runge-Kutta, or Taylor series.",
)
@click.option("--outputs", type=click.IntRange(min=2), default=201, show_default=True, help="Number of output times.")
@click.option("--max-steps", type=click.IntRange(min=1), help="Stop after so many steps.")
@click.option("--max-seconds", type=click.FloatRange(min=0.0, min_open=True), help="Stop after so many seconds.")
@click.option("--max-step", type=click.FloatRange(min=0.0, min_open=True), help="The largest step, s.")
@click.option("--first-step", type=click.FloatRange(min=0.0, min_open=True), help="The first step, s.")
@click.option("--order", type=click.Choice(["2", "4", "6", "8", "10", "12"]), help="Order of gauss and composition.")
@click.option("--step", type=click.FloatRange(min=0.0, min_open=True), help="Step of gauss and composition, s.")
@click.option("--structure", is_flag=True, help="Nothing needs to move: it is a truss.")
@click.option(
    "--until",
    multiple=True,
    metavar="CONDITION",
    help="Stop where a quantity passes a value, as 'rod1.angle crosses 30 deg' (or rises above, falls below).",
)
@click.option("--record", multiple=True, metavar="CONDITION", help="Note when that happens, and go on.")
@click.option(
    "--accuracy",
    type=click.FloatRange(min=1e-15, max=0.1),
    help="Largest error of the motion, of positions relative to the scene's extent and of angles; tolerances follow.",
)
@click.option(
    "--nominal",
    multiple=True,
    metavar="PATH=SIZE",
    help="Size beside which errors of a quantity are small, such as slider.displacement='1 mm'. Can be repeated.",
)
@click.option("--conserved", is_flag=True, help="Show by how much what the scene conserves drifts along the run.")
@click.option(
    "--energy",
    type=click.Choice(["total", "parts"]),
    default="total",
    show_default=True,
    help="Energy as a whole, or by component and connector: shown, with --json, in the file of --save, and as --plot.",
)
@click.option("--timings", is_flag=True, help="Show what each stage from the scene to the motion took.")
@click.option("--plot", type=FILE, help="Save a plot; the suffix says how (.png, .svg, .pdf).")
@click.option("--draw", type=FILE, help="Save a picture of the mechanism (.png, .svg, .pdf), or its motion (.gif).")
@click.option(
    "--view", metavar="AZ,EL", help="From where a scene in space is drawn: azimuth and elevation, degrees.  [30,20]"
)
@click.option("--save", type=FILE, help="Save all trajectories (.nc, .npz, .mat or .csv).")
@click.option("--progress/--no-progress", default=True, help="Show progress where there is a terminal.")
@reporting_errors
def run_command(scene: str, as_json: bool, **options: Any) -> None:
    """Simulate SCENE, and show where it ends and how accurate that is."""
    from atwood.cli.running import RunRequest, run_scene

    run_scene(RunRequest(scene=scene, as_json=as_json, **options))


@main.command("compare", short_help="Compare what each form costs for which error.", epilog=SCENE_HELP)
@options_of_any_scene
@click.option("--t-end", type=float, help="Time of the end, s; the scene's own if not given.")
@click.option(
    "--rtol", "rtols", type=float, multiple=True, help="Relative tolerance; can be repeated.  [default: 1e-4 to 1e-10]"
)
@click.option(
    "--max-seconds", type=click.FloatRange(min=0.0, min_open=True), help="Give up a run after so many seconds."
)
@click.option("--plot", type=FILE, help="Save a work-precision diagram; the suffix says how (.png, .svg, .pdf).")
@click.option("--save", type=FILE, help="Save all figures, and on what they were measured (.csv).")
@click.option(
    "--long",
    "periods",
    type=click.IntRange(min=10, max=1_000_000),
    metavar="PERIODS",
    help="Compare instead how energy and what else is conserved drift over so many periods, by method.",
)
@click.option("--all", "every", is_flag=True, help="Compare all scenes of the installed libraries, one after another.")
@click.option(
    "--html",
    type=DIRECTORY,
    help="Write a page with tables and pictures within it, and all figures as CSV, to this directory.",
)
@click.option("--progress/--no-progress", default=True, help="Show progress where there is a terminal.")
@reporting_errors
def compare_command(scene: str | None, as_json: bool, **options: Any) -> None:
    """Run SCENE in both forms, at several tolerances, against a far more accurate reference."""
    from atwood.cli.comparing import CompareRequest, compare_scene

    compare_scene(CompareRequest(scene=scene, as_json=as_json, **options))


@main.command("sweep", short_help="Simulate a scene with many parameters and starts.", epilog=SCENE_HELP)
@scene_options
@click.option(
    "--vary",
    multiple=True,
    metavar="PATH=VALUES",
    help="Values of a parameter: rod1.length=0.5:2:16 (from, to, how many), or mass2='1,2,5 kg'. Can be repeated.",
)
@click.option(
    "--vary-start",
    multiple=True,
    metavar="PATH=VALUES",
    help="Values of a start value, such as rod1.angle=0:90:10deg. Can be repeated.",
)
@click.option(
    "--combine",
    type=click.Choice(["grid", "list"]),
    default="grid",
    show_default=True,
    help="Every value with every other, or the first of each, the second of each, and so on.",
)
@click.option(
    "--quantity",
    "quantities",
    multiple=True,
    metavar="PATH",
    help="What to keep, such as bob2.position.x; the coordinates if not given. Can be repeated.",
)
@click.option("--form", type=FORM, default="reduced", show_default=True, help="Constraints eliminated, or kept.")
@click.option("--level", type=LEVEL, default="ggl", show_default=True, help="Level of the constraints of the dae form.")
@click.option("--t-end", type=float, help="Time of the end, s; the scene's own if not given.")
@click.option(
    "--rtol", type=float, default=tolerances.RTOL, show_default=True, help="Relative tolerance of the solver."
)
@click.option("--solver", type=SOLVER, default="auto", show_default=True, help="As for `atwood run`.")
@click.option("--accuracy", type=click.FloatRange(min=1e-15, max=0.1), help="Largest error of each motion, as for run.")
@click.option("--outputs", type=click.IntRange(min=2), help="Number of output times; the end alone if not given.")
@click.option("--max-steps", type=click.IntRange(min=1), help="Stop a run after so many steps.")
@click.option("--max-seconds", type=click.FloatRange(min=0.0, min_open=True), help="Stop a run after so many seconds.")
@click.option(
    "--threads", type=click.IntRange(min=1), help="How many threads share the runs.  [default: all processors]"
)
@click.option("--plot", type=FILE, help="Save a picture of the ends; the suffix says how (.png, .svg, .pdf).")
@click.option("--save", type=FILE, help="Save all quantities of all runs (.nc, .npz, .mat, .csv or .json).")
@click.option("--progress/--no-progress", default=True, help="Show progress where there is a terminal.")
@reporting_errors
def sweep_command(scene: str, as_json: bool, **options: Any) -> None:
    """Simulate SCENE with many parameters and starts, and show where the runs end."""
    from atwood.cli.sweeping import SweepRequest, sweep_scene

    sweep_scene(SweepRequest(scene=scene, as_json=as_json, **options))


@main.command("check", short_help="Check components of one's own.")
@click.argument("target", metavar="TARGET")
@click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output.")
@click.option("--run/--no-run", default=True, help="Also run them on a test bench, in both forms: about a second each.")
@reporting_errors
def check_command(target: str, as_json: bool, run: bool) -> None:
    """Check the components of TARGET as the parts of the library are checked.

    TARGET is FILE.py for all components that the file defines, FILE.py:NAME for one, or the name of a library's part.
    Units of laws, joints against constraints, forces against energies, observables, both forms, all spaces. The exit
    code is 1 if something is wrong.
    """
    from atwood.cli.checking import check_components

    check_components(target, as_json, run)
