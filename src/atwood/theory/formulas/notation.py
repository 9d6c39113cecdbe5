"""Names as a textbook has them: theta and x for coordinates, m, l and g for parameters, each with its path and unit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from atwood.arguments import optional
from atwood.errors import UsageError, suggestion
from atwood.expr import Expression, read_by, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.declare.component import Component
from atwood.model.declare.fields import FieldReference
from atwood.model.declare.parameter_expressions import OPERATIONS, ParameterExpression
from atwood.model.local.flatten import passed_on
from atwood.model.values.letters import GREEK, LETTERS, split_letter
from atwood.theory.formulas.tree import Symbol

SYMBOLS = optional(LETTERS)
"""The kind of the argument ``symbols`` of every function that writes formulas; see `notation_of`."""


def _table(text: str) -> dict[str, tuple[str, ...]]:
    """Return letters with what stands below them from pairs of a name and a letter."""
    return {name: tuple(letter.split("_")) for name, letter in (pair.split(":") for pair in text.split())}


_LETTERS = _table(
    """
    mass:m  length:l  natural_length:l_0  stiffness:k  damping:c  gravity:g  radius:r  moment:I  axial_moment:I
    amplitude:A  frequency:f  angular_frequency:Omega  angular_speed:Omega  rate:Omega  charge:e  charge_a:e_a
    charge_b:e_b  gravitational_constant:G  gravitational_parameter:mu  coulomb_constant:k_e  field:B  angle:alpha
    phase:delta  torque:M  force:F  pitch:h  height:h  width:b  inertia:I  ratio:n  slope:Omega  offset:b  speed:v
    time:T  friction:mu  strength:K  acceleration:a  density:rho  area:A  temperature:T  voltage:U  current:I
"""
)
"""Letters of parameters by their names."""

_VECTORS = _table("moments:I_123  center:c_xyz  center_of_mass:c_xyz  displacement:d_xyz  products:D_123")
"""Letters of vectors, and what stands below those of their components x, y and z."""

_COORDINATES = _table(
    """
    angle:theta  angle_a:alpha  angle_b:beta  displacement:x  displacement_1:x  displacement_2:y  quaternion.w:e_0
    quaternion.x:e_1  quaternion.y:e_2  quaternion.z:e_3  spin.x:omega_x  spin.y:omega_y  spin.z:omega_z
    euler.phi:phi  euler.theta:theta  euler.psi:psi  position.x:x  position.y:y  position.z:z  longitude:phi
    inclination:theta  distance:r
"""
)
"""Letters of coordinates and of angular velocities, by the ends of their paths."""


@dataclass(frozen=True)
class Notation:
    """The symbols of a scene.

    Attributes
    ----------
    symbols
        What stands for the symbols of coordinates, multipliers, parameters and time in expressions.
    velocities, accelerations
        For a symbol of a velocity or of its derivative: the symbol, and how many dots it has.
    legend
        All symbols in order: coordinates, angular velocities, multipliers, sampled values, parameters.
    merged
        Parameters that another stands for: equal principal moments of a body, what one parameter of a model with a
        letter of its own is passed on to or that is worked out from it, and equal values that were given one letter.
    """

    symbols: Mapping[Expression, Symbol]
    velocities: Mapping[Expression, tuple[Symbol, int]]
    legend: tuple[Symbol, ...]
    merged: Mapping[Expression, Expression]


@dataclass(frozen=True)
class _Wanted:
    """Something that needs a symbol; its whole name may be given, and it may share that of a model's parameter."""

    expression: Expression
    stem: tuple[str, ...]
    path: str
    part: str
    unit: str
    meaning: str
    value: float | None
    kind: str
    is_given: bool = False
    shared: str = ""


def notation_of(assembly: Assembly, found: Lagrangian, symbols: Mapping[str, str] | None = None) -> Notation:
    """Return the symbols of a scene: letters that were given, those of declarations, and usual ones.

    Parameters
    ----------
    assembly, found
        The scene.
    symbols
        Letters by path, before those that the scene says itself. Of a part it is what stands below its letters. Two
        parameters may have one letter where they are equal.

    Raises
    ------
    UsageError
        If nothing has such a path, or one letter would stand for two things.
    """
    said = {**assembly.flat.symbols, **(symbols or {})}
    _check_paths(assembly, found, said)
    wanted = [*_coordinates(found), *_spins(found), *_multipliers(found)]
    wanted += [*_sampled_values(assembly), *_parameters(assembly)]
    wanted = [_with_letter(assembly, one, said) for one in wanted]
    derived, more = _worked_out(assembly, wanted, said)
    wanted, merged = _put_together([*wanted, *more], _equal_moments(assembly) | derived)
    names: dict[tuple[str, ...], str] = {}
    symbols_of: dict[Expression, Symbol] = {
        found.time: Symbol("t", path="time", unit="s", meaning="Time.", kind="time")
    }
    for order, (one, below) in enumerate(zip(wanted, _subscripts(wanted), strict=True)):
        name = (*one.stem, *below)
        momentum = ("p", *name) if one.kind == "coordinate" else name
        for taken in (name, momentum):
            if names.setdefault(taken, one.path) != one.path:
                raise UsageError(
                    f"{'_'.join(taken)} stands for it and for {names[taken]}",
                    where=one.path,
                    advice="Give each a letter of its own; parameters may share one where they are equal.",
                )
        symbols_of[one.expression] = Symbol(
            name[0], name[1:], one.path, one.unit, one.meaning, one.value, one.kind, order
        )
    velocities: dict[Expression, tuple[Symbol, int]] = {}
    for velocity, rate, place in zip(found.velocities, found.accelerations, found.moves, strict=True):
        dots = 0 if place is None else 1
        own = symbols_of[velocity] if place is None else symbols_of[found.coordinates[place]]
        velocities[velocity], velocities[rate] = (own, dots), (own, dots + 1)
    return Notation(symbols_of, velocities, tuple(symbols_of[one.expression] for one in wanted), merged)


def momentum_symbol(found: Lagrangian, number: int) -> Expression:
    """Return the symbol of the momentum of a coordinate, by its number."""
    return found.graph.symbol(f"p:{found.names[number].name}")


def with_momenta(notation: Notation, found: Lagrangian) -> Notation:
    """Return a notation that has a letter p for the momentum of each coordinate."""
    symbols, added = dict(notation.symbols), []
    for number, (q, name) in enumerate(zip(found.coordinates, found.names, strict=True)):
        own = symbols[q]
        meaning = f"Momentum of {name.name}."
        unit = "kg*m^2/s" if own.unit == "rad" else f"kg*m^2/(s*{own.unit})" if own.unit != "m" else "kg*m/s"
        below = (own.letter, *own.subscripts)
        made = Symbol("p", below, f"p:{name.name}", unit, meaning, None, "momentum", own.order)
        symbols[momentum_symbol(found, number)] = made
        added.append(made)
    moving = [one for one in notation.legend if one.kind == "coordinate"]
    others = [one for one in notation.legend if one.kind != "coordinate"]
    return replace(notation, symbols=symbols, legend=(*moving, *added, *others))


def _check_paths(assembly: Assembly, found: Lagrangian, said: Mapping[str, str]) -> None:
    """Refuse letters for what a scene does not have; what has none in one form may have one in the other."""
    known = {one.name for one in (*found.names, *found.velocity_names)} | {one.label for one in found.constraints}
    known |= {one.name for one in assembly.mechanism.table.values}
    for path, local in assembly.mechanism.locals_.items() if said else ():
        component: Component | None = local.part.component
        known |= {f"{path}.{law.name}" for law in local.part.component.laws("observable")}
        known |= {f"{path}.{name}" for name in local.part.component.connectors()}
        while component is not None:
            ahead = f"{component.path}." if component.path else ""
            known |= {component.path, *(ahead + name for name in (*component._parameters, *component._signals))}
            known |= {ahead + name for name in component._states}
            component = component._parent
    for path in said:
        if path not in known and not (path[-2:] in (".x", ".y", ".z") and path[:-2] in known):
            raise UsageError(
                "there is nothing with this path to have a letter", where=path, advice=suggestion(path, known)
            )


def _with_letter(assembly: Assembly, one: _Wanted, said: Mapping[str, str]) -> _Wanted:
    """Return what needs a symbol with the letter that it was given, or that is declared where it comes from."""
    part, name, axis = _place(assembly, one.path)
    local = assembly.mechanism.locals_.get(part)
    ways: list[tuple[str, str, tuple[str, ...]]] = [(part, name, ())] if local is None else []
    source, own = (None, name) if local is None else (local.part.component, name)
    spec = None if source is None else source._parameters.get(name) or source._signals.get(name)
    if source is not None and axis and spec is not None and getattr(spec, "size", None) is None:
        source = source._parent or source if name in source._settings else source  # what a function takes by name
        field = source._parameters[axis]
        one = replace(one, stem=_parameter_stem(axis, ""), unit=field.unit.text, meaning=field.doc)
        one, own, axis = replace(one, shared=f"{source.path}.{axis}" if source.path else axis), axis, ""
    for component, place in passed_on(source, own) if source is not None else ():
        ways.append((component.path, place, _declared(component, place)))
    for path, own, declared in ways:
        whole = f"{path}.{own}" if path else own
        full = f"{whole}.{axis}" if axis else whole
        given = said.get(full) or said.get(whole)
        is_outer = path != part
        if given:
            stem = split_letter(given) + ((axis,) if axis and full not in said else ())
            return replace(one, stem=stem, is_given=True, shared=full if is_outer else one.shared)
        if declared:
            at = "xyz".find(axis) if len(declared) > 1 else 0
            stem = split_letter(declared[at]) + ((axis,) if axis and len(declared) == 1 else ())
            one = replace(one, stem=stem, shared=full if is_outer else one.shared)
    if one.part in said:
        return replace(one, stem=(*one.stem, *split_letter(said[one.part])), is_given=True)
    return one


def _declared(component: Component, name: str) -> tuple[str, ...]:
    """Return the letters that a class declares for one of its fields, observables or connectors."""
    fields = (component._parameters, component._signals, component._states, type(component)._connectors)
    for table in fields:
        if name in table and table[name].symbol:
            return tuple(table[name].symbol)
    for law in component.laws("observable"):
        if law.name == name and law.options.symbol:
            return tuple(law.options.symbol)
    return next((one.symbol for one in type(component)._connectors.values() if one.of == name and one.symbol), ())


def _put_together(
    wanted: Sequence[_Wanted], merged: Mapping[Expression, Expression]
) -> tuple[list[_Wanted], dict[Expression, Expression]]:
    """Return what needs symbols without parameters that others stand for, and these."""
    by, kept, first = dict(merged), list[_Wanted](), dict[object, _Wanted]()
    for one in wanted:
        if one.kind == "parameter" and one.expression not in by:
            key: object = ("shared", one.shared) if one.shared else ("given", one.stem) if one.is_given else one.path
            before = first.setdefault(key, one)
            if before is not one and before.value == one.value:
                by[one.expression] = before.expression
        if one.expression not in by:
            kept.append(one)
    return kept, by


def _worked_out(
    assembly: Assembly, wanted: Sequence[_Wanted], said: Mapping[str, str]
) -> tuple[dict[Expression, Expression], list[_Wanted]]:
    """Return parameters such as ``length / 2`` in terms of those with letters around them, and which of these are new.

    What has another value than its declaration says, as a changed copy may, keeps a letter of its own.
    """
    known = {one.shared: one.expression for one in reversed(wanted) if one.shared}
    values, more = dict(assembly.mechanism.table.values), dict[Expression, _Wanted]()

    def letter(model: Component, name: str) -> Expression | None:
        for component, own in passed_on(model, name):
            path = f"{component.path}.{own}" if component.path else own
            given = said.get(path) or next(iter(_declared(component, own)), "")
            if given and path not in known:
                known[path] = symbol = assembly.mechanism.table.graph.parameter(path)
                values[symbol], spec = float(component._value(own)), component._parameters[own]
                more[symbol] = _Wanted(
                    *(symbol, split_letter(given), path, component.path, spec.unit.text, spec.doc, values[symbol]),
                    *("parameter", path in said, path),
                )
            if given:
                return known[path]
        return None

    def formula(bound: Any, model: Component) -> Any:
        if isinstance(bound, FieldReference):
            return letter(model, bound.name)
        if not isinstance(bound, ParameterExpression):
            return bound
        inner = [formula(one, model) for one in bound.arguments]
        return None if None in inner else OPERATIONS[bound.operation](*inner)

    found: dict[Expression, Expression] = {}
    for one in wanted:
        part, name, axis = _place(assembly, one.path)
        if one.kind == "parameter" and not one.is_given and not axis and part in assembly.mechanism.locals_:
            *_, (component, own) = passed_on(assembly.mechanism.locals_[part].part.component, name)
            made = None if component._parent is None else formula(component._settings.get(own), component._parent)
            if isinstance(made, Expression) and math.isclose(
                substitute([made], values)[0].value, values[one.expression]
            ):
                found[one.expression] = made
    return found, [more[symbol] for symbol in read_by(found.values(), more)]


def _coordinates(found: Lagrangian) -> Iterator[_Wanted]:
    for q, name in zip(found.coordinates, found.names, strict=True):
        stem, part = _stem(name.name)
        yield _Wanted(q, stem, name.name, part, name.unit, "", None, "coordinate")


def _spins(found: Lagrangian) -> Iterator[_Wanted]:
    for u, name, place in zip(found.velocities, found.velocity_names, found.moves, strict=True):
        if place is None:
            stem, part = _stem(name.name)
            meaning = "Angular velocity in the axes of the body."
            yield _Wanted(u, stem, name.name, part, name.unit, meaning, None, "angular velocity")


def _stem(path: str) -> tuple[tuple[str, ...], str]:
    """Return the letter of a coordinate and the part that it belongs to."""
    pieces = path.split(".")
    for count in (2, 1):
        end = ".".join(pieces[-count:])
        if end in _COORDINATES and len(pieces) > count:
            return _COORDINATES[end], ".".join(pieces[:-count])
    return _word(pieces[-1]), ".".join(pieces[:-1])


def _multipliers(found: Lagrangian) -> Iterator[_Wanted]:
    several = len(found.constraints) > 1
    for number, one in enumerate(found.constraints):
        stem = ("lambda", str(number + 1)) if several else ("lambda",)
        meaning = f"{one.key[0]}.{one.reaction} is {'-' if one.sign < 0 else ''}it."
        yield _Wanted(one.multiplier, stem, one.label, one.key[0], "", meaning, None, "multiplier")


def _parameters(assembly: Assembly) -> Iterator[_Wanted]:
    for symbol, value in assembly.mechanism.table.values.items():
        path = symbol.name
        part, name, axis = _place(assembly, path)
        unit, meaning = _said(assembly, part, name)
        yield _Wanted(symbol, _parameter_stem(name, axis), path, part, unit, meaning, value, "parameter")


def _sampled_values(assembly: Assembly) -> Iterator[_Wanted]:
    for one in assembly.discrete_states:
        part, _, name = one.path.rpartition(".")
        spec = assembly.mechanism.locals_[part].part.component.state_specs()[name.partition("[")[0]]
        unit = spec.unit.text.replace("any", "")
        yield _Wanted(one.symbol, _word(name), one.path, part, unit, spec.doc, None, "sampled value")


def _place(assembly: Assembly, path: str) -> tuple[str, str, str]:
    """Return the part, the name and the axis of a parameter, or of a coordinate."""
    part, _, name = path.rpartition(".")
    if part in assembly.mechanism.locals_:
        return part, name, ""
    outer, _, owner = part.rpartition(".")
    return (outer, owner, name) if outer in assembly.mechanism.locals_ else (part, name, "")


def _said(assembly: Assembly, part: str, name: str) -> tuple[str, str]:
    """Return unit and meaning of a parameter."""
    if part not in assembly.mechanism.locals_:
        return ("m/s^2", "Acceleration of free fall.") if name == "gravity" else ("", "Constant of the start.")
    component = assembly.mechanism.locals_[part].part.component
    spec = component.parameter_specs().get(name) or component.signal_specs().get(name)
    return ("", "") if spec is None else (spec.unit.text.replace("any", ""), spec.doc)


def _parameter_stem(name: str, axis: str) -> tuple[str, ...]:
    if axis and name in _VECTORS:
        letter, axes = _VECTORS[name]
        return letter, axes["xyz".index(axis)]
    if axis and name == "position":
        return (axis,)
    if axis:
        return (*_word(name), axis)
    return _LETTERS.get(name) or _word(name)


def _word(name: str) -> tuple[str, ...]:
    """Return a name as a letter and a number, or as the word that it is."""
    found = re.fullmatch(r"([A-Za-z]|" + "|".join(GREEK) + r")_?(\d*)", name)
    if found:
        return (found[1], found[2]) if found[2] else (found[1],)
    return (name.replace("_", ""),)


def _equal_moments(assembly: Assembly) -> dict[Expression, Expression]:
    """Return principal moments of a body that are equal to one before: a symmetric body has two, a ball one."""
    groups: dict[str, list[Expression]] = {}
    for symbol in assembly.mechanism.table.values:
        part, name, axis = _place(assembly, symbol.name)
        if axis and name == "moments":
            groups.setdefault(part, []).append(symbol)
    values, merged = assembly.mechanism.table.values, {}
    for group in groups.values():
        for i, symbol in enumerate(group):
            first = next((one for one in group[:i] if values[one] == values[symbol]), None)
            if first is not None:
                merged[symbol] = first
    return merged


def _subscripts(wanted: Sequence[_Wanted]) -> list[tuple[str, ...]]:
    """Return what tells apart those that have the same letter: a number if all have one, else the part.

    Coordinates have the plainer names: a parameter with the letter of one says of which part it is.
    """
    groups: dict[tuple[tuple[str, ...], bool], list[int]] = {}
    for i, one in enumerate(wanted):
        if not one.is_given:
            groups.setdefault((one.stem, one.kind == "parameter"), []).append(i)
    numbered = _numbered(wanted, list(groups.values()))
    found: list[tuple[str, ...]] = [()] * len(wanted)
    taken: set[tuple[str, ...]] = {("t",), ("pi",), *(one.stem for one in wanted if one.is_given)}
    stems: set[tuple[str, ...]] = set()
    for (stem, _), members in sorted(groups.items(), key=lambda item: item[0][1]):
        parts = [wanted[i].part for i in members]
        plain = [""] if len(members) == 1 and stem not in stems else None
        stems.add(stem)
        counted = [numbered[part] for part in parts] if all(part in numbered for part in parts) else None
        paths = [one.replace(".", "") for one in _full(wanted[i].path for i in members)]
        for labels in (plain, _numbers(parts), counted, _last_names(parts, stem[0]), _full(parts), paths):
            names = [] if labels is None else [(*stem, one) if one else stem for one in labels]
            if labels is not None and len(set(names)) == len(names) and taken.isdisjoint(names):
                taken.update(names)
                for i, label in zip(members, labels, strict=True):
                    found[i] = (label,) if label else ()
                break
    return found


def _numbered(wanted: Sequence[_Wanted], groups: Sequence[Sequence[int]]) -> dict[str, str]:
    """Return numbers for parts that have words for names, where words would fill the lines.

    That is where three parts or more have the same letters, as crank, coupler and rocker: each has one number in all
    of them. Two words, as cart and bob, and what has a figure already, as principal moments, keep the words.
    """
    families: list[tuple[list[str], bool]] = []
    for members in groups:
        parts = list(dict.fromkeys(wanted[i].part for i in members))
        if len(members) < 2 or len(parts) < len(members) or _numbers(parts) is not None:
            continue
        has_figure = len(wanted[members[0]].stem) > 1
        met = [one for one in families if not set(one[0]).isdisjoint(parts)]
        joined = list(dict.fromkeys([*(part for one in met for part in one[0]), *parts]))
        families = [one for one in families if one not in met]
        families.append((joined, has_figure or any(one[1] for one in met)))
    order = {part: i for i, part in enumerate(dict.fromkeys(one.part for one in wanted))}
    found: dict[str, str] = {}
    for parts, has_figure in families:
        if len(parts) > 2 and not has_figure:
            found |= {part: str(i + 1) for i, part in enumerate(sorted(parts, key=order.__getitem__))}
    return found


def _numbers(parts: Sequence[str]) -> list[str] | None:
    """Return the number at the end of each name, from one on; None if one has none."""
    numbers = []
    for part in parts:
        indexed = re.search(r"\[(\d+)\]$", part)
        plain = re.search(r"(?<=\D)(\d+)$", part)
        if indexed:
            numbers.append(int(indexed[1]) + 1)
        elif plain:
            numbers.append(int(plain[1]))
        else:
            return None
    shift = 1 if 0 in numbers else 0
    return [str(number + shift) for number in numbers]


def _last_names(parts: Iterable[str], letter: str) -> list[str]:
    """Return the last words of the names of parts; of one that is a letter with a number, as m1, the number."""
    names = [part.rpartition(".")[2] for part in parts]
    plain = [re.sub(r"\[(\d+)\]$", lambda found: str(int(found[1]) + 1), name) for name in names]
    words = [name.rpartition("_")[2] for name in plain]
    chosen = words if len(set(words)) == len(words) else [name.replace("_", "") for name in plain]
    return [name[len(letter) :] if re.fullmatch(letter + r"\d+", name) else name for name in chosen]


def _full(parts: Iterable[str]) -> list[str]:
    return [re.sub(r"\W+|_", "", part.replace("[", "")) for part in parts]
