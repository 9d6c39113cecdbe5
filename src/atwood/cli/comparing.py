"""`atwood compare`: what each form costs for which error."""

from __future__ import annotations

from collections.abc import Callable

from atwood.arguments import FLAG, number, optional, whole
from atwood.cli.command import PICTURE, Request, command, written_as
from atwood.cli.output import answer, print_json, progress_bar, warn, writer
from atwood.cli.scenes import bundled_scenes, prepare
from atwood.errors import AtwoodError, UsageError
from atwood.lazy_dataclasses import replace
from atwood.model.compose.composite import Model
from atwood.plotting.comparison_page import check_page, write_page
from atwood.study import Comparison
from atwood.study.comparison.compare import TOLERANCES, compare
from atwood.study.comparison.found import check_rows_file, write_rows
from atwood.study.comparison.long_runs import compare_long


def compare_scene(request: Request) -> None:
    """Run SCENE in both forms, at several tolerances, against a far more accurate reference."""
    _check_files(request)
    if request.all:
        _compare_all(request)
        return
    if request.scene is None:
        raise UsageError("which scene?", advice="Name one (see `atwood list`), or give --all.")
    scene, name = prepare(request.scene, request.settings, request.start_values)
    if request.long is not None:
        _compare_long(request, scene, name)
        return
    with progress_bar(request.progress, "", _share) as progress:
        found = _compared(request, scene, name, progress)
    if request.plot is not None:
        found.plot(request.plot)
    if request.save is not None:
        found.save(request.save)
    if request.html is not None:
        write_page([found], {}, request.html)
    files = {"plotted": request.plot, "saved": request.save, "written": request.html}
    answer(request.as_json, found.to_dict(), found.tables(), **files)


def _compare_long(request: Request, scene: Model, name: str) -> None:
    """Compare methods over many periods."""
    with progress_bar(request.progress, "", _share) as progress:
        limit = request.max_seconds or _LONG_RUN
        found = compare_long(scene, periods=request.long or 1, max_seconds=limit, name=name, progress=progress)
    answer(request.as_json, found.to_dict(), found.tables())


_LONG_RUN = 20.0
"""Seconds for each method over many periods."""

_EACH, _TOGETHER = 10.0, 90.0
"""Seconds for each run, and for all runs of a scene, where all scenes are compared."""


def _compared(
    request: Request,
    scene: Model,
    name: str,
    progress: Callable[[str, int, int], object] | None,
) -> Comparison:
    return compare(
        scene,
        t_end=request.t_end,
        rtols=request.rtols or TOLERANCES,
        max_seconds=request.max_seconds or (_EACH if request.all else None),
        total_seconds=_TOGETHER if request.all else None,
        name=name,
        progress=progress,
    )


def _check_files(request: Request) -> None:
    """Refuse what contradicts, and files that could not be written, before any work is done."""
    if request.long is not None:
        idle = {"--all": request.all, "--rtol": request.rtols, "--t-end": request.t_end}
        idle |= {"--plot": request.plot, "--save": request.save, "--html": request.html}
        for option in (name for name, given in idle.items() if given):
            raise UsageError("it means nothing over many periods", where=option, advice="Leave it or --long out.")
    if not request.all:
        return
    changed = {"SCENE": request.scene, "--set": request.settings, "--start": request.start_values}
    for option in (name for name, given in changed.items() if given):
        raise UsageError("--all takes all scenes as they are", where=option, advice="Leave one of the two out.")
    if request.plot is not None:
        raise UsageError("--all has a picture for each scene", where="--plot", advice="Give --html DIR instead.")


def _compare_all(request: Request) -> None:
    """Compare the forms of all scenes of the installed libraries, one after another."""
    found: list[Comparison] = []
    failed: dict[str, str] = {}
    names = list(bundled_scenes())
    with progress_bar(request.progress, "", _share) as progress:
        for number, name in enumerate(names):
            watch = None if progress is None else _within(progress, number, len(names), name)
            try:
                scene, _ = prepare(name, (), ())
                found.append(_compared(request, scene, name, watch))
            except AtwoodError as error:
                failed[name] = error.message
            except KeyboardInterrupt:
                warn("Interrupted: what was found so far is kept.")
                break
            if progress is None and request.progress:
                told = failed[name] if name in failed else found[-1].verdict
                warn(f"{number + 1} of {len(names)}, {name}: {told}")
    if request.save is not None:
        write_rows(found, request.save)
    if request.html is not None:
        write_page(found, failed, request.html)
    if request.as_json:
        print_json({"comparisons": [one.to_dict() for one in found], "failed": failed})
        return
    out = writer()
    for one in found:
        out.line((f"{one.scene}: {one.verdict}", ""))
    for name, reason in failed.items():
        out.line((f"{name}: no answer: {reason}", ""))
    out.files(saved=request.save, written=request.html)


def _share(what: str, done: int, of: int) -> tuple[float, str]:
    return done / max(of, 1), what


def _within(
    progress: Callable[[str, int, int], object], number: int, count: int, name: str
) -> Callable[[str, int, int], object]:
    """Return what shows the progress of one scene among all."""
    return lambda what, done, of: progress(f"{name} ({number + 1} of {count}): {what}", number * of + done, count * of)


_MORE = {
    "max_seconds": (optional(number("a number of seconds above 0", above=0.0)), None),
    "plot": PICTURE,
    "save": written_as(check_rows_file),
    "progress": (FLAG, True),
    "long": (replace(whole("a whole number of periods, 10 to 1,000,000", 10, 1_000_000), word="PERIODS"), None),
    "all": (FLAG, False),
    "html": written_as(check_page, "DIRECTORY"),
}
_NOT_ASKED = ("forms", "levels", "outputs", "max_seconds", "total_seconds", "name")
COMMAND = command("compare", compare_scene, compare, is_required=False, leave=_NOT_ASKED, more=_MORE)
