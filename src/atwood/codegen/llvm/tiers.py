"""Programs that run at once, by tapes, and by machine code once they have run for long.

A module of tapes has the functions of one of machine code, with the same arrays and bits.  Its own code is that of its
routines, and calls of the evaluator (`atwood.codegen.llvm.tape`): it is the same for all programs.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress

from atwood.clock import TimeIsUp, within_time
from atwood.codegen.cache import Cache, default_cache, make_key
from atwood.codegen.llvm.build import (
    Built,
    RoutineSource,
    build_code,
    build_now,
    default_options,
    hash_of_generators,
    key_of,
    once,
)
from atwood.codegen.llvm.engine import compile_text, load_code, target_description
from atwood.codegen.llvm.module import CodeOptions, Part, stub_text, write_module
from atwood.codegen.llvm.own import address_of
from atwood.codegen.llvm.tape import Tape, tapes_of
from atwood.errors import UnsupportedError
from atwood.stages import stage

_COST = (1.5e-5, 4e-5)
"""Seconds that it takes to make machine code, for each node, at LLVM's quickest level and above."""

_LEAST = 0.01
"""Seconds that it takes at least."""

_STARTS, _START = 10, 5e-3
"""What was started so often will be started again; a start counts for no more than so many seconds."""

_STATES = 1_200
"""Outputs at so many states, as of three runs with 400 samples each, count as what machine code costs."""


class Tiers:
    """Programs as tapes, and as machine code once they have run for as long as that takes to make, or were begun often.

    Parameters
    ----------
    parts, exports, routines
        See `build_code`.
    is_brief
        Whether they are run for short stretches at a time.
    of_tapes
        Routines that do the same whatever the shape of the programs, if others do it for one shape.
    is_quick
        Whether tapes are to do at first; what calls functions in Python has none.

    Attributes
    ----------
    now
        The present code. All that is made has the same arrays, and gives the same values to the bit.
    """

    def __init__(
        self,
        parts: Sequence[Part],
        exports: Sequence[str] = (),
        routines: RoutineSource | None = None,
        is_brief: bool = False,
        of_tapes: RoutineSource | None = None,
        is_quick: bool = True,
    ) -> None:
        options, size = default_options(parts, is_brief), sum(part.program.size for part in parts)
        best = functools.partial(_best, parts, options, exports, routines)
        store, self._lock = default_cache(), threading.Lock()
        is_quick &= store is None or not within_time(lambda: _has_best(store, parts, options, routines))
        self._better: Callable[[], Built] | None = best if is_quick else None
        self._cost = self._left = _LEAST + _COST[options.level > 0] * size
        try:
            self.now = build_tapes(parts, exports, of_tapes or routines) if is_quick else best()
        except UnsupportedError:
            self.now, self._better = best(), None

    @property
    def has_better(self) -> bool:
        """Whether there is code that runs faster."""
        return self._better is not None

    def spend(self, seconds: float) -> Built:
        """Take note that it ran for so long, or, with 0, that it begins; return what is best to go on with."""
        if self._better is not None:
            self._left -= seconds or min(self._cost / _STARTS, _START)
            if self._left <= 0.0:
                with suppress(TimeIsUp):
                    self.at_its_best()
        return self.now

    def spend_on(self, states: int, seconds: float) -> None:
        """Take note that it ran for so long, for so many states: what all outputs of runs ask will be asked again."""
        if self._better is not None:
            self.spend(max(seconds, self._cost * states / _STATES))

    def at_its_best(self) -> Built:
        """Return the code that suits many runs, or a long one."""
        with self._lock:
            better, self._better = self._better, None
            if better is not None and (built := better()).scratch <= self.now.scratch:
                self.now = built
        return self.now


def _best(parts: Sequence[Part], options: CodeOptions, exports: Sequence[str], routines: RoutineSource | None) -> Built:
    """Return machine code, and note that there is some of programs of these names and sizes."""
    built, store = build_code(parts, options, exports=exports, routines=routines), default_cache()
    if store is not None and not store.has(_rough_key(parts)):
        store.write(_rough_key(parts), b"")
    return built


def _has_best(store: Cache, parts: Sequence[Part], options: CodeOptions, routines: RoutineSource | None) -> bool:
    """Return whether there is such code: programs that never had any are not read for its name, which takes longer."""
    return store.read(_rough_key(parts)) is not None and store.has(key_of(parts, options, routines))


def _rough_key(parts: Sequence[Part]) -> str:
    programs = [(one.name, one.program.name, one.program.size) for one in parts]
    return make_key(["machine code of", hash_of_generators(), programs])


def build_tapes(parts: Sequence[Part], exports: Sequence[str] = (), routines: RoutineSource | None = None) -> Built:
    """Return programs as tapes, as `build_code` returns them as machine code.

    Raises
    ------
    UnsupportedError
        If a program calls functions in Python.
    """
    with stage("code"):
        return within_time(lambda: _build_tapes(parts, exports, routines))


def _build_tapes(parts: Sequence[Part], exports: Sequence[str], routines: RoutineSource | None) -> Built:
    tapes: dict[str, Tape] = {}
    for part in parts:
        tapes[part.name], tapes[f"{part.name}_values"] = tapes_of(part.program, address_of, part.positions)
    names = [*exports, *(name for part in parts for name in (part.name, f"{part.name}_prologue"))]
    interpreter = evaluator()
    addresses = {f"tape.{name}": one.words.ctypes.data for name, one in tapes.items()}
    addresses["evaluate"] = interpreter.code.addresses["evaluate"]
    code = _code_of_tapes(tuple(part.name for part in parts), routines)
    loaded = load_code(code, names, addresses, (interpreter, *tapes.values()))
    return Built(loaded, max(one.scratch for one in tapes.values()), False)


@once
def evaluator() -> Built:
    """Return what runs tapes: it is called with one, and then with what a program's function takes."""
    return build_now([], CodeOptions(level=2), ["evaluate"], RoutineSource("codegen.llvm.tape"), True)


@functools.lru_cache(maxsize=64)
def _code_of_tapes(names: tuple[str, ...], routines: RoutineSource | None) -> bytes:
    """Return the object code of a module of tapes, which knows of its programs by their names alone."""
    written = routines.key if routines is not None else ()
    key, store = make_key(["tapes", hash_of_generators(), names, written, target_description()]), default_cache()
    found = store.read(key) if store is not None else None
    if found is not None:
        return found
    text = "\n".join([write_module([], CodeOptions()).text, stub_text(names)])
    if routines is not None:
        from atwood.codegen.llvm.printer import print_routines

        text = f"{text}\n{print_routines(routines.write())}"
    code = compile_text(text, 1, has_variables=True)
    if store is not None:
        store.write(key, code)
    return code
