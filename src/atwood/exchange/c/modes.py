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


def source_of_modes(templates: Sequence[str], modes: Sequence[ModeText], parameters: Sequence[dict[str, Any]]) -> str:
    """Return the source of a scene with modes, from the templates of the whole, of a mode and of a change."""
    template, ask, change = templates
    offset, texts = 0, []
    most = max(max(one.data["passage"]["counts"]) for one in modes)
    counts = {"MODES": len(modes), "BODIES": most + 1, "HELD": len(modes[0].data["held"]) + 1}
    tables = [*(f"#define {key} {one}" for key, one in counts.items()), *exported_tables(modes, parameters)]
    for k, mode in enumerate(modes):
        numbers = {one.path: i for i, one in enumerate(mode.known)}
        tables.append(array(f"quantities_in_{k}", [numbers.get(one.path, -1) for one in modes[0].known], "int"))
        texts.append(ask.replace("KK", str(k)).replace("OFFSET", str(offset)))
        offset += len(sources(mode))
    pairs = [(a, b) for a in range(len(modes)) for b in sorted(set(_leads(modes[a])))]
    for a, b in pairs:
        tables += _guesses(modes[a], modes[b], f"{a}_{b}")
        texts.append(change.replace("AA", str(a)).replace("BB", str(b)))
    text = _repeated(template, "mode", [{"KK": str(k)} for k in range(len(modes))])
    text = _repeated(text, "change", [{"AA": str(a), "BB": str(b)} for a, b in pairs])
    return text.replace("/* tables */", "\n".join(tables)).replace("/* modes */", "\n".join(texts))


def _repeated(text: str, what: str, names: Sequence[dict[str, str]]) -> str:
    """Return a text with the lines that are marked so once for each."""
    lines = []
    for line in text.split("\n"):
        own, mark, _ = line.partition(f" /* each {what} */")
        for name in names if mark else ({},):
            one = own
            for key, value in name.items():
                one = one.replace(key, value)
            lines.append(one)
    return "\n".join(lines)


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
