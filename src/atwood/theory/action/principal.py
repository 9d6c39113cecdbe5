"""Hamilton's principal function as a formula, where H is of second degree in coordinates and momenta.

Motions are then linear in their start, ``z = z* + A(t) (z_0 - z*) + c(t)``. Solved for the momenta at both ends, that
is the gradient of S: ``dS/dq = p`` and ``dS/dq_0 = -p_0`` (Landau and Lifshitz, Mechanics, section 43). What depends on
time alone follows from the equation of Hamilton and Jacobi, in which S is then proven.
"""

from __future__ import annotations

from atwood.arguments import takes
from atwood.errors import UnsupportedError
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.reading import text_of
from atwood.theory.hamiltonian.flow import flow_of
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian
from atwood.theory.hamiltonian.phase_space import HAMILTONIAN, phase_space_of, vanishes
from atwood.theory.hamiltonian.tidied import tidied


@dataclass(frozen=True, eq=False)
class PrincipalFunction(Described):
    """Hamilton's principal function: the action of the motion that leads from one place to another in a time t.

    Attributes
    ----------
    coordinates, starts
        Symbols of the coordinates at the end and at the start.
    expression
        S of both and of t.
    momenta
        The momenta at the end, ``dS/dq``.
    initial_momenta
        Those at the start, ``-dS/dq_0``.
    verdict
        Whether ``dS/dt + H = 0`` at both ends, in words.
    """

    coordinates: tuple[Sympy, ...]
    starts: tuple[Sympy, ...]
    expression: Sympy
    momenta: dict[Sympy, Sympy]
    initial_momenta: dict[Sympy, Sympy]
    verdict: str

    def __repr__(self) -> str:
        return f"<PrincipalFunction S = {text_of(self.expression)}; dS/dt + H = 0 is {self.verdict}>"


@takes(hamiltonian=HAMILTONIAN)
def principal_function(hamiltonian: Hamiltonian) -> PrincipalFunction:
    """Return Hamilton's principal function of a free particle, a uniform field, oscillators: of linear motions.

    Parameters
    ----------
    hamiltonian
        What `atwood.hamiltonian` returns.

    Raises
    ------
    UnsupportedError
        If H depends on time or is not of second degree, which names the terms that are left over; or the coordinates
        at the end do not determine the momenta at the start.
    """
    space, t = phase_space_of(hamiltonian), sympy.Symbol("t")
    h, own = space.read(hamiltonian.expression), (*space.coordinates, *space.momenta)
    names = tuple(sympy.Symbol(str(one.func)) for one in hamiltonian.coordinates)
    n, starts = len(names), tuple(sympy.Symbol(f"{one}_0") for one in names)
    far = [one for one in sympy.Add.make_args(sympy.expand(h)) if not _is_quadratic(one, own)]
    if far or hamiltonian.depends_on_time or hamiltonian.other_forces:
        told = f"{text_of(space.shown(sympy.Add(*far)))} is left over" if far else hamiltonian.sentence
        raise UnsupportedError(
            f"its motions are not linear in their start: {told}",
            where=hamiltonian.name,
            advice="`action` and `boundary_value_motions` have S in numbers.",
        )
    flow = flow_of(hamiltonian.expression, hamiltonian, t)
    moved = sympy.Matrix([space.read(one) for one in (*flow.coordinates, *flow.momenta)])
    still = dict.fromkeys(own, sympy.Integer(0))
    lead, rest = moved.jacobian(own), moved.xreplace(still)
    into = lead[:n, n:]
    if tidied(into.det(method="berkowitz")) == 0:
        raise UnsupportedError("the ends of its motions do not determine their momenta", where=hamiltonian.name)
    found = list(sympy.linsolve([h.diff(one) for one in own], own))
    rests = [one.xreplace(still) for one in found[0]] if found else [sympy.Integer(0)] * (2 * n)
    where = dict(zip(own, rests, strict=True))
    rest = rest - (sympy.Matrix(rests) - lead * sympy.Matrix(rests)) if found else rest
    rest = rest.applyfunc(lambda one: sympy.Integer(0) if vanishes([one]).proven else one)
    end, begin = (sympy.Matrix([x - q for x, q in zip(at, rests, strict=False)]) for at in (names, starts))
    back = into.inv(method="ADJ").applyfunc(tidied)
    first, first_own = back * (end - lead[:n, :n] * begin), -back * rest[:n, :]
    last = lead[n:, :n] * begin + lead[n:, n:] * first
    last_own = (lead[n:, n:] * first_own + rest[n:, :]).applyfunc(tidied)
    pushed = {p: p_rest + c for p, p_rest, c in zip(own[n:], rests[n:], last_own, strict=True)}
    rate = -tidied(h.xreplace({**where, **pushed}))
    own_time = sympy.integrate(rate, t) if rate.is_polynomial(t) else sympy.Integral(rate, t)
    halves = (last.T * end - first.T * begin)[0, 0] / 2 + (last_own.T * end - first_own.T * begin)[0, 0]
    whole = halves + (sympy.Matrix(rests[n:]).T * (end - begin))[0, 0]
    ends = [*names, *starts]
    terms = sympy.Poly(whole, *ends).terms()
    s = sympy.Add(*(tidied(c) * sympy.Mul(*map(sympy.Pow, ends, powers)) for powers, c in terms), own_time)
    at_end, at_start = (
        {sympy.Symbol(f"p_{q}"): sign * s.diff(q) for q in at} for sign, at in ((1, names), (-1, starts))
    )
    pairs = ((names, at_end), (starts, at_start))
    off = [s.diff(t) + h.xreplace(dict(zip(own, (*at, *p.values()), strict=True))) for at, p in pairs]
    verdict = vanishes(off)
    assert verdict.holds
    return PrincipalFunction(names, starts, s, at_end, at_start, verdict.sentence)


def _is_quadratic(term: Sympy, own: tuple[Sympy, ...]) -> bool:
    """Return whether a term is of second degree at most."""
    return bool(term.is_polynomial(*own) and sympy.Poly(term, *own).total_degree() <= 2)
