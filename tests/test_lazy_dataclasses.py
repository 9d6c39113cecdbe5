"""Dataclasses whose methods are written at first use behave as those of the standard library."""

import copy
import dataclasses
import inspect
import pickle
import threading
from abc import ABC, abstractmethod
from functools import cached_property
from typing import ClassVar, Generic, TypeVar

import pytest

from atwood import UsageError, lazy_dataclasses as late
from atwood.arguments import takes_names

T = TypeVar("T")


def classes(dataclass):
    @dataclass(frozen=True)
    class Point:
        """A point."""

        x: float
        y: float = 2.0
        names: list = dataclasses.field(default_factory=list, compare=False, repr=False)
        count: ClassVar[int] = 3

        @cached_property
        def total(self):
            return self.x + self.y

    @dataclass(frozen=True)
    class Heavy(Point):
        """A point with a mass that must be positive."""

        mass: float = dataclasses.field(default=1.0, repr=False)

        def __post_init__(self):
            if self.mass <= 0.0:
                raise ValueError("mass")

    @dataclass
    class Tally(Generic[T]):
        """A tally."""

        items: tuple[T, ...] = ()
        _hidden: int = dataclasses.field(init=False, default=0)

    @dataclass(frozen=True, eq=False)
    class Same:
        """Only equal to itself."""

        value: int

    class Base(ABC):
        @abstractmethod
        def area(self): ...

    @dataclass(frozen=True)
    class Square(Base):
        """A square; it prints itself."""

        side: float

        def area(self):
            return self.side**2

        def __repr__(self):
            return "a square"

    return Point, Heavy, Tally, Same, Square


def behaviour(dataclass):
    point, heavy, tally, same, square = classes(dataclass)
    yield heavy.mass, point.y, hasattr(point, "names"), point.count  # before the first instance
    yield str(inspect.signature(heavy)), heavy.__match_args__
    yield [(one.name, one.type, one.default, one.init, one.repr, one.compare) for one in dataclasses.fields(heavy)]
    one, two = point(1.0), point(1.0, names=["a"])
    yield repr(one).rpartition(".")[2], one == two, one == heavy(1.0), hash(one) == hash(two), one != point(2.0)
    three, four = same(1), same(1)  # both are kept, so that they have places of their own
    yield hash(one) == hash((1.0, 2.0)), hash(three) == hash(four), three == four, one.total
    yield one.names is point(1.0).names, dataclasses.replace(heavy(1.0), mass=2.0).mass, dataclasses.asdict(heavy(1.0))
    yield repr(tally((1, 2))).rpartition(".")[2], tally() == tally(), tally.__hash__, tally(("x",)) == tally(("y",))
    yield square(2.0).area(), repr(square(2.0)), square(2.0) == square(2.0), dataclasses.is_dataclass(square)
    yield copy.copy(one) == one, copy.deepcopy(heavy(3.0)) == heavy(3.0)
    for wrong in (
        lambda: heavy(1.0, mass=-1.0),
        lambda: point(),
        lambda: point(1.0, z=3.0),
        lambda: setattr(one, "x", 3.0),
        lambda: delattr(one, "x"),
        lambda: hash(tally()),
        lambda: tally(_hidden=3),
    ):
        with pytest.raises((TypeError, ValueError, AttributeError)) as caught:
            wrong()
        yield type(caught.value), str(caught.value).rpartition(".")[2]


@pytest.mark.parametrize("few", [0, 1, 24, 1000])
def test_behaves_as_the_standard_library(few, monkeypatch):
    """Whether the constructor of a class is written at once, on the way, or not at all."""
    monkeypatch.setattr(late, "_FEW", few)
    for ours, theirs in zip(behaviour(late.dataclass), behaviour(dataclasses.dataclass), strict=True):
        assert ours == theirs


@pytest.mark.parametrize("dataclass", [late.dataclass, dataclasses.dataclass])
def test_replace_is_that_of_the_standard_library(dataclass):
    point, heavy, tally, same, _ = classes(dataclass)
    for one in (point(1.0, names=["a"]), heavy(1.0, 3.0, mass=2.0), same(4), tally((1,))):
        ours, theirs = late.replace(one), dataclasses.replace(one)
        assert vars(ours) == vars(theirs)
        assert ours is not one
    assert late.replace(heavy(1.0, 3.0), mass=2.0, x=5.0) == dataclasses.replace(heavy(5.0, 3.0), mass=2.0)
    counted = tally((1,))
    counted._hidden = 7
    assert late.replace(counted, items=())._hidden == 0
    with pytest.raises(ValueError, match="mass"):
        late.replace(heavy(1.0), mass=-1.0)
    with pytest.raises(TypeError, match="weight"):
        late.replace(heavy(1.0), weight=1.0)
    child = type("Child", (heavy,), {})(1.0)
    assert type(late.replace(child, y=4.0)) is type(child)


@late.dataclass(frozen=True)
class Pair:
    """Two numbers, in a module from which it can be loaded again."""

    a: int
    b: "Pair | None" = None


def test_instances_pickle_before_and_after_the_class_is_complete():
    data = pickle.dumps(Pair(1, Pair(2)))
    assert pickle.loads(data) == Pair(1, Pair(2))


def test_many_threads_may_make_the_first_instance():
    for _ in range(20):
        kind = late.dataclass(frozen=True)(type("Kind", (), {"__annotations__": {"x": int}}))
        barrier, found = threading.Barrier(8), []

        def make(kind=kind, barrier=barrier, found=found):
            barrier.wait()
            found.append(kind(3))

        threads = [threading.Thread(target=make) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert found == [kind(3)] * 8


def test_names_of_arguments_are_checked_from_the_first_instance_on():
    @takes_names
    @late.dataclass(frozen=True)
    class Pull:
        """A class whose arguments are checked by name before it is completed."""

        at: int
        force: float = 0.0

    for _ in range(2):
        with pytest.raises(UsageError, match=r"^Pull: it takes no 'forse'\. Did you mean 'force'\?"):
            Pull(1, forse=2.0)
        assert Pull(at=1, force=2.0) == Pull(1, 2.0)
        assert repr(Pull(at=1, force=2.0)) == "Pull(at=1, force=2.0)"
