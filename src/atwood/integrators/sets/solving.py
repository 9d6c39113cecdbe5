"""Routines for forces and motions of states that are tried.

`next` of the chosen units says which rows act. Their equations go to `matrix` and `right` and are solved in `left` and
`across`; `repeats` says whether they depend on each other. `forces` and `motions` are of all rows, from the motions
without forces, which are `wanted`.
"""

from __future__ import annotations

from atwood.codegen.routines import BOOLEAN, INTEGER, Routine, Value
from atwood.integrators.sets.record import Sets, each_row, each_unit, is_loose, limit_of, norm, open_routine, product_of
from atwood.numerics.contact_sets import CLEAR, GOES_ON, OPEN, STICKS, STILL, TURNS

_SHORT = 1e-20
"""Squares of rows of length one that are no larger are rounding."""


def _solve() -> Routine:
    """Solve the system of the acting rows; where they depend on each other, by least norm."""
    r, m, (count,) = open_routine("solve_forces", {"count": INTEGER})
    matrix, left, right, solution, size = m.matrix, m.left, m.row("right"), m.row("solution"), m.size
    stride, largest = size + 1, r.variable(0.0)
    m.repeats = 0
    with r.count(count) as i:
        row, own = matrix.at(i * size), left.at(i * stride)
        largest.now = 0.0
        with r.count(count) as j:
            largest.now = r.most(r.size(row[j]), largest.now)
        unit = r.choose(largest.now > 0.0, largest.now, 1.0)
        with r.count(count) as j:
            row[j] = row[j] / unit
            own[j] = row[j]
        right[i] = right[i] / unit
        own[count] = right[i]
    best = r.variable(0, INTEGER)
    with r.count(count) as i:
        largest.now = -1.0
        with r.count(count, i) as k:
            entry = r.size(left[k * stride + i])
            with r.when(entry > largest.now):
                largest.now, best.now = entry, k
        with r.when(~(largest.now > CLEAR)):
            m.repeats = 1
            r.give(r.call("least_forces", r.arguments[0], count))
        pivot, other = left.at(i * stride), left.at(best.now * stride)
        with r.count(count + 1, i) as j:
            a, b = pivot[j], other[j]
            pivot[j] = b
            other[j] = a
        with r.count(count, i + 1) as k:
            row = left.at(k * stride)
            share = row[i] / pivot[i]
            with r.count(count + 1, i + 1) as j:
                row[j] = row[j] - share * pivot[j]
    total = r.variable(0.0)
    with r.count(count) as turn:
        i = count - 1 - turn
        row = left.at(i * stride)
        total.now = 0.0
        with r.count(count, i + 1) as k:
            total.now = total.now + row[k] * solution[k]
        solution[i] = (row[count] - total.now) / row[i]
    r.give(0)
    return r


def _least() -> Routine:
    """Find the shortest solution: rows are made square to each other, the largest first; what follows is left out."""
    r, m, (count,) = open_routine("least_forces", {"count": INTEGER})
    matrix, right, solution, across, size = m.matrix, m.row("right"), m.row("solution"), m.row("across"), m.size
    r.clear(solution, solution.at(count))
    with r.count(count) as i:
        row = matrix.at(i * size)
        length = r.sqrt(product_of(r, count, row, row))
        unit = r.choose(length > 0.0, length, 1.0)
        with r.count(count) as j:
            row[j] = row[j] / unit
        right[i] = right[i] / unit
    best, largest = r.variable(0, INTEGER), r.variable(0.0)
    with r.count(count):
        largest.now = 0.0
        with r.count(count) as k:
            row = matrix.at(k * size)
            square = product_of(r, count, row, row)
            with r.when(square > largest.now):
                largest.now, best.now = square, k
        r.give_if(~(largest.now > _SHORT), 0)
        one, unit = matrix.at(best.now * size), r.sqrt(largest.now)
        value = right[best.now] / unit
        with r.count(count) as j:
            across[j] = one[j] / unit
            solution[j] = solution[j] + value * across[j]
            one[j] = 0.0
        with r.count(count) as k:
            row = matrix.at(k * size)
            with r.count(2):
                share = product_of(r, count, row, across)
                with r.count(count) as j:
                    row[j] = row[j] - share * across[j]
                right[k] = right[k] - share * value
    r.give(0)
    return r


def _equations() -> Routine:
    """Write the equations of the rows that act in the states that are tried; return their number."""
    r, m, () = open_routine("contact_equations", result=INTEGER)
    acting, slot, right, matrix, size, count = m.row("acting"), m.row("slot"), m.row("right"), m.matrix, m.size, m.count
    state, ways, free = m.unit("next"), (m.unit("next_x"), m.unit("next_y")), m.row("wanted")
    response, limits, shares = m.result("response"), m.result("limits"), m.shares
    n = r.variable(0, INTEGER)
    acts = m.unit("acts")
    with r.count(m.count) as k:
        acts[k] = r.choose((m.unit("chosen")[k] != 0.0) & (state[k] != float(OPEN)) & ~is_loose(r, m, k), 1.0, 0.0)
    with each_unit(r, m, "acts") as (k, _, _), each_row(r, m, k) as (_, row):
        acting[n.now] = row.number()
        slot[row] = n.now.number()
        n.now = n.now + 1
    with each_unit(r, m, "acts") as (k, _, is_pair):
        back = (~is_pair & (ways[0][k] < 0.0)).integer() * 2
        with each_row(r, m, k) as (i, row):
            place = r.truncated(slot[row])
            own, part = matrix.at(place * size), r.choose(i == 0, ways[0][k], ways[1][k])
            with r.when(state[k] == float(STICKS)):
                with r.count(n.now) as j:
                    own[j] = response[row * size + r.truncated(acting[j])]
                right[place] = 0.0 - free[row]
            with r.otherwise():
                which = back * count + k
                with r.count(n.now) as j:
                    own[j] = part * shares[which * size + r.truncated(acting[j])]
                own[place] = own[place] + 1.0
                pressed = product_of(r, size, shares.at(which * size), m.row("pressed"))
                right[place] = (0.0 - part) * (limits[which] * m.finite + pressed)
    r.give(n.now)
    return r


def _moved() -> Routine:
    """Solve for the forces of the acting rows, and find how all rows move by them."""
    r, m, (count,) = open_routine("move_by_forces", {"count": INTEGER})
    forces, motions, free, acting, size = m.row("forces"), m.row("motions"), m.row("wanted"), m.row("acting"), m.size
    response, solution = m.result("response"), m.row("solution")
    r.call("solve_forces", r.arguments[0], count)
    r.clear(forces, forces.at(size))
    with r.count(count) as k:
        forces[r.truncated(acting[k])] = solution[k]
    with r.count(size) as i:
        motions[i] = free[i] + product_of(r, size, response.at(i * size), forces)
    r.give(0)
    return r


def _met() -> Routine:
    """Find the directions that cones of two rows take, and forces and motions of the states that are tried."""
    r, m, () = open_routine("meet_states")
    place, motions, size = r.arguments[0], m.row("motions"), m.size
    state, x, y, given = m.unit("next"), m.unit("next_x"), m.unit("next_y"), m.unit("given")
    turned = m.unit("turned_x"), m.unit("turned_y")
    count = r.variable(r.call("contact_equations", place, result=INTEGER), INTEGER)
    r.call("move_by_forces", place, count.now)
    most, some = r.variable(0.0), r.variable(False, BOOLEAN)

    def is_cone(k: Value, is_pair: Value) -> Value:
        return is_pair & (state[k] == float(GOES_ON)) & (given[k] == 0.0) & ~is_loose(r, m, k)

    with r.count(TURNS):
        most.now, some.now = 0.0, False
        with each_unit(r, m, "chosen") as (k, row, is_pair), r.when(is_cone(k, is_pair)):
            some.now = True
            a, b = motions[row], motions[row + 1]
            length = norm(r, a, b)
            unit = r.choose(length > 0.0, length, 1.0)
            r.give_if(~(a * x[k] + b * y[k] > 0.0), 0)
            turned[0][k], turned[1][k] = a / unit, b / unit
            most.now = r.most(r.size(a / unit - x[k]), r.most(r.size(b / unit - y[k]), most.now))
        r.give_if(~some.now | (most.now <= STILL), 0)
        with each_unit(r, m, "chosen") as (k, row, is_pair), r.when(is_cone(k, is_pair)):
            x[k], y[k] = turned[0][k], turned[1][k]
        count.now = r.call("contact_equations", place, result=INTEGER)
        with each_unit(r, m, "chosen") as (k, row, is_pair), r.when(is_cone(k, is_pair)):
            _turn(r, m, k, row, count.now, size)
        r.call("move_by_forces", place, count.now)
    r.give(0)
    return r


def _turn(r: Routine, m: Sets, k: Value, row: Value, count: Value, size: Value) -> None:
    """Add to the equations of a cone how its direction turns with the forces."""
    x, y, forces, motions = m.unit("next_x")[k], m.unit("next_y")[k], m.row("forces"), m.row("motions")
    response, acting, right, matrix = m.result("response"), m.row("acting"), m.row("right"), m.matrix
    first, second, across = response.at(row * size), response.at((row + 1) * size), m.row("across")
    with r.count(size) as j:
        across[j] = x * second[j] - y * first[j]
    share = limit_of(r, m, k, 0) / norm(r, motions[row], motions[row + 1])
    before = product_of(r, size, across, forces)
    for i, part in ((0, 0.0 - y), (1, x)):
        slot = r.truncated(m.row("slot")[row + i])
        own = matrix.at(slot * size)
        with r.count(count) as j:
            own[j] = own[j] + share * part * across[r.truncated(acting[j])]
        right[slot] = right[slot] + share * part * before


SOLVING = (_solve, _least, _equations, _moved, _met)
