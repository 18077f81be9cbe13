"""Angles on the circle: never blend 175° and −175° to 0°."""

from math import floor, pi

from levelhead.kernels.jit import kernel

TWO_PI = 2.0 * pi
ON_A_LINE = 0.0  # the period of what is on no circle


@kernel
def wrap(angle: float, period: float) -> float:
    """The angle brought to [−period/2, period/2); untouched, to the bit, when it is there already.

    ``period`` is 2π for radians, 360 for degrees, and 0 for a quantity that is not on a circle (a height, a price).
    """
    if period > 0.0 and not -0.5 * period <= angle < 0.5 * period:  # nearly always inside, and dividing takes longest
        return angle - period * floor(angle / period + 0.5)
    return angle


@kernel
def blend(a: float, b: float, weight: float, period: float) -> float:
    """``a`` moved towards ``b`` by ``weight`` (0 to 1) along the shorter way round."""
    return wrap(a + weight * wrap(b - a, period), period)
