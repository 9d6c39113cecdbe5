"""The commands, each loaded when it is called."""

from __future__ import annotations

import functools
import importlib
import os
import re
import sys
from pathlib import Path
from typing import Any, NamedTuple

import click

from atwood.cli.errors import FAILED, usage_errors_as_json
from atwood.errors import near_matches

_COMMANDS = {
    "check": ("atwood.cli.checking", "Check components of one's own."),
    "compare": ("atwood.cli.comparing", "Compare what each form costs for which error."),
    "diagram": ("atwood.cli.pages", "Draw which parts of a scene are connected where."),
    "export": ("atwood.cli.exporting", "Write a scene for other tools, as C or as an FMU."),
    "fit": ("atwood.cli.fitting", "Fit parameters and start values of a scene to measurements."),
    "info": ("atwood.cli.info", "Say what a scene is made of, before any run."),
    "list": ("atwood.cli.listing", "List the scenes of the installed libraries."),
    "page": ("atwood.cli.pages", "Write a page on which a scene moves."),
    "run": ("atwood.cli.running", "Simulate a scene."),
    "sweep": ("atwood.cli.sweeping", "Simulate a scene with many parameters and starts."),
}
"""Commands that are no functions of theory: where they are, and what they do."""

_RENAMED = {"solve-start": "solve-initial-values"}
"""Commands that had other names before, which still work."""

_THEORY = Path(__file__).parents[1] / "theory"

_FUNCTION = re.compile(
    r'^(?:@command\("(?P<name>[\w-]+)"\)\n)?@takes\((?:(?!def |class ).*\n)+?def (?P<function>[a-z]\w*)\('
    r'[^"]*(?:"(?!"")[^"]*)*?"""(?P<summary>.+?)(?:"""|\n)',
    re.MULTILINE,
)
"""A public function with a table of kinds, as it is written."""


_OF_SCENE = re.compile(r"scene=|=HAMILTONIAN|=PHASE_SPACE")
"""What is asked of a scene, or of its Hamiltonian: others take formulas alone, and are no commands."""


class TheoryFunction(NamedTuple):
    """A function of theory as a command.

    Attributes
    ----------
    module, function
        Where it is.
    summary
        What it does, in a line.
    """

    module: str
    function: str
    summary: str


@functools.cache
def theory_functions() -> dict[str, TheoryFunction]:
    """Return the public functions of theory by their commands.

    They are found by reading the sources, since to import them loads all of the engine: a function with a table of
    kinds is a command, and nothing else says so.
    """
    found = {}
    for file in sorted(_THEORY.rglob("*.py")):
        module = ".".join(("atwood", *file.relative_to(_THEORY.parent).with_suffix("").parts))
        for one in _FUNCTION.finditer(file.read_text(encoding="utf-8")):
            if not _OF_SCENE.search(one[0].partition("\ndef ")[0]):
                continue
            name = one["name"] or one["function"].replace("_", "-")
            summary = re.sub("^Return ", "Show ", one["summary"].replace("`", "").strip())
            found[name] = TheoryFunction(module, one["function"], summary)
    return found


class _Commands(click.Group):
    """Commands that are loaded when they are called, and whose output may have no place to go to."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return their names."""
        return sorted([*_COMMANDS, *theory_functions()])

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands, and those of theory in a list of their own."""
        theory = {name: one.summary for name, one in theory_functions().items()}
        own = {name: summary for name, (_, summary) in _COMMANDS.items()}
        for title, commands in (("Commands", own), ("Theory of a scene", theory)):
            with formatter.section(title):
                formatter.write_dl([(name, commands[name]) for name in sorted(commands)])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that is called, or say which there are that are called nearly so."""
        args = [_RENAMED.get(args[0], args[0]), *args[1:]]
        if args[0] not in _COMMANDS:
            near = near_matches(args[0], known := self.list_commands(ctx))
            if args[0] not in known and near:
                ctx.fail(f"No such command {args[0]!r}. Did you mean {' or '.join(map(repr, near))}?")
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command by its name."""
        if cmd_name in _COMMANDS:
            room = importlib.import_module(_COMMANDS[cmd_name][0])
            made: click.Command = room.COMMAND if hasattr(room, "COMMAND") else room.COMMANDS[cmd_name]
            return made
        known = theory_functions()
        if cmd_name not in known:
            return None
        from atwood.cli.theory import theory_command

        return theory_command(cmd_name, known[cmd_name].module, known[cmd_name].function)

    def make_context(self, info_name: str | None, args: list[str], *more: Any, **extra: Any) -> click.Context:
        """Read the options that stand before the command."""
        with usage_errors_as_json(args):
            return super().make_context(info_name, args, *more, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Call the command."""
        with usage_errors_as_json(ctx.args):
            return super().invoke(ctx)

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


def _version(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        import atwood

        click.echo(f"atwood {atwood.__version__}")
        ctx.exit()


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
    atwood page double-pendulum -o page.html    its motion in the browser, live
    atwood export double-pendulum --c folder    the scene as C; --fmu file.fmu as an FMU
    atwood compare double-pendulum       what each form costs for which error
    atwood sweep double-pendulum --vary mass2=0.5:2:16
    atwood fit double-pendulum data.csv --vary length1=0.5:2
    atwood equilibria pendulum-on-cart   where it can stay at rest, and whether it does
    atwood modes double-pendulum         frequencies and shapes of small oscillations
    atwood linearize pendulum-on-cart    its linear model, for control
    atwood phase simple-pendulum         its motions over coordinate and speed
    atwood check my_parts.py             whether components of one's own are sound
    """  # noqa: D301 - click reads the backspace, not the two letters
