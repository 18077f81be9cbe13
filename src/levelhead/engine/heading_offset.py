"""A live heading set by the user: all orientations turned about the vertical, with σ carried."""

from collections.abc import Callable
from math import atan2, cos, isfinite, pi, radians, sin, sqrt
from typing import NamedTuple, SupportsFloat

from levelhead.errors import LevelheadError
from levelhead.kernels.quat import Quat, to_euler

Four = tuple[float, float, float, float]
MAX_PITCH = radians(89.0)  # nearer to the vertical the x axis has no heading


class HeadingOffset(NamedTuple):
    """A turn about the vertical.

    Attributes:
        angle: rad, anticlockwise seen from above.
        variance: rad² that it adds to the variance of the heading; below 0 where it removes the drift until then.
    """

    angle: float
    variance: float

    def turn(self, quat: Four) -> Four:
        """An orientation, turned."""
        w, x, y, z = quat
        c, s = cos(0.5 * self.angle), sin(0.5 * self.angle)
        return c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w

    def turn_vector(self, vector: tuple[float, float, float]) -> tuple[float, float, float]:
        """A vector of the earth, turned."""
        east, north, up = vector
        c, s = cos(self.angle), sin(self.angle)
        return c * east - s * north, c * north + s * east, up

    def turn_sigma(self, sigma: tuple[float, float, float]) -> tuple[float, float, float]:
        """1σ about east, north and up, as if the first two were independent."""
        east, north, up = sigma
        c, s = cos(self.angle) ** 2, sin(self.angle) ** 2
        first, second = c * east * east + s * north * north, c * north * north + s * east * east
        return sqrt(first), sqrt(second), sqrt(max(up * up + self.variance, 0.0))

    def tick(self, tick: Callable[..., Four]) -> Callable[..., Four]:
        """A tick of a stream whose orientations are turned."""
        turn = self.turn
        return lambda *given: turn(tick(*given))


def heading_offset(
    quat: Four, sigma_up: float, heading: object, sigma: object, degrees: bool, has_reference: bool
) -> HeadingOffset:
    """The offset with which the yaw of ``quat`` is ``heading``.

    The drift of a relative heading is a random walk: the time after this instant is independent of the time before, so
    σ² begins with the given one. A heading with a reference keeps errors; both count, as if independent.

    Args:
        quat: the orientation now, without an offset.
        sigma_up: rad, 1σ of its heading.
        heading: yaw that it shall have.
        sigma: its 1σ.
        degrees: the unit of both; False: rad.
        has_reference: whether a magnetometer or GNSS corrects the heading.

    Raises:
        LevelheadError: no numbers, or the x axis is vertical within 1°.
    """
    if not (isinstance(heading, SupportsFloat) and isinstance(sigma, SupportsFloat)):
        raise LevelheadError(f"the heading is {heading!r} ± {sigma!r}; expected two numbers")
    unit = pi / 180.0 if degrees else 1.0
    wanted, deviation = unit * float(heading), unit * float(sigma)
    if not isfinite(wanted) or not 0.0 <= deviation < 1e3:
        raise LevelheadError(f"the heading is {heading!r} ± {sigma!r}; expected finite numbers, σ not negative")
    now = to_euler(Quat(*quat))
    if abs(now.pitch) > MAX_PITCH:
        raise LevelheadError("the x axis is vertical, so that there is no heading; level the sensor and try again")
    angle = wanted - now.yaw
    before = sigma_up * sigma_up
    return HeadingOffset(atan2(sin(angle), cos(angle)), deviation * deviation + (before if has_reference else -before))
