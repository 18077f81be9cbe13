"""Conventions, constant rotations and a time shift that make two series of orientation match.

The reference B and the estimate A are quaternions of one moving body from two systems. Searched are

    B(t) = X · E · C(A(t + τ)) · D · Y                                                                          (1)

with C the way the four numbers are meant (order, inverse), E and D the frames of earth and sensor (NED and the like), X
a constant rotation of the earth's side, Y one of the sensor's side, and τ the time by which the estimate is late.
"""

from levelhead.evaluate.align.result import Alignment
from levelhead.evaluate.align.search import align

__all__ = ["Alignment", "align"]
