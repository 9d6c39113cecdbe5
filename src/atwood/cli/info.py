"""`atwood info`: the mechanism report."""

from __future__ import annotations

from atwood.arguments import FLAG, NAME
from atwood.cli.command import Request, command
from atwood.cli.output import print_json, writer
from atwood.cli.parts import is_a_part, mentioning, show_part
from atwood.cli.scenes import bundled_scenes, prepare, reader_of
from atwood.errors import UsageError, near_matches
from atwood.table import table


def show_info(request: Request) -> None:
    """Say what SCENE is made of: bodies, joints, freedom, constraints, and what its equations cost.

    With the name of a part, such as Pivot, or what textbooks or Modelica call it, such as Revolute: its connectors,
    parameters, inputs and quantities. With any other word, such as motor: parts and scenes that mention it.
    """
    if is_a_part(request.scene):
        show_part(request.scene, request.as_json, bool(request.settings or request.start_values or request.moved))
        return
    word = request.scene
    if (
        word not in bundled_scenes()
        and ":" not in word
        and not word.endswith(".py")
        and reader_of(word) is None
        and not near_matches(word, bundled_scenes())
    ):
        _search(word, request.as_json)
        return
    from atwood.reporting import report
    from atwood.reporting.text import described, parameters

    model, name = prepare(request.scene, request.settings, request.start_values)
    found = report(model, name, orientation=request.orientation)
    if request.as_json:
        print_json(found.to_dict())
        return
    out = writer()
    out.show(described(found))
    out.line()
    if request.moved:
        out.line((str(found.initialization), ""))
    else:
        out.show(parameters(found))


def _search(word: str, as_json: bool) -> None:
    """Show what mentions a word that is no name."""
    found = mentioning(word)
    if not found:
        raise UsageError(
            "no scene and no part is called so, and none mentions it",
            where=word,
            advice="See `atwood list` and `atwood list --parts`, or give FILE.py:NAME.",
        )
    if as_json:
        print_json({"mentioned": [dict(zip(("what", "name", "summary"), one, strict=True)) for one in found]})
        return
    out = writer()
    out.line((f"Nothing is called {word!r}. It is mentioned by", ""))
    out.show(table(("", "", "~"), found))


COMMAND = command("info", show_info, more={"moved": (FLAG, False), "orientation": (NAME, "quaternion")})
