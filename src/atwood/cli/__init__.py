"""The command line. Its modules import what is heavy only inside the functions that need it."""

import atexit
import gc
import os

# What is built stays until the end: to look through it again and again for something to free takes a tenth of a run.
gc.set_threshold(400_000, 20, 100)
# Nor at the end, where the process gives everything back at once: that takes a sixth of a run.
atexit.register(gc.freeze)

# Matrices here are small: threads of the linear algebra would wait for each other longer than they work. It is read
# when NumPy is loaded, so it stands before everything else; whoever has set it keeps the last word.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
from atwood.cli.app import main  # noqa: E402 - see above

__all__ = ["main"]
