"""Work-precision diagrams with the ratios that matter written into them; how costs grow with the number of bodies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

__all__ = ["draw", "draw_growth"]

_C, _EXPLICIT, _TAYLOR = "C by hand, order 8(5,3)", "Atwood explicit", "Atwood taylor"


def draw(folder: Path, results: dict[str, Any]) -> None:
    """Draw time against error."""
    import matplotlib as mpl

    mpl.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    for name, found in results.items():
        path = folder / f"work-precision-{name.replace(' ', '-')}.png"
        _one(path, name, found)
        print(f"written: {path}")


def _one(path: Path, name: str, found: dict[str, Any]) -> None:
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(9.0, 6.0), layout="constrained")
    colours = iter(plt.get_cmap("tab20").colors)  # type: ignore[attr-defined]
    for way, points in found["points"].items():
        ours, by_hand = way.startswith("Atwood"), way.startswith("C by hand")
        style = {"linewidth": 2.2 if ours else 1.2, "linestyle": "--" if by_hand else "-"}
        shown = [(max(e, 1e-16), ms) for _, e, ms in points]
        axis.loglog(
            [e for e, _ in shown],
            [ms for _, ms in shown],
            marker="o" if ours else ("s" if by_hand else "."),
            markersize=4,
            color=next(colours),
            label=way,
            **style,
        )
    _annotate(axis, found)
    unit = "angles at the end, rad" if "pendulum" in name else "tip at the end, m"
    axis.set(title=f"{name}: time for an error", xlabel=f"error of the {unit}", ylabel="ms")
    axis.set_xlim(10.0, 1e-15)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _annotate(axis: Any, found: dict[str, Any]) -> None:
    """Write how many times the C by hand Atwood takes, above the errors that have a row in the table."""
    at = found["milliseconds"]
    if _C not in at:
        return
    low = min(ms for points in found["points"].values() for _, _, ms in points)
    for i, target in enumerate(found["errors"]):
        lines = []
        for way in (_EXPLICIT, _TAYLOR):
            if way in at and at[way][i] and at[_C][i]:
                lines.append(f"{way.split()[1]} {at[way][i] / at[_C][i]:.2f}")
        if lines:
            axis.axvline(target, color="0.8", linewidth=0.8, zorder=0)
            axis.text(target, 0.5 * low, "Atwood / C\n" + "\n".join(lines), fontsize=7, ha="center", va="bottom")
    axis.set_ylim(bottom=0.4 * low)


def draw_growth(folder: Path, results: dict[str, Any], stages: Sequence[str]) -> None:
    """Draw what each stage takes, and the memory after it, against the number of bodies: a column a scene."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    by_scene: dict[str, list[tuple[int, dict[str, float]]]] = {}
    for title, made in results.items():
        name, count = title.rsplit(" ", 1)
        if made is not None:
            by_scene.setdefault(name, []).append((int(count), made))
    size = (2.6 * len(by_scene) + 1.4, 5.2)
    figure, axes = plt.subplots(
        2, len(by_scene), figsize=size, sharex=True, sharey="row", squeeze=False, layout="constrained"
    )
    for column, (name, cases) in enumerate(by_scene.items()):
        counts = [count for count, _ in cases]
        for axis, suffix in ((axes[0, column], ""), (axes[1, column], ", MB")):
            for stage in stages[:3] if suffix else stages:  # later runs take no more memory
                values = [max(made[f"{stage}{suffix}"], 1e-4 if not suffix else 0.5) for _, made in cases]
                axis.loglog(counts, values, marker="o", markersize=3.5, linewidth=1.4, label=stage)
            last = max(cases[-1][1][f"{stage}{suffix}"] for stage in stages)
            axis.loglog(counts, [last * count / counts[-1] for count in counts], "--", color="0.6", label="linear")
            axis.grid(alpha=0.3)
        axes[0, column].set_title(name)
        axes[1, column].set_xlabel("bodies")
    axes[0, 0].set_ylabel("s of the processor")
    axes[1, 0].set_ylabel("most memory so far, MB")
    axes[0, 0].set_ylim(bottom=5e-4)
    axes[1, 0].set_ylim(bottom=0.5)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "growth.png"
    figure.savefig(path, dpi=130)
    plt.close(figure)
    print(f"written: {path}")
