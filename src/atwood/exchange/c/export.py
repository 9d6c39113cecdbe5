"""`export_c`: the C of a scene in a folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from atwood.arguments import FILE, PATHS, optional, takes
from atwood.errors import UnsupportedError, UsageError
from atwood.exchange.c.text import SceneText, scene_text
from atwood.expr import Program
from atwood.files import write_atomically
from atwood.forms.assembly import Assembly
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.plotting.live.mode import ModeText, NotLiveError
from atwood.simulation.problem.arguments import FORM


@takes(scene=SCENE, folder=FILE, form=optional(FORM), output=optional(PATHS))
def export_c(
    scene: Model | Assembly,
    folder: str | os.PathLike[str],
    *,
    form: str | None = None,
    output: Sequence[str] | None = None,
) -> list[Path]:
    """Write a scene as C99: a source, its header, and a program that prints the motion.

    The source has all that a motion needs: the equations, the explicit method of order 8(5,3) with its choice of steps
    and its dense output, steps of one length, the projection onto constraints, events, contacts, updates and modes.
    It allocates nothing, keeps all in one struct, and calls ``sqrt``, ``fabs`` and ``floor`` of the C library alone:
    other functions are those of Atwood, so that a motion has the same bits wherever sums and products do, which
    contraction must not change (``-ffp-contract=off``, with gcc).

    Parameters
    ----------
    scene
        A scene, or an assembly of one.
    folder
        Where the files go; it is made if it is not there. They are named after the scene, and ``main.c``.
    form
        See `assemble`.
    output
        Paths of the quantities that can be asked for; all if not given.

    Returns
    -------
    list[Path]
        The header, the source and ``main.c``, and headers and sources of modes, if there are several.

    Raises
    ------
    UnsupportedError
        If the scene needs what has no counterpart in C: functions in Python, contacts beside
        modes, three coordinates of an orientation.
    ParameterError
        If there is no such quantity.
    UsageError
        If a file cannot be written.
    """
    text = exported(scene, form, output)
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"this folder cannot be made ({error.strerror or error})", where=str(target), advice="Give another one."
        ) from error
    files = {f"{text.name}.h": text.header, f"{text.name}.c": text.source, "main.c": text.main, **text.modes}
    for name, one in files.items():
        write_atomically(target / name, partial(Path.write_text, data=one, encoding="utf-8"))
    return [target / name for name in files]


def exported(
    scene: Model | Assembly,
    form: str | None,
    output: Sequence[str] | None,
    more: Callable[[ModeText], dict[str, Program]] | None = None,
) -> SceneText:
    """Return a scene as C; what is refused is not exported, and says so."""
    assembly = assembly_of(scene, form=form)
    try:
        text = scene_text(assembly, output, more)
    except (NotLiveError, UnsupportedError) as error:
        raise UnsupportedError(
            f"it is not exported: {error.message}",
            where=error.where or assembly.flat.name,
            advice="Take away what it names, or exchange results instead (`Result.save`).",
        ) from error
    refused = [path for path in output or () if path in text.mode.unknown]
    if refused:
        raise UnsupportedError(text.mode.unknown[refused[0]], where=refused[0], advice="Leave it out.")
    return text
