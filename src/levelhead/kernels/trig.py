"""sin, cos and atan2 of nothing but + − × ÷ and comparisons: the same bits on every machine, whatever its libm.

IEEE 754 defines the rounding of sums, products, quotients and roots, and not of sines: their last bit differs
between C libraries. Besides, a compiler cannot turn a call of a library into one for several lanes.

Polynomials are economized Taylor series (Lanczos, Applied Analysis, 1956, chapter 7); ``tests/reference/economized.py``
derives their coefficients in exact fractions. Errors are measured in ``tests/kernels/test_trig.py``.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel

TAN_22 = 0.41421356237309503  # tan π/8
TAN_67 = 2.414213562373095  # tan 3π/8
QUARTER = 0.7853981633974483  # π/4; its multiples up to 4 are exact, and below π by 3.9e-17 of themselves:
PI_SHORT = 3.8981718325193755e-17
TURNS = 0.6366197723675814  # 2/π
ROUND = 6755399441055744.0  # 1.5·2⁵²: added and taken off again it rounds to a whole number
HALF_PI_1 = 1.5707963267341256  # π/2 in three parts, the first two so short (33 bits) that k times them is exact
HALF_PI_2 = 6.077100506303966e-11
HALF_PI_3 = 2.0222662487959506e-21


class SinCos(NamedTuple):
    """Sine and cosine of one angle."""

    sin: float
    cos: float


@kernel
def atan2(y: float, x: float) -> float:
    """The angle of the point (x, y), rad, within (−π, π]; 0 for the origin; −0 counts as 0. Error below 4e-16.

    The nearest multiple c of π/4 is taken off by turning the point back by it, which leaves |t| ≤ tan π/8:

        atan2(y, x) = c + atan t,   t = y/x,  (|y| − x)/(|y| + x),  −x/|y|  for c = 0, π/4, π/2                  (1)
        atan t = t (1 − u P(u)),   u = t²,   P of degree 10                                                      (2)

    P is summed in pairs of pairs (G. Estrin, 1960), which a processor works out side by side.

    Good for all numbers below 8e307.
    """
    across = -x if x < 0.0 else x
    num = -y if y < 0.0 else y
    den = across
    c = 0.0
    if num > TAN_67 * across:
        den = num
        num = -across
        c = 2.0 * QUARTER
    elif num > TAN_22 * across:
        den = num + across
        num = num - across
        c = QUARTER
    t = num / den if den > 0.0 else 0.0
    if x < 0.0:  # mirrored at the y axis
        t = -t
        c = 4.0 * QUARTER - c
    u = t * t
    u2 = u * u
    u4 = u2 * u2
    low = (0.3333333333333333 - u * 0.19999999999995652) + u2 * (0.1428571428469138 - u * 0.11111111017100327)
    mid = (0.0909090464769568 - u * 0.07692184699371778) + u2 * (0.06664531369805009 - u * 0.05858311810501153)
    high = (0.05086254885823143 - u * 0.039253696320618564) + u2 * 0.01920252926841228
    angle = c + (t + (c * PI_SHORT - t * u * (low + u4 * (mid + u4 * high))))
    return -angle if y < 0.0 else angle


@kernel
def sincos(x: float) -> SinCos:
    """sin x and cos x. Error below 3e-16 up to 10⁶ rad, below 2e-16·|x| up to 10⁹; never outside of ±1 there.

    With the whole number k nearest to x/(π/2), r = x − k π/2 lies within ±π/4 (Cody & Waite, Software Manual for the
    Elementary Functions, 1980: π/2 in parts whose products with k are exact, up to k = 2²⁰), and

        sin r = r (1 + u S(u)),   cos r = 1 − u/2 + u² C(u),   u = r²                                             (3)
    """
    k = (x * TURNS + ROUND) - ROUND
    r = ((x - k * HALF_PI_1) - k * HALF_PI_2) - k * HALF_PI_3
    u = r * r
    s = r - r * (
        u
        * (
            0.16666666666666666
            - u
            * (
                0.00833333333333095
                - u
                * (
                    0.0001984126983675979
                    - u * (2.7557316103105014e-06 - u * (2.5051131947374594e-08 - u * 1.5918135932869774e-10))
                )
            )
        )
    )
    c = 1.0 - u * (
        0.5
        - u
        * (
            0.041666666666666664
            - u
            * (
                0.0013888888888887398
                - u
                * (
                    2.4801587298766363e-05
                    - u * (2.7557317272036996e-07 - u * (2.087614632531677e-09 - u * 1.1382636115964061e-11))
                )
            )
        )
    )
    quadrant = k - 4.0 * ((0.25 * k + ROUND) - ROUND)  # −2, −1, 0, 1 or 2
    if quadrant == 0.0:
        return SinCos(s, c)
    if quadrant == 1.0:
        return SinCos(c, -s)
    if quadrant == -1.0:
        return SinCos(-c, s)
    return SinCos(-s, -c)


@kernel
def sin(x: float) -> float:
    """sin x, as ``sincos``."""
    s, _ = sincos(x)
    return s


@kernel
def cos(x: float) -> float:
    """cos x, as ``sincos``."""
    _, c = sincos(x)
    return c
