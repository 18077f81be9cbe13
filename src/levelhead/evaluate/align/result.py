"""The result of an alignment, and how certain it is."""

from dataclasses import dataclass, replace
from math import degrees

import numpy as np

from levelhead.evaluate.align.quaternion_convention import TO_ENU, TO_REFERENCE, Convention
from levelhead.evaluate.align.rotation_fit import Freedom
from levelhead.evaluate.lag import MAX_STANDARD_ERROR
from levelhead.rotations import product, to_scipy
from levelhead.track import Track

RESIDUAL_RATIO = 4.0 / 3.0  # a simpler hypothesis is preferred if its residual is at most this much larger
RESIDUAL_MARGIN = 0.02  # °, a difference of residuals that is never worth a more complicated hypothesis
MISMATCH = 20.0  # °, a residual beyond which the two may not belong together
MIN_ROTATION = 2.0  # °, the RMS turn about an axis below which nothing turns about it

Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Alignment:
    """Eq. (1) of this package, found: reference(t) = earth · E · C(estimate(t + shift)) · D · sensor.

    Attributes:
        convention: order, inverse and frames of the estimate, seen from the reference: C, E and D.
        freedom: which constant rotations the hypothesis that won has.
        earth: X, wxyz: rotation from the estimate's earth frame to that of the reference, beyond E.
        sensor: Y, wxyz: rotation from the reference's sensor axes to those of the estimate, beyond D.
        shift: seconds by which the estimate is late; 0 if it was not searched, or has no answer.
        shift_error: its standard error in s; None if it was not searched, or has no answer.
        before: RMS angle in ° between both as they are.
        after: the same, aligned.
        trimmed: RMS angle in ° over the best 90 % of the samples, aligned; by this hypotheses are judged.
        second_best: the convention that fits next best with the same freedom; None if there was no other.
        second_best_trimmed: its ``core``, °.
        spread: RMS turn in ° of the reference about the three principal axes of its motion, the largest first.
        samples: instants compared.
        shift_searched: whether a shift was to be found.
    """

    convention: Convention
    freedom: Freedom
    earth: Quaternion
    sensor: Quaternion
    shift: float
    shift_error: float | None
    before: float
    after: float
    trimmed: float
    second_best: Convention | None
    second_best_trimmed: float | None
    spread: tuple[float, float, float]
    samples: int
    shift_searched: bool = True

    @property
    def order(self) -> str:
        """ "wxyz" or "xyzw": how the estimate writes a quaternion."""
        return self.convention.order

    @property
    def inverse(self) -> bool:
        """Whether the estimate turns the earth's vectors into the sensor's frame."""
        return self.convention.inverse

    @property
    def frame(self) -> str:
        """The estimate's earth frame where the reference's is ENU: "ENU", "NED" or "NWU"."""
        return self.convention.earth

    @property
    def heading(self) -> float:
        """Degrees by which ``earth`` turns heading, anticlockwise seen from above."""
        w, _, _, z = self.earth
        return degrees(2.0 * np.arctan2(z, w) + np.pi) % 360.0 - 180.0

    @property
    def ms(self) -> float:
        """The shift in milliseconds."""
        return 1e3 * self.shift

    @property
    def has_delay(self) -> bool:
        """Whether the shift is more than its own error (3σ) and than 0.05 ms."""
        return self.shift_error is not None and abs(self.shift) > max(3.0 * self.shift_error, 5e-5)

    @property
    def axes(self) -> int:
        """About how many axes the motion turns, 0 to 3; two are needed to distinguish all hypotheses."""
        return sum(turn > max(MIN_ROTATION, self.trimmed) for turn in self.spread)

    @property
    def ambiguities(self) -> tuple[str, ...]:
        """Hypotheses that this motion does not distinguish, in sentences."""
        found = []
        if self.trimmed > MISMATCH:
            found.append(f"Nothing brings them closer than {self.trimmed:.0f}°: they may not show the same motion.")
        if self.axes == 0:
            found.append("This motion hardly turns: it does not distinguish conventions, frames and mounting.")
        elif self.axes == 1:
            found.append(
                "This motion turns about one axis only: it does not distinguish an inverse, or a turn of the sensor, "
                "from a turn of the earth frame."
            )
        if (
            self.axes
            and self.second_best_trimmed is not None
            and self.second_best_trimmed <= residual_limit(self.trimmed)
        ):
            found.append(
                f"This motion does not distinguish {self.convention} from {self.second_best}: "
                f"{format_angle(self.trimmed)} and {format_angle(self.second_best_trimmed)} remain."
            )
        if self.freedom == ("any", "any") and self.axes > 1 and self.convention.order == "wxyz" and self.inverse:
            found.append("With both sides free, an inverse equals order xyzw with other rotations.")
        if self.shift_searched and (self.shift_error is None or self.shift_error > MAX_STANDARD_ERROR):
            found.append("This motion does not determine the shift in time.")
        return tuple(found)

    def apply(self, track: Track, *, constant: bool = True, clock: bool = True) -> Track:
        """The estimate in the reference's convention and on its clock.

        Args:
            track: the estimate, or any other of the same source; its quaternions are taken as they are.
            constant: also the constant rotations ``earth`` and ``sensor``; else order, direction and frames only.
            clock: also the shift in time; t0 of a recording is not touched.

        Returns:
            A Track; its bias is turned with the sensor's axes, its sigma with the earth's.
        """
        convention = self.convention
        left, right = TO_ENU[convention.earth], TO_REFERENCE[convention.sensor]
        if constant:
            left, right = product(np.array(self.earth), left)[0], product(right, np.array(self.sensor))[0]
        norm = np.linalg.norm(track.quat, axis=1, keepdims=True)
        quat = product(left, convention.read(track.quat / np.where(norm > 1e-6, norm, np.nan)), right)
        squares = to_scipy(left).as_matrix() ** 2
        return replace(
            track,
            t=track.t - self.shift if clock else track.t,
            quat=quat,
            bias=None if track.bias is None else track.bias @ to_scipy(right).as_matrix(),
            sigma=None if track.sigma is None else np.sqrt(track.sigma**2 @ squares.T),
        )

    @property
    def description(self) -> str:
        """The match without residuals: "order xyzw; heading turned by 12.0°; 12.3 ms late"."""
        parts = [str(self.convention)]
        if self.freedom.earth == "heading":
            parts.append(f"heading turned by {self.heading:.1f}°")
        elif self.freedom.earth == "any":
            parts.append(f"earth frame turned by {format_rotation(self.earth)}")
        if self.freedom.sensor == "any":
            parts.append(f"sensor turned by {format_rotation(self.sensor)}")
        if self.has_delay:
            amount = f"{abs(self.ms):.1f} ms" if abs(self.shift) < 1.0 else f"{abs(self.shift):.4f} s"
            parts.append(f"{amount} {'late' if self.shift > 0.0 else 'early'}")
        return "; ".join(parts).replace("-", "−").replace("forward−right−down", "forward-right-down")

    def __str__(self) -> str:
        return "\n".join(
            [
                f"{self.description}; {format_angle(self.before)} before, {format_angle(self.after)} after",
                *self.ambiguities,
            ]
        )

    def to_dict(self) -> dict[str, object]:
        """Ready for JSON: numbers, texts, None; never NaN."""
        return {
            "order": self.order,
            "inverse": self.inverse,
            "earth_frame": self.convention.earth,
            "sensor_axes": self.convention.sensor,
            "earth_quat_wxyz": list(self.earth),
            "earth_turn_deg": axis_angle(self.earth)[0],
            "earth_turn_axis": list(axis_angle(self.earth)[1]),
            "sensor_quat_wxyz": list(self.sensor),
            "sensor_turn_deg": axis_angle(self.sensor)[0],
            "sensor_turn_axis": list(axis_angle(self.sensor)[1]),
            "shift_ms": self.ms,
            "shift_error_ms": None if self.shift_error is None else 1e3 * self.shift_error,
            "before_deg": self.before,
            "after_deg": self.after,
            "trimmed_deg": self.trimmed,
            "second_best": None if self.second_best is None else str(self.second_best),
            "second_best_trimmed_deg": self.second_best_trimmed,
            "spread_deg": list(self.spread),
            "samples": self.samples,
            "description": self.description,
            "ambiguities": list(self.ambiguities),
        }


def residual_limit(smallest: float) -> float:
    """The largest residual in ° that does as well as the smallest."""
    return max(RESIDUAL_RATIO * smallest, smallest + RESIDUAL_MARGIN)


def format_angle(angle: float) -> str:
    """An angle in ° as text: one digit behind the point, two figures below 1°."""
    return f"{angle:.1f}°" if angle >= 1.0 else f"{angle:.2g}°" if angle >= 1e-4 else "0°"


def axis_angle(quat: Quaternion) -> tuple[float, tuple[float, float, float]]:
    """Angle in °, 0 to 180, and unit axis of a quaternion wxyz; the axis is z where nothing turns."""
    w, *vector = quat if quat[0] >= 0.0 else tuple(-part for part in quat)
    length = float(np.linalg.norm(vector))
    x, y, z = (0.0, 0.0, 1.0) if length < 1e-12 else (part / length for part in vector)
    return degrees(2.0 * np.arctan2(length, w)), (x, y, z)


def format_rotation(quat: Quaternion) -> str:
    """ "90.0° about z", with a sign where the axis is nearly one of the frame's; else "41.0° about (0.1, 0.9, 0.3)"."""
    angle, axis = axis_angle(quat)
    k = int(np.argmax(np.abs(axis)))
    if angle < 0.05 or abs(axis[k]) > 0.998:  # within 3.6°
        return f"{angle if axis[k] > 0.0 else -angle:.1f}° about {'xyz'[k]}"
    return f"{angle:.1f}° about ({', '.join(f'{part:.2f}' for part in axis)})"
