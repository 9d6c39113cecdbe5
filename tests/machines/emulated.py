"""The machines that are emulated: what BLAS, NumPy, the C library and the machine code of kernels may use of this one.

`OPENBLAS_CORETYPE` chooses the kernels of OpenBLAS, `NPY_DISABLE_CPU_FEATURES` those of NumPy, `GLIBC_TUNABLES` those
of the mathematical functions of the C library, and `ATWOOD_CPU` what LLVM makes machine code for.
"""

from __future__ import annotations

import platform
from dataclasses import dataclass

import numpy as np

SIMD = np.show_config(mode="dicts")["SIMD Extensions"]  # type: ignore[call-overload, index, unused-ignore]

USED = frozenset(SIMD.get("found", []))
"""The features for which NumPy has kernels that it uses on this machine."""

WIDE = frozenset(name for name in USED if name.startswith("AVX512") or name == "X86_V4")
"""Those with 512 bits."""

SKYLAKE = frozenset({"AVX512F", "AVX512CD", "AVX512_SKX", "X86_V4"})
"""Those that the first processors with 512 bits have."""


@dataclass(frozen=True)
class Machine:
    """A processor that this one can stand for.

    Parameters
    ----------
    blas, cpu
        The processor's name for OpenBLAS and for LLVM; empty for this machine's own.
    hidden
        The features that NumPy must not use, in its words.
    hidden_from_libm
        The features that the C library must not use, in its words (glibc.cpu.hwcaps).
    possible
        Whether this machine can do all that the other does.
    """

    blas: str = ""
    cpu: str = ""
    hidden: frozenset[str] = frozenset()
    hidden_from_libm: tuple[str, ...] = ()
    possible: bool = True

    @property
    def environment(self) -> dict[str, str]:
        """The variables that make a process run as on that machine."""
        features = ",".join(f"-{name}" for name in self.hidden_from_libm)
        chosen = {
            "OPENBLAS_CORETYPE": self.blas,
            "ATWOOD_CPU": self.cpu,
            "NPY_DISABLE_CPU_FEATURES": " ".join(sorted(self.hidden)),
            "GLIBC_TUNABLES": f"glibc.cpu.hwcaps={features}" if features else "",
        }
        return {name: value for name, value in chosen.items() if value}


MACHINES = {
    "this": Machine(),
    "nehalem": Machine(
        "Nehalem", "x86-64", USED, ("AVX2", "FMA", "FMA4", "AVX"), platform.machine() in ("x86_64", "AMD64")
    ),
    "haswell": Machine("Haswell", "haswell", WIDE, ("AVX512F",), bool(USED & {"X86_V3", "AVX2"})),
    "skylakex": Machine("SkylakeX", "skylake-avx512", WIDE - SKYLAKE, (), bool(USED & {"X86_V4", "AVX512_SKX"})),
}
