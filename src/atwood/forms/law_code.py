"""What the laws of classes are written with: their code, and what it reads by name from around it.

Two scenes of the same classes have the same laws only as long as nobody has changed the classes, or a number in their
modules, in between, as one does in a notebook.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import BuiltinFunctionType, CodeType, FunctionType, GetSetDescriptorType, MemberDescriptorType, ModuleType
from typing import Any

_PLAIN = (int, float, complex, str, bytes, type(None))

_CONSTANT = {
    "abc", "atwood", "builtins", "cmath", "collections", "functools", "itertools", "math", "numpy", "operator", "typing"
}  # fmt: skip
"""Modules whose names nobody binds anew; of any other, a law may read what changes."""


def law_code(classes: Iterable[type]) -> list[Any] | None:
    """Return code and values that laws are written with, to be compared; None where one may change unseen.

    Atwood's own classes and functions are taken to stay as they are.
    """
    found: list[Any] = []
    seen: dict[int, int] = {}
    waiting: list[Any] = list(classes)
    while waiting:
        one = waiting.pop()
        if isinstance(one, _PLAIN):
            found.append((type(one), repr(one)))  # 0.0 is not -0.0
            continue
        if id(one) in seen or _is_own(one):
            found.append(seen.get(id(one), one if isinstance(one, (type, FunctionType)) else None))
            continue
        seen[id(one)] = len(seen)
        if isinstance(one, (tuple, list, dict)):
            found.append((type(one), len(one)))
            waiting += one
            waiting += one.values() if isinstance(one, dict) else ()
        elif hasattr(one, "cache_info"):
            waiting.append(one.__wrapped__)
        elif isinstance(one, FunctionType):
            found.append(one.__code__)
            waiting += _read_by(one)
        elif isinstance(one, type):
            found.append(one)
            waiting += [part for base in one.__mro__ if not _is_own(base) for part in _body_of(base)]
        elif isinstance(one, BuiltinFunctionType):
            found.append(one)
        else:
            return None
    return found


def _is_own(one: Any) -> bool:
    """Return whether something stays as it is: what is of Python or of Atwood, but for plain values."""
    if isinstance(one, ModuleType):
        return one.__name__.split(".")[0] in _CONSTANT
    if isinstance(one, (type, FunctionType)):
        return str(one.__module__).split(".")[0] in _CONSTANT
    return type(one).__module__.split(".")[0] == "atwood"


def _body_of(one: type) -> Iterator[Any]:
    """Yield what stands in the body of a class: values, and the functions of methods, laws and properties."""
    for value in vars(one).values():
        if isinstance(value, (GetSetDescriptorType, MemberDescriptorType)):
            continue
        wrapped = (value, *getattr(value, "__dict__", {}).values(), getattr(value, "fget", None))
        functions = [
            part for part in (getattr(one, "__func__", one) for one in wrapped) if isinstance(part, FunctionType)
        ]
        yield from functions or [value]


def _read_by(function: FunctionType) -> Iterator[Any]:
    """Yield what a function reads from around it."""
    yield from function.__defaults__ or ()
    yield from (function.__kwdefaults__ or {}).values()
    for cell in function.__closure__ or ():
        yield cell.cell_contents
    codes = [function.__code__]
    for code in codes:
        codes += [one for one in code.co_consts if isinstance(one, CodeType)]
        for name in code.co_names:
            if name in function.__globals__:
                yield function.__globals__[name]
