"""A small scene for each part of the library, as code: `part_scenes.txt` has one in a line for each.

A line names its parts (`rod=Rod(length=1.0)`), connects them (`ground.frame-rod.a`), passes signals on
(`sine.value>force.value`) and says how they start (`rod.angle=1.0`). `stepped` asks for time stepping.
"""

from __future__ import annotations

import re
from pathlib import Path

_TEXT = re.sub(r"\n +", " ", (Path(__file__).parent / "part_scenes.txt").read_text(encoding="utf-8"))
SCENES = dict(line.split(": ", 1) for line in _TEXT.splitlines())
HEADS = {
    "space": "scene = Scene(space='space')",
    "line": "scene = Scene(space='line', line_axis=(0, 0, 1))",
    "weightless": "scene = Scene(gravity=0.0)",
}
CORNERS = (0, 0, 0), (0.4, 0, 0), (0, 0.2, 0), (0, 0, 0.3)


def mesh() -> str:
    """Return a body as an STL file."""
    faces = [[CORNERS[i] for i in face] for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))]
    lines = ["solid wedge"]
    for face in faces:
        lines += [
            "facet normal 0 0 0",
            "outer loop",
            *(f"vertex {x} {y} {z}" for x, y, z in face),
            "endloop",
            "endfacet",
        ]
    return "\n".join([*lines, "endsolid wedge"]) + "\n"


def code_of(part: str) -> str:
    """Return the scene of a part as code."""
    steps = [one.strip() for one in SCENES[part].split(";") if one.strip()]
    told, used = [], []
    head, options = "scene = Scene()", "t_end=2.0"
    for step in steps:
        if step in HEADS:
            head = HEADS[step]
        elif step == "stepped":
            options += ", solver='moreau', step=0.01"
        elif match := re.fullmatch(r"(\w+)=(\w+\(.*\))", step):
            used.append(match[2].partition("(")[0])
            told.append(f'{match[1]} = scene.add("{match[1]}", {match[2]})')
        elif match := re.fullmatch(r"([\w.\[\]]+)-([\w.\[\]]+)", step):
            told.append(f"scene.connect({match[1]}, {match[2]})")
        elif match := re.fullmatch(r"(\w+)\.(\w+)>(\w+)\.(\w+)", step):
            told.append(f'scene.connect({match[1]}.output("{match[2]}"), {match[3]}.input("{match[4]}"))')
        else:
            path, _, value = step.partition("=")
            told.append(f'scene.start["{path}"] = {value}')
    lines = [
        "from atwood import Scene, simulate",
        f"from atwood_library import {', '.join(sorted(set(used)))}",
        "",
        head,
        *told,
    ]
    return "\n".join([*lines, f"result = simulate(scene, {options})"]).replace("'", '"') + "\n"
