"""Binaries of an FMU, by the C compiler that is found, or by ziglang."""

from __future__ import annotations

import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from atwood.errors import UsageError

_SYSTEMS = {"Linux": "linux", "Darwin": "darwin", "Windows": "windows"}
_MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
_ENDINGS = {"linux": ".so", "darwin": ".dylib", "windows": ".dll"}
_OF_FMI_2 = {"x86_64-linux": "linux64", "x86_64-darwin": "darwin64", "x86_64-windows": "win64"}
_ZIG = {"linux": "linux-gnu", "darwin": "macos", "windows": "windows-gnu"}
PLATFORMS = tuple(f"{machine}-{system}" for system in _ENDINGS for machine in ("x86_64", "aarch64"))
"""What FMI 3.0 calls the processors and systems for which there can be binaries."""

_LONGEST = 600.0
"""Seconds that a compiler may take."""


def own_platform() -> str | None:
    """Return what FMI 3.0 calls this one; None where it has no name."""
    machine, system = _MACHINES.get(platform.machine()), _SYSTEMS.get(platform.system())
    return f"{machine}-{system}" if machine and system else None


def has_zig() -> bool:
    """Tell whether ziglang is installed."""
    return importlib.util.find_spec("ziglang") is not None


def find_compiler() -> list[str] | None:
    """Return the command of the C compiler for this platform; None where there is none."""
    named = os.environ.get("CC", "").strip()
    for words in ([shlex.split(named)] if named else []) + [["cc"], ["gcc"], ["clang"], ["cl"]]:
        if shutil.which(words[0]):
            return words
    return None


def place_of(name: str, target: str, version: int) -> str:
    """Return where in an FMU the binary for a platform lies.

    Raises
    ------
    UsageError
        If FMI 2.0 has no name for the platform.
    """
    system = target.partition("-")[2]
    folder = target if version == 3 else _OF_FMI_2.get(target)
    if folder is None:
        known = ", ".join(_OF_FMI_2)
        raise UsageError(f"FMI 2.0 has no name for {target}", where="platform", advice=f"Use {known}, or FMI 3.0.")
    return f"binaries/{folder}/{name}{_ENDINGS[system]}"


def compiled(name: str, sources: Mapping[str, str], units: Sequence[str], target: str) -> bytes | None:
    """Return the binary of an FMU for a platform; None where no compiler for it is found.

    Raises
    ------
    UsageError
        If the compiler fails.
    """
    own = find_compiler() if target == own_platform() else None
    words = own or ([sys.executable, "-m", "ziglang", "cc", *_target(target)] if has_zig() else None)
    if words is None:
        return None
    system = target.partition("-")[2]
    with tempfile.TemporaryDirectory(prefix="atwood-fmu-") as folder:
        for file, text in sources.items():
            Path(folder, file).write_text(text, encoding="utf-8")
        made = f"{name}{_ENDINGS[system]}"
        if Path(words[0]).stem.lower() == "cl":
            command = [*words, "/nologo", "/O2", "/fp:precise", "/LD", *units, f"/Fe{made}"]
        else:
            shared = ["-dynamiclib"] if system == "darwin" and own else ["-shared"]
            flags = ["-O2", "-std=c99", "-ffp-contract=off", "-fvisibility=hidden", "-Werror=implicit"]
            of_unix, library = ([], []) if system == "windows" else (["-fPIC"], ["-lm"])
            command = [*words, *flags, *of_unix, *shared, *units, "-o", made, *library]
        _run(command, folder)
        return Path(folder, made).read_bytes()


def _target(target: str) -> Sequence[str]:
    machine, _, system = target.partition("-")
    return "-target", f"{machine}-{_ZIG[system]}"


def _run(command: Sequence[str], folder: str) -> None:
    advice = "Name another one in the environment variable CC, or leave it out: `platform=()` writes sources alone."
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=_LONGEST)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UsageError(f"the C compiler does not run ({error})", where=command[0], advice=advice) from error
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip()[:500]
        raise UsageError(f"the C compiler fails: {said}", where=command[0], advice=advice)
