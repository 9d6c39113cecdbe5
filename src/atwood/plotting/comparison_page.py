"""Comparisons of many scenes on one page that needs nothing else: tables, and pictures within it."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from atwood.errors import UsageError
from atwood.files import write_atomically
from atwood.plotting.canvas import need_matplotlib
from atwood.plotting.plots.precision import plot_comparison, style_of
from atwood.study.comparison.found import RELATIVE, Comparison, cost_at, write_rows
from atwood.table import facts

_ERRORS = (1e-3, 1e-6, 1e-9)
"""Errors whose costs stand in the table of all scenes."""


def check_page(directory: Path) -> None:
    """Refuse a place where no page can be written, before any work is done."""
    need_matplotlib()
    if directory.exists() and not directory.is_dir():
        raise UsageError("it is a file, and a directory is needed", where=str(directory), advice="Give another name.")
    if not directory.exists() and not directory.absolute().parent.is_dir():
        raise UsageError("its parent is no directory", where=str(directory), advice="Make it first.")


def write_page(comparisons: Sequence[Comparison], failed: Mapping[str, str], directory: Path) -> Path:
    """Write ``index.html``, and all rows as ``comparisons.csv`` beside it, and return the page."""
    check_page(directory)
    directory.mkdir(exist_ok=True)
    labels = list(dict.fromkeys(row.label for one in comparisons for row in one.rows if not row.reason))
    body = [
        "<h1>What each form costs for which error</h1>",
        facts((comparisons[0].environment if comparisons else {}).items()).html(),
        f"<p>{escape(RELATIVE)} Times are of the integration alone. * as accurate as the reference itself.</p>",
        _legend(labels),
        _overview(comparisons, labels),
        *(_section(one) for one in comparisons),
        facts(failed.items(), "Without an answer").html() if failed else "",
    ]
    page = (
        "<!doctype html><html lang='en'><head><meta charset='utf-8'><title>Atwood: forms compared</title>"
        f"<style>{_STYLE}</style></head><body>{''.join(body)}</body></html>"
    )
    target = directory / "index.html"
    write_atomically(target, lambda part: part.write_text(page, encoding="utf-8"))
    write_rows(comparisons, directory / "comparisons.csv")
    return target


def _legend(labels: Sequence[str]) -> str:
    """Return the colours of the forms, which are the same in all pictures."""
    marks = (f"<span class='mark' style='background:{style_of(one, labels)[0]}'></span>{escape(one)}" for one in labels)
    return f"<p class='legend'>{'  '.join(marks)}</p>"


def _anchor(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name)


def _overview(comparisons: Sequence[Comparison], labels: Sequence[str]) -> str:
    """Return the table of all scenes: what each form takes for three errors, the least of a scene marked."""
    heads = "".join(f"<th>{escape(label)}</th>" for label in labels)
    rows = [
        f"<tr><th>scene</th>{heads}</tr>",
        *(_costs_of(one, labels) for one in comparisons),
    ]
    said = ", ".join(f"{error:.0e}" for error in _ERRORS)
    return f"<h2>All scenes: ms for errors of {said}</h2><table>{''.join(rows)}</table>"


def _cost(points: list[tuple[float, float]], error: float) -> float | None:
    """Return the time for an error: between the runs, or that of the cheapest where all are more accurate."""
    if points and max(errs for errs, _ in points) < error:
        return min(wall for _, wall in points)
    return cost_at(points, error) if points else None


def _costs_of(one: Comparison, labels: Sequence[str]) -> str:
    costs: dict[str, list[float | None]] = {}
    for label in labels:
        points = [(max(row.error or 0.0, 1e-16), row.wall_s) for row in one.rows if row.label == label and row.wall_s]
        costs[label] = [_cost(points, error) for error in _ERRORS]
    least = [min((c[k] or math.inf for c in costs.values()), default=math.inf) for k in range(len(_ERRORS))]

    def text(cost: float | None, best: float) -> str:
        if cost is None:
            return "&ndash;"
        shown = f"{1e3 * cost:.3g}"
        return f"<b>{shown}</b>" if cost <= 1.05 * best else shown

    cells = "".join(
        f"<td>{' / '.join(text(c, b) for c, b in zip(found, least, strict=True)) if any(found) else ''}</td>"
        for found in costs.values()
    )
    return f"<tr><th class='scene'><a href='#{_anchor(one.scene)}'>{escape(one.scene)}</a></th>{cells}</tr>"


def _section(one: Comparison) -> str:
    """Return what was found of a scene: sentence, picture and tables."""
    stream = io.BytesIO()
    plot_comparison(one).savefig(stream, format="svg", metadata={"Date": None})
    picture = base64.b64encode(stream.getvalue()).decode("ascii")
    return (
        f"<h2 id='{_anchor(one.scene)}'>{escape(one.scene)}, to t = {one.t_end:g} s</h2>"
        f"<p><b>{escape(one.verdict)}</b></p>"
        f"<img alt='error against time and steps' src='data:image/svg+xml;base64,{picture}'>"
        f"<details><summary>{len(one.rows)} runs</summary>{''.join(each.html() for each in one.tables())}</details>"
    )


_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;color:#22303c;max-width:1150px;margin:2em auto;padding:0 1em}
h1{font-size:1.6em}h2{font-size:1.15em;margin-top:2.2em}
table{border-collapse:collapse;font-size:13px;font-variant-numeric:tabular-nums}
td,th{padding:2px 10px;text-align:right;border-bottom:1px solid #e6eaee;white-space:nowrap}
th{color:#5a6773;font-weight:600}.scene{text-align:left}td:nth-child(2):last-child{white-space:normal}
.mark{display:inline-block;width:.8em;height:.8em;margin:0 .4em 0 1em;border-radius:2px}
img{width:100%;max-width:1000px;display:block}a{color:#2a6fbb;text-decoration:none}summary{cursor:pointer;color:#5a6773}
"""
