"""What formulas in one line have in common, whatever their letters: signs of sums, one stroke for what is below."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction

from atwood.theory.formulas.tree import Node, Number, Term


def signed_sum(terms: Iterable[Term], written: Callable[[Term], str]) -> str:
    """Return terms, written without their signs, with the signs between them; nothing if there are none."""
    text = ""
    for term in terms:
        minus = term.number < 0
        if text:
            text += f" {'-' if minus else '+'} {written(term)}"
        else:
            text = f"-{written(term)}" if minus else written(term)
    return text


def quotient(term: Term, number: Callable[[Number], str], power: Callable[[Node, Fraction], str], *, times: str) -> str:
    """Return a term without its sign: its number, powers above, and powers below behind one stroke."""
    above = [power(node, exponent) for node, exponent in term.factors if exponent > 0]
    below = [power(node, -exponent) for node, exponent in term.factors if exponent < 0]
    head = [] if abs(term.number) == 1 and above else [number(term.number)]
    text = times.join((*head, *above))
    if not below:
        return text
    return f"{text} / {below[0]}" if len(below) == 1 else f"{text} / ({times.join(below)})"
