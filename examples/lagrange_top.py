"""The four motions of a top: the path of its axis on the unit sphere, and what stays constant along it."""

import math
import sys
from pathlib import Path

import numpy as np

import atwood
from atwood.plotting import plot_on_sphere
from atwood_library.scenes import LagrangeTop

MOTIONS = {
    "loops": "thrown against its precession",
    "cusps": "released at rest but for its spin",
    "waves": "thrown along with its precession",
    "steady": "thrown just as fast as it goes on",
}

results = {}
for motion, said in MOTIONS.items():
    top = LagrangeTop(motion=motion, inclination="55 deg", spin=50.0)
    once_round = 2.0 * math.pi / top.steady_precession()
    result = atwood.simulate(top, t_end=once_round, rtol=1e-10, outputs=1201)
    lean = np.degrees(result["top.theta"])
    drift = result.energy.max_drift
    print(f"{motion:<7} {said:<34} leans {lean.min():5.2f} to {lean.max():5.2f} degrees, energy kept to {drift:.0e}")
    results[f"{motion}\n{said}"] = result

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs" / "images"
folder.mkdir(parents=True, exist_ok=True)
plot_on_sphere(results, "top.z_axis", folder / "lagrange_top.png", view=(20, 35))
