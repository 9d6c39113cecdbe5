"""A closed loop: nobody says where to cut it, and the reactions of all pivots come out in both forms."""

import numpy as np

from atwood import report, simulate
from atwood_library.scenes import FourBar

scene = FourBar(crank_length=0.8)
print(report(scene))
reduced = simulate(scene, rtol=1e-11)
kept = simulate(scene, form="dae", rtol=1e-11)
for pivot in ("pivot1", "pivot2", "pivot3", "pivot4"):
    force = np.hypot(reduced[f"{pivot}.force.x"], reduced[f"{pivot}.force.z"])
    other = np.hypot(kept[f"{pivot}.force.x"], kept[f"{pivot}.force.z"])
    print(f"{pivot}: largest force {force.max():.6f} N, forms differ by {np.max(np.abs(force - other)):.1e} N")
