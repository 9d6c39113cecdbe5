"""The commands, with their arguments and options."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from atwood.cli.errors import FAILED, reporting_errors
from atwood.tolerances import tolerances

__all__ = ["main"]

F = TypeVar("F", bound=Callable[..., Any])

_SCENE_HELP = """SCENE is the name of a scene of an installed library (see `atwood list`), or FILE.py:NAME, where NAME
is a Scene class, a scene, or a function that returns one."""


def _version(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        import atwood

        click.echo(f"atwood {atwood.__version__}")
        ctx.exit()


class _Commands(click.Group):
    """Commands whose output may have no place to go to."""

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


def _scene_options(function: F) -> F:
    """Add the scene, and what changes it."""
    for option in (
        click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output."),
        click.option(
            "--start", "starts", multiple=True, metavar="PATH=VALUE",
            help="Start value, such as rod1.angle='30 deg'; =free lets one go that the scene fixes. Can be repeated.",
        ),
        click.option(
            "--set", "settings", multiple=True, metavar="PATH=VALUE",
            help="Parameter, such as rod1.length='30 cm'. Can be repeated.",
        ),
        click.argument("scene"),
    ):  # fmt: skip
        function = option(function)
    return function


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


_ORIENTATION = click.option(
    "--orientation",
    default="quaternion",
    show_default=True,
    metavar="NAME",
    help="Coordinates of orientations in space: quaternion, or Euler angles such as euler-zyz.",
)


@main.command("info", short_help="Say what a scene is made of, before any run.", epilog=_SCENE_HELP)
@_scene_options
@click.option("--moved", is_flag=True, help="Show in full what the start moved from where it was guessed.")
@_ORIENTATION
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


_FORM = click.Choice(["reduced", "dae"])
_LEVEL = click.Choice(["ggl", "index1", "index1-projected"])
_SOLVER = click.Choice(["auto", "ida", "ida-sundae", "explicit", "taylor", "gauss"])
_FILE = click.Path(dir_okay=False, path_type=Path)


@main.command("run", short_help="Simulate a scene.", epilog=_SCENE_HELP)
@_scene_options
@click.option("--form", type=_FORM, default="reduced", show_default=True, help="Constraints eliminated, or kept.")
@click.option(
    "--level", type=_LEVEL, default="ggl", show_default=True, help="Level of the constraints of the dae form."
)
@_ORIENTATION
@click.option("--t-end", type=float, help="Time of the end, s; the scene's own if not given.")
@click.option(
    "--rtol", type=float, default=tolerances.RTOL, show_default=True, help="Relative tolerance of the solver."
)
@click.option("--atol", type=float, help="Absolute tolerance, as a share of the scene's sizes; as --rtol if not given.")
@click.option(
    "--solver",
    type=_SOLVER,
    default="auto",
    show_default=True,
    help="IDA with compiled equations, or through scikit-sundae with equations in Python; or an explicit method: "
    "Runge-Kutta, or Taylor series.",
)
@click.option("--outputs", type=click.IntRange(min=2), default=201, show_default=True, help="Number of output times.")
@click.option("--max-steps", type=click.IntRange(min=1), help="Stop after so many steps.")
@click.option("--max-seconds", type=click.FloatRange(min=0.0, min_open=True), help="Stop after so many seconds.")
@click.option("--max-step", type=click.FloatRange(min=0.0, min_open=True), help="The largest step, s.")
@click.option("--order", type=click.Choice(["2", "4", "6", "8", "10", "12"]), help="With --solver gauss: its order.")
@click.option("--step", type=click.FloatRange(min=0.0, min_open=True), help="With --solver gauss: its step, s.")
@click.option("--structure", is_flag=True, help="Nothing needs to move: it is a truss.")
@click.option(
    "--until",
    multiple=True,
    metavar="CONDITION",
    help="Stop where a quantity passes a value, as 'rod1.angle crosses 30 deg' (or rises above, falls below).",
)
@click.option("--record", multiple=True, metavar="CONDITION", help="Note when that happens, and go on.")
@click.option("--conserved", is_flag=True, help="Show by how much what the scene conserves drifts along the run.")
@click.option("--timings", is_flag=True, help="Show what each stage from the scene to the motion took.")
@click.option("--plot", type=_FILE, help="Save a plot; the suffix says how (.png, .svg, .pdf).")
@click.option("--draw", type=_FILE, help="Save a picture of the mechanism (.png, .svg, .pdf), or its motion (.gif).")
@click.option(
    "--view", metavar="AZ,EL", help="From where a scene in space is drawn: azimuth and elevation, degrees.  [30,20]"
)
@click.option("--save", type=_FILE, help="Save all trajectories (.nc, .npz, .mat or .csv).")
@click.option("--progress/--no-progress", default=True, help="Show progress where there is a terminal.")
@reporting_errors
def run_command(scene: str, as_json: bool, **options: Any) -> None:
    """Simulate SCENE, and show where it ends and how accurate that is."""
    from atwood.cli.running import RunRequest, run_scene

    run_scene(RunRequest(scene=scene, as_json=as_json, **options))


@main.command("equations", short_help="Write the equations of motion of a scene.", epilog=_SCENE_HELP)
@_scene_options
@click.option("--form", type=_FORM, default="reduced", show_default=True, help="Constraints eliminated, or kept.")
@_ORIENTATION
@click.option("--values", is_flag=True, help="Put the values of parameters in place of their symbols.")
@click.option("--latex", is_flag=True, help="Write the equations of motion in LaTeX.")
@click.option("--markdown", is_flag=True, help="Write a page: symbols, energies, momenta, equations, matrices.")
@click.option("--python", is_flag=True, help="Write a module of Python that computes them.")
@click.option("--hamiltonian", is_flag=True, help="Write the Hamiltonian and the momenta instead.")
@reporting_errors
def equations_command(scene: str, as_json: bool, **options: Any) -> None:
    """Write the equations of motion of SCENE: Lagrange's equations, with symbols as in a textbook.

    In space, --orientation euler-zxz gives them in Euler angles; else angular velocities are in the axes of the body.
    """
    from atwood.cli.equations import EquationsRequest, show_equations

    show_equations(EquationsRequest(scene=scene, as_json=as_json, **options))


@main.command("conserved", short_help="List what a scene conserves, and how that is known.", epilog=_SCENE_HELP)
@_scene_options
@_ORIENTATION
@reporting_errors
def conserved_command(
    scene: str, settings: tuple[str, ...], starts: tuple[str, ...], as_json: bool, orientation: str
) -> None:
    """List what is conserved along all motions of SCENE: momenta, energy function, boosts; proven or checked.

    In space, --orientation euler-zxz gives momenta of Euler angles.
    """
    from atwood.cli.conserved import show_conserved

    show_conserved(scene, settings, starts, as_json, orientation)


@main.command("compare", short_help="Compare what each form costs for which error.", epilog=_SCENE_HELP)
@_scene_options
@click.option("--t-end", type=float, help="Time of the end, s; the scene's own if not given.")
@click.option(
    "--rtol", "rtols", type=float, multiple=True, help="Relative tolerance; can be repeated.  [default: 1e-4 to 1e-10]"
)
@click.option(
    "--max-seconds", type=click.FloatRange(min=0.0, min_open=True), help="Give up a run after so many seconds."
)
@click.option("--plot", type=_FILE, help="Save a work-precision diagram; the suffix says how (.png, .svg, .pdf).")
@click.option("--progress/--no-progress", default=True, help="Show progress where there is a terminal.")
@reporting_errors
def compare_command(scene: str, as_json: bool, **options: Any) -> None:
    """Run SCENE in both forms, at several tolerances, against a far more accurate reference."""
    from atwood.cli.comparing import CompareRequest, compare_scene

    compare_scene(CompareRequest(scene=scene, as_json=as_json, **options))


@main.command("sweep", short_help="Simulate a scene with many parameters and starts.", epilog=_SCENE_HELP)
@_scene_options
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
@click.option("--form", type=_FORM, default="reduced", show_default=True, help="Constraints eliminated, or kept.")
@click.option(
    "--level", type=_LEVEL, default="ggl", show_default=True, help="Level of the constraints of the dae form."
)
@click.option("--t-end", type=float, help="Time of the end, s; the scene's own if not given.")
@click.option(
    "--rtol", type=float, default=tolerances.RTOL, show_default=True, help="Relative tolerance of the solver."
)
@click.option("--solver", type=_SOLVER, default="auto", show_default=True, help="As for `atwood run`.")
@click.option("--outputs", type=click.IntRange(min=2), help="Number of output times; the end alone if not given.")
@click.option("--max-steps", type=click.IntRange(min=1), help="Stop a run after so many steps.")
@click.option("--max-seconds", type=click.FloatRange(min=0.0, min_open=True), help="Stop a run after so many seconds.")
@click.option(
    "--threads", type=click.IntRange(min=1), help="How many threads share the runs.  [default: all processors]"
)
@click.option("--plot", type=_FILE, help="Save a picture of the ends; the suffix says how (.png, .svg, .pdf).")
@click.option("--save", type=_FILE, help="Save all quantities of all runs (.nc, .npz, .mat, .csv or .json).")
@click.option("--progress/--no-progress", default=True, help="Show progress where there is a terminal.")
@reporting_errors
def sweep_command(scene: str, as_json: bool, **options: Any) -> None:
    """Simulate SCENE with many parameters and starts, and show where the runs end."""
    from atwood.cli.sweeping import SweepRequest, sweep_scene

    sweep_scene(SweepRequest(scene=scene, as_json=as_json, **options))


def _state_options(function: F) -> F:
    """Add the scene, its parameters, and the state about which it is looked at."""
    for option in (
        click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output."),
        click.option(
            "--at", multiple=True, metavar="PATH=VALUE",
            help="The state, such as rod.angle='180 deg' or wheel.angular_velocity=3: speeds that are not named are "
            "zero. The scene's own start if not given. Can be repeated.",
        ),
        click.option(
            "--set", "settings", multiple=True, metavar="PATH=VALUE",
            help="Parameter, such as rod1.length='30 cm'. Can be repeated.",
        ),
        click.argument("scene"),
    ):  # fmt: skip
        function = option(function)
    return function


@main.command("linearize", short_help="Show the linear model of a scene about a state.", epilog=_SCENE_HELP)
@_state_options
@click.option("--input", "inputs", multiple=True, metavar="PATH", help="Input, such as push.value. Can be repeated.")
@click.option("--output", "outputs", multiple=True, metavar="PATH", help="Quantity, such as bob.position.x.")
@click.option("--form", type=_FORM, default="reduced", show_default=True, help="Whose equations are linearised.")
@click.option("--bode", type=_FILE, help="Save gain and phase over the frequency (.png, .svg, .pdf).")
@reporting_errors
def linearize_command(scene: str, **options: Any) -> None:
    """Show A, B, C, D and the eigenvalues of SCENE about rest or a steady motion."""
    from atwood.cli.linear import show_linear_model

    show_linear_model(scene, **options)


@main.command("modes", short_help="Show the frequencies and shapes of small oscillations.", epilog=_SCENE_HELP)
@_state_options
@click.option("--plot", type=_FILE, help="Save a picture of each mode, numbered (.png, .svg, .pdf).")
@reporting_errors
def modes_command(scene: str, **options: Any) -> None:
    """Show the normal modes of SCENE: about its start if it is at rest there, else about its stable equilibria."""
    from atwood.cli.linear import show_modes

    show_modes(scene, **options)


@main.command("equilibria", short_help="Find where a scene can stay at rest.", epilog=_SCENE_HELP)
@click.argument("scene")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Parameter. Can be repeated.")
@click.option(
    "--region",
    multiple=True,
    metavar="PATH=FROM:TO",
    help="Where to look, such as rod.angle=-90deg:90deg; everywhere if not given. Can be repeated.",
)
@click.option("--along", metavar="PATH=FROM:TO", help="Follow them while a parameter changes, SI units.")
@click.option("--plot", type=_FILE, help="With --along: save a picture of the branches (.png, .svg, .pdf).")
@click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output.")
@reporting_errors
def equilibria_command(scene: str, **options: Any) -> None:
    """Find the equilibria of SCENE, and whether they are stable."""
    from atwood.cli.linear import show_equilibria

    show_equilibria(scene, **options)


@main.command("phase", short_help="Draw the phase portrait of a scene.", epilog=_SCENE_HELP)
@click.argument("scene")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Parameter. Can be repeated.")
@click.option("--coordinates", metavar="FROM:TO", help="Range of the coordinate, with units; chosen if not given.")
@click.option("--speeds", metavar="FROM:TO", help="Range of its rate, with units; chosen if not given.")
@click.option("--plot", type=_FILE, help="Where to save the picture (.png, .svg, .pdf).")
@click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output.")
@reporting_errors
def phase_command(scene: str, **options: Any) -> None:
    """Find the states of rest and the separatrices of SCENE, and draw its motions over coordinate and speed."""
    from atwood.cli.phase import show_phase_portrait

    show_phase_portrait(scene, **options)


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
