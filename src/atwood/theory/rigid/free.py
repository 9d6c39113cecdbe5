"""A body that turns freely: Jacobi's functions, Poinsot's curves, and small deviations from steady rotation.

Euler's equations without torque keep ``2 E = sum I w^2`` and ``L^2 = sum I^2 w^2`` (Landau and Lifshitz, Mechanics,
section 37). The herpolhode is the way of the angular velocity in the plane square to L, on which the ellipsoid of
inertia rolls (Goldstein, section 5.6).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import ARRAY, TEXT, check, each, instance, number, one_of, optional, takes, takes_names
from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.model.compose.composite import Model
from atwood.pipeline import smooth_assembly_of
from atwood.result.work import integral_in_steps, nodes_between
from atwood.simulation.initialization.start import find_start
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.sheet import FormulaSheet, statements_of
from atwood.theory.rigid.bodies import check_free, principal_body

_KINDS = ("asymmetric", "separatrix", "symmetric", "steady")

_SAME = 1e-12
"""Relative: moments of inertia, or L^2 and 2 E I, that differ by less are one."""

_NODES = 12
"""Of Gauss between two times, where a rate is integrated."""


@takes_names
def free_body(kind: str = "asymmetric", *, symbols: Mapping[str, str] | None = None) -> FormulaSheet:
    """Return the formulas of a body that turns freely, in letters.

    Parameters
    ----------
    kind
        ``"asymmetric"``: with ``I_1 < I_2 < I_3`` and ``L^2 > 2 E I_2`` (else 1 and 3 change places): ellipsoids,
        polhode, the motion in Jacobi's functions sn(tau, k), cn, dn, and the herpolhode in polar coordinates rho and
        chi. ``"separatrix"``: the same with ``L^2 = 2 E I_2``. ``"symmetric"``: with ``I_1 = I_2``. ``"steady"``:
        small deviations from rotation at Omega about each of the principal axes.
    symbols
        Other letters.
    """
    made = check(one_of(_KINDS), kind, "kind")
    lines = _POINSOT + _MOTION[made] if made in _MOTION else {"symmetric": _SYMMETRIC, "steady": _STEADY}[made]
    return FormulaSheet(f"Free body: {made}", statements_of(lines)).in_letters(check(SYMBOLS, symbols, "symbols"))


_POINSOT = """
ellipsoid | Ellipsoid of inertia | | I_1*x**2 + I_2*y**2 + I_3*z**2 = 1
energy | Ellipsoid of the energy | | L_1**2/I_1 + L_2**2/I_2 + L_3**2/I_3 = 2*E
sphere | Sphere of the angular momentum | | L_1**2 + L_2**2 + L_3**2 = L**2
polhode_1 | Polhode along 1: an ellipse | | I_2*(I_2-I_1)*omega_2(t)**2 + I_3*(I_3-I_1)*omega_3(t)**2 = L**2 - 2*E*I_1
polhode_2 | along 2: a hyperbola | | I_3*(I_3-I_2)*omega_3(t)**2 - I_1*(I_2-I_1)*omega_1(t)**2 = L**2 - 2*E*I_2
polhode_3 | along 3: an ellipse | | I_1*(I_3-I_1)*omega_1(t)**2 + I_2*(I_3-I_2)*omega_2(t)**2 = 2*E*I_3 - L**2
rho | Herpolhode: distance from L | rho**2 | omega_1(t)**2 + omega_2(t)**2 + omega_3(t)**2 - 4*E**2/L**2
"""

_MOTION = {
    "asymmetric": """
chi | and rate of its angle | chi' | 2*E/L + (2*E*I_1-L**2)*(2*E*I_2-L**2)*(2*E*I_3-L**2)/(I_1*I_2*I_3*L**3*rho**2)
omega_1 | Angular velocity along the principal axes | omega_1(t) | sqrt((2*E*I_3-L**2)/(I_1*(I_3-I_1)))*cn(tau, k)
omega_2 | where sn, cn, dn are Jacobi's functions | omega_2(t) | sqrt((2*E*I_3-L**2)/(I_2*(I_3-I_2)))*sn(tau, k)
omega_3 | and | omega_3(t) | sqrt((L**2-2*E*I_1)/(I_3*(I_3-I_1)))*dn(tau, k)
tau | of the time | tau | sqrt((I_3-I_2)*(L**2-2*E*I_1)/(I_1*I_2*I_3))*(t - t_0)
k | and of the modulus | k**2 | (I_2-I_1)*(2*E*I_3-L**2)/((I_3-I_2)*(L**2-2*E*I_1))
period | Period in the body | T | 4*K(k)*sqrt(I_1*I_2*I_3/((I_3-I_2)*(L**2-2*E*I_1)))
""",
    "separatrix": """
separatrix | The separatrix | | L**2 = 2*E*I_2
chi | and rate of its angle | chi' | 2*E/L
omega_1 | Angular velocity along the principal axes | omega_1(t) | omega_0*sqrt(I_2*(I_3-I_2)/(I_1*(I_3-I_1)))*sech(tau)
omega_2 | about the middle axis | omega_2(t) | omega_0*tanh(tau)
omega_3 | and about the last | omega_3(t) | omega_0*sqrt(I_2*(I_2-I_1)/(I_3*(I_3-I_1)))*sech(tau)
tau | of the time | tau | omega_0*sqrt((I_2-I_1)*(I_3-I_2)/(I_1*I_3))*(t - t_0)
omega_0 | Angular velocity at the ends | omega_0**2 | 2*E/I_2
""",
}

_SYMMETRIC = """
nu | Rate of the angular velocity in the body | nu | (I_3 - I_1)*omega_3/I_1
omega | Angular velocity | omega_1(t); omega_2(t) | omega_s*cos(nu*t + alpha); omega_s*sin(nu*t + alpha)
phi | Precession of the axis about L | phi' | I_3*omega_3/(I_1*cos(theta))
phi_L | the same, from L | phi' | L/I_1
psi | Spin about the axis | psi' | -nu
theta | Angle of the axis from L | tan(theta) | I_1*omega_s/(I_3*omega_3)
body_cone | Angle of the angular velocity from the axis | tan(beta) | omega_s/omega_3
"""

_STEADY = "".join(
    f"""
stable_{k} | Rotation about axis {k} is stable where | | (I_{k} - I_{i})*(I_{k} - I_{j}) > 0
frequency_{k} | and deviations go round at | nu_{k} | Omega*sqrt((I_{k} - I_{i})*(I_{k} - I_{j})/(I_{i}*I_{j}))
growth_{k} | else they grow at | gamma_{k} | Omega*sqrt((I_{k} - I_{i})*(I_{j} - I_{k})/(I_{i}*I_{j}))"""
    for k, i, j in ((1, 2, 3), (2, 1, 3), (3, 1, 2))
)


@dataclass(frozen=True, eq=False)
class FreeRotation:
    """The motion of a body that turns freely, in closed form.

    Attributes
    ----------
    moments
        Principal moments of inertia, kg m^2.
    spin
        Angular velocity along the principal axes at the start, rad/s.
    t_start
        Time of the start, s.
    name
        Of the body.
    """

    moments: FloatArray
    spin: FloatArray
    t_start: float = 0.0
    name: str = "body"

    @property
    def energy(self) -> float:
        """Energy of turning, J."""
        return 0.5 * float(self.moments @ self.spin**2)

    @property
    def momentum(self) -> float:
        """Size of the angular momentum, kg m^2/s."""
        return float(np.linalg.norm(self.moments * self.spin))

    @cached_property
    def _order(self) -> tuple[list[int], float]:
        """The axes in the order of the formulas, and -1 where that is left-handed: then the spin counts backwards."""
        order = [int(k) for k in np.argsort(self.moments, kind="stable")]
        (i1, i2, i3), w = self.moments[order], self.spin[order]
        excess = i3 * (i3 - i2) * w[2] ** 2 - i1 * (i2 - i1) * w[0] ** 2
        if excess < 0.0 or (excess == 0.0 and i3 == i2):
            order = order[::-1]
        return order, float(np.round(np.linalg.det(np.eye(3)[order])))

    @cached_property
    def _jacobi(self) -> tuple[FloatArray, float, float, float]:
        """Amplitudes, rate and parameter ``k^2`` of Jacobi's functions, and their argument at the start."""
        order, sense = self._order
        (i1, i2, i3), w = self.moments[order], sense * self.spin[order]
        high = (
            i1 * (i3 - i1) * w[0] ** 2 + i2 * (i3 - i2) * w[1] ** 2
        )  # 2 E I_3 - L^2, and so on, where nothing cancels
        low = i2 * (i2 - i1) * w[1] ** 2 + i3 * (i3 - i1) * w[2] ** 2
        rate = float(np.sqrt((i3 - i2) * low / (i1 * i2 * i3)))
        k2 = float((i2 - i1) * high / ((i3 - i2) * low))
        k2 = 1.0 if k2 >= 1.0 - _SAME else k2  # the separatrix, as near as numbers tell
        first = float(np.sqrt(high / (i1 * (i3 - i1))))
        third = float(np.copysign(np.sqrt(low / (i3 * (i3 - i1))), w[2]))
        sizes = np.array([first, (i3 - i1) * first * third / (i2 * rate), third])
        begin = float(scipy.special.ellipkinc(np.arctan2(w[1] / sizes[1], w[0] / sizes[0]), k2))
        return sizes, rate, k2, begin

    @cached_property
    def kind(self) -> str:
        """What motion it is: ``"steady"``, ``"symmetric"``, ``"asymmetric"``, or ``"separatrix"``."""
        i, w = self.moments, self.spin
        rates = np.array([(i[1] - i[2]) * w[1] * w[2], (i[2] - i[0]) * w[2] * w[0], (i[0] - i[1]) * w[0] * w[1]])
        if np.max(np.abs(rates)) <= _SAME * np.max(i) * float(w @ w):
            return "steady"
        low, middle, high = np.sort(i)
        if min(middle - low, high - middle) <= _SAME * high:
            return "symmetric"
        return "separatrix" if self._jacobi[2] == 1.0 else "asymmetric"

    @property
    def modulus(self) -> float:
        """The modulus k of Jacobi's functions; zero of a symmetric body."""
        return 0.0 if self.kind == "steady" else float(np.sqrt(self._jacobi[2]))

    @property
    def period(self) -> float:
        """Period of the angular velocity in the body, s; infinite on the separatrix, zero where it rests."""
        if self.kind in ("steady", "separatrix"):
            return 0.0 if self.kind == "steady" else float(np.inf)
        return 4.0 * float(scipy.special.ellipk(self._jacobi[2])) / self._jacobi[1]

    @property
    def formulas(self) -> FormulaSheet:
        """The formulas of this kind of motion; those of an asymmetric body are for axes in the order of its moments."""
        return free_body(self.kind)

    def at(self, times: Any) -> FloatArray:
        """Return the angular velocity along the principal axes at times, rad/s, shape (3, times)."""
        t = np.atleast_1d(check(ARRAY, times, "times", "at")) - self.t_start
        if self.kind == "steady":
            return np.repeat(self.spin[:, None], len(t), axis=1)
        (order, sense), (sizes, rate, k2, begin) = self._order, self._jacobi
        sn, cn, dn, _ = scipy.special.ellipj(rate * t + begin, k2)
        found = np.empty((3, len(t)))
        found[order] = sense * sizes[:, None] * np.stack([cn, sn, dn])
        return found

    def herpolhode(self, times: Any) -> tuple[FloatArray, FloatArray]:
        """Return distance, rad/s, and angle of the angular velocity in the plane square to L at times, which rise."""
        t = np.atleast_1d(check(ARRAY, times, "times", "herpolhode"))
        return self._distance(self.at(t)), integrated(lambda s: self._rate_of_angle(self.at(s)), self.t_start, t)

    def orientation(self, times: Any) -> FloatArray:
        """Return the matrices from the principal axes to axes at rest at times, which rise, shape (times, 3, 3).

        Of those at rest the third is along L, and at the start the angular velocity is between it and the first.
        """
        rho, angle = self.herpolhode(times)
        w = self.at(times)
        along = self.moments[:, None] * w / self.momentum
        across = np.where(rho > _SAME * np.linalg.norm(w, axis=0), w - along * np.sum(along * w, axis=0), self._aside)
        across = across / np.linalg.norm(across, axis=0)
        body = np.stack([across, np.cross(along, across, axis=0), along])
        c, s, zero = np.cos(angle), np.sin(angle), np.zeros_like(angle)
        space = np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]])
        return np.asarray(np.einsum("ijt,jkt->tik", space, body))

    @property
    def _aside(self) -> FloatArray:
        """A direction in the body square to L at the start, as a column."""
        along = self.moments * self.spin
        return np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])[:, None]

    def _distance(self, w: FloatArray) -> FloatArray:
        """Return the distance from the foot of L, as the size of the part of the spin square to it."""
        unit = (self.moments[:, None] * w) / self.momentum
        return np.asarray(np.linalg.norm(w - unit * np.sum(unit * w, axis=0), axis=0))

    def _rate_of_angle(self, w: FloatArray) -> FloatArray:
        product = float(np.prod(2.0 * self.energy * self.moments - self.momentum**2))
        square = np.maximum(self._distance(w) ** 2, 1e-300)
        rates = 2.0 * self.energy / self.momentum + product / (np.prod(self.moments) * self.momentum**3 * square)
        return np.asarray(rates)


def integrated(rate: Callable[[FloatArray], FloatArray], start: float, times: FloatArray) -> FloatArray:
    """Return the integral of a rate from a start to times, which rise, by Gauss's nodes between them."""
    ends = np.r_[start, times]
    rates = rate(nodes_between(ends, _NODES)).reshape(-1, _NODES)
    return integral_in_steps(ends, rates)[0][1:]


_TRIPLE = each(number(), "three numbers", 3, single=False)


@takes(
    scene=optional(instance("a scene, or an assembly of one", Model, Assembly)),
    body=optional(TEXT),
    moments=optional(_TRIPLE),
    spin=optional(_TRIPLE),
)
def free_rotation(
    scene: Model | Assembly | None = None,
    body: str | None = None,
    *,
    moments: tuple[float, float, float] | None = None,
    spin: tuple[float, float, float] | None = None,
) -> FreeRotation:
    """Return the motion of a body that turns freely in closed form: of a scene from its start, or of numbers.

    Parameters
    ----------
    scene
        A scene in space.
    body
        Path of a part that is a rigid body; the only one if not given.
    moments
        Principal moments of inertia, kg m^2, in place of a scene.
    spin
        Angular velocity along the principal axes at the start, rad/s; that of the scene's start if not given.

    Raises
    ------
    UnsupportedError
        If a torque about the centre of mass acts on the body, or it has no inertia about an axis.
    """
    if (scene is None) == (moments is None):
        raise UsageError("a body is needed", where="free_rotation", advice="Give a scene, or moments and spin.")
    if scene is None:
        if spin is None or min(moments or ()) <= 0.0:
            raise UsageError("its moments and its spin do not say a motion", where="free_rotation", advice="Give both.")
        return FreeRotation(np.array(moments), np.array(spin))
    assembly = smooth_assembly_of(scene)
    own = principal_body(assembly, body)
    if np.min(own.moments) <= _SAME * np.max(own.moments):
        told = "its moments of inertia are {:.6g}, {:.6g} and {:.6g} kg m^2, and a motion needs three".format(
            *own.moments
        )
        raise UnsupportedError(told, where=own.part, advice="Name a rigid body with mass.")
    check_free(assembly, own.part)
    began = own.spin if spin is None else np.array(spin)
    return FreeRotation(own.moments, began, find_start(assembly).time, own.part)
