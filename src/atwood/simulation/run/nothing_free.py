"""One stretch of a run in which nothing is free to move: its state is a function of time."""

from __future__ import annotations

import numpy as np

from atwood.clock import TimeIsUp, check_time
from atwood.integrators.protocol import Statistics
from atwood.simulation.events.modes import EventRecord
from atwood.simulation.run.recorder import Recorder
from atwood.simulation.run.run_record import Outcome, Segment


def follow(segment: Segment, recorder: Recorder, t: float) -> Outcome:
    """Go through a mode in which nothing is free to move: its state is a function of time, its events still happen."""
    nothing, last, options = np.zeros(0), t, segment.options
    noted: list[EventRecord] = []

    def ended(t: float, status: str, message: str = "", event: EventRecord | None = None) -> Outcome:
        return Outcome(t, status, message, Statistics(), (segment.choice,), event, noted=tuple(noted))

    try:
        for moment, show in zip(segment.samples.times, segment.samples.shown, strict=True):
            check_time()
            event = segment.probe.between(last, float(moment))
            while event is not None and not event.target:
                noted.append(event)
                recorder.take(event.time, nothing, True)
                event = segment.probe.between(event.time, float(moment))
            if event is not None:
                recorder.take(event.time, nothing, True)
                return ended(event.time, "event", event=event)
            last = float(moment)
            recorder.take(last, nothing, bool(show))
            if options.progress is not None:
                options.progress(last)
    except TimeIsUp:
        last = recorder.close()
        return ended(last, "time_limit", options.out_of_time(last))
    return ended(last, "finished")
