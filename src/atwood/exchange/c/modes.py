"""The C of a scene with modes: each mode is a source of its own, and one more asks them in turn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from atwood.codegen.c.printer import WORDS
from atwood.exchange.c.tables import KINDS, array, exported_tables, sources
from atwood.plotting.live.mode import ModeText

_DECLARED = """
/* What a scene asks of one of its modes, beside a motion. */
int scene_leads(const scene *s, int *has_impact);
void scene_refresh(scene *s, double t);
int scene_leave(scene *s, double *q, double *u, double *held);
int scene_enter(scene *s, double t, const double *guess, const double *q, double *u, const double *held, int hits);
int scene_is_sided(scene *s);
"""

_ASKED = """static void take_KK(scene *s, int status)
{
    const scene_modeKK *const m = &s->inKK;
    int k;
    s->time = m->time;
    memcpy(s->state, m->state, sizeof m->state);
    s->text = m->text;
    s->constraint = m->constraint;
    for (k = m->happened > scene_LOGGED ? m->happened - scene_LOGGED : 0; k < m->happened; k++) {
        const scene_modeKK_happening *const one = m->log + k % scene_LOGGED;
        log_event(s, one->time, OFFSET + one->source, one->kind, one->speed);
        s->event = OFFSET + m->event;
        s->event_time = m->event_time;
    }
    s->status = status;
}

static void give_KK(scene *s)
{
    scene_modeKK *const m = &s->inKK;
    m->rtol = s->rtol;
    m->atol = s->atol;
    m->longest = s->longest;
    m->step = s->step;
    m->happened = 0;
}

static int ask_KK(scene *s, int request, double t, double *values)
{
    scene_modeKK *const m = &s->inKK;
    int k, status;
    give_KK(s);
    if (m->time != s->time || memcmp(m->state, s->state, sizeof m->state) != 0) {
        m->time = s->time;
        memcpy(m->state, s->state, sizeof m->state);
        m->is_evaluated = 0;
    }
    if (request == BEGIN) {
        m->is_new = s->is_new;
        status = scene_modeKK_begin(m);
    } else if (request == GO_ON) {
        status = scene_modeKK_advance(m, t);
    } else if (request == RATES) {
        return scene_modeKK_rates(m, values);
    } else {
        status = scene_modeKK_evaluate(m, s->of_mode);
        for (k = 0; k < scene_QUANTITIES; k++) {
            values[k] = quantities_in_KK[k] >= 0 ? s->of_mode[quantities_in_KK[k]] : (double)NAN;
        }
        return status;
    }
    take_KK(s, status);
    return status;
}
"""

_CHANGE = """static int change_AA_BB(scene *s)
{
    scene_modeAA *const m = &s->inAA;
    scene_modeBB *const o = &s->inBB;
    double guess[scene_modeBB_COORDINATES + 1], q[BODIES], u[BODIES], held[HELD];
    int i, has_impact, status;
    scene_modeAA_leads(m, &has_impact);
    if (scene_modeAA_leave(m, q, u, held) != 0) return say(s, FAILED, "the bodies have no place");
    scene_modeAA_evaluate(m, s->of_mode);
    for (i = 0; i < scene_modeBB_COORDINATES; i++) {
        const int place = guess_AA_BB[i];
        guess[i] = place < 0 ? reference_AA_BB[i] : place < scene_modeAA_STATES ? m->state[place]
                 : s->of_mode[place - scene_modeAA_STATES];
    }
    s->mode = BB;
    give_BB(s);
    status = scene_modeBB_enter(o, m->time, guess, q, u, held, has_impact);
    take_BB(s, status);
    if (status == READY && !scene_modeBB_is_sided(o)) return say(s, FAILED, "parts have changed sides on their line");
    return status;
}
"""


def mode_after(mode: ModeText, event: dict[str, Any], modes: Sequence[ModeText]) -> int:
    """Return the number of the mode that an event leads to; -1 for none."""
    after = {**mode.data["modes"], event["part"]: event["target"]}
    found = [k for k, one in enumerate(modes) if one.data["modes"] == after]
    return found[0] if found and event["part"] in mode.data["modes"] else -1


def header_with(template: str, counts: dict[str, int], memory: Sequence[str]) -> str:
    """Return a header with its counts and the memory of an instance."""
    lines = "\n".join(f"#define scene_{key} {one}" for key, one in counts.items())
    lines += f"\nenum {{ {', '.join(f'scene_{one.upper()}' for one in KINDS)} }};"
    text = template.replace("/* counts */", lines).replace("/* word */", WORDS.replace("word", "scene_word"))
    return text.replace("    /* memory */", "\n".join(f"    {one};" for one in memory))


def with_declarations(header: str) -> str:
    """Return the header of a mode, with what a scene asks of it."""
    return header.replace("\n#ifdef __cplusplus\n}", f"{_DECLARED}\n#ifdef __cplusplus\n}}")


def header_of_modes(template: str, modes: Sequence[ModeText], counts: dict[str, int]) -> str:
    """Return the header of a scene with modes."""
    most = max(len(one.known) for one in modes)
    memory = ["int mode", f"double of_mode[{most + 1}]", *(f"scene_mode{k} in{k}" for k in range(len(modes)))]
    own = "\n".join(f'#include "scene_mode{k}.h"' for k in range(len(modes)))
    return header_with(template, counts, memory).replace("#include <stdint.h>", f"#include <stdint.h>\n\n{own}")


def source_of_modes(template: str, modes: Sequence[ModeText], parameters: Sequence[dict[str, Any]]) -> str:
    """Return the source of a scene with modes."""
    offset, texts = 0, []
    tables = exported_tables(modes, parameters)
    for k, mode in enumerate(modes):
        numbers = {one.path: i for i, one in enumerate(mode.known)}
        tables.append(array(f"quantities_in_{k}", [numbers.get(one.path, -1) for one in modes[0].known], "int"))
        texts.append(_ASKED.replace("KK", str(k)).replace("OFFSET", str(offset)))
        offset += len(sources(mode))
    pairs = [(a, b) for a in range(len(modes)) for b in sorted(set(_leads(modes[a])))]
    most = max(max(one.data["passage"]["counts"]) for one in modes)
    for a, b in pairs:
        tables += _guesses(modes[a], modes[b], f"{a}_{b}")
        text = _CHANGE.replace("AA", str(a)).replace("BB", str(b))
        texts.append(text.replace("BODIES", str(most + 1)).replace("HELD", str(len(modes[0].data["held"]) + 1)))
    texts.append(_dispatched(len(modes), pairs))
    return template.replace("/* tables */", "\n".join(tables)).replace("/* modes */", "\n".join(texts))


def _leads(mode: ModeText) -> Iterator[int]:
    sides = [by for each in mode.data["passage"]["refused"] for _, by in each]
    return (one["leads"] for one in (*mode.data["events"], *sides) if one["leads"] >= 0)


def _guesses(before: ModeText, after: ModeText, name: str) -> list[str]:
    """Return where first guesses of coordinates come from: states, quantities, or a table."""
    states = {one["name"]: i for i, one in enumerate(before.data["coordinates"])}
    known = {one.path: len(before.data["state"]) + i for i, one in enumerate(before.known)}
    places = [(known | states).get(one["name"], -1) for one in after.data["coordinates"]]
    return [
        array(f"guess_{name}", places, "int"),
        array(f"reference_{name}", after.data["passage"]["reference"]),
    ]


def _dispatched(count: int, pairs: Sequence[tuple[int, int]]) -> str:
    """Return the functions that find the mode."""

    def each(text: str) -> str:
        return "\n".join(text.replace("KK", str(k)) for k in range(count))

    changes = "\n".join(f"    case {a * count + b}: return change_{a}_{b}(s);" for a, b in pairs)
    return f"""static int ask(scene *s, int request, double t, double *values)
{{
    switch (s->mode) {{
{each("    case KK: return ask_KK(s, request, t, values);")}
    default: return say(s, FAILED, "there is no such mode");
    }}
}}

static int change(scene *s)
{{
    int has_impact, next = -1;
    switch (s->mode) {{
{each("    case KK: next = scene_modeKK_leads(&s->inKK, &has_impact); break;")}
    default: break;
    }}
    switch (s->mode * {count} + next) {{
{changes}
    default: return say(s, FAILED, "there is no such mode");
    }}
}}

static void refresh(scene *s, double t)
{{
{each("    scene_modeKK_refresh(&s->inKK, t);")}
}}

static void refresh_links(scene *s)
{{
{each("    scene_modeKK_copy(&s->inKK, &s->inKK);")}
}}

static void set_in_modes(scene *s, int number, double value)
{{
{each("    scene_modeKK_set_parameter(&s->inKK, number, value);")}
}}

void scene_default(scene *s)
{{
    memset(s, 0, sizeof *s);
    s->rtol = 1e-8;
    s->is_new = 1;
    s->time = scene_start_time;
{each("    scene_modeKK_default(&s->inKK);")}
    memcpy(s->state, s->in0.state, sizeof s->in0.state);
}}

double scene_parameter(const scene *s, int number)
{{
    return scene_mode0_parameter(&s->in0, number);
}}

void scene_energies(scene *s, double *kinetic, double *potential)
{{
    switch (s->mode) {{
{each("    case KK: scene_modeKK_energies(&s->inKK, kinetic, potential); break;")}
    default: break;
    }}
}}
"""
