"""The energy error of the methods of Gauss over many periods: the last tenth of a run against its first.

Each line has the method's order and steps a period, the largest error of the energy in the first and in the last tenth,
their ratio, steps, evaluations a step, and time a step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from timing import options, save

from atwood import simulate
from atwood_library.scenes import Kepler, SimplePendulum, SphericalPendulum

SHOWN = 20_000


def main(arguments: Sequence[str] | None = None) -> None:
    """Run each system, and print its line."""
    chosen = options(__doc__, arguments)
    periods = 100 if chosen.quick else 100_000
    results = {}
    systems = {
        "pendulum": (SimplePendulum(), 2.1397, 6, 24.3),
        "Kepler, e = 0.5": (Kepler(eccentricity=0.5), 2.0 * math.pi, 8, 50.3),
        "spherical pendulum": (SphericalPendulum(coordinates="angles"), 2.0, 6, 40.3),
    }
    for name, (scene, period, order, count) in systems.items():
        end = periods * period
        times = np.concatenate([np.linspace(0.0, 0.1 * end, SHOWN), np.linspace(0.9 * end, end, SHOWN)])
        run = simulate(scene, t_end=end, solver="gauss", order=order, step=period / count, outputs=times, samples=1)
        errors = np.abs(run.energy.total - run.energy.total[0])
        first, last = float(np.max(errors[:SHOWN])), float(np.max(errors[SHOWN:]))
        done = run.statistics
        results[name] = {"order": order, "first tenth, J": first, "last tenth, J": last, "steps": done.steps}
        print(
            f"{name:<20}order {order:>2}, {count:g} steps a period: first {first:.4e} J, last {last:.4e} J, "
            f"ratio {last / first:.5f}; {done.steps} steps, {done.residual_evaluations / done.steps:.1f} evaluations "
            f"and {1e6 * done.seconds / done.steps:.2f} us a step"
        )
    save(chosen.json, results)


if __name__ == "__main__":
    main()
