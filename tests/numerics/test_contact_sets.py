"""Sets of contacts against every set: what is found contradicts nothing, and nothing is refused that has a solution."""

from __future__ import annotations

import numpy as np
import pytest

from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS, Contacts, Limits, Unit, all_states, find_states


def random_contacts(seed: int, gaps: int, in_space: bool) -> Contacts:
    """Return gaps with friction on a few bodies at random."""
    chance = np.random.default_rng(seed)
    width = 3 if in_space else 2
    rows = gaps * width
    slopes = chance.normal(size=(rows, rows + 2))
    mass = np.diag(chance.uniform(0.5, 2.0, size=rows + 2))
    shares, units = np.zeros((2 * gaps, rows)), []
    for k in range(gaps):
        first = k * width
        units.append(Unit((first,), False, (0.0,), -1))
        units.append(Unit(tuple(range(first + 1, first + width)), True, (0.0,) * (width - 1), 2 * k))
        shares[2 * k + 1, first] = chance.uniform(0.0, 0.5)
    none = np.zeros(2 * gaps)
    response = slopes @ np.linalg.solve(mass, slopes.T)
    return Contacts(response, chance.normal(size=rows), tuple(units), Limits(none, shares, none, shares))


def laws_hold(contacts: Contacts, states, forces, motions) -> None:
    """Check Signorini's and Coulomb's laws by their own words."""
    size, pace = np.max(np.abs(forces)) or 1.0, np.max(np.abs(contacts.free))
    assert motions == pytest.approx(contacts.free + contacts.response @ forces)
    for k, (unit, (state, _)) in enumerate(zip(contacts.units, states, strict=True)):
        f, a = forces[list(unit.rows)], motions[list(unit.rows)]
        if not unit.is_slip:
            assert f[0] >= -1e-8 * size
            assert a[0] >= -1e-8 * pace
            assert abs(f[0] * a[0]) <= 1e-8 * size * pace
            continue
        limit = float(contacts.limits.shares[k] @ forces)
        assert np.linalg.norm(f) <= limit + 1e-7 * size
        if state == GOES_ON and np.linalg.norm(a) > 1e-7 * pace:
            assert np.linalg.norm(f) == pytest.approx(limit, abs=1e-7 * size)
            assert f @ a == pytest.approx(-np.linalg.norm(f) * np.linalg.norm(a), abs=1e-6 * size * pace)
        elif state == STICKS and states[unit.at][0] != OPEN:
            assert np.linalg.norm(a) <= 1e-7 * pace


@pytest.mark.parametrize("in_space", [False, True])
@pytest.mark.parametrize("gaps", [1, 2, 3])
def test_states_obey_the_laws(gaps: int, in_space: bool) -> None:
    solved = 0
    seeds = 10 if gaps == 3 else 40
    for seed in range(seeds):
        contacts = random_contacts(seed, gaps, in_space)
        none = [(OPEN, (0.0,) * len(unit.rows)) for unit in contacts.units]
        found = find_states(contacts, none)
        if found is None:
            assert not list(all_states(contacts))
            continue
        solved += 1
        laws_hold(contacts, found.states, found.forces, found.motions)
    assert solved >= 0.8 * seeds  # with friction there need be no solution


def test_what_was_there_before_is_kept_where_several_sets_fit() -> None:
    """A rod that slides under much friction may stay on the floor or leave it: it goes on as it did."""
    response = np.array([[1.0, -0.9], [-0.9, 1.0]])
    shares = np.array([[0.0, 0.0], [1.6, 0.0]])
    units = (Unit((0,), False, (0.0,), -1), Unit((1,), True, (-1.0,), 0))
    contacts = Contacts(response, np.array([1.0, 0.2]), units, Limits(np.zeros(2), shares, np.zeros(2), shares))
    every = list(all_states(contacts))
    assert len(every) == 2
    for one in every:
        found = find_states(contacts, one.states)
        assert found is not None
        assert found.states == one.states


def test_gaps_that_open_together_are_not_held_closed_by_a_load_elsewhere() -> None:
    """The ends of a beam on a hinge, both from floors that fall away; they were closed with accelerations of 1."""
    response, shares = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.zeros((3, 3))
    units = tuple(Unit((k,), False, (0.0,), -1) for k in range(3))
    limits = Limits(np.zeros(3), shares, np.zeros(3), shares)
    closed = [(STICKS, (0.0,))] * 3
    found = find_states(Contacts(response, np.array([1.0, 1.0, -1.0]), units, limits), closed)
    assert found is not None
    assert [state for state, _ in found.states] == [OPEN, OPEN, STICKS]
    assert not found.is_redundant


def places_on_one_body(seed: int, count: int) -> Contacts:
    """Return gaps with friction in space below one rigid body on a floor: more rows than it has velocities."""
    chance = np.random.default_rng([seed, count])
    places = np.column_stack([chance.uniform(-0.3, 0.3, (count, 2)), np.full(count, -0.15)])
    rows = [np.concatenate([axis, np.cross(place, axis)]) for axis in np.eye(3)[[2, 0, 1]] for place in places]
    slopes = np.array(rows)[[k + count * i for i in range(3) for k in range(count)]]
    inverse = np.diag(1.0 / np.concatenate([np.ones(3), chance.uniform(0.01, 0.2, 3)]))
    force = np.concatenate([chance.normal(0.0, 3.0, 2), [-9.81], chance.normal(0.0, 0.3, 3)])
    units = [Unit((k,), False, (0.0,), -1) for k in range(count)]
    units += [Unit((count + k, 2 * count + k), True, (0.0, 0.0), k) for k in range(count)]
    shares, none = np.zeros((2 * count, 3 * count)), np.zeros(2 * count)
    shares[range(count, 2 * count), range(count)] = chance.uniform(0.0, 1.0)
    free = slopes @ inverse @ force
    return Contacts(slopes @ inverse @ slopes.T, free, tuple(units), Limits(none, shares, none, shares))


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_body_that_rests_on_many_places_is_always_solved(count: int) -> None:
    """What is at rest can always stick, slip or lift off (no wedges: all gaps can open together)."""
    for seed in range(10):
        contacts = places_on_one_body(seed, count)
        found = find_states(contacts, [(STICKS, (0.0,) * len(unit.rows)) for unit in contacts.units])
        assert found is not None, seed
        laws_hold(contacts, found.states, found.forces, found.motions)


@pytest.mark.parametrize("turn", [0.0, 0.3, 2.0])
def test_an_edge_rests_where_one_end_bears_what_the_other_cannot(turn: float) -> None:
    """A rod lands with both ends: one end's friction is used up across, so the other must bear the push along it."""
    ends = np.array([[4.0, -2.0], [-2.0, 4.0]])  # of a rod of mass 1 and length 2, across and up
    response = np.zeros((6, 6))
    response[:2, :2] = response[np.ix_([2, 4], [2, 4])] = ends
    response[np.ix_([3, 5], [3, 5])] = 1.0
    free = -response @ np.array([0.5, 0.5, -0.49999, 0.3, 0.01, 0.19])
    turned = np.eye(6)
    turned[2:4, 2:4] = turned[4:, 4:] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    units = tuple(Unit((k,), False, (0.0,), -1) for k in (0, 1))
    units += tuple(Unit((2 + 2 * k, 3 + 2 * k), True, (0.0, 0.0), k) for k in (0, 1))
    shares, none = np.zeros((4, 6)), np.zeros(4)
    shares[2, 0] = shares[3, 1] = 1.0
    contacts = Contacts(turned @ response @ turned.T, turned @ free, units, Limits(none, shares, none, shares))
    found = find_states(contacts, [(STICKS, (0.0,) * len(unit.rows)) for unit in units], rests=True)
    assert found is not None
    assert [state for state, _ in found.states] == [STICKS] * 4
    assert found.is_redundant
    laws_hold(contacts, found.states, found.forces, found.motions)


@pytest.mark.parametrize(("above", "state"), [(1e-9, GOES_ON), (1e-12, GOES_ON), (0.0, STICKS), (-1e-12, STICKS)])
def test_what_is_pushed_above_its_limit_goes(above: float, state: int) -> None:
    """Weight 1, friction 0.3: what is pushed by 1e-9 more than that was held."""
    units = Unit((0,), False, (0.0,), -1), Unit((1,), True, (0.0,), 0)
    shares, none = np.array([[0.0, 0.0], [0.3, 0.0]]), np.zeros(2)
    contacts = Contacts(np.eye(2), np.array([-1.0, 0.3 * (1.0 + above)]), units, Limits(none, shares, none, shares))
    found = find_states(contacts, [(STICKS, (0.0,))] * 2)
    assert found is not None
    assert found.states == ((STICKS, (0.0,)), (state, (float(state == GOES_ON),)))


def test_what_moves_across_the_way_it_rubs_goes_another_way() -> None:
    """Rubbed to rest along the way it was said to go, it moved square to it, and that contradicted nothing."""
    units = Unit((0,), False, (0.0,), -1), Unit((1, 2), True, (0.0, 0.0), 0)
    shares, none = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), np.zeros(2)
    contacts = Contacts(np.eye(3), np.array([-10.0, 5.0, 3.0]), units, Limits(none, shares, none, shares))
    found = find_states(contacts, [(STICKS, (0.0,)), (GOES_ON, (1.0, 0.0))])
    assert found is not None
    laws_hold(contacts, found.states, found.forces, found.motions)
    assert found.forces[1:] == pytest.approx(-5.0 * np.array([5.0, 3.0]) / np.hypot(5.0, 3.0), rel=1e-12)
