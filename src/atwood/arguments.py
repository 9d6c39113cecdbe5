"""What the arguments of public functions may be, checked once, at the door.

A `Kind` says in words what an argument may be, and reads it: it gives the value in its own type, or refuses it.
`takes` puts the kinds of all arguments before a function, `check_fields` before the fields of a value.
"""

from __future__ import annotations

import functools
import inspect
import math
import operator
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from atwood.errors import AtwoodError, UsageError, near_matches, suggestion
from atwood.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from pathlib import Path

_F = TypeVar("_F", bound=Callable[..., Any])
_T = TypeVar("_T")


class Refused(Exception):
    """A value is not what an argument may be; a text says more of it than its kind does."""


@dataclass(frozen=True)
class Kind:
    """What an argument may be.

    Attributes
    ----------
    what
        In words that go on "Give ...".
    read
        Returns a value in its own type, or raises any error for one that will not do.
    word
        How a command line writes it, such as ``PATH=VALUE``; empty where no text says it.
    typed
        Reads what was typed on a command line; `read` gets what it returns.
    words
        All that it may be, where these are a few words.
    is_many
        Whether it is given once for each of several values.
    of_scene
        What an assembly gives for it, where it is no text.
    """

    what: str
    read: Callable[[Any], Any]
    word: str = ""
    typed: Callable[[str], Any] = str
    words: tuple[str, ...] = ()
    is_many: bool = False
    of_scene: Callable[[Any], Any] | None = None


def takes(error: type[AtwoodError] = UsageError, /, **kinds: Kind) -> Callable[[_F], _F]:
    """Check the arguments of a function before it is called; defaults are taken as they are."""

    def decorate(function: _F) -> _F:
        declared = inspect.signature(function).parameters.values()
        names = [one.name for one in declared if one.name not in ("self", "cls")]
        if set(names) != set(kinds):
            raise TypeError(f"{function.__qualname__} takes {names}, and {list(kinds)} are said of it")
        positional = tuple(one.name for one in declared if one.kind is one.POSITIONAL_OR_KEYWORD)
        rest = next((one.name for one in declared if one.kind is one.VAR_POSITIONAL), "")
        where = function.__qualname__.removesuffix(".__init__")

        @functools.wraps(function)
        def checked(*args: Any, **given: Any) -> Any:
            if args:
                if not (positional or rest):
                    advice = f"Give them by name: {where}({', '.join(f'{name}=...' for name in names)})."
                    raise error("its arguments have no order", where=where, advice=advice)
                read = [
                    check(kinds[name], value, name, where, error) if name in kinds else value
                    for name, value in zip(positional, args, strict=False)
                ]
                further = args[len(positional) :]  # without a name for them, Python refuses them by itself
                args = (*read, *(check(kinds[rest], value, rest, where, error) if rest else value for value in further))
            for name, value in given.items():
                if name not in kinds:
                    close = suggestion(name, near_matches(name, names))
                    advice = close or f"Its arguments are {', '.join(names)}."
                    raise error(f"it takes no {name!r}", where=where, advice=advice)
                given[name] = check(kinds[name], value, name, where, error)
            return function(*args, **given)

        checked.kinds = kinds  # type: ignore[attr-defined]  # read by the command line
        return checked  # type: ignore[return-value]

    return decorate


def command(name: str) -> Callable[[_F], _F]:
    """Say how the command of a function is called, where it is not called as the function."""
    return lambda function: function


def takes_names(target: _T) -> _T:
    """Check the names of the arguments of a function, or of a dataclass, that looks at their values itself."""
    if isinstance(target, type):
        return _takes_fields(target)  # type: ignore[no-any-return]
    function: Any = target
    names = [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]
    return takes(UsageError, **dict.fromkeys(names, ANYTHING))(function)  # type: ignore[no-any-return]


def _takes_fields(cls: Any) -> Any:
    """Check the names of the fields that a dataclass is made with, which need no completed class."""
    names = list(
        dict.fromkeys(name for base in reversed(cls.__mro__) for name in vars(base).get("__annotations__", ()))
    )
    construct = cls.__init__

    @functools.wraps(construct)
    def checked(self: Any, *args: Any, **given: Any) -> None:
        for name in given:
            if name not in names:
                close = suggestion(name, near_matches(name, names))
                advice = close or f"Its arguments are {', '.join(names)}."
                raise UsageError(f"it takes no {name!r}", where=cls.__name__, advice=advice)
        construct(self, *args, **given)

    cls.__init__ = checked
    return cls


def check(kind: Kind, value: Any, name: str, where: str = "", error: type[AtwoodError] = UsageError) -> Any:
    """Return an argument in its own type, or refuse it with its name and that of the function or part."""
    try:
        return kind.read(value)
    except AtwoodError:  # the value itself says more
        raise
    except Exception as problem:  # to look at a value of any class can raise anything
        more = str(problem) if isinstance(problem, Refused) else ""
    said = show(value)
    raise error(f"{name} cannot be {said}", where=where, advice=f"{more} Give {kind.what}.".strip())


def check_fields(value: object, error: type[AtwoodError] = UsageError, /, **kinds: Kind) -> None:
    """Check the fields of a frozen value, from its ``__post_init__``, and give them their own types."""
    where = type(value).__name__
    for name, kind in kinds.items():
        object.__setattr__(value, name, check(kind, getattr(value, name), name, where, error))


def show(value: object) -> str:
    """Return a value as an error shows it: short and on one line, whatever its class does."""
    try:
        text = value.__qualname__ if isinstance(value, type) else _SHORT.repr(value)
    except Exception:  # a class of somebody else
        text = f"a {type(value).__name__}"
    return " ".join(text.split())


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 60


# -- kinds -------------------------------------------------------------------------------------------------------------


def number(
    what: str = "a finite number",
    *,
    above: float = -math.inf,
    below: float = math.inf,
    least: float = -math.inf,
    most: float = math.inf,
) -> Kind:
    """Return the kind of finite real numbers between bounds, of which it may reach the last two; they become floats."""

    def read(value: Any) -> float:
        found = value if type(value) is float else real(value)
        if not (above < found < below and least <= found <= most and math.isfinite(found)):
            raise Refused
        return found

    return Kind(what, read, "NUMBER", float)


def real(value: Any) -> float:
    """Return what is one real number as a float, or raise any error; truth values and text are none."""
    if isinstance(value, (bool, str, bytes, bytearray)) or type(value).__name__ in ("bool", "bool_"):
        raise Refused
    if getattr(value, "ndim", 0):
        raise Refused
    return float(value)


def whole(what: str, least: int, most: int | None = None) -> Kind:
    """Return the kind of whole numbers between bounds, which become ints; ``1e6`` is one."""

    def read(value: Any) -> int:
        found = value if type(value) is int else int(real(value))
        if found != value or found < least or (most is not None and found > most):
            raise Refused
        return found

    return Kind(what, read, "INTEGER", lambda text: read(float(text)))


def one_of(words: Iterable[str]) -> Kind:
    """Return the kind of words of a short list; one that is nearly right is told which it could be."""
    known = tuple(words)

    def read(value: Any) -> str:
        if not isinstance(value, str):
            raise Refused
        if value not in known:
            close = suggestion(value, known)
            raise Refused(close if close.startswith("Did you") else "")
        return value

    return Kind(f"one of {', '.join(map(repr, known))}", read, "NAME", words=known)


def instance(what: str, *classes: type) -> Kind:
    """Return the kind of objects of some classes."""

    def read(value: Any) -> Any:
        if not isinstance(value, classes):
            is_class = isinstance(value, type) and issubclass(value, classes)
            raise Refused(f"Call the class: {value.__name__}()." if is_class else "")
        return value

    return Kind(what, read)


def optional(kind: Kind) -> Kind:
    """Return the kind that None is of, too."""
    return replace(kind, what=f"{kind.what}, or None", read=lambda value: None if value is None else kind.read(value))


def either(*kinds: Kind) -> Kind:
    """Return the kind of what is of one of some kinds; the first that will do reads it."""

    def read(value: Any) -> Any:
        for kind in kinds[:-1]:
            try:
                return kind.read(value)
            except Exception:  # the next may do
                continue
        return kinds[-1].read(value)

    return replace(kinds[0], what=" or ".join(kind.what for kind in kinds), read=read)


def each(kind: Kind, what: str, least: int = 0, single: bool = True) -> Kind:
    """Return the kind of several values of a kind, which become a tuple; a single text may stand for a list of one."""

    def read(value: Any) -> tuple[Any, ...]:
        if isinstance(value, (bytes, bytearray)) or (isinstance(value, str) and not single):
            raise Refused
        found = tuple([kind.read(one) for one in ((value,) if isinstance(value, str) and single else value)])
        if len(found) < least:
            raise Refused
        return found

    return replace(kind, what=what, read=read, is_many=True)


def _array(value: Any) -> Any:
    import numpy as np

    found = np.asarray(value)
    if (found.dtype.kind not in "fiu" and found.size) or not np.isfinite(found).all():  # text and None are no numbers
        raise Refused
    return found.astype(np.float64)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise Refused
    return value


def _not_blank(value: Any) -> str:
    if not _text(value).strip():
        raise Refused
    return str(value)


def _file(value: Any) -> Path:
    from pathlib import Path

    text = os.fspath(value)
    if not isinstance(text, str) or not text.strip() or "\0" in text:
        raise Refused
    return Path(text)


def _callback(value: Any) -> Any:
    if not callable(value) or isinstance(value, type):
        raise Refused
    return value


def _flag(value: Any) -> bool:
    if not isinstance(value, bool) and type(value).__name__ not in ("bool", "bool_"):
        raise Refused
    return operator.truth(value)


def _mapping(value: Any) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        raise Refused
    return value


def _by_path(value: Any) -> Mapping[str, Any]:
    for key in _mapping(value):
        if not isinstance(key, str) or not key.strip():
            raise Refused(f"{show(key)} is no path.")
    return _mapping(value)


ANYTHING = Kind("anything", lambda value: value)
"""For what the function itself looks at."""

ARRAY = Kind("a finite number, or an array of them", _array)
TEXT = Kind("text", _text, "TEXT")
NAME = Kind("a name, as text", _not_blank, "NAME")
DOC = Kind("one line of meaning", _not_blank, "TEXT")
FILE = Kind("the path of a file, as text or a Path", _file, "FILE", _file)
CALLBACK = Kind("a function", _callback)
FLAG = Kind("True or False", _flag, "FLAG")
MAPPING = Kind("a dictionary", _mapping)
PATHS = each(replace(TEXT, word="PATH"), "paths, as a list of texts")
BY_PATH = Kind("a dictionary by path, such as {'rod.length': 1.0}", _by_path, "PATH=VALUE", is_many=True)
