"""The data of a scene as tables of C."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import accumulate
from typing import Any

from atwood.codegen.c.printer import literal
from atwood.integrators.sets import record as sets
from atwood.mechanics.outputs.event_functions import CLOSES, RESTS, RUNS, UPDATE
from atwood.plotting.live.mode import ModeText
from atwood.simulation.events.sides import SIDE

NOTED, ENDS, UPDATES, LEADS, PASSES = range(5)
"""What an event leads to: nothing, the end, other states, another mode, or the other side of what a law compares."""

SIDE_KINDS = ("less", "less_equal", "nonzero", "sign", "floor")
"""Kinds of relations of what moves."""

KINDS = ("event", "impact", "rests", "closes", "opens", "reverses", "sticks", "slips")
"""What happens, as results name it."""


def tables_of(mode: ModeText, parameters: Sequence[dict[str, Any]], sizes: dict[str, int]) -> list[str]:
    """Return the data of a scene."""
    data = mode.data
    span = mode.flat.t_end - mode.flat.t_start
    until = data["schedule"]["end"]
    lines = [
        array("values", data["values"]),
        array("start_state", data["state"]),
        array("tolerances", data["tolerances"]),
        f"static const double relative_share = {literal(data['relative'])};",
        f"static const double horizon = {literal(span if span > 0 else 1.0)};",
        f"static const double known_until = {literal(math.inf if until is None else until)};",
        array("parameter_places", [data["numbers"].get(one["path"], -1) for one in parameters], "int"),
    ]
    if sizes["JUDGES"]:
        lines.append(array("judged_by", data["judged"]))
    if sizes["TURNS"]:
        lines.append(array("turn_starts", accumulate(map(len, data["turns"]), initial=0), "int"))
        lines.append(array("turn_places", [i for turn in data["turns"] for i in turn], "int"))
    if sizes["CONSTRAINTS"] or sizes.get("HAS_MAXIMAL") or sizes.get("SIGNS"):
        lines.append(array("sizes", data["sizes"]))
    if sizes["SIDES"]:
        lines.append(array("side_kinds", [SIDE_KINDS.index(one) for one in data["sides"]["kinds"]], "int"))
    if sizes["CONSTRAINTS"] or sizes["CONTACTS"] or sizes["SIDES"]:
        lines.append(f"static const double time_scale = {literal(data['time'])};")
    if sizes["CONSTRAINTS"]:
        lines += _places(("slope_rows", "slope_columns"), data["slopes"])
    if sizes["WATCHED"]:
        rank = {i: k for k, i in enumerate(data["kept"])}
        lines.append(array("kept_rank", [rank.get(i, -1) for i in range(sizes["CONSTRAINTS"])], "int"))
        lines.append(array("kept_constraints", data["kept"], "int"))
    if sizes["PIECES"]:
        lines.append(array("piece_times", data["schedule"]["times"]))
    if sizes["RELATIONS"]:
        lines.append(array("piece_values", [x for one in data["schedule"]["values"] for x in one]))
    if sizes["EVENTS"]:
        lines += _events(data, sizes)
    if sizes["CONTACTS"]:
        lines += _contacts(data["contacts"], len(sources(mode)))
    if sizes["UPDATES"]:
        lines += _updates(data)
        lines += _lists("event_updates", [one["updates"] for one in data["events"]], "update_firsts")
    if sizes["PASSAGE"]:
        lines += _passage(data["passage"], sizes, sources(mode))
    if sizes["HAS_TANGENT"]:
        lines += _places(("tangent_rows", "tangent_columns"), data["tangent"])
    if sizes["STARTS"]:
        lines += _start(data["start"], mode.flat.t_start)
    if data["modes_of_scene"] > 1:
        lines.append(array("held_places", [data["held"][path] for path in sorted(data["held"])], "int"))
        if sizes["SIGNS"]:
            signs = data["passage"]["signs"]
            lines.append(array("line_of_parts", mode.assembly.mechanism.space.line or ()))
            lines.append(array("sign_places", [i for a, b, _ in signs for i in (a, b)], "int"))
            lines.append(array("signs", [sign for *_, sign in signs]))
    return [*lines, *exported_tables([mode], parameters)]


def exported_tables(modes: Sequence[ModeText], parameters: Sequence[dict[str, Any]]) -> list[str]:
    """Return the tables that a header tells of."""
    mode = modes[0]
    lines = [
        f"const double scene_start_time = {literal(mode.flat.t_start)};",
        f"const double scene_end_time = {literal(mode.flat.t_end)};",
        _texts("const char *const scene_sources", [law for one in modes for law in sources(one)]),
        _texts("const char *const scene_kinds", KINDS),
    ]
    names = [*mode.data["coordinates"], *mode.data["speeds"]]
    more = max(len(one.data["state"]) for one in modes) - len(names)  # of a mode that has more
    described = [("states", [*((one["name"], one["unit"]) for one in names), *([("", "")] * more)])]
    described.append(("quantities", [(one.path, one.unit) for one in mode.known]))
    for key, ones in described:
        rows = ",\n".join(f"    {{{quoted(path)}, {quoted(unit)}}}" for path, unit in ones) or '    {"", ""}'
        lines.append(f"const scene_variable scene_{key}[] = {{\n{rows}\n}};")
    rows = ",\n".join(map(_parameter, parameters)) or '    {"", "", 0.0, 0.0, 0.0}'
    lines.append(f"const scene_parameter_of scene_parameters[] = {{\n{rows}\n}};")
    return lines


def sources(mode: ModeText) -> list[str]:
    """Return the paths of what events come from.

    They are of events, of gaps and slips, of constraints that may jump, and of what gaps have names of their own for.
    """
    data = mode.data
    laws = [f"{one['part']}.{one['law']}" for one in data["events"]]
    laws += [".".join(one) for one in data.get("contacts", {}).get("keys", ())]
    laws += dict.fromkeys(".".join(one) for one in data.get("passage", {}).get("laws", ()))
    return laws + _named(data.get("contacts", {}))


def _named(contacts: dict[str, Any]) -> list[str]:
    """Return the paths of events that gaps have names of their own for."""
    every = zip(contacts.get("keys", ()), contacts.get("words", ()), strict=True)
    return [f"{part}.{said['law']}" for (part, _), words in every for said in words if said]


def _places(names: Sequence[str], found: Sequence[Sequence[int]]) -> list[str]:
    return [array(name, one, "int") for name, one in zip(names, found, strict=True)]


def action_of(event: dict[str, Any]) -> int:
    """Return what an event leads to."""
    if event["updates"]:
        return UPDATES
    if event["target"] in ("", UPDATE):
        return NOTED
    if event["target"] == SIDE:
        return PASSES
    return LEADS if event["leads"] >= 0 or "contact" in event else ENDS


def _events(data: dict[str, Any], sizes: dict[str, int]) -> list[str]:
    events = data["events"]
    lines = [array(f"event_{name}", [one[name] for one in events]) for name in ("small", "direction")]
    lines.append(array("event_noted", [int(one["noted"]) for one in events], "int"))
    lines.append(array("event_action", map(action_of, events), "int"))
    lines.append(array("event_leads", [one["leads"] for one in events], "int"))
    lines.append(array("event_impact", [int(one["impact"]) for one in events], "int"))
    texts = [f"{one['part']}: {one['message']}" for one in events]
    lines.append(_texts("static const char *const event_messages", texts))
    waves = [f(1 + 2.4 * i) for f in (math.cos, math.sin) for i in range(sizes["SIZE"])]
    lines.append(array("turns", waves))
    if sizes["SIDES"]:
        sides = [int(one["law"]) if one["target"] == SIDE else -1 for one in events]
        lines.append(array("event_side", sides, "int"))
    if sizes["CONTACTS"]:
        units, found = data["contacts"]["units"], [one.get("contact", (-1, 0)) for one in events]
        lines.append(array("event_contact", [k for k, _ in found], "int"))
        lines.append(array("event_code", [code for _, code in found]))
        of_speed = units[sets.UNITS["speed"]]
        watches = {RESTS: 2, RUNS: 3}
        kinds = [
            int(not of_speed[k]) if k >= 0 and one["target"] == CLOSES else watches.get(one["target"], 0)
            for (k, _), one in zip(found, events, strict=True)
        ]
        lines.append(array("event_watch", kinds, "int"))
    return lines


def _lists(name: str, lists: Sequence[Sequence[int]], starts: str) -> list[str]:
    ends = accumulate(map(len, lists), initial=0)
    return [array(name, [k for one in lists for k in one], "int"), array(starts, ends, "int")]


def _contacts(contacts: dict[str, Any], count: int) -> list[str]:
    """Return the tables of gaps and slips, of a scene with a number of sources."""
    numbers = iter(range(count - len(_named(contacts)), count))  # the last sources
    names = [next(numbers) if said else -1 for words in contacts["words"] for said in words]
    ends = [
        f"{part}: {opens['message']}" if opens and opens["target"] == "stop" else ""
        for (part, _), (_, opens) in zip(contacts["keys"], contacts["words"], strict=True)
    ]
    places = [place for some in contacts["places"] for place in [*some, -1, -1][:3]]
    refused = ["", *(sets.REFUSED[code] for code in sorted(sets.REFUSED))]
    return [
        array("contact_units", [x for row in contacts["units"] for x in row]),
        array("contact_places", places, "int"),
        array("contact_pattern", contacts["pattern"]),
        array("contact_names", names, "int"),
        array("contact_starts_closed", contacts["closed"], "int"),
        _texts("static const char *const contact_ends", ends),
        _texts("static const char *const refused", refused),
    ]


def _updates(data: dict[str, Any]) -> list[str]:
    updates, first = data["updates"], len(data["coordinates"])
    laws = updates["laws"]
    assert all(i < first for one in laws for kind, i in one["sets"] if kind == "state")
    numbers: list[float] = []
    known = []
    for moment, due in enumerate(updates["due"]):
        for k in due:
            given = laws[k].get("given", {}).get(moment)
            known.append(-1 if given is None else len(numbers))
            numbers += given or ()
    every = [one for law in laws for one in law["sets"]]
    return [
        array("moment_times", updates["times"]),
        *_lists("due", updates["due"], "due_starts"),
        array("due_given", known, "int"),
        array("given_values", numbers),
        array("update_starts", accumulate((len(one["sets"]) for one in laws), initial=0), "int"),
        array("update_is_held", [int(kind == "held") for kind, _ in every], "int"),
        array("update_places", [i for _, i in every], "int"),
    ]


def _start(start: dict[str, Any], t: float) -> list[str]:
    turns = list(accumulate(map(len, start["turns"]), initial=0))
    lines = [
        f"static const double start_moment = {literal(t)};",
        array("start_reference", start["reference"]),
        array("start_place", start["place"]),
        array("start_sizes", start["sizes"]),
        array("start_turns", [i for turn in start["turns"] for i in turn], "int"),
        array("start_turn_firsts", turns, "int"),
    ]
    for name, own in (("places", "place"), ("speeds", "speed")):
        level = start[name]
        lines.append(array(f"{name}_wanted", [one["value"] for one in level["targets"]]))
        for kind in ("fixed", "wrapped", "direct"):
            lines.append(array(f"{name}_{kind}", [one[kind] for one in level["targets"]], "int"))
        lines += _places((f"{own}_slope_rows", f"{own}_slope_columns"), level["slopes"])
    return lines


def _passage(passage: dict[str, Any], sizes: dict[str, int], known: Sequence[str]) -> list[str]:
    sides = [(i, float(sign)) for i, each in enumerate(passage["refused"]) for sign, _ in each]
    by = [one for each in passage["refused"] for _, one in each]
    laws = list(dict.fromkeys(map(tuple, passage["laws"])))
    first = sizes["EVENTS"] + sizes["CONTACTS"]
    lines = [
        array("body_sizes", passage["sizes"]),
        array("one_sides", [int(x) for side in sides for x in side], "int"),
        *_places(("body_mass_rows", "body_mass_columns"), passage["mass"]),
        *_places(("body_slope_rows", "body_slope_columns"), passage["slopes_of_constraints"]),
    ]
    if sizes["SWITCHES"]:
        lines.append(array("side_leads", [-2 if one["target"] == "stop" else one["leads"] for one in by], "int"))
        lines.append(array("side_sources", [known.index(f"{one['part']}.{one['law']}") for one in by], "int"))
        lines.append(array("body_laws", [first + laws.index(tuple(one)) for one in passage["laws"]], "int"))
    if "slopes" in passage:
        lines += _places(("place_rows", "place_columns"), passage["slopes"])
        lines.append(array("body_turns", [i for turn in passage["turns"] for i in turn], "int"))
        lines.append(array("body_spins", [i for spin in passage["spins"] for i in spin], "int"))
        lines.append(array("along_places", [i for pair in passage["along"] for i in pair], "int"))
        lines.append(array("turned_places", [i for pair in passage["turned"] for i in pair], "int"))
    return lines


def _parameter(one: dict[str, Any]) -> str:
    low = -math.inf if one["low"] is None else math.nextafter(one["low"], math.inf) if one["lower_open"] else one["low"]
    high = math.inf if one["high"] is None else one["high"]
    numbers = ", ".join(_number(float(x)) for x in (one["value"], low, high))
    return f"    {{{quoted(one['path'])}, {quoted(one['unit'])}, {numbers}}}"


def _number(value: float) -> str:
    """Return a number as C writes it in a table of constants that may be infinite."""
    return literal(value).replace("((double)INFINITY)", "HUGE_VAL").replace("(-(double)INFINITY)", "-HUGE_VAL")


def _texts(name: str, texts: Sequence[str]) -> str:
    return f"{name}[] = {{{', '.join(map(quoted, texts or ['']))}}};"


def array(name: str, values: Iterable[Any], kind: str = "double") -> str:
    """Return a table of C."""
    texts = [literal(float(one)) if kind == "double" else str(int(one)) for one in values] or ["0"]
    lines = ",\n    ".join(", ".join(texts[k : k + 8]) for k in range(0, len(texts), 8))
    return f"static const {kind} {name}[] = {{\n    {lines}\n}};"


_ESCAPED = b'"\\?'


def quoted(text: str) -> str:
    """Return a text as C writes it."""
    found = ""
    for one in text.encode():
        found += chr(one) if 32 <= one < 127 and one not in _ESCAPED else f"\\{one:03o}"
    return f'"{found}"'
