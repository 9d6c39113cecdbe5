"""Where linear algebra or arithmetic gives up on the numbers of a scene: the error that says when, and of which part.

A matrix whose singular values do not come out, a division by what has become zero: libraries raise their own errors,
which know nothing of mechanisms. There is one door for them in a run, and one where its start is looked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError
from atwood.forms.assembly import Assembly
from atwood.mechanics.dynamics.equations import Equations
from atwood.simulation.dynamics.balance import Balance, balance_of
from atwood.simulation.dynamics.scales import motion_names, motion_scales, scene_length
from atwood.simulation.dynamics.undefined_values import undefined_value_at

__all__ = ["is_numerical", "named", "numerical_failure"]

_OURS = ("atwood", "numpy", "scipy")
"""Errors of anything else, such as what a person is called back with, are for whoever wrote it."""

_MISSED = 1e-6
"""Relative to the scene's size: a constraint that is missed by more contradicts the others."""


def is_numerical(error: Exception) -> bool:
    """Return whether an error says that numbers cannot be worked with, and comes from where they are.

    Parameters
    ----------
    error
        What was raised.
    """
    if isinstance(error, np.linalg.LinAlgError):
        return True
    if isinstance(error, AtwoodError) or not isinstance(error, (ValueError, ArithmeticError)):
        return False
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    room = "" if trace is None else str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0]
    # A ValueError that is no matter of numbers is raised here, or inside NumPy without a frame of its own.
    return room in (_OURS if isinstance(error, ArithmeticError) else _OURS[1:])


def numerical_failure(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, error: Exception) -> SolveError:
    """Return the error of a scene whose numbers could not be worked with, with what is to blame as far as it shows.

    That is a law without a value, else the constraint that is missed most, else what moves fastest.

    Parameters
    ----------
    assembly, t, q, u
        The scene in its mode, and the last good state in the coordinates of its form.
    error
        What was raised.
    """
    said = f"at t = {t:.6g} its numbers could not be worked with ({error})"
    missing = undefined_value_at(assembly, t, q, u)
    if missing is not None:
        return SolveError(
            f"{missing.describe()}, so that nothing can be worked out there",
            where=missing.part,
            advice="A law is evaluated where it has no value: look at its formula, and at what the scene does before.",
        )
    equations = assembly.own_equations
    balance, sizes = balance_of(assembly, assembly.form), motion_scales(equations, scene_length(assembly))
    with np.errstate(all="ignore"):
        contradicts = _most_missed(equations, balance, t, q, sizes)
        if contradicts is not None:
            label, part, miss = contradicts
            return SolveError(
                f"{said}: {label} is missed there by {miss:.3g} of the scene's size",
                where=part,
                advice="Constraints, drives or lengths contradict each other, or differ too much in size.",
            )
        speed = np.abs(u) / sizes
    fastest = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf))) if len(u) else None
    if fastest is None:
        return SolveError(
            said, where=assembly.flat.name, advice="Look at the sizes of masses, lengths and stiffnesses."
        )
    name, unit = motion_names(equations)[fastest], equations.speed_names[fastest].unit
    return SolveError(
        f"{said}; what moves fastest there is {name}, at {u[fastest]:.3g} {unit}",
        where=name.rpartition(".")[0] or assembly.flat.name,
        advice=f"Look at what acts on {name}, and at masses and lengths that differ by many powers of ten.",
    )


def _most_missed(
    equations: Equations, balance: Balance, t: float, q: FloatArray, sizes: FloatArray
) -> tuple[str, str, float] | None:
    """Return label and part of the constraint on positions that is missed most, and by how much; None if all hold."""
    if not balance.constraints:
        return None
    try:
        now = balance.constraints_at(t, q, np.zeros_like(sizes))
        misses = np.abs(now.value / balance.row_scales(now, t, q, sizes))[balance.holonomic]
    except (AtwoodError, ValueError, ArithmeticError):
        return None  # that has no value either, and says nothing about contradictions
    worst = int(np.argmax(misses)) if len(misses) and np.isfinite(misses).all() else None
    if worst is None or not misses[worst] > _MISSED:
        return None
    one = equations.constraints[int(balance.holonomic[worst])]
    return one.label, one.key[0], float(misses[worst])


@contextmanager
def named(assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> Iterator[None]:
    """Turn the errors of libraries into those of a scene at a state; see `numerical_failure`.

    Raises
    ------
    SolveError
        In the place of such an error.
    """
    try:
        yield
    except (ValueError, ArithmeticError) as error:
        if not is_numerical(error):
            raise
        raise numerical_failure(assembly, t, q, u, error) from error
