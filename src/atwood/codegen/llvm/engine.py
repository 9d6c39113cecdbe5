"""LLVM itself: from a module's text to object code, and from object code to functions that can be called.

Object code is what the cache keeps; loading it needs none of LLVM's work on code.  Functions that it calls are
bound to addresses when it is loaded, so that object code holds nothing of the process that made it.

LLVM's objects are closed by name, not by their finalizers: whatever a finalizer raises is lost, Ctrl-C too, and LLVM
works long enough on some of them for that to happen.
"""

from __future__ import annotations

import itertools
import os
import threading
import weakref
from collections import deque
from collections.abc import Iterable, Mapping
from functools import cache, lru_cache

import llvmlite
from llvmlite import binding

_lock = threading.Lock()
_numbers = itertools.count()
_LOADS = 200


class _Grave(weakref.ref["LoadedCode"]):
    """What is unloaded when the code that it refers to is no longer there; the callback is no function of Python."""

    __slots__ = ("linker", "tracker")
    tracker: binding.ResourceTracker
    linker: binding.LLJIT


_graves: dict[int, _Grave] = {}
_dead: deque[_Grave] = deque()


class LoadedCode:
    """Machine code in memory; it stays there as long as this object lives.

    Parameters
    ----------
    tracker, linker
        What keeps the code in memory, and what loaded it.
    kept
        What else the code needs: functions of Python that it calls.

    Attributes
    ----------
    addresses
        The addresses of the exported functions.
    """

    def __init__(
        self,
        tracker: binding.ResourceTracker,
        linker: binding.LLJIT,
        addresses: Mapping[str, int],
        kept: tuple[object, ...],
    ) -> None:
        self._kept = kept
        self.addresses = dict(addresses)
        grave = _Grave(self, _dead.append)
        grave.tracker, grave.linker = tracker, linker
        _graves[id(grave)] = grave


def _unload_dead() -> None:
    """Unload the code that is no longer used."""
    while _dead:
        grave = _dead.popleft()
        del _graves[id(grave)]
        grave.tracker.close()


def compile_text(text: str, level: int, has_variables: bool = False) -> bytes:
    """Return the object code of a module."""
    with _lock:
        with binding.create_context() as context, binding.parse_assembly(text, context) as module:
            if has_variables:
                passes = binding.create_new_module_pass_manager()
                passes.add_sroa_pass()
                passes.run(
                    module, binding.create_pass_builder(_machine(level), binding.create_pipeline_tuning_options())
                )
            found: bytes = _machine(level).emit_object(module)
        return found


def load_code(
    code: bytes, names: Iterable[str], imports: Mapping[str, int], kept: tuple[object, ...] = ()
) -> LoadedCode:
    """Put object code into memory, ready to be called."""
    names = tuple(names)
    builder = binding.JITLibraryBuilder().add_object_img(code)
    for name, address in imports.items():
        builder.import_symbol(name, address)
    for name in names:
        builder.export_symbol(name)
    with _lock:
        _unload_dead()
        number = next(_numbers)
        linker = _linker(number // _LOADS)
        tracker = builder.link(linker, f"atwood.{number}")
        return LoadedCode(tracker, linker, {name: tracker[name] for name in names}, kept)


@cache
def target_description() -> tuple[str, ...]:
    """Return everything about this machine and LLVM that changes object code.

    Code is made for this processor, or for the one that ``ATWOOD_CPU`` names in LLVM's words, such as ``x86-64``.
    """
    version = ".".join(map(str, binding.llvm_version_info))
    cpu, features = os.environ.get("ATWOOD_CPU", ""), ""
    if not cpu:
        cpu, features = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    return (llvmlite.__version__, version, binding.get_process_triple(), cpu, features)


def lane_count() -> int:
    """Return how many numbers the vectors of this machine hold; each run of a sweep has one of them for itself."""
    features = target_description()[-1].split(",")
    return 8 if "+avx512f" in features else 4 if "+avx2" in features else 2


@cache
def _machine(level: int) -> binding.TargetMachine:
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    _, _, triple, cpu, features = target_description()
    target = binding.Target.from_triple(triple)
    return target.create_target_machine(cpu=cpu, features=features, opt=level, jit=True, codemodel="jitdefault")


@lru_cache(maxsize=1)
def _linker(_: int) -> binding.LLJIT:
    """Return what loads code. It keeps some kilobytes of all it ever loaded, and is renewed now and then."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding.create_lljit_compiler()
