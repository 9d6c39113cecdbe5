"""`python -m tests.hard_cases [--write]`: solve all cases, show what is reached, and write the page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from .case import Case, Reached, solve
from .cases import CASES

PAGE = Path(__file__).parents[2] / "docs" / "hard-cases.md"

HEAD = """# Hard cases

Problems on which simulations of mechanisms fail: what is hard, what is asked, what each form reaches. The page is
written by `python -m tests.hard_cases --write`; the tests ask the same. Times are of one machine, with assembling and
compiling, and only tell forms apart.
"""


def lines_of(case: Case, reached: Sequence[Reached]) -> list[str]:
    """Return a case as Markdown."""
    limit, meaning = case.asked
    found = [
        f"### {case.name[0].upper()}{case.name[1:]}",
        "",
        f"{case.hard} Asked: at most {limit:.2g} ({meaning}); known from: {case.source}.",
        "",
        "| form | reached | steps | solver | time, s |",
        "|---|---|---|---|---|",
    ]
    for one in reached:
        error = f"{one.error:.1e}" if one.error <= limit else f"**{one.error:.1e}**"
        found.append(f"| {one.way} | {error} | {one.steps:,} | {one.solver} | {one.seconds:.2g} |")
    return [*found, "", f"Better: {case.better}", ""]


def main() -> int:
    """Solve all cases; the number of those that miss what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write docs/hard-cases.md")
    parser.add_argument("names", nargs="*", help="only cases whose name has one of these in it")
    given = parser.parse_args()
    text, missed = [HEAD], 0
    for kind, cases in groupby(CASES, key=lambda case: case.kind):
        text.append(f"## {kind[0].upper()}{kind[1:]}\n")
        for case in cases:
            if given.names and not any(name in case.name for name in given.names):
                continue
            reached = [solve(case, way) for way in case.ways]
            for one in reached:
                good = one.error <= case.asked[0]
                missed += not good
                print(
                    f"{'' if good else 'MISSED '}{case.name}, {one.way}: {one.error:.1e} of {case.asked[0]:.1e}",
                    flush=True,
                )
            text += lines_of(case, reached)
    if given.write:
        PAGE.write_text("\n".join(text).rstrip() + "\n", encoding="utf-8")
    return missed


if __name__ == "__main__":
    sys.exit(main())
