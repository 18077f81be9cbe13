"""How a sensor sits on its body: the rotation from its axes to the body's, and how to find it.

The body's axes are x forward, y to the left, z up.
"""

import re
from dataclasses import dataclass, replace

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording
from levelhead.rotations import ONE, conjugate, from_matrix, matrix, product
from levelhead.sample import Sample, Triple

NAMES = "xyz"
SQUARE = 0.94  # cosine of 20°: how near a measured axis must be to one of the sensor's
STILL_SECONDS = 1.0
QUIET = 0.05  # rad/s, off the mean of the still second
MIN_TURN = 0.5  # rad: half a radian is turned on purpose
MIN_CORRELATION = 0.7  # correlation of the turn by gyroscope and by accelerometer
ROUNDING = 1e-12  # of a rotation's numbers that are meant to be 0 or ±1
EXPECTED = (
    "expected the sensor's axes for x, y, z, such as -y,x,z; Euler angles in degrees, such as ZYX:90,0,10; or a "
    "quaternion wxyz, such as 0.7071,0,0,0.7071"
)


@dataclass(frozen=True)
class AxisMap:
    """The rotation from the sensor's frame to the body's.

    Attributes:
        rows: its matrix: for each body axis its components along the sensor's axes.
    """

    rows: tuple[Triple, Triple, Triple]

    @classmethod
    def parse(cls, text: str) -> "AxisMap":
        """From the text of ``--axes``.

        "x,y,z" leaves the axes as they are; with "-y,x,z" the body's x is the sensor's −y. "ZYX:90,0,10" has the
        angles in degrees by which the sensor is turned on its body: intrinsic rotations for upper-case letters,
        extrinsic ones for lower-case, as in SciPy. Four numbers are a quaternion wxyz, sensor to body.

        Raises:
            LevelheadError: none of these, or a mirror image, which no mounting can be.
        """
        words = text.replace(" ", "")
        sequence, colon, angles = words.partition(":")
        if colon:
            return cls.from_quaternion(_from_euler(text, sequence, angles))
        if re.fullmatch(r"[-+.0-9eE]+(,[-+.0-9eE]+)+", words):
            return cls.from_quaternion(_numbers(text, words, 4))
        return _from_words(text)

    @classmethod
    def from_quaternion(cls, quat: Array) -> "AxisMap":
        """From a quaternion wxyz (4,), sensor to body, of any length but 0.

        Raises:
            LevelheadError: not four finite numbers, or all 0.
        """
        values = np.asarray(quat, np.float64)
        length = float(np.linalg.norm(values)) if values.shape == (4,) else np.nan
        if not 1e-6 < length < np.inf:
            raise LevelheadError(f"{quat!r} is not a quaternion of a mounting; expected four numbers wxyz")
        rotation = matrix(values[None] / length)[0]
        whole = np.round(rotation)
        rotation = np.where(np.abs(rotation - whole) < ROUNDING, whole + 0.0, rotation)
        first, second, third = (tuple(row) for row in rotation.tolist())
        return cls((first, second, third))

    @property
    def matrix(self) -> Array:
        """(3, 3) rotation from the sensor's frame to the body's."""
        return np.array(self.rows)

    @property
    def quat(self) -> Array:
        """(4,) the same as a quaternion wxyz."""
        return from_matrix(self.matrix)

    @property
    def terms(self) -> list[list[tuple[int, float]]]:
        """For each body axis the sensor's axes that it is made of, 0 to 2, each with its factor."""
        return [[(axis, factor) for axis, factor in enumerate(row) if factor != 0.0] for row in self.rows]

    @property
    def is_permutation(self) -> bool:
        """Whether each axis of the body is one of the sensor's, or its opposite."""
        return all(len(row) == 1 for row in self.terms)

    def __str__(self) -> str:
        """The text for ``--axes``."""
        if self.is_permutation:
            return ",".join(("-" if factor < 0.0 else "") + NAMES[axis] for ((axis, factor),) in self.terms)
        return ",".join(repr(number) for number in self.quat.tolist())

    def turn(self, v: Triple) -> Triple:
        """A vector of the sensor's frame in the body's."""
        x, y, z = (sum([v[axis] * factor for axis, factor in row[1:]], v[row[0][0]] * row[0][1]) for row in self.terms)
        return x, y, z

    def apply(self, sample: Sample) -> Sample:
        """A sample in the body's frame."""
        mag = None if sample.mag is None else self.turn(sample.mag)
        attitude = sample.attitude
        if attitude is not None:
            w, x, y, z = product(np.array([attitude]), conjugate(self.quat))[0].tolist()
            attitude = w, x, y, z
        return sample._replace(gyr=self.turn(sample.gyr), acc=self.turn(sample.acc), mag=mag, attitude=attitude)

    def rotate(self, recording: Recording) -> Recording:
        """A recording in the body's frame, its reference included."""
        across = self.matrix.T
        truth = recording.truth
        if truth is not None:
            bias = None if truth.bias is None else truth.bias @ across
            truth = replace(truth, quat=product(truth.quat, conjugate(self.quat)), bias=bias)
        mag = None if recording.mag is None else recording.mag @ across
        return replace(recording, gyr=recording.gyr @ across, acc=recording.acc @ across, mag=mag, truth=truth)


IDENTITY = AxisMap(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))


def _from_words(text: str) -> AxisMap:
    rows = []
    for word in text.lower().replace(" ", "").split(","):
        letter = word.lstrip("+-")
        if letter not in tuple(NAMES) or len(word) - len(letter) > 1:
            raise LevelheadError(f"axes '{text}' are none; {EXPECTED}")
        rows.append((NAMES.index(letter), -1.0 if word.startswith("-") else 1.0))
    if len(rows) != 3 or len({axis for axis, _ in rows}) != 3:
        raise LevelheadError(f"axes '{text}' do not name each of x, y, z once; expected such as -y,x,z")
    found = _of_units(*rows)
    if np.linalg.det(found.matrix) < 0.0:
        mirrored = ",".join([*text.replace(" ", "").split(",")[:2], _opposite(rows[2])])
        raise LevelheadError(
            f"axes '{text}' are a mirror image: no way of mounting a sensor does that; perhaps {mirrored} is meant"
        )
    return found


def _numbers(text: str, words: str, count: int) -> Array:
    try:
        values = np.array([float(word) for word in words.split(",")])
    except ValueError:
        values = np.empty(0)
    if len(values) != count or not np.isfinite(values).all():
        raise LevelheadError(f"axes '{text}' are not {count} numbers; {EXPECTED}")
    return values


def _from_euler(text: str, sequence: str, angles: str) -> Array:
    """(4,) quaternion wxyz of Euler angles; those of intrinsic rotations are multiplied in their order."""
    if not re.fullmatch(r"[XYZ]{1,3}|[xyz]{1,3}", sequence) or re.search(r"(.)\1", sequence):
        raise LevelheadError(
            f"axes '{text}' have the sequence '{sequence}'; expected one to three letters, XYZ (intrinsic) or xyz "
            "(extrinsic), none twice in a row"
        )
    total = ONE
    for letter, angle in zip(sequence, np.radians(_numbers(text, angles, len(sequence))) / 2.0, strict=True):
        quat = np.concatenate([[np.cos(angle)], np.sin(angle) * np.eye(3)[NAMES.index(letter.lower())]])
        total = (product(total, quat) if letter.isupper() else product(quat, total))[0]
    return total


def _of_units(*rows: tuple[int, float]) -> AxisMap:
    """A map of quarter turns: for each body axis the sensor's axis and its sign."""
    first, second, third = (tuple(_unit(row).tolist()) for row in rows)
    return AxisMap((first, second, third))


def _opposite(row: tuple[int, float]) -> str:
    return ("" if row[1] < 0.0 else "-") + NAMES[row[0]]


def find_axes(recording: Recording) -> AxisMap:
    """The axis map from a still pose and one turn.

    The body is level and still for a second or more and is then leaned to its right side, by 30° or more, and left
    there or brought back. Gravity of the still pose shows which of the sensor's axes is up, the turn which one is
    forward: leaning to the right is a positive turn about it. The third one follows, because only right-handed maps
    exist.

    Raises:
        LevelheadError: the start is not still, there is no turn, the turn is not about a level axis, the sensor sits
            askew by more than 20°, or gyroscope and accelerometer contradict each other: one of them is mirrored.
    """
    t = recording.t - recording.t[0]
    first = t < STILL_SECONDS
    gyr, acc = recording.gyr, recording.acc
    if first.sum() < 5 or t[-1] < 1.5 * STILL_SECONDS:
        raise LevelheadError("the recording is too short to find the axes; expected a still second and one turn")
    bias, rest = gyr[first].mean(axis=0), acc[first].mean(axis=0)
    if (np.abs(gyr[first] - bias) > QUIET).any() or not 8.0 < float(np.linalg.norm(rest)) < 11.6:
        raise LevelheadError("the recording does not begin with a still second; hold the body level and still at first")
    up = _nearest_axis(rest / np.linalg.norm(rest), "up")
    turned = _angle(t, gyr - bias)
    far = int(np.argmax(np.linalg.norm(turned, axis=1)))
    if np.linalg.norm(turned[far]) < MIN_TURN:
        raise LevelheadError("there is no turn in the recording; lean the body to its right side, by 30° or more")
    _must_agree(t, gyr - bias, acc)
    forward = _nearest_axis(turned[far] / np.linalg.norm(turned[far]), "of the turn")
    if forward[0] == up[0]:
        raise LevelheadError("the turn is about the vertical, which adds nothing; lean the body to its right side")
    left = np.cross(_unit(up), _unit(forward))
    axis = int(np.abs(left).argmax())
    return _of_units(forward, (axis, float(left[axis])), up)


def _unit(row: tuple[int, float]) -> Array:
    vector = np.zeros(3)
    vector[row[0]] = row[1]
    return vector


def _nearest_axis(direction: Array, what: str) -> tuple[int, float]:
    axis = int(np.abs(direction).argmax())
    if abs(direction[axis]) < SQUARE:
        degrees = float(np.degrees(np.arccos(min(1.0, abs(float(direction[axis]))))))
        raise LevelheadError(
            f"the axis {what} is {degrees:.0f}° off the sensor's {NAMES[axis]} axis; expected at most 20°: mount it "
            "straight, or turn about one axis only"
        )
    return axis, 1.0 if direction[axis] > 0.0 else -1.0


def _angle(t: Array, gyr: Array) -> Array:
    """(n, 3) ∫ω dt: good enough for one turn about one axis."""
    steps = np.diff(t, prepend=t[0])[:, None]
    turned: Array = np.cumsum(gyr * steps, axis=0)
    return turned


def _must_agree(t: Array, gyr: Array, acc: Array) -> None:
    """Gravity turns the other way in the sensor's frame, du/dt = −ω × u; in a mirrored one it does not."""
    u = acc / np.linalg.norm(acc, axis=1, keepdims=True)
    step = max(1, int(0.1 / float(np.median(np.diff(t)))))
    seen = u[step:] - u[:-step]
    angle = _angle(t, gyr)
    said = -np.cross(angle[step:] - angle[:-step], u[:-step])
    score = float((seen * said).sum() / (np.linalg.norm(seen) * np.linalg.norm(said) + 1e-30))
    if score < MIN_CORRELATION:
        raise LevelheadError(
            f"gyroscope and accelerometer contradict each other about the turn (correlation {score:.2f}): "
            "an axis is mirrored or swapped, or the body accelerated; make one slow turn on the spot"
        )
