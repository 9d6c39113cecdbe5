"""Scenes with one thing broken: the error names the part and a remedy, or the scene is sound in truth and runs."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

import atwood
from atwood import AtwoodError, Scene
from atwood_library import (
    Drive,
    Ground,
    Link,
    Mass1D,
    Pivot,
    PointMass,
    Pulley,
    RigidBody,
    Rod,
    Rope,
    RotaryDrive,
    Slider,
    Spherical,
    Spring,
    Table,
    Weld,
)

from .trial import Finding, Trial


@dataclass
class Draft:
    """A chain of links and of rods with bobs, with names by chance.

    Attributes
    ----------
    scene
        The scene.
    chance
        What decides.
    links, pivots
        Names of the links of the chain and of the pivots before them, from the ground on.
    rods, bobs
        Names of the rods that hang on it, and of their bobs.
    """

    scene: Scene
    chance: random.Random
    ground: str
    links: list[str] = field(default_factory=list)
    pivots: list[str] = field(default_factory=list)
    rods: list[str] = field(default_factory=list)
    bobs: list[str] = field(default_factory=list)

    def name(self, word: str) -> str:
        """Return a name that is not taken."""
        while (found := f"{word}_{self.chance.choice('abcdefgh')}{self.chance.randrange(100)}") in self.scene:
            continue
        return found


def draw(chance: random.Random) -> Draft:
    """Return a sound scene."""
    scene = Scene(space=chance.choice(("plane", "plane", "space")), t_end=0.05)
    draft = Draft(scene, chance, f"ground_{chance.randrange(10)}")
    end = scene.add(draft.ground, Ground()).frame
    for _ in range(chance.randint(1, 3)):
        pivot, link = draft.name("hinge"), draft.name("link")
        turning = scene.add(pivot, Pivot())
        moving = scene.add(link, Link(length=chance.uniform(0.3, 2.0), mass=chance.uniform(0.1, 5.0)))
        scene.connect(end, turning.a)
        scene.connect(turning.b, moving.a)
        end = moving.b
        draft.pivots.append(pivot)
        draft.links.append(link)
    rod, bob = draft.name("rod"), draft.name("bob")
    hanging = scene.add(rod, Rod(length=chance.uniform(0.3, 2.0)))
    scene.connect(end, hanging.a)
    scene.connect(hanging.b, scene.add(bob, PointMass(mass=chance.uniform(0.1, 5.0))).point)
    draft.rods.append(rod)
    draft.bobs.append(bob)
    scene.guess[f"{draft.pivots[0]}.angle"] = chance.uniform(-1.0, 1.0)
    if scene.space == "plane":
        scene.guess[f"{rod}.angle"] = chance.uniform(-1.0, 1.0)
    return draft


def check(seed: int) -> Trial:
    """Break one thing in one scene."""
    chance = random.Random(seed)
    how = chance.choice(BREAKS)
    outcome, finding = attempt(chance, how)
    return Trial((f"{how.__name__}: {outcome}",), () if finding is None else (finding,))


def attempt(chance: random.Random, how: Callable[[Draft, list[str]], None]) -> tuple[str, Finding | None]:
    """Break a scene in one way, run it, and say what came of it."""
    draft = draw(chance)
    names: list[str] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            how(draft, names)
            result = atwood.simulate(
                draft.scene,
                form=chance.choice(("reduced", "dae")),
                rtol=1e-6,
                outputs=3,
                max_seconds=20.0,
            )
            finite = all(np.all(np.isfinite(values)) for values in result.table(_places(result)).values())
            missed = max(result.constraint_max.values())
        except AtwoodError as error:
            return "refused", _without_help(how, names, error)
        except Exception as error:
            return "raised", Finding("crash", f"{how.__name__}: {type(error).__name__}", repr(error))
    if how in NEVER_SOUND:
        return "ran", Finding("wrong", f"{how.__name__}: accepted", str(names))
    if result.status == "time_limit":  # by the clock, on a machine that others use: hangs are seen by their own limit
        return "ran out of time", None
    if result.status != "finished" or not finite or missed > 1e-3:
        return "ran", Finding("wrong", f"{how.__name__}: ran, and is not consistent", f"{result.status} {missed:g}")
    return "ran", None


def _places(result: atwood.Result) -> list[str]:
    return [path for path in result.paths if ".position." in path or path.endswith(".angle")]


def _without_help(how: Callable[..., object], names: list[str], error: AtwoodError) -> Finding | None:
    text = str(error)
    if not any(name in text for name in names):
        return Finding("message", f"{how.__name__}: no part is named", f"{names}: {text}")
    if not error.advice:
        return Finding("message", f"{how.__name__}: no remedy is said", text)
    return None


# -- what is broken ----------------------------------------------------------------------------------------------------
# Each puts one thing wrong, and adds the names of which one must be in the error.


def a_mass_that_is_none(draft: Draft, names: list[str]) -> None:
    """A mass is negative, not a number, or of another unit."""
    path = f"{draft.chance.choice([*draft.links, *draft.bobs])}.mass"
    names.append(path)
    draft.scene.set(path, draft.chance.choice((-1.0, float("nan"), float("inf"), "3 m", "heavy", None, 1e308, [1.0])))


def a_length_that_is_none(draft: Draft, names: list[str]) -> None:
    """A length is zero, negative, or of another unit."""
    path = f"{draft.chance.choice([*draft.links, *draft.rods])}.length"
    names.append(path)
    draft.scene.set(path, draft.chance.choice((0.0, -2.0, float("nan"), "2 kg", "2 metres", 1e-300)))


def an_unknown_parameter(draft: Draft, names: list[str]) -> None:
    """A parameter, or its part, is misspelt."""
    name = draft.chance.choice(draft.links)
    names += [name, "there is no part"]
    draft.scene.set(draft.chance.choice((f"{name}.lenght", f"{name}.Mass", f"{name}x.mass", f"{name}.a")), 1.0)


def an_unknown_start(draft: Draft, names: list[str]) -> None:
    """A start value is of no quantity."""
    name = draft.chance.choice(draft.pivots)
    path = draft.chance.choice((f"{name}.angel", f"{name}x.angle", f"{name}.tension", "angle", name))
    names.append(path)
    draft.scene.start[path] = 0.1


def a_start_of_another_unit(draft: Draft, names: list[str]) -> None:
    """A start value has another unit, is no number, or too large an angle."""
    path = f"{draft.chance.choice(draft.pivots)}.angle"
    names.append(path)
    draft.scene.start[path] = draft.chance.choice(("3 kg", "far", float("nan"), None, "1 deg/s", 1e308, 1e12))


def starts_that_contradict(draft: Draft, names: list[str]) -> None:
    """An angle and a position of the same link do not go together."""
    pivot, link = draft.pivots[0], draft.links[0]
    names += [pivot, link]
    draft.scene.start[f"{pivot}.angle"] = 0.2
    draft.scene.start[f"{link}.b.position.x"] = draft.chance.uniform(2.5, 9.0)


def a_loop_that_cannot_close(draft: Draft, names: list[str]) -> None:
    """The end is tied to a place that it cannot reach."""
    scene, last = draft.scene, draft.links[-1]
    far, joint = draft.name("far"), draft.name("tie")
    names += [far, joint, *draft.pivots, *draft.links]
    anchor = scene.add(far, Ground(position=(draft.chance.uniform(20.0, 50.0), 0.0, 0.0)))
    tie = scene.add(joint, Pivot())
    scene.connect(anchor.frame, tie.a)
    scene.connect(tie.b, scene[last].b)


def drives_that_contradict(draft: Draft, names: list[str]) -> None:
    """Two drives turn the same link in different ways."""
    scene, link = draft.scene, scene_end(draft)
    for rate in (1.0, draft.chance.uniform(2.0, 3.0)):
        name = draft.name("drive")
        names.append(name)
        drive = scene.add(name, RotaryDrive(rotation=lambda t, rate=rate: rate * t))
        scene.connect(scene[draft.ground].frame, drive.a)
        scene.connect(drive.b, link.a)
    names += [*draft.pivots, *draft.links]


def scene_end(draft: Draft) -> Link:
    """Return the first link."""
    return draft.scene[draft.links[0]]


def a_drive_against_a_weld(draft: Draft, names: list[str]) -> None:
    """What a drive moves is held."""
    scene = draft.scene
    drive, weld, body = draft.name("drive"), draft.name("weld"), draft.name("body")
    names += [drive, weld, body]
    moved = scene.add(body, RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    driven, held = scene.add(drive, Drive(motion=lambda t: t + 0.1)), scene.add(weld, Weld())
    scene.connect(scene[draft.ground].frame, driven.a)
    scene.connect(driven.b, moved.frame)
    scene.connect(scene[draft.ground].frame, held.a)
    scene.connect(held.b, moved.frame)


def connectors_that_are_unlike(draft: Draft, names: list[str]) -> None:
    """A rope's groove meets a frame, a shaft a point, or a part stands where a connector should."""
    scene = draft.scene
    name = draft.name("pulley")
    pulley = scene.add(name, Pulley())
    names += [name, draft.pivots[0], draft.links[0]]
    link, pivot = scene[draft.links[0]], scene[draft.pivots[0]]
    a, b = draft.chance.choice(
        ((pulley.groove, link.b), (pivot.shaft, link.b), (pulley, link.b), (pulley.groove, pivot.shaft))
    )
    scene.connect(a, b)


def a_connector_to_itself(draft: Draft, names: list[str]) -> None:
    """A connector is joined to itself."""
    link = draft.scene[draft.links[0]]
    names.append(draft.links[0])
    draft.scene.connect(link.b, link.b)


def a_connector_of_another_scene(draft: Draft, names: list[str]) -> None:
    """A connector belongs to a part that is not in the scene."""
    names += ["Rod", draft.links[0]]
    draft.scene.connect(draft.scene[draft.links[0]].b, Rod(length=1.0).a)


def a_name_twice(draft: Draft, names: list[str]) -> None:
    """A name is taken, is no name, or means something else."""
    name = draft.chance.choice((draft.links[0], "connect", "two words", "1st", "", "start"))
    names += [name or "name"]
    draft.scene.add(name, PointMass())


def an_object_twice(draft: Draft, names: list[str]) -> None:
    """One object is added under two names."""
    name = draft.name("again")
    names += [name, draft.links[0]]
    draft.scene.add(name, draft.scene[draft.links[0]])


def a_model_within_itself(draft: Draft, names: list[str]) -> None:
    """A scene is added to itself, or to a model in it."""
    name = draft.name("inside")
    names.append(name)
    if draft.chance.random() < 0.5:
        draft.scene.add(name, draft.scene)
    else:
        inner = draft.scene.add(name, atwood.Model())
        inner.add(name, draft.scene)


def no_part_but_its_class(draft: Draft, names: list[str]) -> None:
    """A class is added instead of a part of it."""
    name = draft.name("part")
    names.append(name)
    draft.scene.add(name, draft.chance.choice((PointMass, Rod, 3, None, "Rod", {})))


def a_part_that_lacks_a_parameter(draft: Draft, names: list[str]) -> None:
    """A parameter is unknown, with a near match."""
    names += ["Link", "Rod"]
    draft.chance.choice((lambda: Link(lenght=1.0), lambda: Rod(length=1.0, mas=2.0), lambda: Link(axis="w")))()


def a_part_of_another_space(draft: Draft, names: list[str]) -> None:
    """A part exists in other spaces only, or a joint turns about an axis that the plane does not have."""
    draft.scene.space = "plane"
    name = draft.name("joint")
    names.append(name)
    joint = draft.scene.add(name, draft.chance.choice((Spherical(), Pivot(axis=(1.0, 0.0, 0.0)), Slider(axis="y"))))
    draft.scene.connect(draft.scene[draft.links[-1]].b, joint.a)
    body = draft.scene.add(f"{name}_body", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    draft.scene.connect(joint.b, body.frame)


def a_part_without_mass(draft: Draft, names: list[str]) -> None:
    """What is at the end has no mass, and something pulls at it."""
    scene, name, spring = draft.scene, draft.name("light"), draft.name("spring")
    light = scene.add(name, PointMass(mass=0.0))
    pulling = scene.add(spring, Spring(stiffness=10.0, natural_length=0.5))
    scene.connect(scene[draft.links[-1]].b, pulling.a)
    scene.connect(pulling.b, light.point)
    scene.guess[f"{name}.position.x"] = draft.chance.uniform(0.5, 3.0)
    names += [name, spring]


def a_bob_without_mass(draft: Draft, names: list[str]) -> None:
    """The bob of a rod has no mass, so that the rod turns without inertia."""
    draft.scene.set(f"{draft.bobs[0]}.mass", 0.0)
    names += [*draft.bobs, *draft.rods]


def a_part_that_is_joined_to_nothing(draft: Draft, names: list[str]) -> None:
    """A part floats: with mass it falls, without it there is nothing that could move it."""
    part = draft.chance.choice((Rod(length=1.0), PointMass(), Spring(stiffness=1.0), Rope(), Pivot(), Mass1D()))
    name = draft.name("loose")
    draft.scene.add(name, part)
    names.append(name)


def a_connection_twice(draft: Draft, names: list[str]) -> None:
    """Two connectors are joined twice, which changes nothing."""
    pivot, link = draft.scene[draft.pivots[0]], draft.scene[draft.links[0]]
    draft.scene.connect(link.a, pivot.b)
    names += [draft.pivots[0], draft.links[0]]


def a_joint_twice(draft: Draft, names: list[str]) -> None:
    """A second hinge in parallel to the first, which follows from it."""
    scene, name = draft.scene, draft.name("second")
    second = scene.add(name, Pivot())
    scene.connect(scene[draft.pivots[0]].a, second.a)
    scene.connect(second.b, scene[draft.pivots[0]].b)
    names.append(name)


def a_shortcut_past_a_joint(draft: Draft, names: list[str]) -> None:
    """Both frames of a joint are joined, so that it cannot move."""
    pivot = draft.chance.choice(draft.pivots)
    names += [*draft.pivots, *draft.links]
    draft.scene.connect(draft.scene[pivot].a, draft.scene[pivot].b)


def a_weld_too_much(draft: Draft, names: list[str]) -> None:
    """The last link is welded to the ground, where it is not."""
    scene, name = draft.scene, draft.name("weld")
    weld = scene.add(name, Weld(displacement=(30.0, 0.0, 0.0)))
    scene.connect(scene[draft.ground].frame, weld.a)
    scene.connect(weld.b, scene[draft.links[-1]].b)
    names += [name, *draft.pivots, *draft.links]


def signals_that_do_not_fit(draft: Draft, names: list[str]) -> None:
    """An output is given to an input of another unit, or to no input."""
    scene, name = draft.scene, draft.name("drive")
    drive, pivot = scene.add(name, RotaryDrive()), scene[draft.pivots[0]]
    names += [name, draft.pivots[0]]
    draft.chance.choice(
        (
            lambda: scene.connect(pivot.output("angular_velocity"), drive.input("rotation")),
            lambda: scene.connect(pivot.output("angel"), drive.input("rotation")),
            lambda: scene.connect(pivot.output("angle"), drive.input("motion")),
            lambda: scene.connect(pivot.output("angle"), pivot.output("angle")),
            lambda: scene.connect(pivot.output("angle"), drive.a),
        )
    )()


def text_that_is_no_value(draft: Draft, names: list[str]) -> None:
    """A drive follows text that is neither a formula of time nor a length, or could be both."""
    name = draft.name("drive")
    names += ["motion", name]
    text = draft.chance.choice(
        (
            "2 t",
            "5*s",
            "1,5*t",
            "1,5 m",
            "2*kg",
            "3 m + 2*t",
            "2 sin(t)",
            "sin(",
            "x*t",
            "3 kg",
            "2t",
            "t = 3",
            "",
            "5 h",
        )
    )
    draft.scene.add(name, Drive(motion=text))


def a_table_that_is_none(draft: Draft, names: list[str]) -> None:
    """Rows of a table do not rise, are too few, no numbers, or end before the run."""
    name = draft.name("table")
    names += [name, "table"]
    rows = draft.chance.choice(
        (
            [(0.0, 1.0)],
            [(0.0, 1.0), (0.0, 2.0)],
            [(1.0, 0.0), (0.0, 1.0)],
            [(0.0, float("nan")), (1.0, 2.0)],
            [(0.0, "a"), (1.0, 2.0)],
            [(0.01, 0.0), (1.0, 2.0)],
            [(0.0, 0.0), (0.02, 2.0)],
            "nowhere.csv",
            [],
            3.0,
        )
    )
    draft.scene.add(name, Table(table=rows, interpolation=draft.chance.choice(("linear", "akima", "cubic"))))


def no_scene_at_all(draft: Draft, names: list[str]) -> None:
    """There are no parts."""
    draft.scene = Scene()
    names.append("Scene")


BREAKS = (
    a_mass_that_is_none,
    a_length_that_is_none,
    an_unknown_parameter,
    an_unknown_start,
    a_start_of_another_unit,
    starts_that_contradict,
    a_loop_that_cannot_close,
    drives_that_contradict,
    a_drive_against_a_weld,
    connectors_that_are_unlike,
    a_connector_to_itself,
    a_connector_of_another_scene,
    a_name_twice,
    an_object_twice,
    a_model_within_itself,
    no_part_but_its_class,
    a_part_that_lacks_a_parameter,
    a_part_of_another_space,
    a_part_without_mass,
    a_bob_without_mass,
    a_part_that_is_joined_to_nothing,
    a_connection_twice,
    a_joint_twice,
    a_shortcut_past_a_joint,
    a_weld_too_much,
    signals_that_do_not_fit,
    text_that_is_no_value,
    a_table_that_is_none,
    no_scene_at_all,
)
"""All ways to break a scene."""

_MAY_BE_SOUND = (
    a_part_without_mass,
    a_bob_without_mass,
    a_part_that_is_joined_to_nothing,
    a_connection_twice,
    a_joint_twice,
    a_shortcut_past_a_joint,
    a_part_of_another_space,
)
NEVER_SOUND = tuple(how for how in BREAKS if how not in _MAY_BE_SOUND)
