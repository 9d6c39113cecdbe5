"""Modules that take long to import and few processes need: each is imported when it is first asked for something."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

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
