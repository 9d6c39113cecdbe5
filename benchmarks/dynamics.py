"""`atwood.dynamics` of chains of rigid bodies on universal joints beside Pinocchio in the same run, both from Python.

Inverse dynamics is `rnea` there, bias `nle`, the mass matrix `crba`. Arrays are given, and of many
calls the fastest counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from space import chain, pinocchio_model
from timing import options, peer, print_table, ratio, save

import atwood

PAIRS = {"inverse_dynamics": ("rnea", 1.0), "bias": ("nle", 1.0), "mass_matrix": ("crba", 2.0)}
"""What Pinocchio calls it, and how many times as long Atwood may take."""


def fastest(calls: dict[str, Callable[[], object]], times: int) -> dict[str, float]:
    """Return the fastest of so many calls of each, some in a row, all in turn."""
    best = dict.fromkeys(calls, np.inf)
    for _ in range(times // 50):
        for name, call in calls.items():
            for _ in range(50):
                began = time.perf_counter()
                call()
                best[name] = min(best[name], time.perf_counter() - began)
    return best


def measure(links: int, times: int) -> dict[str, Any]:
    """Time one chain."""
    found = atwood.dynamics(chain(links))
    n = len(found.speeds)
    random = np.random.default_rng(3)
    state = [random.uniform(0.2, 0.9, n) for _ in range(3)]
    outs = {"inverse_dynamics": np.empty(n), "bias": np.empty(n), "mass_matrix": np.empty((n, n))}
    counts = {"inverse_dynamics": 3, "bias": 2, "mass_matrix": 1}
    calls: dict[str, Callable[[], object]] = {}
    for name, count in counts.items():
        function = getattr(found, name)
        calls[name] = lambda f=function, s=state[:count], o=outs[name]: f(*s, out=o)  # type: ignore[misc]
        calls[name]()
    pinocchio = peer("pinocchio")
    if pinocchio:
        check(pinocchio, found, state, links)
        model = pinocchio_model(pinocchio, links)
        data = model.createData()
        for name, (theirs, _) in PAIRS.items():
            function = getattr(pinocchio, theirs)
            calls[theirs] = lambda f=function, s=state[: counts[name]]: f(model, data, *s)  # type: ignore[misc]
    return {"links": links, **fastest(calls, times)}


def check(pinocchio: Any, found: atwood.Dynamics, state: Sequence[np.ndarray], links: int) -> None:
    """Stop if generalized forces or mass matrices differ from Pinocchio's."""
    order = [int(path.split(".")[0][5:]) * 2 + path.endswith("b") for path in found.coordinates]
    model = pinocchio_model(pinocchio, links)
    theirs = [np.empty_like(one) for one in state]
    for mine, other in zip(state, theirs, strict=True):
        other[order] = mine
    forces = pinocchio.rnea(model, model.createData(), *theirs)[order]
    matrix = pinocchio.crba(model, model.createData(), theirs[0])
    matrix = (np.triu(matrix) + np.triu(matrix, 1).T)[np.ix_(order, order)]
    for mine, other in ((found.inverse_dynamics(*state), forces), (found.mass_matrix(state[0]), matrix)):
        if not np.allclose(mine, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(other))):
            raise SystemExit(f"it differs from Pinocchio by {np.max(np.abs(mine - other)):.1e}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    rows = [measure(links, 200 if chosen.quick else 2000) for links in ((3,) if chosen.quick else (5, 20))]
    table = []
    for row in rows:
        for name, (theirs, most) in PAIRS.items():
            cells = [f"{row['links']}, {name}", 1e6 * row[name], theirs, theirs in row and 1e6 * row[theirs]]
            table.append([*cells, ratio(row[name], row.get(theirs)), f"<= {most:g}"])
    print_table("One call from Python", ["bodies", "Atwood us", "Pinocchio", "us", "Atwood / Pinocchio", ""], table)
    save(chosen.json, rows)


if __name__ == "__main__":
    main()
