"""The routine that checks forces and motions of states against every law.

`number` is the unit whose state contradicts most, by more than `slack`, and `better` the state it has then.
"""

from __future__ import annotations

from atwood.codegen.routines import BOOLEAN, Operand, Routine, Value
from atwood.integrators.sets.record import Sets, each_row, each_unit, is_loose, limit_of, norm, open_routine
from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS


class _Worst:
    """The state that contradicts most while it is looked for."""

    def __init__(self, r: Routine, m: Sets) -> None:
        self.r, self.m, self.miss = r, m, r.variable(m.slack)
        m.number = -1

    def consider(self, k: Value, miss: Value, state: int, x: Operand = 0.0, y: Operand = 0.0) -> None:
        """Take note of a state that would not contradict, where the present one does so more than others."""
        with self.r.when(miss > self.miss.now):
            self.miss.now = miss
            self.m.number, self.m.better, self.m.better_x, self.m.better_y = k, state, x, y


def _contradiction() -> Routine:
    """Find the unit whose state contradicts most, and the state it has then; -1 where none does."""
    r, m, () = open_routine("contradiction")
    forces, motions, free, size = m.row("forces"), m.row("motions"), m.row("wanted"), m.size
    response, worst = m.result("response"), _Worst(r, m)
    pushes, moves, total = r.variable(0.0), r.variable(0.0), r.variable(0.0)
    with each_unit(r, m, "chosen") as (k, _, _):
        pushes.now = r.most(r.size(limit_of(r, m, k, 0)), pushes.now)
        with each_row(r, m, k) as (_, row):
            pushes.now = r.most(r.size(forces[row]), pushes.now)
            by = response.at(row * size)
            total.now = 0.0
            with r.count(size) as j:
                total.now = total.now + r.size(by[j] * forces[j])
            moves.now = r.most(r.size(free[row]), r.most(total.now, moves.now))
    push, move = (r.choose(one.now > 0.0, one.now, 1.0) for one in (pushes, moves))
    with each_unit(r, m, "chosen") as (k, row, is_pair), r.when(~is_loose(r, m, k)):
        second = row + is_pair.integer()
        f = forces[row] / push, r.choose(is_pair, forces[second] / push, 0.0)
        a = motions[row] / move, r.choose(is_pair, motions[second] / move, 0.0)
        with r.when(m.unit("slip")[k] == 0.0):
            _check_gap(r, m, worst, k, f[0], a[0], limit_of(r, m, k, 1) / push)
        with r.otherwise():
            _check_slip(r, m, worst, k, (f, a, push, is_pair))
    r.give(0)
    return r


def _check_gap(r: Routine, m: Sets, worst: _Worst, k: Value, f: Value, a: Value, static: Value) -> None:
    with r.when(m.unit("next")[k] == float(STICKS)):
        worst.consider(k, 0.0 - f - static, OPEN)
        worst.consider(k, a, OPEN)  # rows that depend on each other cannot all stick
    worst.consider(k, 0.0 - a, STICKS)


def _check_slip(
    r: Routine,
    m: Sets,
    worst: _Worst,
    k: Value,
    at: tuple[tuple[Value, Value], tuple[Value, Value], Value, Value],
) -> None:
    """See by how much the state of a slip contradicts each law; see `atwood.numerics.contact_sets`."""
    f, a, push, is_pair = at
    state, x, y, given = m.unit("next")[k], m.unit("next_x")[k], m.unit("next_y")[k], m.unit("given")[k] != 0.0
    goes, sticks = state == float(GOES_ON), state == float(STICKS)
    back = (~is_pair & r.choose(goes, x < 0.0, f[0] > 0.0, BOOLEAN)).integer() * 2
    limit, static = limit_of(r, m, k, back) / push, limit_of(r, m, k, back + 1) / push
    reads, shares = r.variable(False, BOOLEAN), m.shares.at((back * m.count + k) * m.size)
    with r.count(m.size) as j:
        reads.now = reads.now | (shares[j] != 0.0)
    alone = (m.unit("at")[k] < 0.0) & ~reads.now
    idle = alone & (r.most(limit, static) <= 0.0)
    with r.when(idle):
        worst.consider(k, r.choose(state == float(OPEN), 0.0, 1.0), OPEN)
    size, motion = norm(r, *f), norm(r, *a)
    with r.when(~idle & sticks):
        unit = r.choose(size > 0.0, size, 1.0)
        way = r.choose(size > 0.0, 0.0 - f[0] / unit, 1.0), 0.0 - f[1] / unit
        worst.consider(k, size - static, GOES_ON, *way)
        worst.consider(k, motion, GOES_ON, *way)
    with r.when(~idle & goes):
        with r.when(alone):
            worst.consider(k, 0.0 - limit, OPEN)
        with r.when(~given):
            worst.consider(k, norm(r, f[0] + limit * x, f[1] + limit * y), STICKS)
            along = a[0] * x + a[1] * y
            with r.when(along <= 0.0):
                worst.consider(k, motion, STICKS)
            with r.otherwise():
                worst.consider(k, norm(r, a[0] - along * x, a[1] - along * y), GOES_ON, a[0] / motion, a[1] / motion)
    with r.when(~idle & ~goes & ~sticks):
        miss = r.most(r.most(limit, static), r.choose(reads.now, 1.0, 0.0))
        with r.when(given):
            worst.consider(k, miss, GOES_ON, m.unit("given_x")[k], m.unit("given_y")[k])
        with r.otherwise():
            worst.consider(k, miss, STICKS)


CHECKING = (_contradiction,)
