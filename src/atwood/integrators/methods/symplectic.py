"""Symplectic methods of equal steps: those of Gauss, and compositions where H is T(p) + V(q, t)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from atwood.errors import UnsupportedError, UsageError
from atwood.integrators.methods.record import Method, Task

if TYPE_CHECKING:
    from atwood.integrators.explicit_session import ExplicitSession
    from atwood.integrators.symplectic.stepper import CompiledMethod, Hamiltonian


_ORDER = 8
"""The order unless another one is asked for: it costs least at most tolerances."""


def _gauss(given: Hamiltonian, order: int) -> CompiledMethod:
    from atwood.integrators.symplectic.stepper import compiled_gauss

    return compiled_gauss(given.equations, given.speeds, order)


def _composition(given: Hamiltonian, order: int) -> CompiledMethod:
    from atwood.integrators.symplectic.composition import compiled_composition

    if order not in COMPOSITION.orders:
        raise UsageError(
            f"there is no composition of order {order}",
            where=given.name,
            advice=f"Give one of {', '.join(map(str, COMPOSITION.orders))}, or the solver 'gauss'.",
        )
    found = given.separated()
    if found is None:
        raise UnsupportedError(
            "its H is no sum of a function of momenta and one of coordinates, so that its steps cannot be split",
            where=given.name,
            advice="Use the solver 'gauss', which is symplectic for any H.",
        )
    return compiled_composition(*found, order)


def _open(task: Task, is_split: bool) -> ExplicitSession:
    from atwood.integrators.explicit_session import ExplicitSession
    from atwood.integrators.symplectic.stepper import GaussStepper

    assert task.hamiltonian is not None
    given, problem = task.hamiltonian(), task.problem
    order, make = given.order or _ORDER, _composition if is_split else _gauss
    assert problem.compiled is not None
    compiled = given.compiled(lambda: make(given, order), is_split, order)
    stepper = GaussStepper(
        compiled, given.values, given.momenta, problem.compiled(), given.step or 1.0, given.sizes, problem.guard
    )
    if given.step is None:
        stepper.choose_step(task.t, task.y, task.end, task.settings)
    return ExplicitSession(problem, task.settings, stepper, task.t, task.y, task.budget, end=task.end)


_symplectic: Any = partial(
    Method,
    kind="hamiltonian",
    nodes_in_step=6,
    steps_seen=0.5,
    steps_unseen=10.0,
    loosest_tolerance=1.0,
    default_order=_ORDER,
)

GAUSS: Method = _symplectic(
    "gauss",
    "Gauss, symplectic",
    "E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed., Springer 2006, II.1.3, VIII.6",
    orders=(2, 4, 6, 8, 10, 12),
    open=partial(_open, is_split=False),
    reach=8.0,
    judged_tolerance=1e-11,
)

COMPOSITION: Method = _symplectic(
    "composition",
    "composition, symplectic",
    "E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed., Springer 2006, V.3",
    orders=(2, 4, 6, 8),
    open=partial(_open, is_split=True),
    reach=6.0,
)
