"""Elementary functions: nanoseconds a number, alone and in lanes, beside the C library's.

Each is called by its address in one loop over the same 4,096 numbers, which vary smoothly, as they do along a motion.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from timing import best_of, options, print_table, ratio, save

from atwood.codegen.functions import write_routines
from atwood.codegen.llvm.engine import LoadedCode, compile_text, load_code
from atwood.codegen.llvm.own import own_functions
from atwood.codegen.llvm.printer import print_routines
from atwood.codegen.routines import ADDRESS, NUMBER, Routine

NUMBERS = {
    "sin": (-3.0, 3.0),
    "cos": (-3.0, 3.0),
    "sin_cos": (-30.0, 30.0),
    "tan": (-3.0, 3.0),
    "asin": (-1.0, 1.0),
    "acos": (-1.0, 1.0),
    "atan": (-5.0, 5.0),
    "atan2": (-1.0, 1.0),
    "exp": (-20.0, 20.0),
    "log": (0.01, 100.0),
    "sinh": (-5.0, 5.0),
    "cosh": (-5.0, 5.0),
    "tanh": (-3.0, 3.0),
    "pow": (0.1, 10.0),
}
"""Between which numbers each is called."""

COUNT = 4096
LANES = (2, 4, 8)
_DECLARED = "\n".join(f"declare double @llvm.{one}.f64(double)" for one in ("sqrt", "fabs", "floor"))
_DECLARED += "\nattributes #0 = { nounwind }\n"


def shape_of(name: str) -> tuple[int, int]:
    """Return how many arguments a function has, and how many results."""
    return (2 if name in ("atan2", "pow") else 1), (2 if name == "sin_cos" else 1)


def write_loop(name: str, lanes: int) -> Routine:
    """Return the loop that calls a function by its address over all numbers."""
    taken, results = shape_of(name)
    places = [f"x{k}" for k in range(taken)] + [f"y{k}" for k in range(results)]
    r = Routine(f"over_{name}_{lanes}", dict.fromkeys(["function", *places], ADDRESS), None, exported=True)
    function, *arrays = r.arguments
    given, filled = arrays[:taken], arrays[taken:]
    with r.count(COUNT, step=max(lanes, 1)) as k:
        if lanes:
            r.call(function, *(one.at(k) for one in arrays), result=None)
        elif results == 2:
            r.call(function, *(one[k] for one in given), *(one.at(k) for one in filled), result=None)
        else:
            filled[0][k] = r.call(function, *(one[k] for one in given), result=NUMBER)
    r.give()
    return r


def load(routines: list[Routine]) -> LoadedCode:
    """Return routines as machine code."""
    code = compile_text(print_routines(routines) + "\n" + _DECLARED, 2, has_variables=True)
    return load_code(code, [one.name for one in routines if one.exported], {})


def timed(loop: int, function: int, arrays: list[np.ndarray[Any, Any]]) -> Callable[[], float]:
    """Return what measures the nanoseconds that a number takes."""
    call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * (len(arrays) + 1))(loop)
    given = [one.ctypes.data for one in arrays]

    def measure() -> float:
        began = time.perf_counter()
        call(function, *given)
        return (time.perf_counter() - began) / COUNT * 1e9

    return measure


def main() -> None:
    """Print the table."""
    given = options(__doc__, None)
    library = ctypes.CDLL(ctypes.util.find_library("m"))
    names = list(NUMBERS)
    loops = load([write_loop(name, lanes) for name in names for lanes in (0, *LANES)])
    wide = load([*write_routines(names, each=False), *(one for lanes in LANES for one in write_routines(names, lanes))])
    rows, kept = [], {}
    for name, (low, high) in NUMBERS.items():
        taken, results = shape_of(name)
        wave = np.sin(np.linspace(0.0, 40.0, COUNT))
        arrays = [low + (high - low) * 0.5 * (1.0 + wave * s) for s in (1.0, -0.7)[:taken]]
        arrays += [np.empty(COUNT) for _ in range(results)]
        theirs = ctypes.cast(getattr(library, name.replace("_", "")), ctypes.c_void_p).value or 0
        own, over = own_functions().addresses[f"own_{name}"], loops.addresses
        measures = {"own": timed(over[f"over_{name}_0"], own, arrays)}
        measures["C"] = timed(over[f"over_{name}_0"], theirs, arrays)
        for lanes in LANES:
            there = wide.addresses[f"own_{name}_{lanes}"]
            measures[f"{lanes} lanes"] = timed(over[f"over_{name}_{lanes}"], there, arrays)
        found = kept[name] = best_of(measures, 30 * given.repeat)
        rows.append([name, *found.values(), *(ratio(found[one], found["C"]) for one in found if one != "C")])
    heads = [*found, *(f"{one} / C" for one in found if one != "C")]
    print_table("Nanoseconds a number", ["", *heads], rows)
    save(given.json, {"functions": kept})


if __name__ == "__main__":
    main()
