"""A Track: the result of a filter for every sample, with its σ."""

from dataclasses import dataclass, field, replace
from math import cos, pi, radians, sin
from typing import TYPE_CHECKING, NamedTuple, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from levelhead.calibration import Calibration
from levelhead.errors import LevelheadError, nearest, require
from levelhead.filters.health import FAULTS
from levelhead.filters.parameters import Params, short_name
from levelhead.recording import Array, real_array, time_array
from levelhead.rotations import FRD_TO_FLU, NED_TO_ENU, product, to_scipy, turn_heading

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


def declination_angle(declination: object, degrees: bool = True) -> float:
    """A declination in rad.

    Raises:
        LevelheadError: no number within half a turn.
    """
    unit, half_turn = ("degrees", 180.0) if degrees else ("rad", pi)
    if not isinstance(declination, SupportsFloat) or not abs(float(declination)) <= half_turn:
        raise LevelheadError(
            f"the declination is {declination!r}; it must be {unit} from true to magnetic north, positive east, within "
            f"±{half_turn:g}"
        )
    return radians(float(declination)) if degrees else float(declination)


class North(NamedTuple):
    """The direction of magnetic north in the frame of an orientation.

    Attributes:
        azimuth: rad, clockwise from the y axis; 0: the y axis points north.
        sigma: its 1σ, rad; 1.8 where it may be any direction.
    """

    azimuth: float
    sigma: float


def north_of(known: Calibration | None) -> North | None:
    """North as a filter has estimated it beside the errors of its sensor; None: it does not."""
    found = None if known is None else known.north
    return None if found is None else North(float(found.value[0]), float(found.sigma[0]))


@dataclass(frozen=True, eq=False)
class Track:
    """Orientation over time.

    Attributes:
        t: (n,) seconds.
        quat: (n, 4) unit quaternions wxyz that turn sensor-frame vectors into the earth frame (x east, y north, z up).
        bias: (n, 3) estimated gyroscope bias in rad/s, or None if the filter estimates none.
        sigma: (n, 3) 1σ of the attitude error about east, north and up in rad, or None if nothing is known about it.
        health: (n,) bits of ``levelhead.filters.health``: the faults of a sample and the measures taken.
        params: the Params object that made it.
        declination: rad, positive east, by which heading was turned from magnetic to true north; None: it was not.
        calibration: the filter's estimate of its sensor's errors at the end; None if it estimates none.
        position: (n, 3) m, earth frame: from where position or height was first seen, or where GNSS has its origin;
            None if nothing of position or velocity was seen.
        velocity: (n, 3) m/s, earth frame, likewise.
        sigma_position: (n, 3) 1σ of position in m.
        sigma_velocity: (n, 3) 1σ of velocity in m/s.
    """

    t: Array
    quat: Array
    bias: Array | None = None
    sigma: Array | None = None
    health: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))  # zeros when not given
    params: Params | None = None
    declination: float | None = None
    calibration: Calibration | None = None
    position: Array | None = None
    velocity: Array | None = None
    sigma_position: Array | None = None
    sigma_velocity: Array | None = None

    def __post_init__(self) -> None:
        t = time_array(self.t)
        n = len(t)
        object.__setattr__(self, "t", t)
        shapes = (("quat", 4, "unit quaternions wxyz"), ("bias", 3, "rad/s"), ("sigma", 3, "rad"), ("position", 3, "m"),
                  ("velocity", 3, "m/s"), ("sigma_position", 3, "m"), ("sigma_velocity", 3, "m/s"))  # fmt: skip
        for name, width, unit in shapes:
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, real_array(name, values, (n, width), unit))
        if len(self.health) == 0:
            object.__setattr__(self, "health", np.zeros(n, np.uint32))
        if np.shape(self.health) != (n,):
            raise LevelheadError(f"health has shape {np.shape(self.health)}; expected ({n},) of bits")
        if self.declination is not None:
            object.__setattr__(self, "declination", declination_angle(self.declination, degrees=False))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def name(self) -> str:
        """The filter's name, with the parameters that differ from its defaults."""
        return short_name(self.params) if self.params is not None else "orientation"

    def euler(self, degrees: bool = True) -> Array:
        """(n, 3) roll, pitch and yaw (intrinsic z-y-x) in degrees or radians; roll and yaw within ±180°, pitch ±90°."""
        w, x, y, z = self.quat.T
        forward_x, forward_y = 1 - 2 * (y * y + z * z), 2 * (w * z + x * y)
        angles = np.stack(
            [
                np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
                np.arctan2(2 * (w * y - z * x), np.hypot(forward_x, forward_y)),
                np.arctan2(forward_y, forward_x),
            ],
            axis=1,
        )
        return np.degrees(angles) if degrees else angles

    @property
    def north(self) -> North | None:
        """Where magnetic north was at the end, by a filter that estimates it beside the orientation; None: by none."""
        found = north_of(self.calibration)
        return (
            found
            if found is None or self.declination is None
            else found._replace(azimuth=found.azimuth + self.declination)
        )

    @property
    def sigma_tilt(self) -> Array | None:
        """(n,) 1σ of the inclination error in rad."""
        return None if self.sigma is None else np.hypot(self.sigma[:, 0], self.sigma[:, 1])

    @property
    def sigma_heading(self) -> Array | None:
        """(n,) 1σ of the heading error in rad."""
        return None if self.sigma is None else self.sigma[:, 2]

    def to_true_north(self, declination: float, *, degrees: bool = True) -> "Track":
        """The same orientation over an earth frame whose y axis points to true north instead of magnetic north.

        q_true = R_z(−D) q, so that every bearing grows by D and every yaw shrinks by it. σ about the new east and north
        axes are those of the old ones turned as if their errors were independent, because a Track has no covariances:
        σ_E² ← σ_E² cos² D + σ_N² sin² D. Inclination and heading keep theirs.

        Args:
            declination: D, from true north to magnetic north at this place and time, positive east.
            degrees: the unit of ``declination``; False: rad.

        Raises:
            LevelheadError: no such angle, or the track is relative to true north already.
        """
        angle = declination_angle(declination, degrees)
        if self.declination is not None:
            raise LevelheadError(
                f"this track is relative to true north already, by a declination of {np.degrees(self.declination):g}°"
            )
        c, s = cos(angle), sin(angle)

        def rotate(values: Array | None) -> Array | None:
            if values is None:
                return None
            east, north, up = values.T
            return np.stack([c * east + s * north, c * north - s * east, up], axis=1)

        def rotate_sigma(values: Array | None) -> Array | None:
            if values is None:
                return None
            east, north, up = values.T
            return np.stack([np.hypot(c * east, s * north), np.hypot(s * east, c * north), up], axis=1)

        return replace(
            self,
            quat=turn_heading(self.quat, -angle),
            declination=angle,
            position=rotate(self.position),
            velocity=rotate(self.velocity),
            sigma=rotate_sigma(self.sigma),
            sigma_position=rotate_sigma(self.sigma_position),
            sigma_velocity=rotate_sigma(self.sigma_velocity),
        )

    def as_rotation(self, frame: str = "ENU") -> "Rotation":
        """A ``scipy.spatial.transform.Rotation`` of all samples, sensor frame to earth frame.

        Args:
            frame: "ENU", or "NED" (x north, y east, z down) with the sensor's axes forward-right-down accordingly.

        Raises:
            LevelheadError: another frame, or SciPy is not installed.
        """
        require("scipy", "Track.as_rotation", "scipy")
        if frame == "ENU":
            return to_scipy(self.quat)
        if frame == "NED":
            return to_scipy(product(NED_TO_ENU, self.quat, FRD_TO_FLU))
        raise LevelheadError(f"'{frame}' is not an earth frame; {nearest(frame, ['ENU', 'NED'])}")

    def __repr__(self) -> str:
        flagged = int(np.count_nonzero(self.health & np.uint32(FAULTS)))
        return f"Track({self.name}, {len(self)} samples{f', {flagged} with health bits' if flagged else ''})"
