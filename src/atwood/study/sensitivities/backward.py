"""Steps of an explicit pair taken back: what changes at the end of each, in terms of what changes at its begin.

A step is ``K_i = f(t + c_i h, y + h sum_j a_ij K_j)``, and ends at ``P(y + h sum_i b_i K_i)``, with the projection P
onto the constraints. A cotangent C of its end becomes ``C := P'^T C``; then, from the last stage to the first,
``M_i = f'(Y_i)^T h (b_i C + sum_j a_ji M_j)``; and ``C + sum_i M_i`` is that of its begin (W. W. Hager, Numerische
Mathematik 87, 2000; A. Walther, Computational Optimization and Applications 36, 2007). That is exact for the steps
taken. Kept of a run is where each step begins; the stages are worked out again.
"""

from __future__ import annotations

from atwood.codegen.llvm.build import RoutineSource
from atwood.codegen.routines import (
    ADDRESS,
    CODE,
    INTEGER,
    NUMBER,
    Routine,
    Value,
    Variable,
    call_kernel,
    place_of,
)
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.integrators.protocol import MET, STEPS

HEAD = 5
"""So many addresses the data of the routines begin with: derived values of four programs, and scratch."""


def backward_source(coordinates: int, speeds: int, given: bool, projects: bool, parameters: int) -> RoutineSource:
    """Return what writes ``record``, ``ahead`` and ``back``."""
    files = ("integrators/protocol.py", "integrators/embedded/tableau.py", "integrators/methods/dormand_prince.py")
    about = (coordinates, speeds, given, projects, parameters)
    return RoutineSource("study.sensitivities.backward", files, about)


def room_of(coordinates: int, speeds: int, parameters: int) -> int:
    """Return the length of the work array."""
    return (2 * TABLEAU.end + STEPS + 3) * (coordinates + speeds) + speeds + parameters


def write_routines(coordinates: int, speeds: int, given: bool, projects: bool, parameters: int) -> list[Routine]:
    """Write the routines; see `backward_source`."""
    one = _Writer(coordinates, speeds, given, projects, parameters)
    return [_record(coordinates + speeds), one.step(), one.ahead(), one.back()]


def _record(n: int) -> Routine:
    """Keep where a step begins. The data: how many there are, how many have room, and the addresses of both arrays."""
    arguments = {"t": NUMBER, "y": ADDRESS, "p": ADDRESS, "t_new": NUMBER, "y_new": ADDRESS, "p_new": ADDRESS}
    r = Routine("record", arguments | {"data": ADDRESS}, exported=True)
    t, y, _, _, _, _, data = r.arguments
    count = data.read(0, INTEGER)
    with r.when(count < data.read(1, INTEGER)):
        data.read(2, ADDRESS)[count] = t
        r.copy(data.read(3, ADDRESS).at(count * n), y, n)
    data.write(0, count + 1, INTEGER)
    r.give(0)
    return r


class _Work:
    """Places in the work array."""

    def __init__(self, r: Routine, work: Value, n: int) -> None:
        stages = TABLEAU.end
        self.slopes, self.stages, self.iterates = work, work.at(stages * n), work.at(2 * stages * n)
        rest = work.at((2 * stages + STEPS + 1) * n)
        self.pulled, self.base, self.more = rest, rest.at(n), rest.at(2 * n)


class _Writer:
    """Writes the routines for one size of state."""

    def __init__(self, coordinates: int, speeds: int, given: bool, projects: bool, parameters: int) -> None:
        self.split, self.n = coordinates, coordinates + speeds
        self.speeds, self.given, self.projects, self.parameters = speeds, given, projects, parameters
        self.pair: Tableau = TABLEAU

    def _rates(self, r: Routine, data: Value, t: Value, y: Value, target: Value) -> Value:
        """Call the right-hand side."""
        u, cut = y.at(self.split), target.at(self.split)
        if not self.given:
            r.copy(target, u, self.speeds)
        outputs = [target, cut] if self.given else [cut]
        return call_kernel(r, "kernel", [place_of(r, t), y, u], data.read(0, ADDRESS), data.read(4, ADDRESS), outputs)

    def _pull(self, r: Routine, data: Value, number: int, t: Value, y: Value, c: Value, w: _Work) -> Value:
        """Call what hands a cotangent back through the right-hand side or the projection."""
        name = ("pull", "pull_nearer")[number]
        inputs = [place_of(r, t), y, y.at(self.split), c]
        return call_kernel(
            r, name, inputs, data.read(2 + number, ADDRESS), data.read(4, ADDRESS), [w.pulled, w.more.at(self.speeds)]
        )

    def step(self) -> Routine:
        """Write a step: its slopes, stages, and iterates of the projection; how many these are, -1 where it fails."""
        arguments = {"t": NUMBER, "h": NUMBER, "y": ADDRESS, "work": ADDRESS, "data": ADDRESS}
        r = Routine("step", arguments, result=INTEGER)
        t, h, y, work, data = r.arguments
        w, n = _Work(r, work, self.n), self.n
        for stage in range(self.pair.end + 1):
            target = w.stages.at(stage * n) if stage < self.pair.end else w.iterates
            weights = self.pair.stages[stage - 1] if stage else {}
            with r.count(n) as j:
                total = y[j]
                for row, weight in weights.items():
                    total = total + w.slopes[j + row * n] * (h * weight)
                target[j] = total
            if stage < self.pair.end:
                time = t + h * self.pair.nodes[stage]
                r.give_if(self._rates(r, data, time, target, w.slopes.at(stage * n)) != 0, -1)
        if not self.projects:
            r.give(0)
            return r
        with r.count(STEPS) as i:
            at, to = w.iterates.at(i * n), w.iterates.at((i + 1) * n)
            inputs, outputs = [place_of(r, t + h), at, at.at(self.split)], [to, to.at(self.split), w.more]
            code = call_kernel(r, "nearer", inputs, data.read(1, ADDRESS), data.read(4, ADDRESS), outputs)
            r.give_if(code != 0, -1)
            largest = r.variable(0.0)
            with r.count(self.speeds) as j:
                largest.now = r.most(r.size(w.more[j]), largest.now)
            with r.when(largest.now <= MET):
                r.give(i + 1)
        r.give(-1)
        return r

    def ahead(self) -> Routine:
        """Write steps from states, each by itself; the states where they end."""
        arguments = {"count": INTEGER, "times": ADDRESS, "steps": ADDRESS, "begins": ADDRESS, "ends": ADDRESS}
        r = Routine("ahead", arguments | {"work": ADDRESS, "data": ADDRESS}, exported=True)
        count, times, steps, begins, ends, work, data = r.arguments
        w, n = _Work(r, work, self.n), self.n
        with r.count(count) as k:
            found = r.call("step", times[k], steps[k], begins.at(k * n), work, data, result=INTEGER)
            r.give_if(found < 0, 1)
            r.copy(ends.at(k * n), w.iterates.at(found * n), n)
        r.give(r.value(0, CODE))
        return r

    def back(self) -> Routine:
        """Write the sweep over steps, from the last to the first.

        `lines` says for each its row among the states, and the row of weights that it ends with, whose cotangent at the
        begin is added; or -1 where it goes on to the step that was taken back before.
        """
        arguments = {"count": INTEGER, "times": ADDRESS, "steps": ADDRESS, "lines": ADDRESS, "states": ADDRESS}
        arguments |= {"weights": ADDRESS, "adjoint": ADDRESS, "gradient": ADDRESS, "work": ADDRESS, "data": ADDRESS}
        r = Routine("back", arguments, exported=True)
        count, times, steps, lines, states, weights, adjoint, gradient, work, data = r.arguments
        w, n = _Work(r, work, self.n), self.n
        with r.count(count) as k:
            t, h = times[k], steps[k]
            row, place = lines.read(k * 2, INTEGER), lines.read(k * 2 + 1, INTEGER)
            branches = place >= 0
            y = states.at(row * n)
            found = r.call("step", t, h, y, work, data, result=INTEGER)
            r.give_if(found < 0, 1)
            with r.when(branches):
                r.copy(w.base, weights.at(place * n), n)
            with r.otherwise():
                r.copy(w.base, adjoint, n)
            self._unproject(r, data, t + h, r.variable(found, INTEGER), gradient, w)
            self._unstep(r, data, t, h, gradient, w)
            with r.when(~branches):
                r.clear(adjoint, adjoint.at(n))
            with r.count(n) as j:
                adjoint[j] = adjoint[j] + w.base[j]
        r.give(r.value(0, CODE))
        return r

    def _unproject(self, r: Routine, data: Value, t: Value, left: Variable, gradient: Value, w: _Work) -> None:
        """Take a cotangent back through the iterates of the projection."""
        if not self.projects:
            return
        with r.forever() as turns:
            with r.when(left.now <= 0):
                r.leave(turns)
            left.now = left.now - 1
            r.give_if(self._pull(r, data, 1, t, w.iterates.at(left.now * self.n), w.base, w) != 0, 1)
            r.copy(w.base, w.pulled, self.n)
            self._gather(r, gradient, w)

    def _unstep(self, r: Routine, data: Value, t: Value, h: Value, gradient: Value, w: _Work) -> None:
        """Take a cotangent back through the stages; those of slopes take the place of the slopes."""
        n, pair = self.n, self.pair
        with r.count(n) as j:
            end = w.base[j]
            for stage in range(pair.end):
                w.slopes[j + stage * n] = end * (h * pair.stages[pair.end - 1].get(stage, 0.0))
        for stage in reversed(range(pair.end)):
            time, place = t + h * pair.nodes[stage], w.stages.at(stage * n)
            r.give_if(self._pull(r, data, 0, time, place, w.slopes.at(stage * n), w) != 0, 1)
            self._gather(r, gradient, w)
            with r.count(n) as j:
                own = w.pulled[j]
                w.base[j] = w.base[j] + own
                for row, weight in (pair.stages[stage - 1] if stage else {}).items():
                    w.slopes[j + row * n] = w.slopes[j + row * n] + own * (h * weight)

    def _gather(self, r: Routine, gradient: Value, w: _Work) -> None:
        own = w.more.at(self.speeds)
        with r.count(self.parameters) as k:
            gradient[k] = gradient[k] + own[k]
