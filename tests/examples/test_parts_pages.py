"""Pages of parts, which the site is built with, say of each part of the library what it has."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from atwood.cli.parts import library_parts
from atwood_library.scenes import DoublePendulum

DOCS = Path(__file__).parents[2] / "docs"


def test_every_part_has_its_section_with_all_that_it_declares(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    import parts_pages

    monkeypatch.setattr(parts_pages, "PAGES", tmp_path)
    monkeypatch.setattr(parts_pages, "SCENES", {"double-pendulum": DoublePendulum})
    parts_pages.write_parts()
    pages = {file.stem: file.read_text(encoding="utf-8") for file in tmp_path.glob("*.md")}
    sections = {}
    for group, text in pages.items():
        if group != "index":
            title, *found = re.split(r"^## ", text, flags=re.MULTILINE)
            assert title.startswith("# ")
            sections.update({one.partition("\n")[0]: one for one in found})
    assert set(sections) == set(library_parts()) != set()
    for name, kind in library_parts().items():
        declared = [*kind.parameter_specs(), *kind.signal_specs(), *(law.name for law in kind.laws("observable"))]
        assert all(f"| `{one}` |" in sections[name] for one in declared), name
        assert all(word in sections[name] for word in vars(kind).get("synonyms", ())), name
        assert "\n---" not in sections[name], name
        group = kind.__module__.split(".")[-2]
        assert f"[{name}]({group}.md#{name.lower()})" in pages["index"]
    assert "[double-pendulum](../gallery/double-pendulum.md)" in sections["Rod"]
