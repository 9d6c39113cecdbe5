"""Every scene of the library as a page computes it, in both forms, beside `simulate`: one table.

Milliseconds are those of Node at rtol 1e-8, after a first run: for a second of motion, and for the motion and the
poses of a frame of 1/60 s, in the middle and at most.

python -m tests.live_scenes [NAME ...]
"""

from __future__ import annotations

import sys
import time
import warnings
from typing import Any

import numpy as np

from atwood.errors import AtwoodError
from atwood.plotting.live import LiveProgram, live_program
from atwood_library.scenes import SCENES

from .plotting.test_live import RTOL, SPAN, played, state_at

RUN = """
print(given.map(([name, span]) => {
  const engine = start(name), said = engine.advance(span), state = Array.from(engine.state);
  const events = engine.events.map(one => one.time);
  const quick = start(name, {rtol: 1e-8});
  quick.advance(span);
  quick.reset();
  const took = [];
  for (let frame = 1; frame <= 60 * span; frame++) {
    const began = performance.now();
    quick.advance(frame / 60);
    quick.poses();
    quick.places();
    took.push(performance.now() - began);
  }
  took.sort((a, b) => a - b);
  const spent = took.reduce((sum, one) => sum + one, 0);
  return [said.code, said.text, engine.time, state, spent / span, took[took.length >> 1], took.at(-1), events];
}));
"""


def compared(name: str, form: str, found: list[Any], span: float) -> str:
    """Return how far a page is from `simulate`."""
    code, text, _, state, milliseconds, usual, longest, events = found
    if code != "reached":
        return f"{code}: {text}"
    tight, loose = (state_at(SCENES[name](), span, form=form, rtol=one, solver="explicit") for one in (1e-12, RTOL))
    if len(tight) != len(state):
        return f"{len(state)} unknowns beside {len(tight)}"
    apart, own = (float(np.max(np.abs(one - tight), initial=0.0)) for one in (np.array(state), loose))
    verdict = "" if apart <= max(1e-8, 100.0 * own) else "  FAR"
    frame = f"frame {usual:.2f} ms, longest {longest:.2f}"
    return f"{apart:.1e} (own {own:.1e}), {milliseconds:.2f} ms/s, {frame}, {len(events)} events{verdict}"


def main(names: list[str]) -> None:
    """Print the table."""
    made: dict[str, LiveProgram] = {}
    spans = {name: min(SPAN, SCENES[name]().t_end) if hasattr(SCENES[name](), "t_end") else SPAN for name in names}
    for name in names:
        for form in ("reduced", "dae"):
            began = time.perf_counter()
            try:
                made[f"{name} {form}"] = live_program(SCENES[name](), form)
            except AtwoodError as error:
                made[f"{name} {form}"] = LiveProgram(name, form, f"ERROR {error}")
            print(f"made {name} {form} in {time.perf_counter() - began:.2f} s", file=sys.stderr)
    live = [one for one in made if made[one].model]
    found = dict(zip(live, played(made, RUN, [[one, spans[one.split()[0]]] for one in live]), strict=True))
    for key, one in made.items():
        name, form = key.split()
        said = one.reason or compared(name, form, found[key], spans[name])
        print(f"{name:24} {form:8} {len(one.model) / 1000:7.1f} kB  {said}", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(sys.argv[1:] or list(SCENES))
