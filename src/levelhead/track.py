"""A Track: the result of a filter for every sample, with its σ."""

import re
import warnings
from dataclasses import dataclass, field, replace
from math import cos, pi, radians, sin
from typing import TYPE_CHECKING, NamedTuple, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from levelhead import filters
from levelhead.axis_map import AxisMap
from levelhead.calibration import Calibration
from levelhead.earth_frame import ENU, FRAMES, find_frame, frame_change
from levelhead.errors import LevelheadError, require
from levelhead.filters.health import FAULTS
from levelhead.filters.parameters import Params, short_name
from levelhead.motion import VectorSeries, acceleration_in_body, acceleration_in_earth, white_noise
from levelhead.recording import Array, Recording, real_array, time_array
from levelhead.rotations import ONE, conjugate, interpolate, matrix, product, to_scipy, turn_heading

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from levelhead.heave import Heave

POSE = "POSE"  # the frame of a track relative to one of its poses
NORTH_SIGMA = radians(30.0)  # above it north has not been found: a quarter of all directions is within 1.5σ
LEVEL_NOSE = 0.9998  # sine of 89°: nearer to the vertical the x axis has no heading


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

    @property
    def known(self) -> bool:
        """Whether σ is at most 30°."""
        return self.sigma <= NORTH_SIGMA


def north_of(known: Calibration | None) -> North | None:
    """North as a filter has estimated it beside the errors of its sensor; None: it does not."""
    found = None if known is None else known.north
    return None if found is None else North(float(found.value[0]), float(found.sigma[0]))


def is_relative(params: Params, has_mag: bool, has_gnss: bool = False) -> bool:
    """Whether a filter's heading counts from the start: it takes no reference, or keeps north apart from it."""
    flt = filters.of(params)
    if has_gnss and flt.aided_smoothing is not None:
        return False
    follows = has_mag and "heading" in flt.estimates
    return not follows or getattr(params, "north_rate", 1.0) == 0.0


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
        frame: the earth frame, "ENU", "NED" or "NWU", or "POSE", that of a pose (``relative_to``); with NED the axes of
            the body are forward-right-down. σ is about the axes of the frame.
        axes: how the sensor sits on the body whose orientation this is; None: the orientation is the sensor's.
        readings: the recording that it was made from, in the axes of the sensor; None: it is not known.
        relative: whether heading counts from the start: there was nothing to give north, or the filter keeps it apart
            (``north``). σ of heading then has no part of north. None: by ``params`` and ``readings``.
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
    frame: str = "ENU"
    axes: AxisMap | None = None
    readings: Recording | None = field(default=None, repr=False)
    relative: bool | None = None

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
        if self.readings is not None and len(self.readings) != n:
            raise LevelheadError(f"readings has {len(self.readings)} samples; expected {n}, one for each stamp")
        if self.relative is None:
            relative = False
            if self.params is not None and (seen := self.readings) is not None:
                relative = is_relative(self.params, seen.mag is not None, seen.gnss is not None)
            object.__setattr__(self, "relative", relative)
        if self.frame != POSE:
            object.__setattr__(self, "frame", find_frame(self.frame).name)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def name(self) -> str:
        """The filter's name, with the parameters that differ from its defaults."""
        return short_name(self.params) if self.params is not None else "orientation"

    def euler(self, sequence: str | None = None, *, frame: str | None = None, degrees: bool = True) -> Array:
        """(n, 3) Euler angles in degrees or radians.

        Args:
            sequence: None: roll, pitch and yaw (intrinsic z-y-x in the opposite order), roll and yaw within ±180°,
                pitch ±90°. Three letters: the angles of these rotations in their order, intrinsic for "ZXY", extrinsic
                for "zxy" (``scipy.spatial.transform.Rotation.as_euler``, which this needs).
            frame: "ENU", "NED" or "NWU"; None: that of the track.
            degrees: the unit; False: rad.

        Raises:
            LevelheadError: no such sequence or frame, or SciPy is not installed.
        """
        if sequence is not None:
            return self._any_euler(sequence, frame, degrees)
        w, x, y, z = (self if frame is None else self.to_frame(frame)).quat.T
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

    def _any_euler(self, sequence: str, frame: str | None, degrees: bool) -> Array:
        letters = str(sequence)
        if not re.fullmatch(r"[XYZ]{3}|[xyz]{3}", letters) or letters[0] == letters[1] or letters[1] == letters[2]:
            raise LevelheadError(
                f"the sequence is {sequence!r}; expected three letters, XYZ (intrinsic) or xyz (extrinsic), none twice "
                "in a row"
            )
        require("scipy", "Track.euler with a sequence", "scipy")
        quat = (self if frame is None else self.to_frame(frame)).quat
        known = np.isfinite(quat).all(axis=1, keepdims=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # gimbal lock, where SciPy sets the third angle to 0
            angles: Array = to_scipy(np.where(known, quat, ONE)).as_euler(letters, degrees)
        return np.where(known, angles, np.nan)

    @property
    def north(self) -> North | None:
        """Where magnetic north was at the end, by a filter that estimates it beside the orientation; None: by none."""
        return north_of(self.calibration)

    @property
    def sigma_tilt(self) -> Array | None:
        """(n,) 1σ of the inclination error in rad."""
        return None if self.sigma is None else np.hypot(self.sigma[:, 0], self.sigma[:, 1])

    @property
    def sigma_heading(self) -> Array | None:
        """(n,) 1σ of the heading error in rad."""
        return None if self.sigma is None else self.sigma[:, 2]

    def to_north(self) -> "Track":
        """The same track turned about the vertical, all of it by one angle, so that y is magnetic north.

        The angle is that of ``north``: its azimuth at the end, when every reading has been seen. σ² of heading becomes
        its own plus that of north, as if they were independent. A track that is not ``relative`` stays as it is.

        Raises:
            LevelheadError: there was no magnetometer, the filter does not follow it, or σ of north is above 30°.
        """
        if not self.relative:
            return self
        north = self.north
        if north is None:
            raise LevelheadError(
                f"{self.name} has found no north: there was no magnetometer, or the filter does not use it; heading is "
                "relative to the start (Track.with_heading sets it)"
            )
        if not north.known:
            raise LevelheadError(
                f"north is not known: its σ is {np.degrees(north.sigma):.0f}°, and the sensor turned by "
                f"{np.degrees(self._turn_about_up()):.0f}° about the vertical; turn it all the way round once and over "
                "on its side, away from iron"
            )
        turned = self.to_frame("ENU")._turned_about_up(north.azimuth)._with_heading_error(north.sigma)
        return replace(turned, relative=False).to_frame(self.frame)

    def _turn_about_up(self) -> float:
        """How far the sensor has turned about the vertical between its extremes, rad."""
        quat = self.of_sensor().quat
        w, z = quat[np.isfinite(quat).all(axis=1)][:, [0, 3]].T
        return float(np.ptp(np.unwrap(2.0 * np.arctan2(z, w)))) if len(w) else 0.0

    def _with_heading_error(self, sigma: float | Array) -> "Track":
        """The track in ENU with one more independent error of heading, 1σ in rad."""
        if self.sigma is None:
            return self
        up = np.hypot(self.sigma[:, 2], sigma)
        return replace(self, sigma=np.stack([self.sigma[:, 0], self.sigma[:, 1], up], axis=1))

    def to_true_north(self, declination: float, *, sigma: float = 0.0, degrees: bool = True) -> "Track":
        """The same orientation over an earth frame whose y axis points to true north instead of magnetic north.

        q_true = R_z(−D) q, so that every bearing grows by D and every yaw shrinks by it. σ about the new east and north
        axes are those of the old ones turned as if their errors were independent, because a Track has no covariances:
        σ_E² ← σ_E² cos² D + σ_N² sin² D. Inclination and heading keep theirs. A ``relative`` track is turned to
        magnetic north first (``to_north``).

        Args:
            declination: D, from true north to magnetic north at this place and time, positive east.
            sigma: 1σ of the declination, which the heading gets too.
            degrees: the unit of both; False: rad.

        Raises:
            LevelheadError: no such angle, the track is relative to true north already, or as ``to_north``.
        """
        angle = declination_angle(declination, degrees)
        if self.declination is not None:
            raise LevelheadError(
                f"this track is relative to true north already, by a declination of {np.degrees(self.declination):g}°"
            )
        turned = replace(self.to_north().to_frame("ENU")._turned_about_up(-angle), declination=angle)
        if sigma > 0.0:
            turned = turned._with_heading_error(radians(sigma) if degrees else sigma)
        return turned.to_frame(self.frame)

    def _turned_about_up(self, angle: float) -> "Track":
        """The track in ENU turned by an angle in rad, and the azimuth of its north with it."""
        c, s = cos(angle), sin(angle)
        known = self.calibration
        if known is not None and known.north is not None:
            azimuth = (known.north.value - angle + pi) % (2.0 * pi) - pi
            known = known.with_north(replace(known.north, value=azimuth))

        def rotate(values: Array | None) -> Array | None:
            if values is None:
                return None
            east, north, up = values.T
            return np.stack([c * east - s * north, c * north + s * east, up], axis=1)

        def rotate_sigma(values: Array | None) -> Array | None:
            if values is None:
                return None
            east, north, up = values.T
            return np.stack([np.hypot(c * east, s * north), np.hypot(s * east, c * north), up], axis=1)

        return replace(
            self,
            quat=turn_heading(self.quat, angle),
            calibration=known,
            position=rotate(self.position),
            velocity=rotate(self.velocity),
            sigma=rotate_sigma(self.sigma),
            sigma_position=rotate_sigma(self.sigma_position),
            sigma_velocity=rotate_sigma(self.sigma_velocity),
        )

    def as_rotation(self, frame: str | None = None) -> "Rotation":
        """A ``scipy.spatial.transform.Rotation`` of all samples, body frame to earth frame.

        Args:
            frame: "ENU" or "NWU" with a body forward-left-up; "NED" with a body forward-right-down; None: that of the
                track.

        Raises:
            LevelheadError: another frame, or SciPy is not installed.
        """
        require("scipy", "Track.as_rotation", "scipy")
        return to_scipy(self.quat if frame is None else self.to_frame(frame).quat)

    def to_frame(self, name: str) -> "Track":
        """The same orientation in another earth frame, with the axes of the body that go with it.

        Args:
            name: "ENU" or "NWU" with a body forward-left-up, or "NED" with a body forward-right-down.

        Raises:
            LevelheadError: no such frame, or the track is relative to a pose, which has no vertical.
        """
        wanted = find_frame(name)
        if wanted.name == self.frame:
            return self
        if self.frame == POSE:
            raise LevelheadError(f"this track is relative to one of its poses; it cannot be given in {wanted.name}")
        change = frame_change(FRAMES[self.frame], wanted)

        def earth(values: Array | None) -> Array | None:
            return None if values is None else values @ change.earth_matrix.T + 0.0

        def deviation(values: Array | None) -> Array | None:
            return None if values is None else values @ np.abs(change.earth_matrix.T)

        return replace(
            self,
            frame=wanted.name,
            quat=product(change.earth, self.quat, conjugate(change.body)),
            bias=None if self.bias is None else self.bias @ change.body_matrix.T + 0.0,
            position=earth(self.position),
            velocity=earth(self.velocity),
            sigma=deviation(self.sigma),
            sigma_position=deviation(self.sigma_position),
            sigma_velocity=deviation(self.sigma_velocity),
        )

    def mount(self, axes: AxisMap | str) -> "Track":
        """The orientation of the body on which the sensor sits.

        Args:
            axes: the rotation from the sensor's axes to the body's (x forward, y left, z up), or its text, such as
                "-y,x,z", "ZYX:90,0,10" or a quaternion "0.7071,0,0,0.7071".

        Raises:
            LevelheadError: no such axes, or the track is the body's already or in another frame than ENU.
        """
        mounting = AxisMap.parse(axes) if isinstance(axes, str) else axes
        if self.axes is not None or self.frame != "ENU":
            raise LevelheadError(
                f"this track is in {self.frame} with axes {self.axes}; give the axes of a track in ENU, once"
            )
        bias = None if self.bias is None else self.bias @ mounting.matrix.T
        return replace(self, quat=product(self.quat, conjugate(mounting.quat)), bias=bias, axes=mounting)

    def of_sensor(self) -> "Track":
        """The orientation of the sensor in ENU, whatever the frame and the mounting of this track."""
        plain = self.to_frame("ENU")
        if plain.axes is None:
            return plain
        bias = None if plain.bias is None else plain.bias @ plain.axes.matrix
        return replace(plain, quat=product(plain.quat, plain.axes.quat), bias=bias, axes=None)

    @property
    def has_heading_at_start(self) -> bool:
        """Whether the x axis of the first orientation is at least 1° off the vertical."""
        return bool(abs(matrix(self.quat[:1])[0, 2, 0]) <= LEVEL_NOSE)

    def relative_to(self, t: float) -> "Track":
        """The rotation since the pose at a stamp, in the axes of the body there: the identity at ``t``.

        σ² is that of both poses together, as if their errors were independent; it is an upper bound where they are
        alike. No vertical is left, so that the frame is "POSE", and position and velocity are left out.

        Args:
            t: s, within the track.

        Raises:
            LevelheadError: no such stamp, or no orientation there.
        """
        start, deviation = self._at(t)
        sigma = None
        if deviation is not None and self.sigma is not None:
            turn = matrix(conjugate(start)[None])[0]
            sigma = np.sqrt((self.sigma**2 + deviation**2) @ (turn**2).T)
        quat = product(conjugate(start), self.quat)
        return replace(
            self, quat=quat, sigma=sigma, frame=POSE, position=None, velocity=None, sigma_position=None,
            sigma_velocity=None, declination=None,
        )  # fmt: skip

    def with_heading(
        self, heading: float, t: float | None = None, *, sigma: float = 0.0, degrees: bool = True
    ) -> "Track":
        """The same track turned about the vertical so that its yaw at a stamp is that given.

        σ² of the heading is its own at each sample, that at ``t`` and that given, as if they were independent. North is
        that of the heading: a declination is left out, and the track is no longer ``relative``.

        Args:
            heading: yaw at ``t`` in the frame of the track: from east anticlockwise in ENU, a bearing in NED.
            t: s; None: the start.
            sigma: its 1σ.
            degrees: the unit of both; False: rad.

        Raises:
            LevelheadError: no such stamp or number, or a pose whose x axis is vertical within 1°.
        """
        values = np.array([heading, sigma], np.float64) * (pi / 180.0 if degrees else 1.0)
        if not np.isfinite(values).all() or values[1] < 0.0 or self.frame == POSE:
            raise LevelheadError(
                f"the heading is {heading!r} ± {sigma!r}; expected numbers, σ not negative, and a track with a vertical"
            )
        when = float(self.t[0]) if t is None else t
        start, deviation = self._at(when)
        pose = Track(self.t[:1], start[None], frame=self.frame)
        if abs(matrix(pose.quat)[0, 2, 0]) > LEVEL_NOSE:
            raise LevelheadError(f"at {when:g} s the x axis is vertical: there is no heading; give another stamp")
        now = pose.euler(degrees=False)[0, 2]
        turn = (values[0] - now) * (-1.0 if self.frame == "NED" else 1.0)
        turned = self.to_frame("ENU")._turned_about_up(float(turn))
        if deviation is not None:
            turned = turned._with_heading_error(np.hypot(deviation[2], values[1]))
        return replace(turned, declination=None, relative=False).to_frame(self.frame)

    def _at(self, t: object) -> tuple[Array, Array | None]:
        """The quaternion (4,) and σ (3,) at a stamp."""
        if not isinstance(t, SupportsFloat) or not self.t[0] <= float(t) <= self.t[-1]:
            raise LevelheadError(f"t is {t!r}; expected a stamp from {self.t[0]:g} to {self.t[-1]:g} s")
        when = np.array([float(t)])
        quat = self.quat[:1] if len(self) == 1 else interpolate(when, self.t, self.quat)
        if not np.isfinite(quat).all():
            raise LevelheadError(f"there is no orientation at {float(t):g} s; give another stamp")
        sigma = None
        if self.sigma is not None:
            sigma = np.array([np.interp(when[0], self.t, column) for column in self.sigma.T])
        return quat[0], sigma

    def specific_force(self, recording: Recording | None = None) -> VectorSeries:
        """Specific force in m/s², body axes, without the errors of the sensor that the filter has found.

        σ is that of the accelerometer alone: its white noise, measured where it moves least, and that of its bias.

        Args:
            recording: that of the track; None: ``readings``.

        Raises:
            LevelheadError: neither is there, or the stamps are others.
        """
        force, deviation = self._force(recording)
        body = self._body()
        sigma = np.broadcast_to(np.sqrt(body**2 @ deviation**2), force.shape)
        return VectorSeries(force @ body.T, sigma)

    def linear_acceleration(self, recording: Recording | None = None) -> VectorSeries:
        """Acceleration without gravity in m/s², body axes, with the σ of attitude and sensor."""
        force, deviation = self._force(recording)
        plain = self.of_sensor()
        found = acceleration_in_body(plain.quat, force, plain.sigma, deviation)
        body = self._body()
        sigma = None if found.sigma is None else np.sqrt(found.sigma**2 @ (body**2).T)
        return VectorSeries(found.value @ body.T, sigma)

    def earth_acceleration(self, recording: Recording | None = None) -> VectorSeries:
        """Acceleration without gravity in m/s² along the axes of the earth frame; see ``linear_acceleration``."""
        force, deviation = self._force(recording)
        plain = self.of_sensor()
        found = acceleration_in_earth(plain.quat, force, plain.sigma, deviation)
        axes = frame_change(ENU, find_frame(self.frame)).earth_matrix.T
        return VectorSeries(found.value @ axes, None if found.sigma is None else found.sigma @ np.abs(axes))

    def heave(
        self, recording: Recording | None = None, *, arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> "Heave":
        """Vertical motion of a boat or a buoy about its mean, up positive, with 1σ (``levelhead.heave``; needs SciPy).

        The errors of attitude are largest after the start of ``fuse``; those of ``smooth`` are not.

        Args:
            recording: that of the track; None: ``readings``.
            arm: m, from the sensor to the point whose heave is wanted, in the axes of the body.

        Raises:
            LevelheadError: no waves, too few of them, errors that hide them, or no such arm.
        """
        from levelhead.heave import estimate_heave

        lever = real_array("arm", arm, (3,), "m")
        found = self.earth_acceleration(recording)
        sign = -1.0 if self.frame == "NED" else 1.0
        sigma = None if found.sigma is None else found.sigma[:, 2]
        heave = estimate_heave(self.t, sign * found.value[:, 2], sigma)
        reach = matrix(self.quat) @ lever
        rise, deviation = sign * (reach[:, 2] - np.nanmean(reach[:, 2])), heave.sigma
        if self.sigma is not None:
            tilt = np.hypot(self.sigma[:, 0] * reach[:, 1], self.sigma[:, 1] * reach[:, 0])
            deviation = np.hypot(deviation, tilt)
        pace = np.gradient(rise, self.t)
        return heave._replace(value=heave.value + rise, velocity=heave.velocity + pace, sigma=deviation)

    def angular_rate(self, recording: Recording | None = None) -> VectorSeries:
        """Angular rate in rad/s, body axes, without the bias and the scale errors that the filter has found.

        σ: the white noise of the gyroscope, measured where it moves least, and the 1σ of its bias at the end.
        """
        readings = self._readings(recording)
        gyr, known = readings.gyr, self.calibration
        body = self._body()
        noise = white_noise(gyr)
        if known is not None:
            gyr = gyr - gyr @ known.gyr_matrix.value.T
            noise = np.hypot(noise, known.gyr_bias.sigma)
        gyr = gyr @ body.T
        gyr = gyr if self.bias is None else gyr - self.bias
        return VectorSeries(gyr, np.broadcast_to(np.sqrt(body**2 @ noise**2), gyr.shape))

    def _readings(self, recording: Recording | None) -> Recording:
        readings = self.readings if recording is None else recording
        if readings is None:
            raise LevelheadError("this track does not hold its readings; give the recording that it was made from")
        if len(readings) != len(self) or not np.array_equal(readings.t, self.t):
            raise LevelheadError("the recording has other stamps than the track; give the one that it was made from")
        return readings

    def _force(self, recording: Recording | None) -> tuple[Array, Array]:
        """(n, 3) specific force in the sensor's axes, and its 1σ (3,)."""
        readings = self._readings(recording)
        noise = white_noise(readings.acc)
        if self.calibration is None:
            return readings.acc, noise
        return self.calibration.apply(readings).acc, np.hypot(noise, self.calibration.acc_bias.sigma)

    def _body(self) -> Array:
        """(3, 3) from the sensor's axes to those of the body."""
        mounting = np.eye(3) if self.axes is None else self.axes.matrix
        turned: Array = frame_change(ENU, FRAMES.get(self.frame, ENU)).body_matrix @ mounting
        return turned

    def __repr__(self) -> str:
        flagged = int(np.count_nonzero(self.health & np.uint32(FAULTS)))
        return f"Track({self.name}, {len(self)} samples{f', {flagged} with health bits' if flagged else ''})"
