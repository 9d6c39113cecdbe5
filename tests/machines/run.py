"""Run the suite as on another machine, in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .emulated import Machine

ROOT = Path(__file__).resolve().parents[2]
BYTE_CODE = ROOT / ".pytest_cache" / "machines"
"""Where the byte code of tests is that records what assertions compare."""

EMULATED = ("OPENBLAS_CORETYPE", "ATWOOD_CPU", "NPY_DISABLE_CPU_FEATURES", "GLIBC_TUNABLES")


@dataclass(frozen=True)
class Run:
    """What came of the suite on one machine: the outcome of each test, and value / bound of what each compared."""

    seconds: float
    status: int
    said: str
    outcomes: dict[str, str] = field(default_factory=dict)
    margins: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def failed(self) -> list[str]:
        return [test for test, outcome in self.outcomes.items() if outcome == "failed"]

    @property
    def finished(self) -> bool:
        """Whether pytest came to its end: all passed (0), some failed (1)."""
        return self.status in (0, 1) and bool(self.outcomes)


def run_as(machine: Machine, parts: Sequence[str], workers: int) -> Run:
    """Run tests as on a machine, with a cache of kernels of its own that is empty at the start."""
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory, "margins.json")
        options = ["-p", "tests.machines.margins", "--margins", str(file), "-o", "enable_assertion_pass_hook=true"]
        options += ["-p", "no:cacheprovider", *(["-n", str(workers)] if workers > 1 else [])]
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *options, *parts],
            cwd=ROOT,
            env={
                **{name: value for name, value in os.environ.items() if name not in EMULATED},
                **machine.environment,
                "ATWOOD_CACHE_DIR": str(Path(directory, "kernels")),
                "PYTHONPYCACHEPREFIX": str(BYTE_CODE),
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
        found = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    return Run(time.monotonic() - started, done.returncode, done.stdout, **found)
