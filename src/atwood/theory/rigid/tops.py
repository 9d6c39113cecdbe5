"""The heavy symmetric top: the cubic of its nutation, its four motions, steady precession, and the sleeping top."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import ARRAY, check, takes, takes_names
from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.sheet import FormulaSheet, statements_of
from atwood.theory.reduction.reduced import reduced
from atwood.theory.rigid.bodies import principal_body
from atwood.theory.rigid.free import integrated

_NEAR = 1e-7
"""Of u: roots of F that are as near are one, since rounding splits a double root by its square root."""

_SPLIT = 1e-5
"""Of u: imaginary parts that the rounding of an energy, which is mostly that of the spin, gives a double root."""

_FITS = 1e-9
"""Relative to the effective potential: how well that of a scene must be that of a top."""


@takes_names
def top_formulas(*, symbols: Mapping[str, str] | None = None) -> FormulaSheet:
    """Return the formulas of a heavy symmetric top with a fixed tip, in letters (Goldstein, section 5.7).

    ``I_1`` is about the tip, l the distance of the centre of mass from it, and ``u = cos(theta)``.

    Parameters
    ----------
    symbols
        Other letters.

    Returns
    -------
    FormulaSheet
        ``energy``, the momenta ``p_phi`` and ``p_psi``, the rates ``phi`` and ``psi``, ``F`` with ``u'^2 = F(u)``,
        ``steady``: the condition for the u of a steady precession at given momenta, with its rates ``slow`` and
        ``fast``, ``nutation``: the frequency of small deviations from it; ``sleeping``: when the upright top is stable,
        with ``sleeping_frequencies`` and ``sleeping_growth``.
    """
    found = FormulaSheet("Heavy symmetric top", statements_of(_TOP))
    return found.in_letters(check(SYMBOLS, symbols, "symbols"))


_TOP = """
energy | Energy | E | I_1*theta'**2/2 + (p_phi - p_psi*cos(theta(t)))**2/(2*I_1*sin(theta(t))**2) + p_psi**2/(2*I_3) + m*g*l*cos(theta(t))
p_phi | Momenta | p_phi | I_1*phi'*sin(theta(t))**2 + p_psi*cos(theta(t))
p_psi | and | p_psi | I_3*(psi' + phi'*cos(theta(t)))
phi | Precession | phi' | (p_phi - p_psi*cos(theta(t)))/(I_1*sin(theta(t))**2)
psi | Spin | psi' | p_psi/I_3 - cos(theta(t))*(p_phi - p_psi*cos(theta(t)))/(I_1*sin(theta(t))**2)
F | Nutation, with u the cosine of theta | u'**2 | (1 - u**2)*(2*E - p_psi**2/I_3 - 2*m*g*l*u)/I_1 - (p_phi - p_psi*u)**2/I_1**2
steady | Steady precession | | (p_phi - p_psi*u)*(p_psi - p_phi*u) = I_1*m*g*l*(1 - u**2)**2
slow | at the slow rate | Omega_1 | (p_psi - sqrt(p_psi**2 - 4*I_1*m*g*l*u))/(2*I_1*u)
fast | or at the fast one | Omega_2 | (p_psi + sqrt(p_psi**2 - 4*I_1*m*g*l*u))/(2*I_1*u)
nutation | Small deviations from it at the rate Omega | nu**2 | (p_psi/I_1 - 2*Omega*u)**2 + Omega**2*(1 - u**2)
sleeping | The sleeping top is stable where | | p_psi**2 > 4*I_1*m*g*l
sleeping_frequencies | Its axis goes round at | nu_1; nu_2 | (p_psi - sqrt(p_psi**2 - 4*I_1*m*g*l))/(2*I_1); (p_psi + sqrt(p_psi**2 - 4*I_1*m*g*l))/(2*I_1)
sleeping_growth | else deviations grow at | gamma | sqrt(4*I_1*m*g*l - p_psi**2)/(2*I_1)
"""  # noqa: E501


@dataclass(frozen=True, eq=False)
class SymmetricTop:
    """A motion of a heavy symmetric top, by its constants.

    Attributes
    ----------
    across
        Moment of inertia across its axis about the tip, I_1, kg m^2.
    along
        Moment of inertia about its axis, I_3, kg m^2.
    weight
        m g l, J.
    p_phi
        Angular momentum about the vertical, kg m^2/s.
    p_psi
        Angular momentum about its axis, kg m^2/s.
    energy
        Kinetic and potential energy, J.
    name
        What it is called.
    """

    across: float
    along: float
    weight: float
    p_phi: float
    p_psi: float
    energy: float
    name: str = "top"

    @property
    def formulas(self) -> FormulaSheet:
        """The formulas, with these constants."""
        made = top_formulas()
        values = (self.across, self.along, self.p_phi, self.p_psi, self.energy)
        return FormulaSheet(
            made.title, made.statements, dict(zip(("I_1", "I_3", "p_phi", "p_psi", "E"), values, strict=True))
        )

    @cached_property
    def _cubic(self) -> FloatArray:
        """The coefficients of F, that of u^3 first."""
        a, b = self.p_psi / self.across, self.p_phi / self.across
        free, beta = (2.0 * self.energy - self.p_psi**2 / self.along) / self.across, 2.0 * self.weight / self.across
        return np.array([beta, -free - a * a, 2.0 * a * b - beta, free - b * b])

    def f(self, u: FloatArray) -> FloatArray:
        """Return ``F(u) = u'^2``, 1/s^2."""
        return np.asarray(np.polyval(self._cubic, u))

    @cached_property
    def roots(self) -> FloatArray:
        """The real roots of F, rising: its axis swings between the first two, which are from -1 to 1."""
        found = np.roots(self._cubic)
        if np.max(np.abs(found.imag)) > _SPLIT:
            raise UsageError(
                "no motion has these constants: its energy is below that of steady precession",
                where=self.name,
                advice=f"Give it more; with these momenta it precesses steadily at u = {self.steady:.6g}.",
            )
        return np.sort(found.real)

    @property
    def kind(self) -> str:
        """Which of the motions it is: ``"steady"``, ``"loops"``, ``"cusps"`` or ``"waves"`` (Goldstein, figure 5.9).

        Its axis turns back where ``p_phi = p_psi u``: between the circles there are loops, on the upper one cusps.
        """
        low, high = self.roots[:2]
        if high - low <= 2.0 * _NEAR:
            return "steady"
        back = self.p_phi / self.p_psi if self.p_psi else np.inf * np.sign(self.p_phi)
        if min(abs(back - low), abs(back - high)) <= _NEAR:
            return "cusps"
        return "loops" if low < back < high else "waves"

    @cached_property
    def _swing(self) -> tuple[float, float]:
        """Rate of Jacobi's functions, and their parameter ``k^2``, of ``u = u_1 + (u_2 - u_1) sn^2``."""
        low, high, beyond = self.roots
        return float(np.sqrt(0.25 * self._cubic[0] * (beyond - low))), float((high - low) / (beyond - low))

    @property
    def period(self) -> float:
        """Period of the nutation, s."""
        rate, square = self._swing
        return 2.0 * float(scipy.special.ellipk(square)) / rate

    def angles(self, times: Any) -> FloatArray:
        """Return theta, phi and psi at times, which rise, shape (3, times); at 0 it is highest, phi and psi are 0.

        The height is in Jacobi's functions, phi and psi are quadratures of their rates.
        """
        t = np.atleast_1d(check(ARRAY, times, "times", "angles"))
        (low, high), (rate, square) = self.roots[:2], self._swing

        def height(s: FloatArray) -> FloatArray:
            sn = scipy.special.ellipj(rate * (s + 0.5 * self.period), square)[0]
            return np.asarray(low + (high - low) * sn**2)

        def around(s: FloatArray) -> FloatArray:
            u = height(s)
            return (self.p_phi - self.p_psi * u) / (self.across * (1.0 - u**2))

        def spin(s: FloatArray) -> FloatArray:
            return self.p_psi / self.along - height(s) * around(s)

        return np.stack([np.arccos(height(t)), integrated(around, 0.0, t), integrated(spin, 0.0, t)])

    @property
    def steady(self) -> float:
        """The u of steady precession with these momenta, where the potential is least; 1 of a sleeping top."""
        a, b, w = self.p_psi, self.p_phi, self.across * self.weight
        found = np.roots([w, 0.0, -(a * b) - 2.0 * w, a * a + b * b, w - a * b])
        inside = found.real[(np.abs(found.imag) <= _NEAR) & (np.abs(found.real) < 1.0)]
        return float(
            min(inside, key=lambda u: (b - a * u) ** 2 / (2.0 * self.across * (1.0 - u * u)) + self.weight * u)
        )

    @property
    def is_stable_upright(self) -> bool:
        """Whether it would sleep: stand upright with its spin, stably."""
        return self.p_psi**2 > 4.0 * self.across * self.weight

    def __repr__(self) -> str:
        return f"<SymmetricTop {self.name}: {self.kind} between u = {self.roots[0]:.6g} and {self.roots[1]:.6g}>"


@takes(scene=SCENE)
def symmetric_top(scene: Model | Assembly) -> SymmetricTop:
    """Return the motion of a heavy symmetric top from the start of a scene, by its constants.

    Parameters
    ----------
    scene
        A scene with one rigid body that turns about a fixed point of its axis of symmetry, which is z.

    Raises
    ------
    UnsupportedError
        If its effective potential is not that of a top, with what is left over.
    """
    motion = reduced(scene)
    where, angle = motion.scene, motion.coordinate
    named = {path.rpartition(".")[2]: value for path, value in motion.momenta.items()}
    if set(named) != {"phi", "psi"} or not angle.endswith("theta"):
        told = f"it has {angle} with the momenta of {', '.join(motion.momenta) or 'nothing'}"
        raise UnsupportedError(f"it is no top on a fixed tip: {told}", where=where, advice="See `reduced`.")
    along = float(principal_body(smooth_assembly_of(scene)).moments[2])
    theta = np.linspace(0.2, 2.9, 12)
    at = motion.radial.at(theta)
    one, two, u = named["phi"], named["psi"], np.cos(theta)
    rest = at.potential - (one - two * u) ** 2 / (2.0 * at.inertia * (1.0 - u**2)) - two**2 / (2.0 * along)
    weight = float(u @ rest / (u @ u))
    left = float(np.max(np.abs(rest - weight * u))) / float(np.max(np.abs(at.potential)))
    if left > _FITS or np.ptp(at.inertia) > _FITS * at.inertia[0]:
        told = f"{left:.2g} of its effective potential is left over"
        raise UnsupportedError(f"it is no symmetric top on a fixed tip: {told}", where=where, advice="See `reduced`.")
    return SymmetricTop(float(at.inertia[0]), along, weight, one, two, motion.energy, where)
