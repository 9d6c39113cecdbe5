"""How errors reach the reader: one clear line, and an exit code."""

from __future__ import annotations

import contextlib
import functools
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any, ParamSpec

import click

from atwood.errors import AtwoodError

FAILED = 1
"""Exit code when a scene, or what was asked of it, is not sound."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells expect it."""

P = ParamSpec("P")


def reporting_errors(function: Callable[P, Any]) -> Callable[P, None]:
    """Wrap a command so that its errors are shown without a traceback."""

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> None:
        context = click.get_current_context()
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _show_warning
                function(*args, **kwargs)
        except AtwoodError as error:
            if kwargs.get("as_json"):
                _print_error(error.message, error.where, error.advice)
            click.echo(f"Error: {_one_line(str(error))}", err=True)
            context.exit(FAILED)
        except KeyboardInterrupt:
            click.echo("Interrupted.", err=True)
            context.exit(INTERRUPTED)

    return wrapped


@contextlib.contextmanager
def usage_errors_as_json(arguments: Sequence[str]) -> Iterator[None]:
    """Write what is wrong with the arguments of a command as JSON too, if they ask for it."""
    is_asked_for = "--json" in arguments
    try:
        yield
    except click.UsageError as error:
        if is_asked_for:
            command = error.ctx.command_path if error.ctx is not None else "atwood"
            _print_error(error.format_message(), command, f"Try '{command} --help'.")
        raise


def _print_error(message: str, where: str, advice: str) -> None:
    from atwood.cli.output import print_json

    print_json({"error": {"message": message, "where": where, "advice": advice}})


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Show a warning as a line of its own, without the place in the source that gave it."""
    click.echo(f"Warning: {_one_line(str(message))}", err=True)


def _one_line(text: str) -> str:
    """Return a text on one line, with arguments as options: ``at=`` is ``--at``."""
    return re.sub(r"`(\w+)=`", lambda found: f"--{found[1].replace('_', '-')}", " ".join(text.split()))
