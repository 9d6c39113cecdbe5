"""Every example runs, as it stands, in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path: Path, tmp_path: Path) -> None:
    if "import control\n" in path.read_text(encoding="utf-8"):
        pytest.importorskip("control", reason="python-control is not installed: pip install 'atwood[control]'")
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    paths = [str(ROOT / "src"), str(ROOT / "library"), environment.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(p for p in paths if p)
    done = subprocess.run(
        [sys.executable, "-W", "error::RuntimeWarning", str(path), str(tmp_path)],  # pictures go there
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
