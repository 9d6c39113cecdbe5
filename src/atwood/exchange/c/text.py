"""The C99 of a scene: programs, routines, data and engine in one file, its header, and a program that prints it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from importlib.resources import files
from typing import Any

from atwood.codegen.c.printer import BITS, HEAD, print_routines, reached
from atwood.codegen.c.program import functions_of, print_program
from atwood.codegen.functions import write_routines as write_functions
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.codegen.routines import Routine
from atwood.exchange.c.modes import header_of_modes, header_with, mode_after, source_of_modes, with_declarations
from atwood.exchange.c.tables import ENDS, LEADS, NOTED, PASSES, SIDE_KINDS, UPDATES, sources, tables_of
from atwood.expr.core.program import Program
from atwood.forms.assembly import Assembly
from atwood.integrators.embedded.rates import write_routines as write_rates
from atwood.integrators.embedded.stepper import FIELDS
from atwood.integrators.embedded.steps import write_routines as write_steps
from atwood.integrators.event_location import FIELDS as SEARCH_FIELDS, MOST, ROWS as SEARCH_ROWS, STACK
from atwood.integrators.event_routines import write_routines as write_search
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.integrators.sets import record as sets
from atwood.integrators.sets.resolve import write_sets
from atwood.integrators.sets.series import LONG
from atwood.integrators.step_guard import write_routines as write_guard
from atwood.integrators.stepper import WIDTH
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.live.mode import ModeText
from atwood.plotting.live.parameters import live_parameters
from atwood.plotting.live.program import live_modes
from atwood.plotting.live.start import add_start, add_tangent

_CALLED = {"constraints": "held"}
"""Programs that C calls otherwise, since a routine of the method has their name."""

_ASKED = "constraints", "quantities", "loads", "contacts", "sides", "maximal", "impact", "tangent", "places"
"""Programs of (t, q, u) and more that the engine calls itself, beside updates and those of the start."""

_LOGGED = 64
"""Events that are remembered."""

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
    modes
        Files of modes by their names, if there are several.
    mode
        What was printed; the first mode.
    size
        The number of states, in the mode that has most.
    parameters
        What can be changed, as `atwood.plotting.live.parameters.live_parameters` describes it.
    start_time, end_time
        When it begins and ends, s.
    """

    name: str
    header: str
    source: str
    main: str
    modes: dict[str, str]
    mode: ModeText
    size: int
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
    modes, start = live_modes(assembly, quantities=quantities)
    mode = modes[0]
    mode.data["start"] = add_start(mode, start)
    for one in modes:
        if "passage" in one.data or one.data.get("start"):
            add_tangent(one)
        one.data["modes_of_scene"] = len(modes)
        sides = [by for each in one.data.get("passage", {}).get("refused", ()) for _, by in each]
        for event in (*one.data["events"], *sides):
            event["leads"] = mode_after(one, event, modes)
    name, parameters = c_name(assembly.flat.name), live_parameters(mode.assembly)
    beside = more(mode) if more and len(modes) == 1 else {}
    texts = [(_header(one, parameters, beside), _source(one, parameters, beside)) for one in modes]
    header, source = texts[0]
    of_modes: dict[str, str] = {}
    if len(modes) > 1:
        for k, (own_header, own_source) in enumerate(texts):
            own = f"{name}_mode{k}"
            of_modes[f"{own}.h"] = with_name(with_declarations(own_header), own)
            of_modes[f"{own}.c"] = with_name(own_source, own)
        header = header_of_modes(_template("scene.h"), modes, _counts(modes, parameters))
        source = source_of_modes([_with_log("modes.c"), _template("ask.c"), _template("change.c")], modes, parameters)
    return SceneText(
        name,
        with_name(header, name),
        with_name(source, name),
        with_name(_template("main.c"), name),
        of_modes,
        mode,
        max(len(one.data["state"]) for one in modes),
        parameters,
        mode.flat.t_start,
        mode.flat.t_end,
    )


def c_name(name: str) -> str:
    """Return a name of a scene as C takes it."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    text = re.sub(r"\W+", "_", words, flags=re.ASCII).strip("_").lower() or "model"
    text = f"model_{text}" if text[0].isdigit() else text
    return text if "_" in text else f"{text}_model"  # no word of C and no function of its library has a stroke


def with_name(text: str, name: str) -> str:
    """Return a text in which names of the header begin with that of the scene."""
    return re.sub(r'(?<=")scene(?=\.[ch]")|\bscene(?=_[A-Za-z])|\bscene\b(?=[ ;*)])', name, text)


def _template(name: str) -> str:
    return files("atwood.exchange.c").joinpath(name).read_text(encoding="utf-8")


def _programs(mode: ModeText) -> dict[str, Program]:
    """Return the programs that a motion needs, by their names in C."""
    known = mode.programs
    names = ["kernel", "nearer", "judge", "events", "constraints", "quantities", "loads", "contacts", "sides"]
    names += [one for one in known if one.startswith(("update_", "start_"))]
    names += ["tangent"] if mode.data.get("start") or "maximal" in known else []
    if "passage" in mode.data:
        names += ["maximal", "impact", *(["places"] if mode.data["passage"]["signs"] else [])]
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
        **_sizes_of_changes(data, programs),
    }


def _sizes_of_changes(data: dict[str, Any], programs: dict[str, Program]) -> dict[str, int]:
    """Return the numbers of what updates, contacts, and passages through all bodies need."""
    updates, contacts, passage = (data.get(name) or {} for name in ("updates", "contacts", "passage"))
    found = {"UPDATES": len(updates.get("laws", ())), "MOMENTS": len(updates.get("times", ()))}
    found |= {"CONTACTS": len(contacts.get("keys", ())), "PASSAGE": int(bool(passage))}
    found["SWITCHES"] = int(bool(passage) and passage["switches"])
    sides = data.get("sides", {"kinds": [], "first": 0})
    found |= {"SIDES": len(sides["kinds"]), "FIRST_SIDE": sides["first"]}
    found["HELD_VALUES"] = len(data["held"])
    if contacts:
        found |= {"CONTACT_ROWS": contacts["size"], "PATTERN": len(contacts["pattern"]) // 2}
        found |= {"PAST": LONG, "UNITS": len(sets.UNITS), "ENTRY": len(sets.ENTRY)}
        found |= {"WATCH_GAP": 1, "WATCH_REST": 2, "WATCH_RUN": 3}
        found |= {"OPENS": sets.OPENS, "YIELDS": sets.YIELDS, "UNDETERMINED": sets.UNDETERMINED}
    if passage:
        n, m = passage["counts"]
        found |= {"BODY_COORDINATES": n, "BODY_SPEEDS": m, "BODY_CONSTRAINTS": len(passage["labels"])}
        found |= {"BODY_TURNS": len(passage["turns"]), "BODY_MASSES": len(passage["mass"][0])}
        found |= {"BODY_SLOPES": len(passage["slopes_of_constraints"][0])}
        found |= {"HAS_MAXIMAL": int("maximal" in programs), "ONE_SIDES": sum(map(len, passage["refused"]))}
        found |= {"PLACE_SLOPES": len(passage.get("slopes", [()])[0]), "ALONG": len(passage["along"])}
        found |= {"TURNED": len(passage["turned"]), "SIGNS": len(passage["signs"])}
    found |= {"HAS_TANGENT": int("tangent" in programs), "TANGENTS": len(data.get("tangent", [()])[0])}
    return found | _sizes_of_start(data, programs)


def _sizes_of_start(data: dict[str, Any], programs: dict[str, Program]) -> dict[str, int]:
    start = data.get("start")
    found = {"STARTS": int(bool(start)), "LEASTNORM": int(bool(start) or "passage" in data)}
    if not start:
        return found | {"START_COORDINATES": len(data["coordinates"])}
    n, m = start["counts"]
    found |= {"START_COORDINATES": n, "START_SPEEDS": m, "START_TURNS": len(start["turns"])}
    for name, slopes in (("PLACE", "PLACE_SLOPES_OF_START"), ("SPEED", "SPEED_SLOPES")):
        level = start[f"{name.lower()}s"]
        found |= {f"{name}_CONSTRAINTS": level["constraints"], f"{name}_TARGETS": len(level["targets"])}
        found[slopes] = len(level["slopes"][0])
    return found | {"START_IS_MAXIMAL": int("start_maximal" in programs)}


# -- header ---------------------------------------------------------------------------------------------------------


def _header(mode: ModeText, parameters: Sequence[dict[str, Any]], beside: dict[str, Program]) -> str:
    programs = _programs(mode)
    sizes = _sizes(mode, programs)
    return header_with(_template("scene.h"), _counts([mode], parameters), _memory(programs | beside, sizes))


def _counts(modes: Sequence[ModeText], parameters: Sequence[dict[str, Any]]) -> dict[str, int]:
    data = modes[0].data
    return {
        "STATES": max(len(one.data["state"]) for one in modes),
        "PARAMETERS": len(parameters),
        "QUANTITIES": len(modes[0].known),
        "COORDINATES": len(data["coordinates"]),
        "SOURCES": sum(len(sources(one)) for one in modes),
        "LOGGED": _LOGGED,
    }


def _memory(programs: dict[str, Program], sizes: dict[str, int]) -> list[str]:
    """Return the arrays of an instance."""
    size, events = sizes["SIZE"], sizes["EVENTS"]
    scratch = max(print_program(name, one)[1] for name, one in programs.items())
    most = max(size, events)
    words = {"values": sizes["VALUES"], "session": len(FIELDS), "arrays": TABLEAU.rows["all"] * sizes["PADDED"]}
    words |= {"scratch": scratch, "block": 5, "functions": 6, "y": size, "yp": most}
    if sizes["PROJECTS"]:
        words["nearer_room"] = size + sizes["SPEEDS"]
    if sizes["JUDGES"]:
        words["judged"] = 4
    if events:
        words |= {"sought": len(SEARCH_FIELDS), "event_y": most, "event_yp": most, "shifted": size, "turns": 2 * size}
        words |= {"rows": len(SEARCH_ROWS) * events + _POINTS * (1 + 2 * events), "shifts": events, "self": 1}
    if sizes["CONTACTS"]:
        count, rows = sizes["CONTACTS"], sizes["CONTACT_ROWS"]
        words |= {"sets": len(sets.FIELDS), "units": len(sets.UNITS) * count, "set_rows": len(sets.ROWS) * rows}
        words |= {"matrix": rows * rows, "left": rows * (rows + 1), "shares": 4 * count * rows}
        words |= {"pattern": 2 * sizes["PATTERN"], "impacts": 2 * LONG}
        words |= {"log_of_sets": sets.CAPACITY * (rows + len(sets.ENTRY))}
    if sizes["PASSAGE"]:
        words["body"] = max(size, sizes["BODY_COORDINATES"] + sizes["BODY_SPEEDS"])
    for name, one in programs.items():
        words[f"{name}_derived"] = len(one.prologue)
        if _is_asked(name):
            words |= {f"{name}_{k}": len(group.expressions) for k, group in enumerate(one.outputs)}
    lines = [f"scene_word {name}[{max(count, 1)}]" for name, count in words.items()]
    if sizes["CONSTRAINTS"]:
        lines.append("double held_size")
    if sizes["WATCHED"]:
        lines += ["double held_last, held_largest", f"double held_most[{max(sizes['KEPT'], 1)}]"]
    if sizes["CONTACTS"]:
        lines += [f"double triggers[{sizes['CONTACTS']}]", f"int calm[{max(events, 1)}]"]
    if sizes["SIDES"]:
        lines.append(f"int passed_sides[{sizes['SIDES']}]")
    if sizes["UPDATES"]:
        most = max((len(one.results) for name, one in programs.items() if name.startswith("update_")), default=1)
        lines.append(f"double set_by_update[{max(most, 1)}]")
    if sizes["STARTS"]:
        n, m = sizes["START_COORDINATES"], sizes["START_SPEEDS"]
        rows = max(sizes[f"{name}_CONSTRAINTS"] + sizes[f"{name}_TARGETS"] for name in ("PLACE", "SPEED"))
        lines += [f"scene_word start_y[{n + m}]", f"int row_of_condition[{rows + 1}]"]
        lines += [f"double rows_of_start[{rows * m + 1}], misses_of_start[{rows + 1}], step_of_start[{m + 1}]"]
    if sizes["PASSAGE"]:
        m, held = sizes["BODY_SPEEDS"], sizes["BODY_CONSTRAINTS"]
        numbers = {"masses": m * m, "slopes": held * m, "rows_of_impact": max((m + held) ** 2, m * sizes["SPEEDS"])}
        numbers |= dict.fromkeys(("right", "unknowns"), max(m + held, sizes["SPEEDS"]))
        numbers |= {"places": sizes["BODY_COORDINATES"], "velocities": m, "was": 2 * held, "now": 2 * held}
        lines += [f"double {name}[{max(count, 1)}]" for name, count in numbers.items()]
    return [*lines, *([f"int fired[{events}]"] if events else [])]


def _is_asked(name: str) -> bool:
    return name in _ASKED or name.startswith(("update_", "start_"))


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
        *([_numbered("SET", sets.FIELDS), _numbered("UNIT", sets.UNITS)] if sizes["CONTACTS"] else []),
        f"enum {{ NOTED = {NOTED}, ENDS = {ENDS}, UPDATES_STATES = {UPDATES}, LEADS = {LEADS}, PASSES = {PASSES} }};",
        *([_numbered("", [one.upper() for one in SIDE_KINDS])] if sizes["SIDES"] else []),
        "",
        *bits,
        *(_declared(name) for name in every),
        body,
        *printed,
        *tables_of(mode, parameters, sizes),
        *(_asking(name, one) for name, one in programs.items() if _is_asked(name)),
        *([_updating(programs)] if sizes["UPDATES"] else []),
        _filling(programs),
        _engine(sizes),
        *([_template("mode.c")] if mode.data["modes_of_scene"] > 1 else []),
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
    if sizes["CONTACTS"]:
        known += write_sets()
        roots.append("resolve")
    if any("factorise(" in one for one in printed):
        known += write_elimination()
        roots += ["factorise", "substitute"]
    functions = write_functions(functions_of(programs.values()), each=False)
    roots += [one.name for one in functions if any(f"{one.name}(" in text for text in printed)]
    return reached([*functions, *known], roots)


def _numbered(prefix: str, names: Iterable[str]) -> str:
    numbers = TABLEAU.rows.items() if names is TABLEAU.rows else ((one, k) for k, one in enumerate(names))
    before = f"{prefix}_" if prefix else ""
    texts = [f"{before}{str(name).replace(' ', '_')} = {number}" for name, number in numbers]
    return f"enum {{ {', '.join(texts)} }};"


def _declared(name: str) -> str:
    return f"static int32_t {name}(word *inputs, word *derived, word *scratch, word *outputs);"


def _asking(name: str, program: Program) -> str:
    """Return the function that calls a program of (t, q, u) and perhaps of the accelerations."""
    outputs = "\n".join(f"    out[{k}].p = s->{name}_{k};" for k in range(len(program.outputs)))
    kind = "BODY_" if name == "impact" else "START_" if name.startswith(("start_", "tangent")) else ""
    return f"""static int call_{name}(scene *s, double t, word *y, word *a)
{{
    word in[4], out[{len(program.outputs)}], moment;
    moment.f = t;
    in[0].p = &moment;
    in[1].p = y;
    in[2].p = y + {kind}COORDINATES;
    in[3].p = a;
{outputs}
    return {name}(in, s->{name}_derived, s->scratch, out);
}}
"""


def _updating(programs: dict[str, Program]) -> str:
    """Return the function that makes an update of the state in s->y; no address where it has no value."""
    cases = "\n".join(
        f"    case {name.removeprefix('update_')}:\n        count = {len(one.results)};\n        found = s->{name}_0;\n"
        f"        if (call_{name}(s, s->time, s->y, NULL) != 0) return NULL;\n        break;"
        for name, one in programs.items()
        if name.startswith("update_")
    )
    return f"""static const double *updated(scene *s, int k)
{{
    const word *found;
    int i, count;
    switch (k) {{
{cases}
    default:
        return NULL;
    }}
    for (i = 0; i < count; i++) s->set_by_update[i] = found[i].f;
    return s->set_by_update;
}}
"""


def _with_log(name: str) -> str:
    """Return a template with what tells of events."""
    return _template(name).replace("/* log */\n", _template("log.c"))


def _engine(sizes: dict[str, int]) -> str:
    """Return the engine, with what passes through all bodies and what meets contacts where there are any."""
    text = _with_log("engine.c")
    for name, size in {"contacts": "", "sides": "", "leastnorm": "", "passage": "", "start": "STARTS"}.items():
        text = text.replace(f"/* {name} */\n", _template(f"{name}.c") if sizes[size or name.upper()] else "")
    return text


def _filling(programs: dict[str, Program]) -> str:
    lines = "\n".join(f"    {name}_prologue(s->values, s->{name}_derived, s->scratch);" for name in programs)
    return f"/* What depends on parameters alone. */\nstatic void fill(scene *s)\n{{\n{lines}\n}}\n"
