"""What is known of a method, and what it is given of a stretch of a run."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from math import inf
from typing import TYPE_CHECKING, Any, Literal

from atwood.arrays import FloatArray
from atwood.integrators.protocol import LOOSEST, Budget, ExplicitProblem, ImplicitProblem, SolverOptions
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.integrators.batch import BatchPlaces
    from atwood.integrators.embedded.lanes import RatesOfMany
    from atwood.integrators.embedded.looks import EventsOfMany
    from atwood.integrators.embedded.tableau import Tableau
    from atwood.integrators.explicit_session import ExplicitSession, OnStiff
    from atwood.integrators.lanes import LanePlaces
    from atwood.integrators.session import Session
    from atwood.integrators.symplectic.stepper import Hamiltonian
    from atwood.integrators.taylor.stepper import TaylorProblem
    from atwood.integrators.time_stepping.session import ImpulsiveProblem


LEAST = 1e-15
"""The least relative tolerance: a few times the relative error of one operation."""


@dataclass(frozen=True, eq=False)
class Task:
    """A stretch of a run: its equations, in the forms that methods read, its start and its limits.

    Attributes
    ----------
    settings
        Accuracy.
    t, y, yp
        Consistent start values; explicit methods find the rates by themselves.
    budget
        Limits.
    end
        The last time that will be asked for, s.
    on_stiff
        Asked whether to leave the rest to an implicit method; see `~atwood.integrators.explicit_session`.
    explicit
        The equations ``y' = f(t, y)``, with what is watched.
    many
        Their rates for so many runs side by side, the values of the parameters, and what is watched, if anything is.
    series, hamiltonian
        Their Taylor recurrences, and Hamilton's equations.
    implicit
        The equations ``F(t, y, y') = 0``; given whether compiled functions look for events.
    impulsive
        The equations where nothing touches, and what contacts do.
    angles
        Unknowns of the implicit equations that are angles.
    """

    settings: SolverOptions
    t: float
    y: FloatArray
    yp: FloatArray | None = None
    budget: Budget | None = None
    end: float = inf
    on_stiff: OnStiff | None = None
    explicit: ExplicitProblem | None = None
    series: Callable[[], TaylorProblem] | None = None
    many: Callable[[int], tuple[RatesOfMany, FloatArray, EventsOfMany | None]] | None = None
    hamiltonian: Callable[[], Hamiltonian] | None = None
    implicit: Callable[[bool], ImplicitProblem] | None = None
    impulsive: ImpulsiveProblem | None = None
    angles: tuple[int, ...] = ()

    @property
    def problem(self) -> ExplicitProblem:
        """The equations for an explicit method."""
        assert self.explicit is not None
        return self.explicit


@dataclass(frozen=True, eq=False)
class Method:
    """A method: what it is, what it keeps, how accurate it can be, and how a session of it is opened.

    Attributes
    ----------
    key, title
        How it is asked for, and what it is called.
    citation
        Where it is described.
    kind
        What its equations are: ``F(t, y, y') = 0``, ``y' = f(t, y)``, their recurrences, Hamilton's, or those of
        a motion with contacts whose events are not looked for.
    orders
        The orders that it has; several are chosen from by the method, or by whoever asks where steps are equal.
    open
        Opens a session.
    nodes_in_step
        Points of Gauss and Legendre that integrate along a step as accurately as the method.
    reach
        How far a curved function may change in a step, in units of its own scale: as far as the slopes that the method
        takes show.
    steps_seen, steps_unseen
        So many steps from sample to sample leave nothing unseen between the two; with more than so many, rates at
        samples say little of those in between.
    dense_order
        Of what is read between two steps; 0 where that is as accurate as a step.
    keeps_constraints
        Whether it solves equations whose constraints stay.
    word
        What a result calls it in few words; its key if not given.
    tableau
        Its coefficients, where it is an embedded pair.
    batch
        Returns the addresses with which many runs are made in one call; None where each is made by itself.
    lanes
        Returns what so many runs side by side need; None where they are made one after another.
    least_tolerance
        A relative tolerance below this it cannot be asked for.
    loosest_tolerance
        The largest relative tolerance that its steps are chosen by.
    first_share
        The first tolerance that is tried for an accuracy of the motion, relative to that.
    judged_tolerance
        The relative tolerance that its runs are as accurate as, where it is not the one that was asked for.
    default_order
        The order unless another is asked for, where steps are equal; 0 where the method chooses it.
    is_interpreted
        Whether its equations are always functions in Python.
    """

    key: str
    title: str
    citation: str
    kind: Literal["implicit", "explicit", "series", "hamiltonian", "impulsive"]
    orders: tuple[int, ...]
    open: Callable[[Task], Session]
    nodes_in_step: int
    reach: float
    steps_seen: float
    steps_unseen: float
    dense_order: int = 0
    keeps_constraints: bool = False
    word: str = ""
    tableau: Tableau | None = None
    batch: Callable[[Task], BatchPlaces] | None = None
    lanes: Callable[[Task, int], LanePlaces] | None = None
    least_tolerance: float = LEAST
    loosest_tolerance: float = LOOSEST
    first_share: float = 0.3
    judged_tolerance: float | None = None
    default_order: int = 0
    is_interpreted: bool = False

    @cached_property
    def is_implicit(self) -> bool:
        """Whether it solves equations of multipliers and rates."""
        return self.kind == "implicit"

    @cached_property
    def looks_for_events(self) -> bool:
        """Whether steps end where something happens; else what contacts do in a step is at its end."""
        return self.kind != "impulsive"

    @cached_property
    def has_equal_steps(self) -> bool:
        """Whether all its steps are equal, so that it takes an order and a step."""
        return self.default_order > 0


def open_pair(task: Task, pair: Tableau) -> ExplicitSession:
    """Open a session of an embedded pair."""
    from atwood.integrators.embedded.stepper import CompiledStepper
    from atwood.integrators.explicit_session import ExplicitSession

    stepper = CompiledStepper(task.problem, task.settings, pair)
    return ExplicitSession(
        task.problem, task.settings, stepper, task.t, task.y, task.budget, on_stiff=task.on_stiff, end=task.end
    )


def explicit_pair(key: str, title: str, citation: str, pair: Tableau, **more: Any) -> Method:
    """Return the method of an embedded pair; see `Method` for what else is said of it."""

    def places(task: Task) -> BatchPlaces:
        from atwood.integrators.embedded.stepper import CompiledStepper

        return CompiledStepper(task.problem, task.settings, pair).batch_places()

    def lanes(task: Task, runs: int) -> LanePlaces:
        from atwood.integrators.embedded.lanes import open_lanes

        assert task.many is not None
        return open_lanes(*task.many(runs), task.settings, pair)

    usual = {"nodes_in_step": pair.order // 2 + 3, "reach": 8.0, "steps_seen": 0.5, "steps_unseen": 10.0}
    return Method(
        key,
        title,
        citation,
        "explicit",
        (pair.order,),
        lambda task: open_pair(task, pair),
        dense_order=pair.dense_order,
        keeps_constraints=True,
        tableau=pair,
        batch=places,
        lanes=lanes,
        **{**usual, **more},
    )
