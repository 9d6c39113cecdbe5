"""The formulas in the documents are those that are written."""

import re
from pathlib import Path

from atwood import equations
from atwood_library.scenes import SCENES

PAGE = Path(__file__).parents[3] / "docs" / "equations.md"


def test_the_page_shows_what_is_written() -> None:
    blocks = re.findall(
        r"^\$\$\n(\\begin\{aligned\}.*?)\n\$\$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    pendulum, top = equations(SCENES["double-pendulum"]()), equations(SCENES["lagrange-top"](), orientation="euler-zxz")
    written = "\n".join(
        (pendulum.markdown(), equations(SCENES["simple-pendulum"](), form="dae").latex(), top.markdown())
    )
    assert len(blocks) == 4
    for block in blocks:
        assert block in written
