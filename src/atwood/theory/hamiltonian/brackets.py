"""Poisson brackets (Goldstein, section 9.5; with his sign, ``{q, p} = 1``)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from atwood.arguments import command, takes
from atwood.lazy_modules import sympy
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian
from atwood.theory.hamiltonian.phase_space import (
    EXPRESSION,
    EXPRESSIONS,
    HAMILTONIAN,
    PHASE_SPACE,
    PhaseSpace,
    Sympy,
    phase_space_of,
    short,
)


@command("bracket")
@takes(f=EXPRESSION, g=EXPRESSION, hamiltonian=PHASE_SPACE)
def poisson_bracket(f: Any, g: Any, hamiltonian: Hamiltonian | tuple[Sequence[Sympy], Sequence[Sympy]]) -> Sympy:
    """Return the Poisson bracket ``{f, g} = sum df/dq dg/dp - df/dp dg/dq``.

    Parameters
    ----------
    f, g
        Functions of coordinates, momenta and time: sympy expressions in the symbols of the Hamiltonian, or text of
        them: ``"theta"`` is the coordinate theta(t).
    hamiltonian
        What `atwood.hamiltonian` returns, or a pair: coordinates and momenta.

    Returns
    -------
    sympy.Expr
        The bracket, as short as formulas of equations are made.

    Raises
    ------
    UsageError
        If a function holds what is neither coordinate nor momentum, parameter nor time.
    """
    space = phase_space_of(hamiltonian)
    return space.shown(short(bracket(space.read(f), space.read(g), space)))


@command("brackets")
@takes(functions=EXPRESSIONS, hamiltonian=PHASE_SPACE)
def poisson_brackets(
    functions: Sequence[Any], hamiltonian: Hamiltonian | tuple[Sequence[Sympy], Sequence[Sympy]]
) -> Sympy:
    """Return the matrix of the Poisson brackets of several functions with each other.

    Parameters
    ----------
    functions
        The functions, such as the components of angular momentum.
    hamiltonian
        See `poisson_bracket`.
    """
    space = phase_space_of(hamiltonian)
    read = [space.read(one) for one in functions]
    return sympy.ImmutableMatrix(
        len(read), len(read), [space.shown(short(bracket(f, g, space))) for f in read for g in read]
    )


@takes(coordinates=EXPRESSIONS, momenta=EXPRESSIONS, hamiltonian=PHASE_SPACE)
def fundamental_brackets(
    coordinates: Sequence[Any],
    momenta: Sequence[Any],
    hamiltonian: Hamiltonian | tuple[Sequence[Sympy], Sequence[Sympy]],
) -> Sympy:
    """Return the brackets of new coordinates and momenta: the matrix Omega if they are canonical.

    Parameters
    ----------
    coordinates, momenta
        New ones as functions of the old.
    hamiltonian
        See `poisson_bracket`.
    """
    return poisson_brackets([*coordinates, *momenta], hamiltonian)


@takes(f=EXPRESSION, hamiltonian=HAMILTONIAN)
def total_derivative(f: Any, hamiltonian: Hamiltonian) -> Sympy:
    """Return the rate of a function along motions, ``df/dt = {f, H} + df/dt`` (Goldstein, equation 9.94).

    It is zero for constants of the motion; so is then that of the bracket of two of them (Poisson's theorem).

    Parameters
    ----------
    f
        The function.
    hamiltonian
        The Hamiltonian; forces that do not follow from it are not in it.
    """
    space = phase_space_of(hamiltonian)
    read = space.read(f)
    found = bracket(read, space.read(hamiltonian.expression), space) + read.diff(sympy.Symbol("t"))
    return space.shown(short(found))


def bracket(f: Sympy, g: Sympy, space: PhaseSpace) -> Sympy:
    """Return the Poisson bracket of functions on the plain symbols of a phase space, as it comes."""
    pairs = zip(space.coordinates, space.momenta, strict=True)
    return sympy.Add(*(f.diff(q) * g.diff(p) - f.diff(p) * g.diff(q) for q, p in pairs))
