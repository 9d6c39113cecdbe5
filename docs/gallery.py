"""The gallery: a page for every scene of the library, with a page that moves; written when the site is built."""

from __future__ import annotations

import inspect
import re
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

from atwood import Scene, animate, simulate
from atwood.plotting.pages.document import library_script
from atwood.plotting.pages.page import make_page
from atwood_library.scenes import SCENES

HERE = Path(__file__).parent
PAGES, FILES = HERE / "gallery", HERE / "gallery-files"
_KINDS = {"line": "On a line", "plane": "In the plane", "space": "In space"}


def write_gallery(*_: Any) -> None:
    """Write the gallery beside the other pages: Markdown for the site, and what moves as files."""
    for folder in (PAGES, FILES / "live"):
        folder.mkdir(parents=True, exist_ok=True)
    (FILES / "live" / "library.js").write_text(library_script(), encoding="utf-8")
    kinds: dict[str, list[str]] = defaultdict(list)
    for name in SCENES:
        scene = SCENES[name]()
        kinds[scene.space].append(_write_scene(name, scene))
    parts = ["# Gallery", _INTRODUCTION]
    parts += [f"## {title}\n\n{_grid(kinds[kind])}" for kind, title in _KINDS.items()]
    parts.append("## By chapter of the course\n\n" + "\n".join(_by_chapter()))
    hidden = "\n".join(["```{toctree}", ":hidden:", "", *SCENES, "```"])
    write(PAGES / "index.md", "\n\n".join((*parts, hidden)) + "\n")


_INTRODUCTION = """Every scene of the library. Each page has the scene in motion: turn it, and where it is live, change
its lengths, masses and starts while it moves. `atwood page NAME` writes the same as a file."""


def write(file: Path, text: str) -> None:
    """Write a file where it is not there already, so that Sphinx reads again only what is new."""
    if not file.exists() or file.read_text(encoding="utf-8") != text:
        file.write_text(text, encoding="utf-8")


def _write_scene(name: str, scene: Scene) -> str:
    """Write the page of a scene, and return its card."""
    result = simulate(scene)
    made = make_page({result.method: result}, library="library.js")
    write(FILES / "live" / f"{name}.html", made.html)
    animate(result, FILES / "live" / f"{name}.gif", seconds=2.5, frames_per_second=8)
    told = inspect.cleandoc(type(scene).__doc__ or "").partition("\n\nParameters\n")[0]
    summary, _, more = told.partition("\n\n")
    also = HERE / "scenes" / f"{name}.md"
    source = Path(sys.modules[type(scene).__module__].__file__ or "")
    mode = "Live: the browser solves its equations." if made.mode == "live" else f"Recorded: {made.reason}."
    frame = f'<iframe src="../live/{name}.html" title="{name} in motion" loading="lazy" class="moving"></iframe>'
    sections = [
        f"# {name}",
        summary,
        f"```{{raw}} html\n{frame}\n<p><a href='../live/{name}.html'>Open it alone</a></p>\n```",
        f"{mode} `atwood page {name}` writes it as a file.",
        more,
        f"What is known of it, and shown by tests: [{name}](../scenes/{name}.md)." if also.exists() else "",
        f"## The scene\n\n```python\n{source.read_text(encoding='utf-8')}\n```",
    ]
    write(PAGES / f"{name}.md", "\n\n".join(one for one in sections if one) + "\n")
    picture = f'<img src="../live/{name}.gif" alt="{name} in motion" loading="lazy">'
    return f'<a class="card" href="{name}.html">{picture}<span>{name}</span></a>'


def _grid(cards: list[str]) -> str:
    return "```{raw} html\n<div class='gallery'>" + "\n".join(cards) + "</div>\n```"


def _by_chapter() -> list[str]:
    """Return which scenes each chapter of the course uses."""
    found = []
    for file in sorted((HERE / "course").glob("[0-9]-*.md")):
        text = file.read_text(encoding="utf-8")
        title = re.search(r"^# (.+)$", text, re.MULTILINE)
        used = [name for name in SCENES if name in text or SCENES[name].__name__ in text]
        links = ", ".join(f"[{name}]({name}.md)" for name in used)
        found.append(f"- [{title[1] if title else file.stem}](../course/{file.name}): {links}")
    return found


if __name__ == "__main__":
    write_gallery()
