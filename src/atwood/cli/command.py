"""Commands made of functions: options, their checks and their help come from tables of kinds and from docstrings.

`takes` puts a table of kinds before each public function. An option of the command line is an argument with a kind
that text can say; its help is what the docstring says of the argument, and its default that of the function.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click

from atwood.arguments import FILE, TEXT, Kind, Refused, check
from atwood.cli.errors import reporting_errors
from atwood.cli.scenes import pairs
from atwood.docstrings import documented, first_sentence, without_marks
from atwood.errors import UsageError
from atwood.lazy_dataclasses import replace

SCENE_HELP = """SCENE is the name of a scene of an installed library (see `atwood list`), or FILE.py:NAME, where NAME
is a Scene class, a scene, or a function that returns one."""

_COMMON = {
    "settings": ("--set", "Parameter, such as rod1.length='30 cm'."),
    "start_values": ("--start", "Start value, such as rod1.angle='30 deg'; =free lets one go that the scene fixes."),
}
"""Options of all commands that take a scene."""


def written_as(check_file: Callable[[Path], object], word: str = "FILE") -> tuple[Kind, Any]:
    """Return an option that names a file, which is refused before any work is done where it could not be written."""

    def read(value: Any) -> Any:
        file: Path = FILE.read(value)
        check_file(file)
        return file

    return replace(FILE, read=read, word=word), None


def _check_picture(file: Path) -> None:
    from atwood.plotting.canvas import check_picture  # few runs draw

    check_picture(file)


PICTURE = written_as(_check_picture)
"""The option of a picture."""

_OR_NONE = ", or None."
"""What an argument may be in Python alone."""


class Request(SimpleNamespace):
    """What was asked for on the command line, by the names of arguments."""

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)

    def of(self, function: Callable[..., Any], leave: Collection[str] = ()) -> dict[str, Any]:
        """Return the arguments of a function that were asked for."""
        known = vars(self)
        leave = {*leave, "scene", "progress"}
        return {name: known[name] for name in kinds_of(function) if name in known and name not in leave}


def kinds_of(function: Callable[..., Any]) -> Mapping[str, Kind]:
    """Return the table of kinds of a function."""
    found: Mapping[str, Kind] = getattr(function, "kinds", {})
    return found


def command(
    name: str,
    run: Callable[[Request], None],
    *functions: Callable[..., Any],
    argument: str = "scene",
    is_required: bool = True,
    leave: Collection[str] = (),
    more: Mapping[str, tuple[Kind, Any]] | None = None,
    names: Mapping[str, str] | None = None,
) -> click.Command:
    """Return the command that runs with what was asked for."""
    params: list[click.Parameter] = []
    if argument:
        params.append(click.Argument([argument], required=is_required))
    for key, (option, text) in _COMMON.items() if argument == "scene" else ():
        params.append(_Option([option, key], multiple=True, metavar="PATH=VALUE", help=f"{text} Can be repeated."))
    json = "Write JSON, and nothing else, to standard output."
    params.append(_Option(["--json", "as_json"], is_flag=True, help=json))
    table: dict[str, tuple[Kind, Any]] = {}
    for function in functions:
        signature = inspect.signature(function).parameters
        for key, kind in kinds_of(function).items():
            default = signature[key].default
            if kind.word and key not in (*leave, "scene"):
                known = table.get(key, (kind, default))
                table[key] = (known[0], default if known[1] is None else known[1])
    table |= more or {}
    told = (run, *functions)
    called_so = {key: f"--{_singular(key) if kind.is_many else key}" for key, (kind, _) in table.items()}
    called_so |= {key: "--starts" for key, option in called_so.items() if option == "--start"} | dict(names or {})
    params += [_option(key, kind, default, told, called_so[key]) for key, (kind, default) in table.items()]

    @reporting_errors
    def called(**typed: Any) -> None:
        texts = {key: typed.pop(key) for key in options}
        read = {key: _read(texts[key], kind, option) for key, (kind, option) in options.items()}
        for key in own:
            if read[key] is not None:
                read[key] = check(options[key][0], read[key], options[key][1])
        try:
            run(Request(**typed, **read, typed=texts))
        except UsageError as error:
            name = error.message.partition(" cannot be ")[0]
            if error.where not in callers or name not in options:
                raise
            message, advice = error.message.replace(name, options[name][1], 1), error.advice.replace(_OR_NONE, ".")
            raise UsageError(message, advice=advice) from None

    own, callers = dict(more or {}), {one.__qualname__ for one in functions}
    options = {one.name: (table[one.name][0], one.opts[0]) for one in params if one.name in table}
    text = inspect.cleandoc(run.__doc__ or "").partition("\n\nParameters\n")[0]
    return click.Command(
        name,
        callback=called,
        params=params,
        help=re.sub("^Return ", "Show ", without_marks(text)),
        epilog=SCENE_HELP if argument == "scene" else None,
    )


class _Option(click.Option):
    """An option whose help is read from docstrings when it is shown."""

    told: Sequence[Callable[..., Any]] = ()

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option as it is written, and what is said of it."""
        if self.help is None:
            text = next((found for one in self.told if (found := documented(one).get(self.name or ""))), "")
            self.help = f"{first_sentence(text)} Can be repeated." if self.multiple else first_sentence(text)
        return super().get_help_record(ctx)


class _Typed(click.ParamType):  # type: ignore[type-arg]  # generic in the newest click alone
    """The type of what a kind reads."""

    def __init__(self, kind: Kind) -> None:
        self.kind, self.name = kind, kind.word.lower()

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return what was typed, or refuse it."""
        try:
            return _typed(self.kind, value, param.opts[0] if param is not None else "")
        except (Refused, ValueError) as error:
            said = str(error) if isinstance(error, Refused) else ""
            advice = f"{said} Give {self.kind.what}.".replace(_OR_NONE, ".").strip()
            self.fail(f"{value!r} will not do. {advice}", param, ctx)
        except UsageError:
            return value  # it is read again where errors are reported


def _typed(kind: Kind, value: Any, where: str) -> Any:
    """Return what a kind makes of what was typed; an error says where it was."""
    try:
        return kind.typed(value) if isinstance(value, str) else value
    except UsageError as error:
        raise UsageError(error.message, where=where, advice=error.advice) from None


def _typed_again(kind: Kind, value: str, where: str) -> Any:
    """Return what a kind makes of one of several texts, or refuse it."""
    try:
        return _typed(kind, value, where)
    except (Refused, ValueError):
        raise UsageError(f"{value!r} will not do", where=where, advice=f"Write {kind.word}.") from None


def _option(name: str, kind: Kind, default: Any, told: Sequence[Callable[..., Any]], called: str) -> click.Option:
    """Return the option of an argument."""
    option = called.replace("_", "-")
    settings: dict[str, Any] = {"show_default": default not in (None, (), False, inspect.Parameter.empty)}
    if kind.word == "FLAG":
        declared = f"{option}/--no-{option[2:]}" if default else option
        settings |= {"is_flag": True, "show_default": False}
    else:
        declared, is_short = option, len(kind.words) in range(1, _SHORT)
        settings["metavar"] = f"[{'|'.join(kind.words)}]" if is_short else kind.word
        settings["type"] = click.Choice(kind.words) if is_short else _Typed(TEXT if kind.is_many else kind)
        settings["multiple"] = kind.is_many
    if default is inspect.Parameter.empty:
        settings["required"] = True
    elif not kind.is_many:
        settings["default"] = default if not kind.words or default is None else str(default)
    made = _Option([*declared.split(","), name], **settings)
    made.told = told
    return made


_SHORT = 10
"""Of so many words a list is too long to be shown with an option."""


def _singular(name: str) -> str:
    return re.sub("ies$", "y", name) if name.endswith("ies") else name.removesuffix("s")


def _read(typed: Any, kind: Kind, option: str) -> Any:
    """Return what was typed as a function takes it; nothing of what can be repeated is what is usual."""
    if kind.is_many and "=" in kind.word and not any(sign in kind.word for sign in ",["):
        return {path: _typed_again(kind, text, f"{option} {path}") for path, text in pairs(typed, option)} or None
    if kind.is_many:
        return [_typed_again(kind, one, option) for one in typed] or None
    return _typed(kind, typed, option)
