"""What went wrong, where, and what to do about it.

Every error that Atwood raises on purpose is an `AtwoodError`.  It carries three pieces: a message (what went
wrong), `where` (the component path or file the message is about) and `advice` (what the reader can do).  The
pieces stay apart as attributes, so that a program can act on them, and read as one sentence in a traceback.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

__all__ = [
    "AtwoodError",
    "ConnectError",
    "DeclarationError",
    "KernelEvaluationError",
    "ParameterError",
    "ResultError",
    "SolveError",
    "StartError",
    "TopologyError",
    "UnsupportedError",
    "UsageError",
    "check_known",
    "is_about",
    "near_matches",
    "suggestion",
    "suggestion_in_parts",
]


class AtwoodError(Exception):
    """Base of all errors that Atwood raises on purpose.

    Parameters
    ----------
    message
        What went wrong, in plain words.
    where
        What the message is about: a component path such as ``crane.rope``, or a file.
    advice
        What the reader can do about it.
    """

    def __init__(self, message: str, *, where: str = "", advice: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.where = where
        self.advice = advice

    def __str__(self) -> str:
        text = f"{self.where}: {self.message}" if self.where else self.message
        if not self.advice:
            return text
        if text and text[-1] not in ".!?:;":
            text += "."
        return f"{text} {self.advice}".strip()


class DeclarationError(AtwoodError):
    """A component, connector or model is declared in a way that cannot mean anything."""


class MissingNameError(DeclarationError, AttributeError):
    """A component is asked for a name that it does not have."""


class ParameterError(AtwoodError):
    """A parameter is unknown, missing, or has a value that is not admissible."""


class ConnectError(AtwoodError):
    """Two connectors cannot be connected."""


class TopologyError(AtwoodError):
    """The parts are fine one by one, but the mechanism they make is not."""


class StartError(AtwoodError):
    """No consistent start was found: positions, speeds or forces contradict each other."""


class SolveError(AtwoodError):
    """The integration could not go on."""


class KernelEvaluationError(AtwoodError):
    """An expression has no value at this state: a division by zero, or a function outside its domain."""


class ResultError(AtwoodError):
    """A result was asked for something that it does not hold."""


class MissingQuantityError(ResultError, KeyError):
    """A result holds no quantity at this path; to be met as a `KeyError` by what reads mappings."""


class MissingGroupError(ResultError, AttributeError):
    """A result is asked for a group of quantities that there is not."""


class UsageError(AtwoodError):
    """A function or command was called in a way it does not understand."""


class UnsupportedError(AtwoodError):
    """The request makes sense, but Atwood cannot do it."""


def is_about(error: AtwoodError, path: str) -> bool:
    """Return whether an error is about a component or something inside it: ``rod1`` is not ``rod10``."""
    return error.where == path or error.where.startswith(f"{path}.")


def near_matches(word: str, choices: Iterable[str], n: int = 3) -> list[str]:
    """Return the choices that look most like a word, best first."""
    spellings: dict[str, list[str]] = {}
    for choice in choices:
        same = spellings.setdefault(choice.casefold(), [])
        if choice not in same:
            same.append(choice)
    from difflib import get_close_matches

    close = get_close_matches(word.casefold(), spellings, n=max(n, 1), cutoff=0.6)
    return [choice for key in close for choice in spellings[key]][: max(n, 0)]


def suggestion(word: str, choices: Iterable[str]) -> str:
    """Return a hint for a name that does not exist."""
    known = list(dict.fromkeys(choices))
    close = near_matches(word, known)
    if close:
        return f"Did you mean {_either([repr(name) for name in close])}?"
    if 0 < len(known) <= _SHORT_LIST:
        return f"There is {', '.join(repr(name) for name in sorted(known))}"
    return ""


_SHORT_LIST = 12


def check_known(
    name: str,
    known: Collection[str],
    problem: str,
    *,
    where: str | None = None,
    hint: Callable[[str, Iterable[str]], str] = suggestion,
    error: type[AtwoodError] = UsageError,
) -> None:
    """Refuse a name that does not exist, with a hint at what could be meant; without `where` it is about the name."""
    if name not in known:
        raise error(problem, where=name if where is None else where, advice=hint(name, known))


def suggestion_in_parts(path: str, known: Iterable[str], verb: str = "has") -> str:
    """Return a hint for a quantity that does not exist: what looks alike in its part, or what that part has."""
    choices, part = list(known), path
    own = [name for name in choices if name.startswith(f"{part}.")]
    while not own and "." in part:
        part = part.rpartition(".")[0]
        own = [name for name in choices if name.startswith(f"{part}.")]
    tails = [name.removeprefix(f"{part}.") for name in own]
    close = near_matches(path.removeprefix(f"{part}."), tails)
    if not own or close:
        whole = (name.removesuffix(".x").removesuffix(".y").removesuffix(".z") for name in choices)
        parts = list(dict.fromkeys(name.rpartition(".")[0] for name in whole if "." in name))
        near = [f"{part}.{tail}" for tail in close] or near_matches(path, choices) or near_matches(path, parts)
        return suggestion(path, near) or (f"There are quantities of {', '.join(_first(parts))}." if parts else "")
    return f"{part} {verb} {', '.join(_vectors(tails))}."


def _first(names: list[str]) -> list[str]:
    """Return a list that can be read at a glance."""
    return names if len(names) <= _SHORT_LIST else [*names[: _SHORT_LIST - 1], "..."]


def _vectors(names: Iterable[str]) -> list[str]:
    """Return names with the components of a vector as one, such as ``position.x/y/z``."""
    axes: dict[str, list[str]] = {}
    for name in names:
        stem, _, last = name.rpartition(".")
        axes.setdefault(f"{stem}." if last in ("x", "y", "z") else name, []).append(last)
    return [stem + "/".join(last) if stem.endswith(".") else stem for stem, last in axes.items()]


def _either(names: list[str]) -> str:
    """Join names as a reader would say them: a, b or c."""
    if len(names) == 1:
        return names[0]
    return f"{', '.join(names[:-1])} or {names[-1]}"
