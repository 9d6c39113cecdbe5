"""A scene as its start is found, before that start says what becomes of its constraints on velocities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from atwood.expr import Expression
from atwood.forms.assembly import Assembly
from atwood.forms.shared import Shared

__all__ = ["starting", "with_places"]


def starting(assembly: Assembly) -> Assembly:
    """Return a scene as its start is found: with constraints on velocities as they are, which no start decides.

    Parameters
    ----------
    assembly
        The scene; it is returned itself where nothing depends on the start.
    """
    if assembly.mechanism.places is None:
        return assembly
    shared, known = assembly.shared.get("starting", lambda: (Shared(), assembly.parameters))
    every = assembly.mechanism.table.values
    values = {symbol: every[symbol] for symbol in known if symbol in every}
    table = replace(assembly.mechanism.table, values=values)
    mechanism = replace(assembly.mechanism, table=table, places=None)
    return replace(assembly, mechanism=mechanism, source=None, why_new="", shared=shared, _kernels={})


def with_places(assembly: Assembly, places: Mapping[str, Mapping[Expression, float]]) -> Assembly:
    """Return a scene with what its start makes of its constraints on velocities.

    Parameters
    ----------
    assembly
        The scene as its start was found.
    places
        See `atwood.mechanics.mechanism.Mechanism`.
    """
    shared, parameters = Shared(), assembly.parameters
    shared.get("starting", lambda: (assembly.shared, parameters))
    # Constants of integration are further parameters.
    table = replace(assembly.mechanism.table, values=dict(assembly.mechanism.table.values))
    mechanism = replace(assembly.mechanism, table=table, places=places)
    made = replace(assembly, mechanism=mechanism, shared=shared, _kernels={})
    _ = made.reduced, made.maximal  # the constants must be there before anything is bound
    return made
