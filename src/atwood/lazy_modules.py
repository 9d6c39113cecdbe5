"""Modules that take long to import and few processes need: each is imported when it is first asked for something."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from atwood.errors import UsageError

if TYPE_CHECKING:
    import mpmath as mpmath  # type: ignore[import-untyped]
    import scipy as scipy
    import scipy.interpolate
    import scipy.io
    import scipy.linalg
    import scipy.optimize
    import scipy.signal
    import scipy.sparse
    import scipy.sparse.linalg
    import scipy.spatial
    import scipy.stats
    import sympy as sympy
else:

    class _LazyModule:
        """A module that is imported when an attribute of it is first read."""

        def __init__(self, name):
            self._name = name

        def __getattr__(self, name):
            if name.startswith("__"):  # somebody looks at what it is
                raise AttributeError(name)
            value = getattr(import_module(self._name), name)
            setattr(self, name, value)
            return value

    mpmath, scipy, sympy = map(_LazyModule, ("mpmath", "scipy", "sympy"))


def needed(name: str, extra: str, what: str = "", where: str = "") -> Any:
    """Return a module that is optional, or say in words what needs it, and what to install."""
    try:
        return import_module(name)
    except ImportError as error:
        raise UsageError(f"{what or name} is not installed", where=where, advice=f"pip install {extra}") from error


def names_for_checkers(package: str) -> dict[str, str]:
    """Return the module of each name that a package imports for type checkers alone, below ``if TYPE_CHECKING``.

    So these names stand once. They are read from the source, which takes a tenth of a millisecond.
    """
    spec: Any = sys.modules[package].__spec__
    lines = re.findall(r"^    from (\S+) import (\([^)]*\)|.+)$", spec.loader.get_source(package), re.MULTILINE)
    return {name: module for module, names in lines for name in re.findall(r"(\w+)\s*(?:,|\)|$)", names)}


def imports_later(package: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package whose names of `names_for_checkers` are imported when first used."""
    modules = names_for_checkers(package)

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        found = getattr(import_module(modules[name]), name)
        setattr(sys.modules[package], name, found)
        return found

    return get
