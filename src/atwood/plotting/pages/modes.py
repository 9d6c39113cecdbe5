"""A page of one small oscillation: slowly, as wide as one likes, with its shape as bars."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from atwood.errors import AtwoodError
from atwood.plotting.pages.document import write_document
from atwood.plotting.pages.page import Page, known_path, page_content, run_data
from atwood.plotting.pages.stage import set_stage
from atwood.plotting.pages.still import still_picture
from atwood.result.result import Result
from atwood.theory.linear.normal_modes import NormalModes

_AMPLITUDES = 0.05, 0.1, 0.15, 0.2, 0.3, 0.4
"""Of the largest displacement, rad or extents of the scene."""

_FRAMES, _SHOWN = 61, 2.5
"""Of a period: how many places are known, and how many seconds it takes on the page."""


def mode_page(modes: NormalModes, mode: int, shown: Sequence[str] = ()) -> Page:
    """Return the page of a mode, by its number."""
    swings = _swings(modes, mode)
    largest, shape = swings[-1], modes.shapes[mode]
    for path in shown:
        known_path(path, list(largest.paths))
    most = max(shape, key=lambda path: abs(shape[path]))
    content = page_content({"mode": largest}, list(shown) or [path for path in [most] if path in largest], {}, "never")
    reason = f"mode {mode} is shown, one period again and again"
    bars = [
        {
            "path": path,
            "size": abs(value),
            "signed": value.real if abs(value.imag) < 1e-9 * abs(value) else None,
            "degrees": float(np.degrees(np.angle(value))),
            "unit": largest.unit(path) if path in largest else "",
        }
        for path, value in shape.items()
    ]
    told = {
        "reason": reason,
        "facts": _told(modes, mode),
        "about": [[f"mode {k}", _told(modes, k).partition(": ")[2]] for k in range(len(modes))],
        "report": modes.as_text(),
        "oscillation": {
            "speed": float(largest.time[-1] - largest.time[0]) / _SHOWN,
            "largest": most,
            "shape": bars,
            "swings": [run_data("mode", one, set_stage(one), is_whole=True) for one in swings],
            "first": min(len(swings) - 1, _AMPLITUDES.index(0.2)),
        },
    }
    payload = {**content.payload, **told}
    return Page(write_document(payload, still_picture(content.stage, payload["title"]), {}), "recorded", reason)


def _swings(modes: NormalModes, mode: int) -> list[Result]:
    """Return a period of a mode by amplitude, as far as closed loops can follow."""
    found = [modes.motion(mode, _AMPLITUDES[0], _FRAMES)]
    with suppress(AtwoodError):
        for amplitude in _AMPLITUDES[1:]:
            found.append(modes.motion(mode, amplitude, _FRAMES))
    return found


def _told(modes: NormalModes, mode: int) -> str:
    """Return what there is to say of a mode in a line."""
    hertz, period = modes.frequencies[mode], modes.periods[mode]
    growth, ratio = modes.growth_rates[mode], modes.damping_ratios[mode]
    swings = f"{hertz:.6g} Hz, period {period:.6g} s, " if hertz else "does not oscillate, "
    return f"mode {mode}, counted from 0, of {len(modes)}: {swings}damping ratio {ratio:.4g}, growth {growth:.4g} 1/s"
