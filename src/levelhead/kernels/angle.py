"""Angles on the circle: never blend 175° and −175° to 0°."""

from math import pi

from levelhead.compiler.mark import kernel
from levelhead.kernels.trig import ROUND

TWO_PI = 2.0 * pi


@kernel
def wrap(angle: float, period: float) -> float:
    """The angle brought to [−period/2, period/2); untouched, to the bit, when it is there already.

    ``period`` is 2π for radians, 360 for degrees, and 0 for a quantity that is not on a circle (a height, a price).
    """
    if period > 0.0 and not -0.5 * period <= angle < 0.5 * period:  # nearly always inside, and dividing takes longest
        turns = angle / period + 0.5
        whole = (turns + ROUND) - ROUND
        if whole > turns:  # to the nearest, but floor is meant; a real floor would keep lanes from being SIMD
            whole -= 1.0
        return angle - period * whole
    return angle


@kernel
def blend(a: float, b: float, weight: float, period: float) -> float:
    """``a`` moved towards ``b`` by ``weight`` (0 to 1) along the shorter way round."""
    return wrap(a + weight * wrap(b - a, period), period)
