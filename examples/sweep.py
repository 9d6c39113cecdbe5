"""Ten thousand double pendulums: how often does the lower rod go over the top within ten seconds?"""

import numpy as np

from atwood import simulate, sweep
from atwood_library.scenes import DoublePendulum

angles = np.linspace(-np.pi, np.pi, 100)
found = sweep(DoublePendulum(), start={"rod1.angle": angles, "rod2.angle": angles}, t_end=10.0, rtol=1e-6)
turns = np.abs(found.grid("rod2.angle")) > np.pi
print(f"{np.mean(turns):.1%} of {len(found)} runs end with the lower rod over the top")
statistics = found.statistics
print(f"{statistics.batched} runs in machine code, {1e6 * statistics.wall_seconds / len(found):.0f} microseconds each")

# Parameters are varied in the same way, and lists from anywhere: here a random sample, each run with its own masses.
random = np.random.default_rng(1)
masses = {"mass1": random.uniform(0.5, 2.0, 200), "mass2": random.uniform(0.5, 2.0, 200)}
spread = sweep(DoublePendulum(), masses, combine="list", t_end=1.0, quantities=["rod1.tension"])
print(f"the tension after 1 s lies between {spread['rod1.tension'].min():.2f} and {spread['rod1.tension'].max():.2f} N")

# Any run can be had by itself, with all its quantities.
worst = int(np.argmax(spread.end("rod1.tension")))
scene = DoublePendulum(mass1=masses["mass1"][worst], mass2=masses["mass2"][worst])
print(f"run {worst} again: {simulate(scene, t_end=1.0)['rod1.tension'][-1]:.2f} N")
