"""On what figures were measured: the lines that a paper has of it."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from atwood.result.about import versions

__all__ = ["environment"]

_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def environment() -> dict[str, str]:
    """Return processor, system, versions, BLAS, threads and date, in words."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {**_lasting(), "threads": _threads(), "load": _load(), "date": now}


@cache
def _lasting() -> dict[str, str]:
    found = versions()
    python = found.pop("python")
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.release()}",
        "python": f"{platform.python_implementation()} {python}",
        "versions": ", ".join(f"{name} {number}" for name, number in [*found.items(), ("llvm", _llvm())]),
        "blas": _blas(),
    }


def _processor() -> str:
    """Return the name of the processor, and how many of them may be used."""
    name = platform.processor() or platform.machine()
    table = Path("/proc/cpuinfo")
    if table.is_file():
        lines = (line.partition(":") for line in table.read_text(encoding="utf-8", errors="replace").splitlines())
        name = next((value.strip() for key, _, value in lines if key.strip() == "model name"), name)
    return f"{name}, {platform.machine()}"


def _threads() -> str:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    given = ", ".join(f"{name}={os.environ[name]}" for name in _THREADS if name in os.environ)
    return f"runs in one thread of {usable}; BLAS: {given or 'as it chooses'}"


def _load() -> str:
    """Return how busy the machine was in the last minute; figures taken beside other work mean little."""
    return f"{os.getloadavg()[0]:.1f} over the last minute" if hasattr(os, "getloadavg") else "unknown"


def _llvm() -> str:
    from llvmlite import binding

    return ".".join(map(str, binding.llvm_version_info))


def _blas() -> str:
    import numpy as np

    told: Any = np.show_config(mode="dicts")
    found = told.get("Build Dependencies", {}).get("blas", {}) if isinstance(told, dict) else {}
    return " ".join(str(found[key]) for key in ("name", "version") if found.get(key)) or "unknown"
