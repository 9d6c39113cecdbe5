"""`python -m tests.hard_cases [--write]`: solve all cases, show what is reached, and write the page.

What was reached is kept beside the page's cases in a file of figures where one is given, so that one case can be asked
again and the page be written with all of them.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from .case import KINDS, Case, Reached, solve
from .cases import CASES

PAGE = Path(__file__).parents[2] / "docs" / "hard-cases.md"

HEAD = """# Hard cases

Problems on which simulations of mechanisms fail: what is hard, what is asked, what each form reaches. The page is
written by `python -m tests.hard_cases --write`; the tests ask the same. Times are of one machine, with assembling and
compiling, and only tell forms apart. Errors in bold miss what is asked.

One problem of the test set for initial value problem solvers is not here: the wheelset, whose contact points are
unknowns of their own and whose creep is no part of the library.
"""


def lines_of(case: Case, reached: Sequence[Reached]) -> list[str]:
    """Return a case as Markdown."""
    limit, meaning = case.asked
    found = [f"### {case.name[0].upper()}{case.name[1:]}", ""]
    if case.refused:
        said = sorted({one.status for one in reached if one.solver == "refused"}, key=len)
        told = f"it says: *{said[0]}*" if said else "**it runs**"
        return [*found, f"{case.hard} Asked: {meaning}; {told}", "", f"Better: {case.better}", ""]
    found += [
        f"{case.hard} Asked: at most {limit:.2g} ({meaning}); known from: {case.source}.",
        "",
        "| form | reached | asked | steps | solver | time, s |",
        "|---|---|---|---|---|---|",
    ]
    for one in reached:
        asked = case.limit(one.way)
        error = f"{one.error:.1e}" if one.error <= asked else f"**{one.error:.1e}**"
        found.append(f"| {one.way} | {error} | {asked:.2g} | {one.steps:,} | {one.solver} | {one.seconds:.2g} |")
    return [*found, "", f"Better: {case.better}", ""]


def overview(reached: dict[str, list[Reached]]) -> list[str]:
    """Return a table of the kinds: how many cases there are, and how many ways meet what is asked."""
    text = ["| kind | cases | ways that meet what is asked |", "|---|---|---|"]
    for kind, cases in groupby(CASES, key=lambda case: case.kind):
        solved = [case for case in cases if case.name in reached]
        ways = [one.error <= case.limit(one.way) for case in solved for one in reached[case.name]]
        text.append(f"| [{kind}](#{kind.replace(' ', '-')}) | {len(solved)} | {sum(ways)} of {len(ways)} |")
    return [*text, ""]


def page(reached: dict[str, list[Reached]]) -> str:
    """Return the page of the cases that were solved."""
    text = [HEAD, *overview(reached)]
    for kind, cases in groupby(CASES, key=lambda case: case.kind):
        text.append(f"## {kind[0].upper()}{kind[1:]}\n")
        for case in cases:
            if case.name in reached:
                text += lines_of(case, reached[case.name])
    return "\n".join(text).rstrip() + "\n"


def main() -> int:
    """Solve all cases; the number of those that miss what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write docs/hard-cases.md")
    parser.add_argument("--quick", action="store_true", help="only cases that take a second or so")
    parser.add_argument("--kind", choices=KINDS, help="only cases of a kind")
    parser.add_argument("--keep", type=Path, help="file of what was reached: read first, and written with what is new")
    parser.add_argument("names", nargs="*", help="only cases whose name has one of these in it")
    given = parser.parse_args()
    kept: dict[str, list[Reached]] = {}
    if given.keep and given.keep.exists():
        told = json.loads(given.keep.read_text(encoding="utf-8"))
        kept = {name: [Reached(**one) for one in ways] for name, ways in told.items()}
    missed = 0
    for case in CASES:
        named = not given.names or any(name in case.name for name in given.names)
        if not named or (given.kind and case.kind != given.kind) or (given.quick and not case.quick):
            continue
        kept[case.name] = [solve(case, way) for way in case.ways]
        for one in kept[case.name]:
            good = one.error <= case.limit(one.way)
            missed += not good
            word = "" if good else "MISSED "
            print(f"{word}{case.name}, {one.way}: {one.error:.1e} of {case.limit(one.way):.1e}", flush=True)
        if given.keep:
            text = json.dumps({name: [asdict(one) for one in ways] for name, ways in kept.items()}, indent=1)
            given.keep.write_text(text + "\n", encoding="utf-8")
    if given.write:
        PAGE.write_text(page(kept), encoding="utf-8")
    return missed


if __name__ == "__main__":
    sys.exit(main())
