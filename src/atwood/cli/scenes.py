"""Finding scenes: by name in the installed libraries, or in a file."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import inspect
import math
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from atwood.cli.output import warn
from atwood.errors import AtwoodError, UsageError, near_matches, suggestion
from atwood.model.compose.composite import Model, owner_of
from atwood.model.compose.scene import Scene
from atwood.model.compose.serialization import all_libraries, declared_libraries
from atwood.model.local.flatten import unit_at
from atwood.model.values.units import split_quantity


def bundled_scenes() -> dict[str, type[Model]]:
    """Return the scenes of all installed libraries by name."""
    found: dict[str, type[Model]] = {}
    for scenes in _scenes_of(all_libraries()):
        for name in scenes:
            found.setdefault(name, scenes[name])
    return found


def _scenes_of(libraries: Iterable[str]) -> Iterator[Mapping[str, type[Model]]]:
    """Yield the scenes of one library after another; a library may load each when it is asked for."""
    for module in _modules_of(libraries, "scenes"):
        yield getattr(module, "SCENES", {})


def _modules_of(libraries: Iterable[str], module: str) -> Iterator[ModuleType]:
    """Yield a module that libraries may have, of one after another: `scenes`, and `readers` of files."""
    for library in libraries:
        name = f"{library}.{module}"
        try:
            yield importlib.import_module(name)
        except ImportError as error:
            if isinstance(error, ModuleNotFoundError) and error.name == name:
                continue  # a library without it
            raise UsageError(f"the library cannot be loaded ({error})", where=library) from error


def reader_of(text: str) -> Callable[[str], Scene] | None:
    """Return what reads a file as a scene, by how its name ends; None for any other text."""
    suffix = Path(text).suffix.lower()
    if suffix:  # names of scenes have no dot
        for readers in _modules_of(all_libraries(), "readers"):
            if suffix in getattr(readers, "READERS", {}):
                found: Callable[[str], Scene] = readers.READERS[suffix]
                return found
    return None


def find_scene(text: str) -> tuple[Model, str]:
    """Return a scene and what to call it."""
    file, colon, name = text.rpartition(":")
    if colon and file.endswith(".py"):
        return _scene_in_file(Path(file), name), name
    if text.endswith(".py"):
        return _only_scene(Path(text))
    if read := reader_of(text):
        return read(text), Path(text).stem
    for libraries in (declared_libraries, all_libraries):
        for scenes in _scenes_of(libraries()):
            if text in scenes:
                return scenes[text](), text
    known = bundled_scenes()
    if not known:
        raise UsageError(
            "no component library is installed", where=text, advice="Install one, or give a scene as FILE.py:NAME."
        )
    advice = "See `atwood list`, or give FILE.py:NAME, or a file of a robot (.urdf, .xml)."
    if near_matches(text, known):
        advice = suggestion(text, known)
    elif Path(text).is_file():
        raise UsageError("nothing reads such a file as a scene", where=text, advice=advice)
    raise UsageError("there is no such scene", where=text, advice=advice)


def prepare(text: str, settings: Sequence[str], starts: Sequence[str]) -> tuple[Model, str]:
    """Return a scene with its parameters and start values changed, and what to call it."""
    scene, name = find_scene(text)
    for path, value in pairs(settings, "--set"):
        scene.set(path, value)
        warn_of_radians(scene, path, [value], "--set", value)
    for path, value in pairs(starts, "--start"):
        if not isinstance(scene, Scene):
            raise UsageError("this is a model and no scene, and has no start of its own", where=name)
        if value.strip() != "free":
            scene.start[path] = value
            warn_of_radians(scene, path, [value], "--start", value)
        elif path in scene.start:
            scene.guess[path] = scene.start.pop(path)
        else:
            raise UsageError("the scene fixes no such start value", where=path, advice=suggestion(path, scene.start))
    return scene, name


def check_applies(scene: Model, form: str, level: str, orientation: str = "quaternion") -> None:
    """Refuse what was asked for on the command line and would change nothing."""
    if form == "reduced" and level != "ggl":
        raise UsageError(
            f"the reduced form has no levels, and no {level!r}: its constraints are eliminated",
            where="--level",
            advice="Add --form dae.",
        )
    if isinstance(scene, Scene) and scene.space != "space" and orientation != "quaternion":
        raise UsageError(
            f"there are no orientations in a {scene.space} for which {orientation!r} would be coordinates",
            where="--orientation",
            advice="Leave it away; it is for scenes in space.",
        )


def warn_of_radians(scene: Model, path: str, values: Iterable[object], option: str, typed: str) -> None:
    """Say that an angle without a unit is in radians, where it is beyond a turn, as degrees mostly are."""
    if option in ("--set", "--vary"):
        part, name = owner_of(scene, path)
        unit = part.parameter_specs()[name].unit if name in part.parameter_specs() else None
    else:
        unit = unit_at(scene, path)
    if unit is None or unit.text != "rad":
        return
    plain = [number for number, given in map(_number_and_unit, values) if not given]
    if plain and max(map(abs, plain)) > math.tau:
        farthest = max(plain, key=abs)
        taken = "it is taken as" if len(plain) == 1 else f"{typed} is taken as up to"
        turns = f"{taken} {farthest:g} rad, which is {math.degrees(farthest):g} degrees"
        warn(f"Warning: {option} {path}: {turns}. If degrees are meant, write '{typed} deg'.")


def _number_and_unit(value: object) -> tuple[float, str]:
    if isinstance(value, str):
        return split_quantity(value) or (0.0, "?")
    return (float(value), "") if isinstance(value, (int, float)) else (0.0, "?")


def pairs(texts: Sequence[str], option: str) -> Iterator[tuple[str, str]]:
    """Yield path and value of options like ``--set path=value``."""
    for text in texts:
        path, equals, value = text.partition("=")
        if not (equals and path.strip() and value.strip()):
            raise UsageError(f"{text!r} does not say which value", where=option, advice=f"Write {option} PATH=VALUE.")
        yield path.strip(), value.strip()


# -- files -------------------------------------------------------------------------------------------------------------


def _scene_in_file(file: Path, name: str) -> Model:
    module = load_file(file)
    where = f"{file}:{name}"
    if not hasattr(module, name):
        names = [*_candidates(module), *_functions(module)]
        raise UsageError(f"the file defines no {name!r}", where=where, advice=suggestion(name, names))
    return _as_scene(getattr(module, name), file, where)


def _only_scene(file: Path) -> tuple[Model, str]:
    """Return the scene of a file that defines just one."""
    module = load_file(file)
    names = list(_candidates(module))
    if len(names) != 1:
        functions = ", ".join(_functions(module))
        no_scene = f"it defines no scene, but functions: {functions}" if functions else "it defines no scene"
        listed = f"it defines {', '.join(names)}" if names else no_scene
        raise UsageError(f"which scene? {listed}", where=str(file), advice=f"Write {file}:NAME.")
    return _scene_in_file(file, names[0]), names[0]


def _candidates(module: ModuleType) -> Mapping[str, Any]:
    """Return the scenes that a module itself defines."""
    return {
        name: value
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (
            isinstance(value, Scene)
            or (isinstance(value, type) and issubclass(value, Scene) and value.__module__ == module.__name__)
        )
    }


def _functions(module: ModuleType) -> Iterator[str]:
    """Yield the functions that a module itself defines and that can be called without arguments."""
    for name, value in vars(module).items():
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not name.startswith("_"):
            needed = inspect.signature(value).parameters.values()
            if all(one.default is not one.empty or "VAR" in one.kind.name for one in needed):
                yield name


def _as_scene(value: Any, file: Path, where: str) -> Model:
    if callable(value) and not isinstance(value, Model):
        with _placing_errors(file):
            value = value()
    if not isinstance(value, Model):
        raise UsageError(
            f"this is no scene but of type {type(value).__name__}",
            where=where,
            advice="Name a Scene class, a scene, or a function without arguments that returns one.",
        )
    return value


def load_file(file: Path) -> ModuleType:
    """Run a file as a module; what it prints goes to standard error."""
    if not file.is_file():
        raise UsageError("there is no such file", where=str(file))
    name = f"_atwood_scene_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise UsageError("it cannot be read as a Python file", where=str(file))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and the like look their module up
    folder = str(file.resolve().parent)
    if folder not in sys.path:
        sys.path.insert(0, folder)  # as when the file is run as a script; functions in it may import later
    with _placing_errors(file):
        spec.loader.exec_module(module)
    return module


@contextlib.contextmanager
def _placing_errors(file: Path) -> Iterator[None]:
    """Turn whatever goes wrong in a user's file into an error with the file and the line."""
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    except SyntaxError as error:
        name = error.filename or str(file)
        raise UsageError(f"it is not valid Python ({error.msg})", where=f"{name}:{error.lineno}") from error
    except AtwoodError as error:
        where = f"{_line_in(error, file)}: {error.where}" if error.where else _line_in(error, file)
        raise UsageError(error.message, where=where, advice=error.advice) from error
    except KeyboardInterrupt:
        raise
    except SystemExit as error:
        raise UsageError(f"it leaves Python with exit code {error.code}", where=_line_in(error, file)) from error
    except Exception as error:
        raise UsageError(f"{type(error).__name__}: {error}", where=_line_in(error, file)) from error


def _line_in(error: BaseException, file: Path) -> str:
    """Return the file with the line of it in which an error arose."""
    wanted = file.resolve()
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if Path(frame.filename).resolve() == wanted
    ]
    return f"{file}:{lines[-1]}" if lines and lines[-1] is not None else str(file)
