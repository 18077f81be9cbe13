"""The heading offset and the errors that lanes gather, against a heading that the estimates were turned by."""

from math import atan2, cos, sin

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead.kernels.quat import Quat
from levelhead.tune.lane_score import OFFSET, SQUARES, add_offset, add_squares


def quats(turns: Rotation) -> list[Quat]:
    return [Quat(w, x, y, z) for x, y, z, w in turns.as_quat()]


@pytest.mark.parametrize("heading", [-2.5, -0.7, 0.0, 0.4, 3.0])
def test_the_offset_is_the_heading_between_estimates_and_truth(heading: float) -> None:
    truth = Rotation.random(50, random_state=1)
    turned = Rotation.from_euler("z", heading) * truth
    sums = OFFSET.start
    for quat, true in zip(quats(turned), quats(truth), strict=True):
        sums = add_offset(sums, quat, true)
    half = 0.5 * atan2(sums[0], sums[1])
    assert np.cos(2.0 * half - heading) == pytest.approx(1.0, abs=1e-12)
    squares = SQUARES.start._replace(cos=cos(half), sin=sin(half))
    for quat, true in zip(quats(turned), quats(truth), strict=True):
        squares = add_squares(squares, quat, true)
    assert squares[2:] == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_squares_are_those_of_tilt_and_heading() -> None:
    """An error of 0.1 rad about one axis; the angles are halves, as in quaternions."""
    truth = Rotation.random(20, random_state=2)
    for error, expected in (("x", (1.0, 1.0, 0.0)), ("z", (1.0, 0.0, 1.0))):
        squares = SQUARES.start
        for quat, true in zip(quats(Rotation.from_euler(error, 0.1) * truth), quats(truth), strict=True):
            squares = add_squares(squares, quat, true)
        assert np.array(squares[2:]) / (20 * 0.05**2) == pytest.approx(expected, abs=1e-9)
