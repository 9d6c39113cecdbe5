"""Validation: committed figures of accuracy, drawn when the site is built; nothing is run for it."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from statistics import median
from typing import Any

from gallery import write

from atwood.plotting.canvas import COLOURS, GREY, legend, new_figure, polish

HERE = Path(__file__).parent
PAGES = HERE / "validation"
_METHODS = "reduced, explicit", "dae, explicit", "reduced, IDA", "dae (ggl), IDA"
_EXACT = 1e-17
_INTRODUCTION = """How far the motions that Atwood computes are from true ones: scenes of the library against their
references, hard cases against what is known of them, and the exact solutions that tests compare with. Figures of scenes
are those of {date}, on {processor} ({system}; {versions}); errors depend little on the machine.
`python -m tests.validation` and `python -m tests.hard_cases --write` make all figures anew. How one's own run is
judged: [how right a run is](../accuracy.md), and [comparing forms and methods](../comparing.md)."""
_SCENES = """## Scenes of the library

{count} scenes, in both forms, with explicit and implicit methods: the largest difference from the reference, of
positions relative to the scene's extent and of angles, over the tolerance that was asked for. References are closed
forms where there are any, else solutions that are far more accurate. Chaotic scenes and those with impacts lie above
the others: there an error grows by itself. What `compare` refuses, or had no time for in ten seconds, is said below."""
_CASES = """## Hard cases

[Problems on which simulations of mechanisms fail](../hard-cases.md): {count} runs, and what each reached over what was
asked; left of the line is better."""


def write_validation(*_: Any) -> None:
    """Write the page and its pictures."""
    PAGES.mkdir(exist_ok=True)
    rows = list(csv.DictReader((HERE / "validation.csv").read_text(encoding="utf-8").splitlines()))
    where = json.loads((HERE / "validation.json").read_text(encoding="utf-8"))
    cases = (HERE / "hard-cases.md").read_text(encoding="utf-8")
    references = (HERE.parent / "tests" / "references" / "README.md").read_text(encoding="utf-8")
    _draw_scenes(rows)
    count = _draw_cases(cases)
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    parts = [
        "# Validation",
        _INTRODUCTION.format(**where),
        _SCENES.format(count=len(scenes)),
        "![Errors over tolerances](scenes.png)",
        _medians(rows),
        "<details><summary>All scenes, at a tolerance of 1e-10</summary>\n\n" + _scenes(rows) + "\n\n</details>",
        _CASES.format(count=count),
        "![What was reached over what was asked](cases.png)",
        "## Exact solutions that tests compare with\n\nWritten without Atwood, by NumPy, SciPy and mpmath.\n\n"
        + _table_in(references),
        "## Beside other programs\n\n58 examples of the Modelica Standard Library: [how they compare](../modelica.md).",
    ]
    write(PAGES / "index.md", "\n\n".join(parts) + "\n")


def _number(text: str) -> float | None:
    return max(float(text), _EXACT) if text else None


def _errors(rows: list[dict[str, str]], method: str, rtol: str) -> list[float]:
    found = (
        _number(row["error"]) for row in rows if (row["method"], row["rtol"]) == (method, rtol) and not row["said"]
    )
    return [one for one in found if one is not None]


def _rtols(rows: list[dict[str, str]]) -> list[str]:
    return sorted({row["rtol"] for row in rows if row["rtol"]}, key=float, reverse=True)


def _draw_scenes(rows: list[dict[str, str]]) -> None:
    figure = new_figure(7.0, 4.4)
    axes = figure.subplots()
    rtols = _rtols(rows)
    for k, method in enumerate(_METHODS):
        for rtol in rtols:
            errors = _errors(rows, method, rtol)
            label = method if rtol == rtols[0] else None
            place = [float(rtol) * 1.6 ** (k - 1.5)] * len(errors)
            axes.plot(place, errors, "o", color=COLOURS[k], markersize=3.2, alpha=0.55, label=label)
    axes.plot([float(one) for one in rtols], [float(one) for one in rtols], color=GREY, linewidth=1.0)
    axes.set_xscale("log")
    axes.set_yscale("log")
    polish(axes, "relative tolerance", "error")
    legend(axes, beside=1.0)
    figure.savefig(PAGES / "scenes.png", dpi=110, metadata={"Software": None})


def _medians(rows: list[dict[str, str]]) -> str:
    rtols = _rtols(rows)
    lines = [
        "| middle of all scenes | " + " | ".join(f"asked {one}" for one in rtols) + " |",
        "|---" * (len(rtols) + 1) + "|",
    ]
    for method in _METHODS:
        of = [_errors(rows, method, rtol) for rtol in rtols]
        lines.append(
            f"| {method} | " + " | ".join(f"{median(one):.1e} ({len(one)} scenes)" if one else "" for one in of) + " |"
        )
    return "\n".join(lines)


def _scenes(rows: list[dict[str, str]]) -> str:
    rtol = _rtols(rows)[-1]
    lines = ["| scene | " + " | ".join(_METHODS) + " | against |", "|---" * (len(_METHODS) + 2) + "|"]
    for scene in dict.fromkeys(row["scene"] for row in rows):
        own = [row for row in rows if row["scene"] == scene]
        of = {row["method"]: row["error"] or row["said"] for row in own if row["rtol"] == rtol}
        against = own[0]["reference"].partition(";")[0] or own[0]["said"]
        cells = (of.get(method, "").replace("|", "\\|")[:60] for method in _METHODS)
        lines.append(f"| [{scene}](../gallery/{scene}.md) | " + " | ".join(cells) + f" | {against} |")
    return "\n".join(lines)


def _draw_cases(text: str) -> int:
    """Draw each run of each kind as a dot, and return how many there are."""
    found: list[tuple[str, str, float]] = []
    kind = ""
    for line in text.splitlines():
        if line.startswith("## "):
            kind = line[3:]
        match = re.match(r"\| (reduced|dae)[^|]*\| \*{0,2}([\d.e+-]+)\*{0,2} \| ([\d.e+-]+) \|", line)
        if match:
            found.append((kind, match[1], max(float(match[2]), _EXACT) / float(match[3])))
    kinds = list(dict.fromkeys(one[0] for one in found))
    figure = new_figure(7.0, 4.4)
    axes = figure.subplots()
    for k, form in enumerate(("reduced", "dae")):
        own = [(share, kinds.index(kind) + 0.2 * k) for kind, of, share in found if of == form]
        axes.plot(*zip(*own, strict=True), "o", color=COLOURS[k], markersize=3.5, alpha=0.6, label=form)
    axes.axvline(1.0, color=GREY, linewidth=1.0)
    axes.set_xscale("log")
    axes.set_yticks(range(len(kinds)), kinds)
    axes.invert_yaxis()
    polish(axes, "reached, over what was asked", "")
    legend(axes, beside=1.0)
    figure.savefig(PAGES / "cases.png", dpi=110, metadata={"Software": None})
    return len(found)


def _table_in(text: str) -> str:
    return "\n".join(line for line in text.splitlines() if line.startswith("|"))


if __name__ == "__main__":
    write_validation()
