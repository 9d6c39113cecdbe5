"""The momenta dL/dq' of coordinates as quantities by path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from atwood.expr import substitute
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.lagrangian.of_assembly import lagrangian_of
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.outputs.observables import Observable
from atwood.mechanics.outputs.reading import MOMENTUM

__all__ = ["momenta_of"]

_MOMENTA: Key[Mapping[str, Observable]] = Key("momenta of coordinates")
_UNITS = {"m": "kg*m/s", "rad": "kg*m^2/s"}


def momenta_of(assembly: Assembly, equations: Equations) -> Mapping[str, Observable]:
    """Return the momenta ``dL/dq'`` of coordinates by path.

    Parameters
    ----------
    assembly
        The scene.
    equations
        Its equations in the coordinates that are meant: generalized ones.

    Returns
    -------
    dict
        Empty in maximal coordinates, and where constraints on velocities are solved, whose momenta are not free.
    """
    if equations is assembly.maximal:
        return {}
    form = "reduced" if equations is assembly.reduced else "regular"
    return assembly.shared.get(_MOMENTA, lambda: _momenta(assembly, form), form)


def _momenta(assembly: Assembly, form: Any) -> Mapping[str, Observable]:
    found = lagrangian_of(assembly, form)
    if found.is_restricted:
        return {}
    own = found.equations
    pairs = zip(found.velocities, found.moves, own.speeds, strict=True)
    on_speeds: dict[Any, Any] = {v: own.rates[place] for v, place, u in pairs if v is not u and place is not None}
    momenta = list(found.momenta)
    momenta = substitute(momenta, on_speeds) if on_speeds else momenta
    made = {}
    for value, place in zip(momenta, found.moves, strict=True):
        if place is not None and found.names[place].unit in _UNITS:
            name = found.names[place]
            path, unit = f"{MOMENTUM}{name.name}", _UNITS[name.unit]
            made[path] = Observable(path, unit, f"Momentum of {name.name}.", False, value)
    return made
