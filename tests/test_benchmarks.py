"""The benchmarks run; how fast anything is, is not tested."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


SCRIPTS = sorted(file.stem for file in (ROOT / "benchmarks").glob("*.py") if "__main__" in file.read_text("utf-8"))


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SCRIPTS)
def test_smallest_case(name: str, tmp_path: Path) -> None:
    paths = [str(ROOT / "src"), str(ROOT / "library"), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}
    written = tmp_path / "measured.json"
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / f"{name}.py"), "--quick", "--json", str(written)],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(written.read_text(encoding="utf-8"))
