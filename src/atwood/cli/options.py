"""Arguments and options that several commands take."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from atwood.integrators.methods import AUTO, METHODS

__all__ = [
    "DIRECTORY",
    "FILE",
    "FORM",
    "LEVEL",
    "ORIENTATION",
    "SCENE_HELP",
    "SOLVER",
    "options_of_any_scene",
    "scene_options",
]

F = TypeVar("F", bound=Callable[..., Any])

SCENE_HELP = """SCENE is the name of a scene of an installed library (see `atwood list`), or FILE.py:NAME, where NAME
is a Scene class, a scene, or a function that returns one."""

ORIENTATION = click.option(
    "--orientation",
    default="quaternion",
    show_default=True,
    metavar="NAME",
    help="Coordinates of orientations in space: quaternion, or Euler angles such as euler-zyz.",
)

FORM = click.Choice(["reduced", "dae"])
LEVEL = click.Choice(["ggl", "index1", "index1-projected"])
SOLVER = click.Choice([AUTO, *METHODS])
FILE = click.Path(dir_okay=False, path_type=Path)
DIRECTORY = click.Path(file_okay=False, path_type=Path)


def scene_options(function: F) -> F:
    """Add the scene, and what changes it."""
    return _with_scene(function, True)


def options_of_any_scene(function: F) -> F:
    """Add the same where the scene may be left out."""
    return _with_scene(function, False)


def _with_scene(function: F, required: bool) -> F:
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
        click.argument("scene", required=required),
    ):  # fmt: skip
        function = option(function)
    return function
