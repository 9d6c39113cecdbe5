"""The C99 of a scene: programs, routines, data and engine in one file, its header, and a program that prints it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources import files
from itertools import accumulate
from typing import Any

from atwood.codegen.c.printer import BITS, HEAD, WORDS, literal, print_routines, reached
from atwood.codegen.c.program import functions_of, print_program
from atwood.codegen.functions import write_routines as write_functions
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.codegen.routines import Routine
from atwood.errors import UnsupportedError
from atwood.expr.core.program import Program
from atwood.forms.assembly import Assembly
from atwood.integrators.compiled_location import FIELDS as SEARCH_FIELDS, ROWS as SEARCH_ROWS, STACK
from atwood.integrators.embedded.rates import write_routines as write_rates
from atwood.integrators.embedded.stepper import FIELDS
from atwood.integrators.embedded.steps import write_routines as write_steps
from atwood.integrators.event_location import MOST
from atwood.integrators.event_routines import write_routines as write_search
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.integrators.step_guard import write_routines as write_guard
from atwood.integrators.stepper import WIDTH
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.live.mode import ModeText
from atwood.plotting.live.parameters import live_parameters
from atwood.plotting.live.program import live_modes

_CALLED = {"constraints": "held"}
"""Programs that C calls otherwise, since a routine of the method has their name."""

_ASKED = "events", "constraints", "quantities", "loads"
"""Programs of (t, q, u) and more that the engine calls itself."""

_POINTS = STACK + MOST + 2
"""Points that a search for events remembers."""


@dataclass(frozen=True, eq=False)
class SceneText:
    """A scene as C99.

    Attributes
    ----------
    name
        Its name in C, with which all names of the header begin.
    header, source, main
        The files.
    mode
        What was printed.
    parameters
        What can be changed, as `atwood.plotting.live.parameters.live_parameters` describes it.
    start_time, end_time
        When it begins and ends, s.
    """

    name: str
    header: str
    source: str
    main: str
    mode: ModeText
    parameters: Sequence[dict[str, Any]]
    start_time: float
    end_time: float


def scene_text(
    assembly: Assembly,
    quantities: Sequence[str] | None = None,
    more: Callable[[ModeText], dict[str, Program]] | None = None,
) -> SceneText:
    """Return a scene as C99.

    Parameters
    ----------
    assembly
        The scene.
    quantities
        Paths of the quantities that can be asked for; all if not given.
    more
        Gives programs beside those of a motion, by their names in C.

    Raises
    ------
    UnsupportedError
        If what it needs has no counterpart in C; its message names the part.
    AtwoodError
        If the scene cannot be assembled, or has no start.
    """
    modes, _ = live_modes(assembly, quantities=quantities)
    mode = modes[0]
    _refuse(mode, len(modes))
    name, parameters = c_name(assembly.flat.name), live_parameters(mode.assembly)
    beside = more(mode) if more else {}
    return SceneText(
        name,
        with_name(_header(mode, parameters, beside), name),
        with_name(_source(mode, parameters, beside), name),
        with_name(_template("main.c"), name),
        mode,
        parameters,
        mode.flat.t_start,
        mode.flat.t_end,
    )


def _refuse(mode: ModeText, modes: int) -> None:
    """Say what C does not follow."""
    targets = {event["target"]: event for event in mode.data["events"]}
    for target, event in targets.items():
        where = f"{event['part']}.{event['law']}"
        if target == "side":
            raise UnsupportedError("a law that compares what moves is not exported", where=mode.flat.name)
        if "contact" in event:
            raise UnsupportedError("gaps and dry friction are not exported", where=where)
        if modes > 1 and target not in ("", "stop"):
            raise UnsupportedError(f"an event that leads to the mode {target!r} is not exported", where=where)
        if event["updates"]:
            raise UnsupportedError("an event with updates is not exported", where=where)
    if mode.data.get("updates"):
        raise UnsupportedError("updates at moments are not exported", where=mode.flat.name)
    if "contacts" in mode.data:
        raise UnsupportedError("gaps and dry friction are not exported", where=mode.flat.name)


def c_name(name: str) -> str:
    """Return a name of a scene as C takes it."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    text = re.sub(r"\W+", "_", words, flags=re.ASCII).strip("_").lower() or "model"
    text = f"model_{text}" if text[0].isdigit() else text
    return text if "_" in text else f"{text}_model"  # no word of C and no function of its library has a stroke


def with_name(text: str, name: str) -> str:
    """Return a text in which names of the header begin with that of the scene."""
    text = text.replace('"scene.h"', f'"{name}.h"')
    return re.sub(r"\bscene_(?=[A-Za-z])", f"{name}_", re.sub(r"\bscene\b(?=[ ;*)])", name, text))


def _template(name: str) -> str:
    return files("atwood.exchange.c").joinpath(name).read_text(encoding="utf-8")


def _programs(mode: ModeText) -> dict[str, Program]:
    """Return the programs that a motion needs, by their names in C."""
    known = mode.programs
    names = ["kernel", "nearer", "judge", "events", "constraints", "quantities", "loads"]
    found = {one: known[own] for one in names if (own := _CALLED.get(one, one)) in known}
    if not mode.data["constraints"]:
        found.pop("constraints", None)
    return found


def _sizes(mode: ModeText, programs: dict[str, Program]) -> dict[str, int]:
    """Return the numbers by which the engine knows what there is."""
    data = mode.data
    n, m = len(data["coordinates"]), len(data["speeds"])
    held = "constraints" in programs
    pieces = data["schedule"]
    relations = len(pieces["values"][0]) if pieces["values"] else 0
    return {
        "COORDINATES": n,
        "SPEEDS": m,
        "SIZE": n + m,
        "PADDED": -(-(n + m) // WIDTH) * WIDTH,
        "VALUES": len(data["values"]),
        "PROJECTS": int("nearer" in programs),
        "JUDGES": int("judge" in programs),
        "EVENTS": len(data["events"]),
        "CONSTRAINTS": len(data["constraints"]) if held else 0,
        "SLOPES": len(data["slopes"][0]) if held else 0,
        "KEPT": len(data["kept"]) if held else 0,
        "WATCHED": int(held and bool(data.get("watched")) and bool(data["kept"])),
        "TURNS": len(data["turns"]),
        "PIECES": len(pieces["times"]) if relations else 0,
        "RELATIONS": relations,
        "RELATION": pieces["first"],
        "PLAIN": len(data["paths"]["quantities"]),
        "LOADS": len(data["paths"].get("loads", ())),
    }


# -- header ---------------------------------------------------------------------------------------------------------


def _header(mode: ModeText, parameters: Sequence[dict[str, Any]], beside: dict[str, Program]) -> str:
    programs = _programs(mode)
    sizes = _sizes(mode, programs)
    text = _template("scene.h")
    counts = {"STATES": sizes["SIZE"], "PARAMETERS": len(parameters), "QUANTITIES": len(mode.known)}
    counts |= {"COORDINATES": sizes["COORDINATES"]}
    lines = "\n".join(f"#define scene_{key} {one}" for key, one in counts.items())
    text = text.replace("/* counts */", lines).replace("/* word */", WORDS.replace("word", "scene_word"))
    return text.replace("    /* memory */", "\n".join(f"    {one};" for one in _memory(programs | beside, sizes)))


def _memory(programs: dict[str, Program], sizes: dict[str, int]) -> list[str]:
    """Return the arrays of an instance."""
    size, events = sizes["SIZE"], sizes["EVENTS"]
    scratch = max(print_program(name, one)[1] for name, one in programs.items())
    most = max(size, events)
    words = {"values": sizes["VALUES"], "session": len(FIELDS), "arrays": TABLEAU.rows["all"] * sizes["PADDED"]}
    words |= {"scratch": scratch, "block": 5, "functions": 5, "y": size, "yp": most}
    if sizes["PROJECTS"]:
        words["nearer_room"] = size + sizes["SPEEDS"]
    if sizes["JUDGES"]:
        words["judged"] = 4
    if events:
        words |= {"sought": len(SEARCH_FIELDS), "event_y": most, "event_yp": most, "shifted": size, "turns": 2 * size}
        words |= {"rows": len(SEARCH_ROWS) * events + _POINTS * (1 + 2 * events), "shifts": events, "self": 1}
    for name, one in programs.items():
        words[f"{name}_derived"] = len(one.prologue)
        if name in _ASKED and name != "events":
            words |= {f"{name}_{k}": len(group.expressions) for k, group in enumerate(one.outputs)}
    lines = [f"scene_word {name}[{max(count, 1)}]" for name, count in words.items()]
    if sizes["CONSTRAINTS"]:
        lines.append("double held_size")
    if sizes["WATCHED"]:
        lines += ["double held_last, held_largest", f"double held_most[{max(sizes['KEPT'], 1)}]"]
    return [*lines, *([f"int fired[{events}]"] if events else [])]


# -- source ---------------------------------------------------------------------------------------------------------


def _source(mode: ModeText, parameters: Sequence[dict[str, Any]], beside: dict[str, Program]) -> str:
    programs = _programs(mode)
    sizes = _sizes(mode, programs)
    every = programs | beside
    printed = [print_program(name, one)[0] for name, one in every.items()]
    routines = _routines(every, sizes, printed)
    places = {name: k for k, name in enumerate(FIELDS)}
    counts = {places["size"]: sizes["SIZE"], places["padded"]: sizes["PADDED"]}
    body = print_routines(routines, {one.name: counts for one in write_steps(TABLEAU)})
    bits = [line for line in BITS.splitlines() if _is_called(line, [body, *printed, *BITS.splitlines()])]
    parts = [
        f"/* {mode.flat.name.replace('*/', '')}: equations of motion and the method that solves them. */",
        HEAD,
        '#include "scene.h"\n\ntypedef scene_word word;\n',
        "enum { READY = scene_READY, STOPPED = scene_STOPPED, FAILED = scene_FAILED,",
        "       AT_SINGULARITY = scene_AT_SINGULARITY, REFUSED = scene_REFUSED };",
        *(f"#define {name} {one}" for name, one in sizes.items()),
        _numbered("FIELD", FIELDS),
        _numbered("ROW", TABLEAU.rows),
        *([_numbered("SOUGHT", SEARCH_FIELDS), _numbered("SEARCHED", SEARCH_ROWS)] if sizes["EVENTS"] else []),
        "",
        *bits,
        *(_declared(name) for name in every),
        body,
        *printed,
        *_tables(mode, parameters, sizes),
        *(_asking(name, one) for name, one in programs.items() if name in _ASKED and name != "events"),
        _filling(programs),
        _template("engine.c"),
    ]
    return "\n".join(parts)


def _is_called(line: str, texts: Iterable[str]) -> bool:
    name = line.split("(")[0].split()[-1]
    return any(f"{name}(" in text for text in texts if text != line)


def _routines(programs: dict[str, Program], sizes: dict[str, int], printed: Sequence[str]) -> list[Routine]:
    """Return the routines that are called, by programs too."""
    given = len(programs["kernel"].outputs) == 2
    known = write_rates(sizes["COORDINATES"], sizes["SPEEDS"], given, bool(sizes["PROJECTS"]))
    roots = ["rates", *(["project"] if sizes["PROJECTS"] else []), "begin", "run", "interpolate"]
    known += write_steps(TABLEAU)
    if sizes["JUDGES"]:
        known += write_guard("judge")
        roots.append("guard")
    if sizes["EVENTS"]:
        known += write_search()
        roots += ["search", "restart"]
    if any("factorise(" in one for one in printed):
        known += write_elimination()
        roots += ["factorise", "substitute"]
    functions = write_functions(functions_of(programs.values()), each=False)
    roots += [one.name for one in functions if any(f"{one.name}(" in text for text in printed)]
    return reached([*functions, *known], roots)


def _numbered(prefix: str, names: Mapping[str, object]) -> str:
    numbers = names.items() if names is TABLEAU.rows else ((one, k) for k, one in enumerate(names))
    texts = [f"{prefix}_{str(name).replace(' ', '_')} = {number}" for name, number in numbers]
    return f"enum {{ {', '.join(texts)} }};"


def _declared(name: str) -> str:
    return f"static int32_t {name}(word *inputs, word *derived, word *scratch, word *outputs);"


def _asking(name: str, program: Program) -> str:
    """Return the function that calls a program of (t, q, u) and perhaps of the accelerations."""
    outputs = "\n".join(f"    out[{k}].p = s->{name}_{k};" for k in range(len(program.outputs)))
    return f"""static int call_{name}(scene *s, double t, word *y, word *a)
{{
    word in[4], out[{len(program.outputs)}], moment;
    moment.f = t;
    in[0].p = &moment;
    in[1].p = y;
    in[2].p = y + COORDINATES;
    in[3].p = a;
{outputs}
    return {name}(in, s->{name}_derived, s->scratch, out);
}}
"""


def _filling(programs: dict[str, Program]) -> str:
    lines = "\n".join(f"    {name}_prologue(s->values, s->{name}_derived, s->scratch);" for name in programs)
    return f"/* What depends on parameters alone. */\nstatic void fill(scene *s)\n{{\n{lines}\n}}\n"


def _tables(mode: ModeText, parameters: Sequence[dict[str, Any]], sizes: dict[str, int]) -> list[str]:
    """Return the data of a scene."""
    data = mode.data
    span = mode.flat.t_end - mode.flat.t_start
    until = data["schedule"]["end"]
    lines = [
        f"const double scene_start_time = {literal(mode.flat.t_start)};",
        f"const double scene_end_time = {literal(mode.flat.t_end)};",
        _array("values", data["values"]),
        _array("start_state", data["state"]),
        _array("tolerances", data["tolerances"]),
        f"static const double relative_share = {literal(data['relative'])};",
        f"static const double horizon = {literal(span if span > 0 else 1.0)};",
        f"static const double known_until = {literal(math.inf if until is None else until)};",
        _array("parameter_places", [data["numbers"][one["path"]] for one in parameters], "int"),
    ]
    if sizes["JUDGES"]:
        lines.append(_array("judged_by", data["judged"]))
    if sizes["TURNS"]:
        lines.append(_array("turn_starts", accumulate(map(len, data["turns"]), initial=0), "int"))
        lines.append(_array("turn_places", [i for turn in data["turns"] for i in turn], "int"))
    if sizes["CONSTRAINTS"]:
        lines += [_array("sizes", data["sizes"]), f"static const double time_scale = {literal(data['time'])};"]
        lines += [
            _array(f"slope_{name}", one, "int") for name, one in zip(("rows", "columns"), data["slopes"], strict=True)
        ]
    if sizes["WATCHED"]:
        rank = {i: k for k, i in enumerate(data["kept"])}
        lines.append(_array("kept_rank", [rank.get(i, -1) for i in range(sizes["CONSTRAINTS"])], "int"))
        lines.append(_array("kept_constraints", data["kept"], "int"))
    if sizes["PIECES"]:
        lines.append(_array("piece_times", data["schedule"]["times"]))
    if sizes["RELATIONS"]:
        lines.append(_array("piece_values", [x for one in data["schedule"]["values"] for x in one]))
    if sizes["EVENTS"]:
        events = data["events"]
        lines += [_array(f"event_{name}", [one[name] for one in events]) for name in ("small", "direction")]
        lines.append(_array("event_noted", [int(one["noted"]) for one in events], "int"))
        lines.append(_array("event_stops", [int(one["target"] == "stop") for one in events], "int"))
        texts = [quoted(f"{one['part']}: {one['message']}") for one in events]
        lines.append(f"static const char *const event_messages[] = {{{', '.join(texts)}}};")
        waves = [f(1 + 2.4 * i) for f in (math.cos, math.sin) for i in range(sizes["SIZE"])]
        lines.append(_array("turns", waves))
    names = [*data["coordinates"], *data["speeds"]]
    described = [("states", [(one["name"], one["unit"]) for one in names])]
    described.append(("quantities", [(one.path, one.unit) for one in mode.known]))
    for key, ones in described:
        rows = ",\n".join(f"    {{{quoted(path)}, {quoted(unit)}}}" for path, unit in ones) or '    {"", ""}'
        lines.append(f"const scene_variable scene_{key}[] = {{\n{rows}\n}};")
    rows = ",\n".join(map(_parameter, parameters)) or '    {"", "", 0.0, 0.0, 0.0}'
    lines.append(f"const scene_parameter_of scene_parameters[] = {{\n{rows}\n}};")
    return lines


def _parameter(one: dict[str, Any]) -> str:
    low = -math.inf if one["low"] is None else math.nextafter(one["low"], math.inf) if one["lower_open"] else one["low"]
    high = math.inf if one["high"] is None else one["high"]
    numbers = ", ".join(_number(float(x)) for x in (one["value"], low, high))
    return f"    {{{quoted(one['path'])}, {quoted(one['unit'])}, {numbers}}}"


def _number(value: float) -> str:
    """Return a number as C writes it in a table of constants that may be infinite."""
    return literal(value).replace("((double)INFINITY)", "HUGE_VAL").replace("(-(double)INFINITY)", "-HUGE_VAL")


def _array(name: str, values: Iterable[Any], kind: str = "double") -> str:
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
