"""Elementary functions, written once: the same bits on every machine and in every language, at most 1 ulp off.

Each works on floats and, through the operators of other operands, writes a routine for one number or for lanes of
them (`atwood.codegen.functions`); `m` is the arithmetic.  Only operations that IEEE 754 rounds in one way occur, none
fused; no branch but `unless`, which hands arguments that are rare to a function of their own.  Kernels on reduced
arguments follow fdlibm (Sun Microsystems, 1993), which gives more accuracy than its callers keep: here remainders
stay beside all that is rounded (Dekker, Numerische Mathematik 18, 1971).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import Any, TypeAlias

from atwood.arrays import FloatArray

Operand: TypeAlias = Any
"""A float, or a number or lanes of a routine."""

Arithmetic: TypeAlias = Any
"""`FLOATS`, or a routine: what choices and words are made with."""

_ROUNDER = 1.5 * 2.0**52
"""Added to a number below 2^51, it leaves the nearest whole number in the low bits."""

_NEAR, _FAR, _LARGE = 0.785, 1e6, 700.0
_HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32)
"""Half a turn over two: three parts of 33 bits, whose products with whole numbers to 2^20 are exact, and the rest."""

_PI, _PI_REST = 3.141592653589793, 1.2246467991473532e-16
_QUARTER = (1.5707963267948966, 6.123233995736766e-17)
_LN2, _LN2_REST = 6.93147180369123816490e-01, 1.90821492927058770002e-10


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))


_SINE = _numbers(
    "-0.16666666666666632 0.00833333333332249 -0.0001984126982985795 2.7557313707070068e-06 "
    "-2.5050760253406863e-08 1.58969099521155e-10"
)
_COSINE = _numbers(
    "0.0416666666666666 -0.001388888888887411 2.480158728947673e-05 -2.7557314351390663e-07 "
    "2.087572321298175e-09 -1.1359647557788195e-11"
)
_EXP = _numbers(
    "0.5000000000000013 0.166666666666667 0.04166666666651493 0.008333333333307134 0.0013888888947155627 "
    "0.00019841269917540255 2.480148978619029e-05 2.7557216155561723e-06 2.7631339607011405e-07 "
    "2.5117908754320983e-08"
)
_LOG = _numbers(
    "0.6666666666666735 0.3999999999940942 0.2857142874366239 0.22222198432149784 0.1818357216161805 "
    "0.15313837699209373 0.14798198605116586"
)
_ARCSINE = _numbers(
    "0.16666666666666666 -0.3255658186224009 0.20121253213486293 -0.04005553450067941 "
    "0.0007915349942898145 3.479331075960212e-05"
)
_ARCSINE_BELOW = _numbers("1.0 -2.403394911734414 2.0209457602335057 -0.6882839716054533 0.07703815055590194")
_ARCTANGENT = _numbers(
    "0.33333333333333326 -0.19999999999996376 0.14285714284814474 -0.11111111001450195 0.09090901519755376 "
    "-0.07691991188875662 0.066584776069134 -0.05753453239848936 0.04114606921818777"
)
_SINH = _numbers(
    "0.16666666666666666 0.008333333333333333 0.0001984126984126959 2.755731922412024e-06 "
    "2.505210834564127e-08 1.605905070590505e-10 7.6464763583229e-13 2.8483983728870674e-15"
)
_TANH = _numbers("-1614.6876844170845 -99.28772310019185 -0.9643991794250523")
_TANH_BELOW = _numbers("4844.063053251255 2235.4883906010045 112.81167849163293 1.0")
_LOG2 = _numbers(
    "0.5999999999999946 0.4285714285785502 0.33333332981837743 0.272728123808534 0.23066074577556175 "
    "0.20697501780033842"
)
_TWO_BY_PI_DIGITS = (
    "a2f9836e4e441529fc2757d1f534ddc0db6295993c439041fe5163abdebbc561b7246e3a424dd2e006492eea09d1921cfe1d"
    "eb1cb129a73ee88235f52ebb4484e99c7026b45f7e413991d639835339f49c845f8bbdf9283b1ff897ffde05980fef2f118b"
    "5a0a6d1f6d367ecf27cb09b74f463f669e5fea2d7527bac7ebe5f17b3d0739f78a5292ea6bfb5fb11f8d5d0856033046fc7b"
)
_TWO_BY_PI = (0.0, 0.0, 0.0, *(float(int(_TWO_BY_PI_DIGITS[k : k + 6], 16)) for k in range(0, 300, 6)))
"""2 / pi in figures of 24 bits, behind three that are zero."""


class Floats:
    """The arithmetic of floats."""

    @staticmethod
    def high(a: float) -> int:
        """Return the first 32 bits."""
        found: int = struct.unpack(">I4x", struct.pack(">d", a))[0]
        return found

    @staticmethod
    def low(a: float) -> int:
        """Return the last 32 bits."""
        found: int = struct.unpack(">4xI", struct.pack(">d", a))[0]
        return found

    @staticmethod
    def of_words(high: int, low: int) -> float:
        """Return the number with these bits."""
        found: float = struct.unpack(">d", struct.pack(">II", high & 0xFFFFFFFF, low))[0]
        return found

    @staticmethod
    def choose(condition: bool, a: float, b: float) -> float:
        """Return the first value where a condition holds, and else the second."""
        return a if condition else b

    pick = choose

    @staticmethod
    def flip(turned: int, a: float) -> float:
        """Return a number, with the other sign where a word is 1 and not 0."""
        return -a if turned else a

    @staticmethod
    def sqrt(a: float) -> float:
        """Return the square root."""
        return math.sqrt(a) if a >= 0.0 else a - a if a == 0.0 else math.nan

    size = staticmethod(abs)

    @staticmethod
    def as_number(word: int) -> float:
        """Return a word as a number."""
        return float(word)

    @staticmethod
    def look_up(table: Sequence[float], position: int) -> float:
        """Return an element of a table."""
        return table[position]

    @staticmethod
    def either(word: int, a: Callable[[], float], b: Callable[[], float]) -> float:
        """Return what the first function gives where a word is 1, and the second where it is 0."""
        return a() if word else b()

    @staticmethod
    def shortcut(
        condition: bool, quick: Callable[[], tuple[float, ...]], usual: Callable[[], tuple[float, ...]]
    ) -> tuple[float, ...]:
        """Return what either function gives: they give the same where the condition holds, the first one sooner."""
        return quick() if condition else usual()

    def unless(
        self,
        usual: bool,
        values: Callable[[], tuple[float, ...]],
        otherwise: Callable[..., tuple[float, ...]],
        *given: float,
    ) -> tuple[float, ...]:
        """Return values where they are what is wanted, and otherwise those of a function by its name."""
        return values() if usual else otherwise(self, *given)


FLOATS = Floats()


def _polynomial(x: Operand, coefficients: Sequence[float]) -> Operand:
    """Return a polynomial, whose terms are added in pairs so that few wait for each other."""
    terms: list[Operand] = list(coefficients)
    while len(terms) > 1:
        pairs = [a + x * b for a, b in zip(terms[::2], terms[1::2], strict=False)]
        terms = pairs + terms[2 * len(pairs) :]
        x = x * x
    return terms[0]


def _horner(x: Operand, coefficients: Sequence[float]) -> Operand:
    total: Operand = coefficients[-1]
    for one in coefficients[-2::-1]:
        total = one + x * total
    return total


def _coarse(m: Arithmetic, a: Operand) -> Operand:
    """Return the first 21 bits of a number."""
    m = FLOATS if isinstance(a, float) else m  # constants
    return m.of_words(m.high(a), 0)


def _product(m: Arithmetic, a: Operand, b: Operand) -> tuple[Operand, Operand]:
    """Return a product, and what rounding took from it."""
    first, second = _coarse(m, a), _coarse(m, b)
    rest, other = a - first, b - second
    found = a * b
    return found, ((first * second - found) + (first * other + rest * second)) + rest * other


def _sum(a: Operand, b: Operand) -> tuple[Operand, Operand]:
    """Return a sum, and what rounding took from it."""
    found = a + b
    of_b = found - a
    return found, (a - (found - of_b)) + (b - of_b)


# -- angles -----------------------------------------------------------------------------------------------------------


def _reduced(m: Arithmetic, x: Operand) -> tuple[Operand, Operand, Operand]:
    """Return the number of quarter turns as a word, and what is left as a number and its rest."""
    shifted = x * 0.6366197723675814 + _ROUNDER
    k = shifted - _ROUNDER
    first, taken = x - k * _HALF_PI[0], k * _HALF_PI[1]
    second, more = first - taken, k * _HALF_PI[2]
    left = second - more
    missed = (taken - (first - second)) + (more - (second - left))
    missed = k * _HALF_PI[3] + missed
    found = left - missed
    return m.low(shifted), found, (left - found) - missed


def _reduced_far(m: Arithmetic, x: Operand) -> tuple[Operand, Operand, Operand]:
    """Do the same for any size (Payne and Hanek, ACM SIGNUM Newsletter 18, 1983), with figures of 24 bits."""
    sign, size = m.high(x) >> 31, m.size(x)
    exponent = (m.high(size) >> 20) - 1023  # 19 or more
    start = (exponent - 1) * 43691 >> 20  # a 24th, rounded down: figures before make whole turns
    left = m.of_words((m.high(size) & 0xFFFFF) + ((1023 + 23) << 20), m.low(size))
    figures = []
    for _ in range(3):
        whole = (left + _ROUNDER) - _ROUNDER
        figures.append(whole)
        left = (left - whole) * 2.0**24
    terms = []
    for k in range(8):
        one, two, three = (m.look_up(_TWO_BY_PI, start + (k + 2 - i)) for i in range(3))
        terms.append(figures[0] * one + figures[1] * two + figures[2] * three)
    for k in range(7, 0, -1):
        carried = (terms[k] * 2.0**-24 + _ROUNDER) - _ROUNDER
        terms[k], terms[k - 1] = terms[k] - carried * 2.0**24, terms[k - 1] + carried
    unit = m.of_words((exponent - start * 24 + 1000) << 20, 0)
    for k in range(8):
        terms[k] = terms[k] * unit * 2.0 ** (-24 * k)
    whole = (terms[0] * 0.25 + _ROUNDER) - _ROUNDER
    turned = (terms[0] - whole * 4.0) + terms[1]
    shifted = turned + _ROUNDER
    first, missed = _sum(turned - (shifted - _ROUNDER), terms[2] + terms[3])
    missed = missed + ((terms[4] + terms[5]) + (terms[6] + terms[7]))
    first, missed = _sum(first, missed)
    found, rest = _product(m, first, _QUARTER[0])
    found, rest = _sum(found, rest + (first * _QUARTER[1] + missed * _QUARTER[0]))
    none = x - x  # 0, but no number where there is no angle
    quarters = m.low(m.flip(sign, shifted - _ROUNDER) + _ROUNDER)
    return quarters, m.flip(sign, found) + none, m.flip(sign, rest)


def _sine(r: Operand, rest: Operand) -> tuple[Operand, Operand]:
    """Return the sine of what is left of an angle, as a number less a small one."""
    z = r * r
    w, v = z * z, z * r
    s = (_SINE[1] + z * (_SINE[2] + z * _SINE[3])) + z * w * (_SINE[4] + z * _SINE[5])
    if rest is None:
        return r, z * (0.0 - v * s) - v * _SINE[0]
    return r, (z * (0.5 * rest - v * s) - rest) - v * _SINE[0]


def _cosine(r: Operand, rest: Operand) -> tuple[Operand, Operand]:
    """Return the cosine of what is left of an angle, as a number less a small one."""
    z = r * r
    w = z * z
    c = z * (_COSINE[0] + z * (_COSINE[1] + z * _COSINE[2])) + w * w * (_COSINE[3] + z * (_COSINE[4] + z * _COSINE[5]))
    half = 0.5 * z
    one = 1.0 - half
    return one, (half - (1.0 - one)) - (z * c if rest is None else z * c - r * rest)


def _near(m: Arithmetic, x: Operand) -> tuple[Operand, Operand]:
    s, c = _sine(x, None), _cosine(x, None)
    return s[0] - s[1], c[0] - c[1]


def _wave_of(m: Arithmetic, reduced: tuple[Operand, Operand, Operand], turned: int) -> tuple[Operand]:
    """Return the sine of an angle, or of one so many quarter turns on: alone, it needs one of two polynomials."""
    quarters, *r = reduced
    quarters = quarters + turned
    found = m.either(quarters & 1, *(lambda wave=wave: (lambda a, b: a - b)(*wave(*r)) for wave in (_cosine, _sine)))
    return (m.flip((quarters >> 1) & 1, found),)


def _sin_cos_of(m: Arithmetic, reduced: tuple[Operand, Operand, Operand]) -> tuple[Operand, Operand]:
    quarters, *r = reduced
    (s, s_less), (c, c_less) = _sine(*r), _cosine(*r)
    s, c, odd = s - s_less, c - c_less, quarters & 1
    turned = (quarters >> 1) & 1, ((quarters + 1) >> 1) & 1
    return m.flip(turned[0], m.pick(odd, c, s)), m.flip(turned[1], m.pick(odd, s, c))


def sin_cos_far(m: Arithmetic, x: Operand) -> tuple[Operand, Operand]:
    """Return sine and cosine of a large angle, or of what is none."""
    return _sin_cos_of(m, _reduced_far(m, x))


def sin_cos(m: Arithmetic, x: Operand) -> tuple[Operand, Operand]:
    """Return sine and cosine of an angle."""
    found: tuple[Operand, Operand] = m.unless(
        m.size(x) <= _FAR,
        lambda: m.shortcut(m.size(x) < _NEAR, lambda: _near(m, x), lambda: _sin_cos_of(m, _reduced(m, x))),
        sin_cos_far,
        x,
    )
    return found


def _wave(m: Arithmetic, x: Operand, turned: int, far: Callable[..., tuple[Operand]]) -> tuple[Operand]:
    found: tuple[Operand] = m.unless(
        m.size(x) <= _FAR,
        lambda: m.shortcut(
            m.size(x) < _NEAR, lambda: _near(m, x)[turned : turned + 1], lambda: _wave_of(m, _reduced(m, x), turned)
        ),
        far,
        x,
    )
    return found


def sin_far(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the sine of a large angle, or of what is none."""
    return _wave_of(m, _reduced_far(m, x), 0)


def cos_far(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the cosine of a large angle, or of what is none."""
    return _wave_of(m, _reduced_far(m, x), 1)


def sin(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the sine of an angle."""
    return _wave(m, x, 0, sin_far)


def cos(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the cosine of an angle."""
    return _wave(m, x, 1, cos_far)


def _tan_of(m: Arithmetic, reduced: tuple[Operand, Operand, Operand]) -> tuple[Operand]:
    quarters, *r = reduced
    odd, sine, cosine = quarters & 1, _sine(*r), _cosine(*r)
    top, top_rest = (m.pick(odd, b, a) for a, b in zip(sine, cosine, strict=True))
    bottom, bottom_rest = (m.pick(odd, a, b) for a, b in zip(sine, cosine, strict=True))
    n, d = top - top_rest, bottom - bottom_rest
    n_rest, d_rest = (top - n) - top_rest, (bottom - d) - bottom_rest
    inverse = 1.0 / d
    quotient = n * inverse
    p, missed = _product(m, quotient, d)
    found = quotient - (((p - n) + missed) - (n_rest - quotient * d_rest)) * inverse
    return (m.flip(odd, found),)


def tan_far(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the tangent of a large angle, or of what is none."""
    return _tan_of(m, _reduced_far(m, x))


def tan(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the tangent of an angle."""
    found: tuple[Operand] = m.unless(m.size(x) <= _FAR, lambda: _tan_of(m, _reduced(m, x)), tan_far, x)
    return found


def _root(m: Arithmetic, t: Operand) -> tuple[Operand, Operand]:
    """Return the square root as its first bits and what is missing."""
    s = m.sqrt(t)
    first = _coarse(m, s)
    return first, (t - first * first) / m.choose(s > 0.0, s + first, 1.0)


def _arcsine_rest(m: Arithmetic, size: Operand) -> tuple[Operand, Operand, Operand]:
    """Return whether a sine is small, its square or the half of what it lacks of 1, and the rest over the angle."""
    is_small = size < 0.5
    t = m.choose(is_small, size * size, (1.0 - size) * 0.5)
    return is_small, t, t * _polynomial(t, _ARCSINE) / _polynomial(t, _ARCSINE_BELOW)


def asin(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the angle with a sine."""
    size = m.size(x)
    is_small, t, r = _arcsine_rest(m, size)
    first, missed = _root(m, t)
    p = 2.0 * ((first + missed) * r) - (_QUARTER[1] - 2.0 * missed)
    quarter = 0.5 * _QUARTER[0]
    large = quarter - (p - (quarter - 2.0 * first))
    return (m.flip(m.high(x) >> 31, m.choose(is_small, size + size * r, large)),)


def acos(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the angle with a cosine."""
    is_small, t, r = _arcsine_rest(m, m.size(x))
    first, missed = _root(m, t)
    w = r * (first + missed) + missed
    back = _PI - 2.0 * (first + (w - _QUARTER[1]))
    large = m.pick(m.high(x) >> 31, back, 2.0 * (first + w))
    return (m.choose(is_small, _QUARTER[0] - (x - (_QUARTER[1] - x * r)), large),)


def _atan2_of(m: Arithmetic, y: Operand, x: Operand) -> Operand:
    """Return the angle of a point whose larger coordinate, and whose ratio, has a normal size."""
    across, along = m.size(y), m.size(x)
    is_steep = across > along
    a, b = m.choose(is_steep, along, across), m.choose(is_steep, across, along)
    is_near, is_far = a > 0.25 * b, a > 0.72 * b
    c = m.choose(is_far, -1.0, m.choose(is_near, -0.5, 0.0))
    n, n_rest = _sum(a, c * b)
    q = c * a
    d = b - q
    d_rest = (b - d) - q
    inverse = 1.0 / d
    t = n * inverse
    p, missed = _product(m, t, d)
    e = (((n - p) - missed) + (n_rest - t * d_rest)) * inverse
    z = t * t
    u = (e - e * z) - t * (z * _polynomial(z, _ARCTANGENT))
    back = m.high(x) >> 31
    direction = m.flip(back, m.choose(is_steep, -1.0, 1.0))
    start = m.choose(is_steep, _QUARTER[0], m.pick(back, _PI, 0.0))
    start_rest = m.choose(is_steep, _QUARTER[1], m.pick(back, _PI_REST, 0.0))
    turned = direction * m.choose(is_far, 0.5 * _QUARTER[0], m.choose(is_near, 0.4636476090008061, 0.0))
    turned_rest = direction * m.choose(is_far, 0.5 * _QUARTER[1], m.choose(is_near, 2.2698777452961687e-17, 0.0))
    middle = start + turned
    t = direction * t
    found = middle + t
    rest = ((middle - found) + t) + (((start - middle) + turned) + (start_rest + turned_rest) + direction * u)
    return m.flip(m.high(y) >> 31, found + rest)


def atan2_far(m: Arithmetic, y: Operand, x: Operand) -> tuple[Operand]:
    """Return the angle of a point at zero, far away or with coordinates of very different sizes."""
    across, along = m.size(y), m.size(x)
    inf = math.inf
    a = m.choose(across == inf, 1.0, m.choose(along == inf, 0.0, across))
    b = m.choose(along == inf, 1.0, m.choose(across == inf, 0.0, m.choose(across + along == 0.0, 1.0, along)))
    most = m.choose(a > b, a, b)
    unit = m.choose(most > 2.0**400, 2.0**-600, m.choose(most < 2.0**-400, 2.0**600, 1.0))
    back = m.high(x) >> 31
    found = _atan2_of(m, m.flip(m.high(y) >> 31, a * unit), m.flip(back, b * unit))
    flat = m.choose(a < b * 2.0**-490, m.pick(back, 0.0, 1.0), 0.0)
    found = m.choose(flat == 1.0, m.flip(m.high(y) >> 31, a / m.choose(b > 0.0, b, 1.0)), found)
    return (m.choose((x == x) & (y == y), found, x + y),)


def atan2(m: Arithmetic, y: Operand, x: Operand) -> tuple[Operand]:
    """Return the angle of a point."""
    across, along = m.size(y), m.size(x)
    most, least = m.choose(across > along, across, along), m.choose(across > along, along, across)
    usual = (most > 2.0**-400) & (most < 2.0**400) & ((least > 2.0**-450) | (least == 0.0))
    found: tuple[Operand] = m.unless(usual, lambda: (_atan2_of(m, y, x),), atan2_far, y, x)
    return found


def atan(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the angle with a tangent."""
    one = m.choose(x == x, 1.0, 1.0)
    size = m.size(x)
    usual = (size < 2.0**400) & ((size > 2.0**-450) | (x == 0.0))
    found: tuple[Operand] = m.unless(usual, lambda: (_atan2_of(m, x, one),), atan2_far, x, one)
    return found


# -- powers -----------------------------------------------------------------------------------------------------------


def _scaled(m: Arithmetic, a: Operand, k: Operand) -> Operand:
    """Return a number times a power of two, beyond all finite numbers or down to zero where that is so."""
    power = m.low(k + (_ROUNDER + 2048.0))
    half = power >> 1
    return a * m.of_words((half - 1) << 20, 0) * m.of_words((power - half - 1) << 20, 0)


def _power_of_two(m: Arithmetic, k: Operand) -> Operand:
    """Return two to the power of a whole number, where that is a normal number."""
    return m.of_words(m.low(k + (_ROUNDER + 1023.0)) << 20, 0)


def _exponential(m: Arithmetic, x: Operand) -> tuple[Operand, Operand, Operand]:
    """Return the exponential as two terms and the power of two that they are to be multiplied by."""
    k = (x * 1.4426950408889634 + _ROUNDER) - _ROUNDER
    first, second = x - k * _LN2, k * _LN2_REST
    r = first - second
    missed = (first - r) - second
    one = 1.0 + r
    return one, ((1.0 - one) + r) + (missed + r * r * _polynomial(r, _EXP)), k


def exp_far(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return an exponential that may be no finite number, or a denormal one."""
    one, rest, k = _exponential(m, m.choose(x > 710.0, 710.0, m.choose(x < -746.0, -746.0, x)))
    return (_scaled(m, one + rest, k),)


def _exp_of(m: Arithmetic, x: Operand) -> tuple[Operand]:
    one, rest, k = _exponential(m, x)
    return ((one + rest) * _power_of_two(m, k),)


def exp(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the exponential."""
    found: tuple[Operand] = m.unless(m.size(x) <= _LARGE, lambda: _exp_of(m, x), exp_far, x)
    return found


def _log_of(m: Arithmetic, x: Operand, shift: Operand) -> Operand:
    """Return the natural logarithm of a normal number, less what the shift of its exponent stands for."""
    high = m.high(x) + (0x3FF00000 - 0x3FE6A09E)
    f = m.of_words((high & 0xFFFFF) + 0x3FE6A09E, m.low(x)) - 1.0
    k = m.as_number(high >> 20) - shift
    half = 0.5 * f * f
    s = f / (2.0 + f)
    z = s * s
    r = z * _polynomial(z, _LOG)
    return k * _LN2 - ((half - (s * (half + r) + k * _LN2_REST)) - f)


def log_far(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the natural logarithm of a denormal number, or of what has none that is finite."""
    is_tiny = x < 2.0**-1022
    found = _log_of(m, m.choose(is_tiny, x * 2.0**54, x), m.choose(is_tiny, 1077.0, 1023.0))
    outside = m.choose(x == 0.0, -math.inf, math.nan)
    return (m.choose(x > 0.0, m.choose(x < math.inf, found, x), outside),)


def log(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the natural logarithm."""
    usual = (x >= 2.0**-1022) & (x < math.inf)
    found: tuple[Operand] = m.unless(usual, lambda: (_log_of(m, x, 1023.0),), log_far, x)
    return found


def _hyperbolic(m: Arithmetic, size: Operand) -> tuple[Operand, Operand, Operand, Operand]:
    """Return half the exponential as two terms and a power of two, and its inverse over the same power."""
    one, rest, k = _exponential(m, m.choose(size > 720.0, 720.0, size))
    found = one + rest
    below = m.choose(k > 500.0, 500.0, k)
    return found, (one - found) + rest, k - 1.0, _scaled(m, 1.0 / found, -2.0 * below)


def sinh(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the hyperbolic sine."""
    size = m.size(x)
    found, rest, k, inverse = _hyperbolic(m, size)
    z = size * size
    large = _scaled(m, found + (rest - inverse), k)
    small = size + size * z * _polynomial(z, _SINH)
    return (m.flip(m.high(x) >> 31, m.choose(size < 1.0, small, large)),)


def cosh(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the hyperbolic cosine."""
    found, rest, k, inverse = _hyperbolic(m, m.size(x))
    return (_scaled(m, found + (rest + inverse), k),)


def tanh(m: Arithmetic, x: Operand) -> tuple[Operand]:
    """Return the hyperbolic tangent."""
    size = m.size(x)
    one, rest, k = _exponential(m, 2.0 * m.choose(size > 20.0, 20.0, size))
    power = _power_of_two(m, k)
    found = one + rest
    above = found * power
    d = above + 1.0
    t = 2.0 / d
    e = t * (((above - d) + 1.0) + ((one - found) + rest) * power) * (0.5 * t)
    large = 1.0 - t
    large = large + (((1.0 - large) - t) + e)
    z = size * size
    small = size + size * (z * (_horner(z, _TANH) / _horner(z, _TANH_BELOW)))
    return (m.flip(m.high(x) >> 31, m.choose(size < 0.625, small, large)),)


def _logarithm_of_two(m: Arithmetic, x: Operand, shift: Operand) -> tuple[Operand, Operand]:
    """Return the logarithm to the base of 2 of a normal number, as its first bits and the rest, less a shift."""
    high = m.high(x)
    mantissa = m.of_words((high & 0xFFFFF) + 0x3FF00000, m.low(x))
    exponent = m.as_number(high >> 20) - shift
    is_large = mantissa > 1.7320508075688772
    a = m.choose(is_large, 0.5 * mantissa, mantissa)
    n = m.choose(is_large, exponent + 1.0, exponent)
    is_above = a > 1.2247448713915890
    base = m.choose(is_above, 1.5, 1.0)
    u, below = a - base, a + base
    inverse = 1.0 / below
    ratio = u * inverse
    s = _coarse(m, ratio)
    t = _coarse(m, below)
    s_rest = inverse * ((u - s * t) - s * (a - (t - base)))
    square = ratio * ratio
    r = square * square * _polynomial(square, _LOG2) + s_rest * (s + ratio)
    square = s * s
    t = _coarse(m, 3.0 + square + r)
    t_rest = r - ((t - 3.0) - square)
    u, v = s * t, s_rest * t + t_rest * ratio
    p = _coarse(m, u + v)
    p_rest = v - (p - u)
    z = 9.61796700954437255859e-01 * p
    z_rest = (-7.02846165095275826516e-09 * p + p_rest * 9.61796693925975554329e-01) + m.choose(
        is_above, 1.35003920212974897128e-08, 0.0
    )
    middle = m.choose(is_above, 5.84962487220764160156e-01, 0.0)
    found = _coarse(m, ((z + z_rest) + middle) + n)
    return found, z_rest - (((found - n) - middle) - z)


def _exponent_of(m: Arithmetic, a: Operand, b: Operand, shift: Operand) -> tuple[Operand, Operand]:
    """Return the logarithm of a power to the base of 2, as two terms."""
    first, rest = _logarithm_of_two(m, a, shift)
    coarse = _coarse(m, b)
    return coarse * first, (b - coarse) * first + b * rest


def _power_from(m: Arithmetic, p: Operand, p_rest: Operand) -> tuple[Operand, Operand]:
    """Return a number and a whole one: the power of two with a sum as exponent is the first times two to the other."""
    k = ((p + p_rest) + _ROUNDER) - _ROUNDER
    p = p - k
    t = _coarse(m, p_rest + p)
    u = t * 6.93147182464599609375e-01
    v = (p_rest - (t - p)) * 6.93147180559945286227e-01 + t * -1.90465429995776804525e-09
    z = u + v
    w = v - (z - u)
    one = 1.0 + z
    return one + (((1.0 - one) + z) + ((w + w * z) + z * z * _polynomial(z, _EXP))), k


def _power_of(m: Arithmetic, a: Operand, b: Operand) -> Operand:
    """Return a positive number to a finite power, of any size."""
    is_tiny = a < 2.0**-1022
    p, p_rest = _exponent_of(m, m.choose(is_tiny, a * 2.0**54, a), b, m.choose(is_tiny, 1077.0, 1023.0))
    total = p + p_rest
    p = m.choose(total > 1100.0, 1100.0, m.choose(total < -1100.0, -1100.0, p))
    return _scaled(m, *_power_from(m, p, m.choose(m.size(total) <= 1100.0, p_rest, 0.0)))


def power_far(m: Arithmetic, a: Operand, b: Operand) -> tuple[Operand]:
    """Return a power of zero, of what is negative or infinite, or with an infinite exponent."""
    size, inf = m.size(a), math.inf
    power = m.size(b)
    is_whole, is_even = (m.choose(one < 2.0**52, (one + 2.0**52) - 2.0**52, one) == one for one in (power, 0.5 * power))
    even = m.choose(is_even, 1.0, 0.0)
    negative = m.high(a) >> 31
    base = m.choose((size > 0.0) & (size < inf), size, 2.0)
    exponent = m.choose(power < inf, b, 0.0)
    found = _power_of(m, base, exponent)
    grows = m.choose(b > 0.0, inf, 0.0)
    falls = m.choose(b > 0.0, 0.0, inf)
    found = m.choose(size == inf, grows, m.choose(size == 0.0, falls, found))
    found = m.choose(power == inf, m.choose(size > 1.0, grows, m.choose(size < 1.0, falls, 1.0)), found)
    found = m.choose((m.pick(negative, 1.0, 0.0) - even == 1.0) & is_whole, found * -1.0, found)
    has_value = is_whole | (a >= 0.0) | (size == 0.0) | (size == inf)
    found = m.choose(has_value, found, math.nan)
    found = m.choose((a == a) & (b == b), found, a + b)
    return (m.choose(b == 0.0, 1.0, m.choose(a == 1.0, 1.0, found)),)


def power(m: Arithmetic, a: Operand, b: Operand) -> tuple[Operand]:
    """Return a number to a power."""
    p, p_rest = _exponent_of(m, a, b, 1023.0)
    usual = (a >= 2.0**-1022) & (a < math.inf) & (m.size(p + p_rest) <= 1000.0)

    def values() -> tuple[Operand]:
        found, k = _power_from(m, p, p_rest)
        return (found * _power_of_two(m, k),)

    found: tuple[Operand] = m.unless(usual, values, power_far, a, b)
    return found


FUNCTIONS: Mapping[str, Callable[..., tuple[Operand, ...]]] = {
    one.__name__: one for one in (sin, cos, tan, asin, acos, atan, atan2, exp, log, sinh, cosh, tanh)
} | {"pow": power}
"""The functions by their names as operations."""

compiled: dict[str, Callable[..., float]] = {}
"""Machine code of the functions, once the process has loaded it: the same bits, twenty times as fast."""


def _on_floats(name: str, call: Callable[..., tuple[float, ...]]) -> Callable[..., float]:
    def found(*given: float) -> float:
        code = compiled.get(name)
        return call(FLOATS, *map(float, given))[0] if code is None else code(*given)

    return found


ON_FLOATS: Mapping[str, Callable[..., float]] = {name: _on_floats(name, call) for name, call in FUNCTIONS.items()}
"""The functions on floats; nan and infinities as IEEE 754 has them, and no error."""


def _strictly(call: Callable[..., float]) -> Callable[..., float]:
    def found(*given: float) -> float:
        value = call(*given)
        if not math.isfinite(value):
            if value != value and not any(one != one for one in given):
                raise ValueError("outside the domain")
            if value == value and all(map(math.isfinite, given)):
                raise OverflowError("no finite value")
        return value

    return found


STRICT: Mapping[str, Callable[..., float]] = {name: _strictly(call) for name, call in ON_FLOATS.items()}
"""The functions on floats, with the errors of Python's own where there is no value."""


@cache
def _machine_code() -> Callable[..., FloatArray]:
    found: Callable[..., FloatArray] = import_module("atwood.codegen.llvm.own").on_arrays
    return found


def _on_arrays(name: str) -> Callable[..., FloatArray]:
    return lambda *given: _machine_code()(name, *given)


ON_ARRAYS: Mapping[str, Callable[..., FloatArray]] = {name: _on_arrays(name) for name in FUNCTIONS}
"""The functions on arrays, entry by entry, by machine code that is loaded with the first call."""
