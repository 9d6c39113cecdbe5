"""Pages of scenes in `docs/scenes/`, each with a picture, its parts, and both forms compared, from the scene itself.

``python -m tests.pages write`` writes them anew, ``python -m tests.pages write kepler`` one of them, and ``say`` in
place of ``write`` only the commands that have an answer. What stands in the overviews
(`docs/scenes/fields-and-curves.md` and its neighbours) of a scene is repeated on its page.
"""

from __future__ import annotations

import inspect
import json
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import atwood
from atwood import AtwoodError, Model, Scene, UsageError
from atwood_library.scenes import SCENES

HERE = Path(__file__).resolve().parents[1] / "docs" / "scenes"
OVERVIEWS = ("drives-and-control", "fields-and-curves", "mechanisms")
ROW = re.compile(r"^\| \[`([a-z0-9-]+)`\]\(\1\.md\) \| .* \| .* \| (.*) \|$", re.MULTILINE)
SETTINGS: dict[str, dict[str, Any]] = {
    "stewart-platform": {"legs": "controlled"},
    "bead-on-wire": {"shape": "parabola", "rate": 2.5},
}
"""Scenes that are shown with other values than their own."""
RTOL = 1e-9
COLOURS = 24


def known() -> dict[str, str]:
    """Return what the overviews say of each scene that has a page, by its name."""
    text = "\n".join((HERE / f"{name}.md").read_text(encoding="utf-8") for name in OVERVIEWS)
    return dict(ROW.findall(text))


def make(name: str) -> Scene:
    """Return a scene with the values that are shown."""
    return SCENES[name](**SETTINGS.get(name, {}))


def head(name: str) -> str:
    """Return what a page begins with: title, meaning, what is known, picture, and parts."""
    kind = SCENES[name]
    lines = [f"# {name}", inspect.cleandoc(vars(kind)["__doc__"] or "")]
    says = known()[name]
    lines.append(f"What is known of it, and tested: {says}.")
    given = SETTINGS.get(name, {})
    shown = "".join(f" --set {path}={value}" for path, value in given.items())
    lines.append(f"![{name}](images/{name}.png)")
    lines.append(f"```console\n$ atwood run {name}{shown}\n```")
    lines.append(code(name))
    lines.append("| part | is | what it does |\n|---|---|---|\n" + "\n".join(part_rows(make(name))))
    return "\n\n".join(lines)


def code(name: str) -> str:
    """Return the scene in Python."""
    given = ", ".join(f"{path}={json.dumps(value)}" for path, value in SETTINGS.get(name, {}).items())
    short = min(1.0, make(name).t_end)
    return (
        "```python\nfrom atwood import simulate\n"
        f"from atwood_library.scenes import {SCENES[name].__name__}\n\n"
        f"result = simulate({SCENES[name].__name__}({given}), t_end={short:g})\n"
        'assert result.status == "finished"\n```'
    )


def part_rows(scene: Model) -> list[str]:
    """Return a row for each kind of part of a scene, with the names of those that are of it."""
    names: dict[type, list[str]] = {}
    for name, part in leaves(scene):
        names.setdefault(type(part), []).append(name)
    rows = []
    for kind, several in names.items():
        more = f" and {len(several) - 6} more" if len(several) > 6 else ""
        shown = ", ".join(f"`{one}`" for one in several[:6])
        rows.append(f"| {shown}{more} | `{kind.__name__}` | {summary(kind)} |")
    return rows


def leaves(model: Any, before: str = "") -> list[tuple[str, Any]]:
    """Return the parts of a model and of the models in it, with their paths."""
    found = []
    for name, part in model.parts.items():
        found += leaves(part, f"{before}{name}.") if hasattr(part, "parts") else [(before + name, part)]
    return found


def summary(kind: type) -> str:
    """Return the first sentence of what a class says of itself."""
    return " ".join(inspect.cleandoc(vars(kind)["__doc__"] or "").split("\n\n")[0].split()).replace("|", "\\|")


def compared(name: str) -> tuple[str, Any]:
    """Return both forms beside each other, and the run of the reduced form."""
    runs = {form: atwood.simulate(make(name), form=form, rtol=RTOL, outputs=101) for form in ("reduced", "dae")}
    rows = []
    equations = {form: run.assembly.own_equations for form, run in runs.items()}
    for what, of in (
        ("coordinates", lambda e: len(e.coordinates)),
        ("speeds", lambda e: len(e.speeds)),
        ("constraints left", lambda e: len(e.constraints)),
    ):
        rows.append(f"| {what} | {of(equations['reduced'])} | {of(equations['dae'])} |")
    for form, run in runs.items():
        assert run.status == "finished", (name, form, run.message)
    text = "| | reduced | dae |\n|---|---|---|\n" + "\n".join(rows)
    end = runs["reduced"].time[-1]
    text += f"\n\nRun to {end:g} s at a relative tolerance of 1e-9, both forms give the same places and angles to "
    return f"{text}{_power(_gap(runs))} of their sizes.\n", runs["reduced"]


def _equations(assembly: Any) -> str:
    found = atwood.equations(assembly)
    count = len(found.expressions.velocities)
    return f"{count} equation{'s' if count > 1 else ''} of motion" + ("" if found.is_readable else ": their structure")


def _one_degree(assembly: Any) -> str:
    reduced = assembly.reduced
    if len(reduced.speeds) != 1 or len(reduced.coordinates) != 1 or reduced.constraints:
        raise UsageError("a portrait is of one coordinate")
    return f"all motions over `{reduced.names[0].name}` and its rate"


def _reduced(assembly: Any) -> str:
    found = atwood.reduced(assembly)
    return f"the motion of `{found.coordinate}` alone, in its effective potential"


def _routhian(assembly: Any) -> str:
    ignorable = atwood.routhian(assembly).ignorable
    if not ignorable:
        raise UsageError("no coordinate is ignorable")
    return (
        f"the Routhian: {', '.join(f'`{one}`' for one in ignorable)} {'is' if len(ignorable) == 1 else 'are'} ignorable"
    )


def _free(assembly: Any) -> str:
    if not assembly.regular.orientation_coordinates:
        raise UsageError("no body turns freely")
    atwood.free_rotation(assembly)
    return "a free body: its polhode and how it turns, in closed form"


QUESTIONS: dict[str, Callable[[Any], str]] = {
    "equations": _equations,
    "hamiltonian": lambda assembly: atwood.hamiltonian(assembly).sentence.rstrip("."),
    "routhian": _routhian,
    "reduced": _reduced,
    "phase": _one_degree,
    "symmetric-top": lambda assembly: f"a heavy symmetric top: {atwood.symmetric_top(assembly).kind}",
    "free-rotation": _free,
}
"""Commands of theory, and what each says of a scene that it has an answer for; `UnsupportedError` or the like else."""


def said(name: str) -> str:
    """Return what can be said of a scene: the commands that have an answer, asked one after another."""
    assembly = atwood.assemble(make(name))
    given = "".join(f" --set {path}={value}" for path, value in SETTINGS.get(name, {}).items())
    rows = []
    for command, ask in QUESTIONS.items():
        try:
            rows.append(f"| `atwood {command} {name}{given}` | {ask(assembly)} |")
        except AtwoodError:
            continue
    rows.append(f"| `atwood conserved {name}{given}` | what is conserved, and how that is known |")
    rows.append(f"| `atwood compare {name}{given}` | what each form costs for which error |")
    return "## What can be said of it\n\n| command | says |\n|---|---|\n" + "\n".join(rows) + "\n"


def add(name: str) -> None:
    """Write anew what can be said of a scene, and leave the rest of its page."""
    file = HERE / f"{name}.md"
    text = file.read_text(encoding="utf-8").partition("\n## What can be said")[0]
    file.write_text(f"{text}\n{said(name)}", encoding="utf-8")


def _gap(runs: dict[str, Any]) -> float:
    """Return by how much the coordinates of the dae form differ in both runs, relative to their largest values."""
    dae = runs["dae"]
    paths = [one.name for one in dae.assembly.own_equations.names if one.name in dae and one.name in runs["reduced"]]
    worst = 0.0
    for path in paths:
        mine, other = (runs[form].array(path) for form in ("reduced", "dae"))
        worst = max(worst, float(abs(mine - other).max()) / max(1.0, float(abs(mine).max())))
    assert paths
    return worst


def _power(value: float) -> str:
    """Return the next power of ten above a number, as text."""
    return f"1e{max(-9, math.ceil(math.log10(value or 1e-16))):d}"


def write(name: str) -> None:
    """Write the page of a scene and its picture."""
    from matplotlib.figure import Figure

    from atwood.plotting import plot_mechanism

    text, run = compared(name)
    (HERE / f"{name}.md").write_text(f"{head(name)}\n\n{text}\n{said(name)}", encoding="utf-8")
    figure: Figure = plot_mechanism(run)
    _save_small(figure, HERE / "images" / f"{name}.png")


def _save_small(figure: Any, file: Path) -> None:
    """Save a figure with few colours, 640 points wide."""
    from io import BytesIO

    from PIL import Image

    file.parent.mkdir(exist_ok=True)
    memory = BytesIO()
    width = figure.get_size_inches()[0]
    figure.savefig(memory, format="png", dpi=640.0 / width, facecolor="white")
    picture = Image.open(memory).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    picture.save(file, optimize=True)


if __name__ == "__main__":
    if sys.argv[1:2] not in (["write"], ["say"]):
        sys.exit(__doc__)
    for scene in sys.argv[2:] or known():
        print(scene, flush=True)
        (write if sys.argv[1] == "write" else add)(scene)
