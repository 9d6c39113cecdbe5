"""What pictures of scenes in a plane and on a line consist of, in a few numbers."""

import numpy as np
from matplotlib.figure import Figure


def fingerprint(figure: Figure) -> dict[str, list[float]]:
    """Return the size of a figure, and for each kind of thing drawn how many there are and the sums of its places."""
    found: dict[str, list[float]] = {"size": [float(side) for side in figure.get_size_inches()]}
    kinds: dict[str, list[np.ndarray]] = {"lines": [], "patches": [], "traces": []}
    for axes in figure.axes:
        kinds["lines"] += [np.column_stack(line.get_data()).astype(float) for line in axes.get_lines()]
        kinds["patches"] += [patch.get_patch_transform().transform(patch.get_path().vertices) for patch in axes.patches]
        kinds["traces"] += [path.vertices for one in axes.collections for path in one.get_paths()]
        found.setdefault("limits", []).extend([*axes.get_xlim(), *axes.get_ylim()])
    for kind, pieces in kinds.items():
        points = np.concatenate(pieces) if pieces else np.zeros((0, 2))
        sums = [*points.sum(axis=0), *np.abs(points).sum(axis=0), float(points.prod(axis=1).sum())]
        found[kind] = [float(len(pieces)), float(len(points)), *(float(one) for one in sums)]
    return found
