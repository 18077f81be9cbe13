"""Whether a sum of intervals has reached a length, decided so that no rounding of time stamps moves it.

At a usual rate a usual length is a whole number of intervals: 0.02 s is four of them at 200 Hz. Their sum then equals
the length but for rounding, and ``time >= length`` ends at the fourth sample on one clock and at the fifth on another.
Here a sum is complete from ``SLACK`` of an interval before the length. A tie needs a rate whose product with the length
is a whole number less ``SLACK``, and no number is farther from fractions with small denominators than the golden
section (A. Hurwitz, Mathematische Annalen 39, 1891).
"""

from levelhead.compiler.mark import kernel

SLACK = 0.3819660112501051  # of an interval: (3 − √5)/2


@kernel
def has_elapsed(time: float, dt: float, length: float) -> bool:
    """Whether ``time`` (s), a sum of intervals of which the last was ``dt`` (s), has reached ``length`` (s)."""
    return time + SLACK * dt >= length
