"""Normal forms of polynomials in sines and cosines."""

from __future__ import annotations

from atwood.expr.simplify.polynomial import (
    ONE,
    Atom,
    Expansion,
    Monomial,
    Polynomial,
    TooLargeError,
    Wave,
    add_coefficient,
    canonical_wave,
    multiply_monomials,
)

_LARGEST_DEGREE = 8


def join_squares(expansion: Expansion, polynomial: Polynomial) -> Polynomial:
    """Return a polynomial in which ``s^2`` next to ``c^2`` is replaced by ``1 - c^2``.

    Only squares that have their partner in the polynomial are replaced: a lone small ``s^2`` would lose digits.
    """
    result = {monomial: dict(coefficient) for monomial, coefficient in polynomial.items()}
    changed = True
    while changed:
        changed = False
        for monomial in sorted(result):
            partner = _partner_of_square(expansion, monomial, result)
            if partner is not None:
                rest, cosine = partner
                coefficient = result.pop(monomial)
                add_coefficient(result, rest, coefficient)
                add_coefficient(result, cosine, coefficient, -1.0)
                changed = True
                break
    return result


def _partner_of_square(
    expansion: Expansion, monomial: Monomial, polynomial: Polynomial
) -> tuple[Monomial, Monomial] | None:
    """Return a monomial without one ``s^2``, and with ``c^2`` in its place if the polynomial has that one."""
    for number, exponent in monomial:
        atom = expansion.atoms[number]
        if atom.kind == "sin" and exponent >= 2:
            cosine = expansion.numbers.get(Atom("cos", atom.argument))
            if cosine is not None:
                rest = multiply_monomials(monomial, ((number, -2),))
                partner = multiply_monomials(rest, ((cosine, 2),))
                if partner in polynomial:
                    return rest, partner
    return None


def sum_of_waves(expansion: Expansion, polynomial: Polynomial, limit: int) -> Polynomial:
    """Return a polynomial with products of sines and cosines of angles written as sums.

    Every monomial of the result has at most one sine or cosine of a combination of angles, so that terms
    that are equal by trigonometry become equal terms.
    """
    result: Polynomial = {}
    for monomial, coefficient in polynomial.items():
        rest: list[tuple[int, int]] = []
        waves: dict[tuple[str, Wave], float] = {("cos", (0,) * len(expansion.angles)): 1.0}
        degree = 0
        for number, exponent in monomial:
            atom = expansion.atoms[number]
            if atom.kind not in ("sin", "cos") or not isinstance(atom.argument, tuple):
                rest.append((number, exponent))
                continue
            degree += exponent
            if degree > _LARGEST_DEGREE:
                raise TooLargeError
            for _ in range(exponent):
                waves = _times_wave(waves, atom.kind, atom.argument)
        for (kind, wave), factor in waves.items():
            extra: Monomial = ((expansion.number(Atom(kind, wave)), 1),) if any(wave) else ONE
            add_coefficient(result, multiply_monomials(tuple(rest), extra), coefficient, factor)
        if len(result) > 4 * limit:
            raise TooLargeError
    return result


def _times_wave(waves: dict[tuple[str, Wave], float], kind: str, wave: Wave) -> dict[tuple[str, Wave], float]:
    """Return a sum of sines and cosines times one more, by the product rules."""
    result: dict[tuple[str, Wave], float] = {}
    for (first, base), factor in waves.items():
        total = tuple(a + b for a, b in zip(base, wave, strict=True))
        difference = tuple(a - b for a, b in zip(base, wave, strict=True))
        made = "cos" if first == kind else "sin"
        if kind == "cos":
            signs = (1.0, 1.0)
        else:
            signs = (-1.0, 1.0) if first == "sin" else (1.0, -1.0)
        for sign, combined in zip(signs, (total, difference), strict=True):
            turn, canonical = canonical_wave(made, combined)
            if made == "sin" and not any(canonical):
                continue
            key = (made, canonical)
            result[key] = result.get(key, 0.0) + 0.5 * sign * turn * factor
    return {key: factor for key, factor in result.items() if factor}


def products_of_waves(expansion: Expansion, polynomial: Polynomial) -> Polynomial:
    """Return a sum of waves in which pairs that are one product are products again.

    This undoes :func:`sum_of_waves` where nothing was gained: ``cos(a - b) - cos(a + b)`` becomes
    ``2 sin(a) sin(b)``, and ``1 - cos(2 a)`` becomes ``2 sin(a)^2``.
    """
    result = {monomial: dict(coefficient) for monomial, coefficient in polynomial.items()}
    for monomial in sorted(polynomial):
        if monomial in result:
            _fold_pair(expansion, monomial, result)
    return result


def _fold_pair(expansion: Expansion, monomial: Monomial, result: Polynomial) -> None:
    """Replace one pair of waves by a product, in place, if the monomial is half of such a pair."""
    kind, wave, rest = _split_wave(expansion, monomial)
    if sum(map(abs, wave)) < 2:
        return
    for other in sorted(result):
        other_kind, other_wave, other_rest = _split_wave(expansion, other)
        if other == monomial or other_rest != rest or (any(other_wave) and other_kind != kind):
            continue
        if kind == "sin" and not any(other_wave):
            continue
        ratio = _ratio(result[other], result[monomial])
        sums = [a + b for a, b in zip(wave, other_wave, strict=True)]
        if ratio is None or any(count % 2 for count in sums) or sum(map(abs, other_wave)) > sum(map(abs, wave)):
            continue
        first = tuple(count // 2 for count in sums)
        second = tuple((a - b) // 2 for a, b in zip(wave, other_wave, strict=True))
        kinds = {("cos", 1): ("cos", "cos", 2.0), ("cos", -1): ("sin", "sin", -2.0)}
        kinds |= {("sin", 1): ("sin", "cos", 2.0), ("sin", -1): ("cos", "sin", 2.0)}
        left, right, factor = kinds[kind, ratio]
        coefficient = result.pop(monomial)
        del result[other]
        product = rest
        for part_kind, part in ((left, first), (right, second)):
            turn, canonical = canonical_wave(part_kind, part)
            factor *= turn
            if any(canonical):
                product = multiply_monomials(product, ((expansion.number(Atom(part_kind, canonical)), 1),))
        add_coefficient(result, product, coefficient, factor)
        return


def without_squares(expansion: Expansion, polynomial: Polynomial, kind: str, limit: int) -> Polynomial:
    """Return a polynomial without squares of sines, or of cosines: ``s^2 = 1 - c^2``.

    Of every polynomial in sines and cosines of the same angles there is one such form, so that all that cancels does.
    """
    other = "cos" if kind == "sin" else "sin"
    result: Polynomial = {}
    stack = list(polynomial.items())
    while stack:
        monomial, coefficient = stack.pop()
        for number, exponent in monomial:
            atom = expansion.atoms[number]
            if atom.kind == kind and exponent >= 2:
                rest = multiply_monomials(monomial, ((number, -2),))
                partner = multiply_monomials(rest, ((expansion.number(Atom(other, atom.argument)), 2),))
                expansion.spend(2 * len(coefficient))
                stack += [(rest, coefficient), (partner, {one: -value for one, value in coefficient.items()})]
                break
        else:
            add_coefficient(result, monomial, coefficient)
            if len(result) > 4 * limit:
                raise TooLargeError
    return result


def squares_of_waves(expansion: Expansion, polynomial: Polynomial) -> Polynomial:
    """Return a sum of waves in which those of twice an angle are squares and products: ``sin(2 a)`` is 2 sin(a) cos(a).

    ``p + q cos(2 a)`` becomes ``(p + q) cos(a)^2 + (p - q) sin(a)^2``, as moments of inertia are written.
    """
    result = {monomial: dict(coefficient) for monomial, coefficient in polynomial.items()}
    for monomial in sorted(polynomial):
        kind, wave, rest = _split_wave(expansion, monomial)
        if not any(wave) or any(count % 2 for count in wave):
            continue
        half = tuple(count // 2 for count in wave)
        cosine, sine = (expansion.number(Atom(one, half)) for one in ("cos", "sin"))
        coefficient = result.pop(monomial)
        if kind == "sin":
            both = multiply_monomials(((cosine, 1),), ((sine, 1),))
            add_coefficient(result, multiply_monomials(rest, both), coefficient, 2.0)
            continue
        level = result.pop(rest, {})
        for atom, sign in ((cosine, 1.0), (sine, -1.0)):
            square = multiply_monomials(rest, ((atom, 2),))
            add_coefficient(result, square, level)
            add_coefficient(result, square, coefficient, sign)
    return result


def _split_wave(expansion: Expansion, monomial: Monomial) -> tuple[str, Wave, Monomial]:
    """Return the wave of a monomial and the rest; the wave of zero where it has none or several."""
    for number, exponent in monomial:
        atom = expansion.atoms[number]
        if atom.kind in ("sin", "cos") and isinstance(atom.argument, tuple) and exponent == 1:
            return atom.kind, atom.argument, multiply_monomials(monomial, ((number, -1),))
    return "cos", (0,) * len(expansion.angles), monomial


def _ratio(a: dict[Monomial, float], b: dict[Monomial, float]) -> int | None:
    """Return 1 or -1 if a coefficient is plus or minus another, else None."""
    if a.keys() != b.keys():
        return None
    for ratio in (1, -1):
        if all(abs(value - ratio * b[key]) <= 1e-14 * abs(value) for key, value in a.items()):
            return ratio
    return None
