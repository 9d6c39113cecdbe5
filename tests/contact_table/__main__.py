"""The command: `python -m tests.contact_table`. It prints the largest error of each row in each view and form."""

from __future__ import annotations

import time
import warnings

import click

from .rows import ROWS
from .views import VIEWS

FORMS = ("reduced", "dae")


def worst_of(row: str, view: str, form: str) -> tuple[float, str]:
    """Return the largest error of a row, in units of its scene, and what it is of; infinity where there is no run."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pairs = ROWS[row].check(VIEWS[view], form)
    except Exception as error:  # the table tells of every row
        return float("inf"), f"{type(error).__name__}: {error}"
    return max((abs(found - known), what) for what, found, known in pairs)


@click.command()
@click.option("--row", "rows", multiple=True, type=click.Choice(list(ROWS)), help="Rows; all if not given.")
@click.option("--view", "views", multiple=True, type=click.Choice(list(VIEWS)), help="Views; all if not given.")
@click.option("--form", "forms", multiple=True, type=click.Choice(FORMS), help="Forms; both if not given.")
def main(rows: tuple[str, ...], views: tuple[str, ...], forms: tuple[str, ...]) -> None:
    """Check rows against what is known; the exit status is 1 if one is further off than it may be."""
    views, missed = views or tuple(VIEWS), 0
    print(f"{'':24}" + "".join(f"{view:>11}" for view in views))
    for row in rows or tuple(ROWS):
        for form in forms or FORMS:
            began, said = time.process_time(), []
            line = f"{row:17}{form:7}"
            for view in views:
                worst, what = worst_of(row, view, form)
                is_off = not worst <= ROWS[row].off
                missed += is_off
                line += f"{worst:10.1e}{'*' if is_off else ' '}"
                said += [f"    {view}: {what}"] if is_off else []
            print(f"{line}{time.process_time() - began:7.1f} s", *said, sep="\n", flush=True)
    raise SystemExit(missed > 0)


if __name__ == "__main__":
    main(prog_name="python -m tests.contact_table")
