"""Functions in Python that compiled code calls by their addresses, and what goes wrong in them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from ctypes import c_double, c_void_p
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.interrupts import InterruptLater


class PythonCalls:
    """Addresses of functions in Python, for as long as this is kept.

    Attributes
    ----------
    interrupted
        Whether Ctrl-C came while compiled code ran; it is raised when that returns.
    complaint
        Why the last function that was called had no value; None if it had one.
    """

    def __init__(self) -> None:
        self.interrupted = False
        self.complaint: Exception | None = None
        self._failure: BaseException | None = None
        self._made: list[object] = []

    def address(
        self,
        kind: Callable[..., Any],
        function: Callable[..., Any],
        arrays: Mapping[int, int],
        result: tuple[int, int] | None = None,
    ) -> int:
        """Return the address of a function in C that calls one in Python.

        Parameters
        ----------
        kind
            Its signature.
        function
            What is called, with all arguments up to the last array.
        arrays
            The places of arguments that are arrays, and their lengths.
        result
            The place and the length of the array that takes up what is returned, and numbers that are none where it has
            no value; if None, the function says itself whether all is well.
        """
        count = max(arrays) + 1

        def array(place: int, length: int) -> FloatArray:
            return np.ctypeslib.as_array(ctypes.cast(place, ctypes.POINTER(c_double)), (length,))

        def call(*given: Any) -> int:
            if self._failure is None and not self.interrupted:
                try:
                    found = function(
                        *(array(one, arrays[k]) if k in arrays else one for k, one in enumerate(given[:count]))
                    )
                    self.complaint = None
                    if result is None:
                        return 0 if found else 1
                    values = array(given[result[0]], result[1])
                    values[:] = found
                    return 0 if np.isfinite(values).all() else 1
                except (KernelEvaluationError, ArithmeticError) as error:
                    self.complaint = error
                except BaseException as error:
                    self._failure = error
            if result is not None:
                array(given[result[0]], result[1]).fill(np.nan)
            return 1

        made = kind(call)
        self._made.append(made)
        return ctypes.cast(made, c_void_p).value or 0

    def run(self, call: Callable[..., int], *arguments: Any) -> int:
        """Return what compiled code returns, or raise what went wrong in a function that it called."""
        with InterruptLater(self):
            code = call(*arguments)
        failure, self._failure = self._failure, None
        interrupted, self.interrupted = self.interrupted, False
        if failure is not None:
            raise failure
        if interrupted:
            raise KeyboardInterrupt
        return code
