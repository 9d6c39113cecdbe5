"""What the documents show as code runs as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import atwood.solids
import atwood.xml_files
import atwood_library
from atwood_library import robots

from ..pages import OVERVIEWS

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *(file for room in ("course", "tutorials", "coming-from") for file in sorted((ROOT / "docs" / room).glob("*.md"))),
    *(ROOT / "docs" / "scenes" / f"{name}.md" for name in OVERVIEWS),  # pages of scenes have a test of their own
]
BLOCK = re.compile(r"^```(?:python|\{code-cell\})\n(.*?)^```", re.MULTILINE | re.DOTALL)
SHOWN = {str(path.relative_to(ROOT)): BLOCK.findall(path.read_text(encoding="utf-8")) for path in DOCUMENTS}


@pytest.mark.parametrize("name", [name for name, blocks in SHOWN.items() if blocks])
def test_code_in_documents_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "shown"}
    for block in SHOWN[name]:
        exec(compile(block, name, "exec"), names)


def test_there_is_code_in_documents():
    names = {name for name, blocks in SHOWN.items() if blocks}
    assert {"README.md", "docs/writing-a-component.md", "docs/space.md", "docs/tutorials/chaos.md"} <= names


def test_every_public_name_has_its_place_in_the_reference():
    pages = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "api").glob("*.md"))
    shown = re.findall(r"^\.\. auto(?:class|function|data):: (\w+)", pages, re.MULTILINE)
    assert len(shown) == len(set(shown))
    modules = (atwood, atwood.solids, atwood.xml_files, atwood_library, robots)
    public = {name for module in modules for name in module.__all__} - {"__version__"}
    assert set(shown) == public
