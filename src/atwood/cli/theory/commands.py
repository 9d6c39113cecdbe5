"""The commands that say what theory knows of a scene: equations, conserved quantities, linear models, portraits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from atwood.cli.errors import reporting_errors
from atwood.cli.options import FILE, FORM, ORIENTATION, SCENE_HELP, scene_options

__all__ = ["COMMANDS"]

F = TypeVar("F", bound=Callable[..., Any])


@click.command("equations", short_help="Write the equations of motion of a scene.", epilog=SCENE_HELP)
@scene_options
@click.option("--form", type=FORM, default="reduced", show_default=True, help="Constraints eliminated, or kept.")
@ORIENTATION
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
    from atwood.cli.theory.equations import EquationsRequest, show_equations

    show_equations(EquationsRequest(scene=scene, as_json=as_json, **options))


@click.command("conserved", short_help="List what a scene conserves, and how that is known.", epilog=SCENE_HELP)
@scene_options
@ORIENTATION
@reporting_errors
def conserved_command(
    scene: str, settings: tuple[str, ...], starts: tuple[str, ...], as_json: bool, orientation: str
) -> None:
    """List what is conserved along all motions of SCENE: momenta, energy function, boosts; proven or checked.

    In space, --orientation euler-zxz gives momenta of Euler angles.
    """
    from atwood.cli.theory.conserved import show_conserved

    show_conserved(scene, settings, starts, as_json, orientation)


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


@click.command("linearize", short_help="Show the linear model of a scene about a state.", epilog=SCENE_HELP)
@_state_options
@click.option("--input", "inputs", multiple=True, metavar="PATH", help="Input, such as push.value. Can be repeated.")
@click.option("--output", "outputs", multiple=True, metavar="PATH", help="Quantity, such as bob.position.x.")
@click.option("--form", type=FORM, default="reduced", show_default=True, help="Whose equations are linearised.")
@click.option("--bode", type=FILE, help="Save gain and phase over the frequency (.png, .svg, .pdf).")
@reporting_errors
def linearize_command(scene: str, **options: Any) -> None:
    """Show A, B, C, D and the eigenvalues of SCENE about rest or a steady motion."""
    from atwood.cli.theory.linear import show_linear_model

    show_linear_model(scene, **options)


@click.command("modes", short_help="Show the frequencies and shapes of small oscillations.", epilog=SCENE_HELP)
@_state_options
@click.option("--plot", type=FILE, help="Save a picture of each mode, numbered (.png, .svg, .pdf).")
@reporting_errors
def modes_command(scene: str, **options: Any) -> None:
    """Show the normal modes of SCENE: about its start if it is at rest there, else about its stable equilibria."""
    from atwood.cli.theory.linear import show_modes

    show_modes(scene, **options)


@click.command("equilibria", short_help="Find where a scene can stay at rest.", epilog=SCENE_HELP)
@click.argument("scene")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Parameter. Can be repeated.")
@click.option(
    "--region",
    multiple=True,
    metavar="PATH=FROM:TO",
    help="Where to look, such as rod.angle=-90deg:90deg; everywhere if not given. Can be repeated.",
)
@click.option("--along", metavar="PATH=FROM:TO", help="Follow them while a parameter changes, SI units.")
@click.option("--plot", type=FILE, help="With --along: save a picture of the branches (.png, .svg, .pdf).")
@click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output.")
@reporting_errors
def equilibria_command(scene: str, **options: Any) -> None:
    """Find the equilibria of SCENE, and whether they are stable."""
    from atwood.cli.theory.linear import show_equilibria

    show_equilibria(scene, **options)


@click.command("phase", short_help="Draw the phase portrait of a scene.", epilog=SCENE_HELP)
@click.argument("scene")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Parameter. Can be repeated.")
@click.option("--coordinates", metavar="FROM:TO", help="Range of the coordinate, with units; chosen if not given.")
@click.option("--speeds", metavar="FROM:TO", help="Range of its rate, with units; chosen if not given.")
@click.option("--plot", type=FILE, help="Where to save the picture (.png, .svg, .pdf).")
@click.option("--json", "as_json", is_flag=True, help="Write JSON, and nothing else, to standard output.")
@reporting_errors
def phase_command(scene: str, **options: Any) -> None:
    """Find the states of rest and the separatrices of SCENE, and draw its motions over coordinate and speed."""
    from atwood.cli.theory.phase import show_phase_portrait

    show_phase_portrait(scene, **options)


_ALL = (conserved_command, equations_command, equilibria_command, linearize_command, modes_command, phase_command)
COMMANDS = {str(one.name): one for one in _ALL}
"""By name."""
