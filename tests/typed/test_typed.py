"""A user's script is sound to type checkers, and runs; mypy looks at the same files in `.ci/run`."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

SCRIPT, MISTAKES = (Path(__file__).with_name(name) for name in ("script.py", "mistakes.py"))


def test_the_script_runs(capsys) -> None:
    made = runpy.run_path(str(SCRIPT))
    assert made["spring"].stiffness == 50.0
    assert made["result"].status == "finished"
    assert "('finished', 'finished')" in capsys.readouterr().out


def test_pyright_passes_the_script_and_finds_the_mistakes(tmp_path: Path) -> None:
    script, mistakes = (one.read_text(encoding="utf-8") for one in (SCRIPT, MISTAKES))
    bare = re.sub(r"  # type: ignore.*|^# pyright.*", "", mistakes, flags=re.MULTILINE)
    for name, text in (("script.py", script), ("mistakes.py", mistakes), ("bare.py", bare)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    src = Path(__file__).parents[2]
    settings = tmp_path / "pyrightconfig.json"
    settings.write_text(json.dumps({"extraPaths": [str(src / "src"), str(src / "library")]}))
    command = [sys.executable, "-m", "pyright", "--outputjson", "-p", str(settings), "--pythonpath", sys.executable]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    found = json.loads(done.stdout)["generalDiagnostics"]
    errors = [(Path(one["file"]).name, one["range"]["start"]["line"]) for one in found if one["severity"] == "error"]
    wrong = [number for number, line in enumerate(mistakes.splitlines()) if "# type: ignore" in line]
    assert errors == [("bare.py", number) for number in wrong]
