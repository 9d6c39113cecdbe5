"""The routine that makes updates of discrete states; see `atwood.simulation.events.traced`."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Routine, Value, call_kernel, place_of


def write_routines(
    places: Sequence[Sequence[tuple[int, int]]],
    chains: Sequence[Sequence[int]],
    sizes: tuple[int, int, int, int],
    inputs: int,
) -> list[Routine]:
    """Write ``int update(t, y, parameters, others, chain, data)``: 1 where a result is not finite.

    The discrete states among the parameters are set, and continuous ones in y. `others` is how many parameters follow
    the discrete states. The data: room, scratch, and what depends on parameters alone of each program.
    """
    coordinates, _, held, first = sizes
    arguments = {"t": NUMBER, "y": ADDRESS, "parameters": ADDRESS, "others": INTEGER, "chain": INTEGER, "data": ADDRESS}
    r = Routine("update", arguments, exported=True)
    t, y, parameters, others, chain, data = r.arguments
    room, scratch, read = (data.read(k, ADDRESS) for k in range(3))
    rest, time, states = room.at(others + first), place_of(r, t), parameters.at(first)
    found = rest.at(inputs)
    r.copy(room, parameters, first)
    r.copy(room.at(first), states.at(held), others)
    r.call("inputs_prologue", room, read, scratch, result=None)

    def call(number: int) -> None:
        given: list[Value] = [time, y, y.at(coordinates), states]
        r.give_if(call_kernel(r, "inputs", given, read, scratch, [rest]) != 0, 1)
        given = [time, rest, states, y]
        r.give_if(call_kernel(r, f"update_{number}", given, data.read(3 + number, ADDRESS), scratch, [found]) != 0, 1)
        for k, (place, coordinate) in enumerate(places[number]):
            if place >= 0:
                states[place] = found[k]
            else:
                y[coordinate] = found[k]

    for number, order in enumerate(chains, start=1):
        with r.when(chain == number):
            for one in order:
                call(one)
    r.give(0)
    return [r]
