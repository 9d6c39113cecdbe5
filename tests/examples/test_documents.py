"""What the documents show as code runs as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
SHOWN = {path.name: BLOCK.findall(path.read_text(encoding="utf-8")) for path in DOCUMENTS}


@pytest.mark.parametrize("name", [name for name, blocks in SHOWN.items() if blocks])
def test_code_in_documents_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "shown"}
    for block in SHOWN[name]:
        exec(compile(block, name, "exec"), names)


def test_there_is_code_in_documents():
    assert {"README.md", "writing-a-component.md", "space.md"} <= {name for name, blocks in SHOWN.items() if blocks}
