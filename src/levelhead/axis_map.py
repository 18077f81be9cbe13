"""How a sensor sits on its body: which of its axes is which of the body's, and how to find out.

The body's axes are x forward, y to the left, z up.
"""

from dataclasses import dataclass

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording
from levelhead.sample import Sample, Triple

NAMES = "xyz"
SQUARE = 0.94  # cosine of 20°: how near a measured axis must be to one of the sensor's
STILL_SECONDS = 1.0
QUIET = 0.05  # rad/s, off the mean of the still second
LEAST_TURN = 0.5  # rad: half a radian is turned on purpose
AGREES = 0.7  # correlation of what gyroscope and accelerometer say about the turn


@dataclass(frozen=True)
class AxisMap:
    """The sensor's axes that are the body's x, y and z, signs included: a rotation by quarter turns.

    Attributes:
        rows: for each body axis (which sensor axis, 0 to 2, and its sign, 1.0 or −1.0).
    """

    rows: tuple[tuple[int, float], tuple[int, float], tuple[int, float]]

    @classmethod
    def parse(cls, text: str) -> "AxisMap":
        """From words such as "x,y,z" (as they are) or "-y,x,z" (the body's x is the sensor's −y).

        Raises:
            LevelheadError: not three axes, one twice, or a mirror image, which no mounting can be.
        """
        rows = []
        for word in text.lower().replace(" ", "").split(","):
            letter = word.lstrip("+-")
            if letter not in tuple(NAMES) or len(word) - len(letter) > 1:
                raise LevelheadError(f"axes '{text}' are none; expected the sensor's axes for x, y, z, such as -y,x,z")
            rows.append((NAMES.index(letter), -1.0 if word.startswith("-") else 1.0))
        if len(rows) != 3 or len({axis for axis, _ in rows}) != 3:
            raise LevelheadError(f"axes '{text}' do not name each of x, y, z once; expected such as -y,x,z")
        found = cls((rows[0], rows[1], rows[2]))
        if np.linalg.det(found.matrix) < 0.0:
            mirrored = ",".join([*text.replace(" ", "").split(",")[:2], _opposite(rows[2])])
            raise LevelheadError(
                f"axes '{text}' are a mirror image: no way of mounting a sensor does that; perhaps {mirrored} is meant"
            )
        return found

    @property
    def matrix(self) -> Array:
        """(3, 3) rotation from the sensor's frame to the body's."""
        matrix = np.zeros((3, 3))
        for row, (axis, sign) in enumerate(self.rows):
            matrix[row, axis] = sign
        return matrix

    def __str__(self) -> str:
        return ",".join(("-" if sign < 0.0 else "") + NAMES[axis] for axis, sign in self.rows)

    def turn(self, v: Triple) -> Triple:
        """A vector of the sensor's frame in the body's."""
        (i, a), (j, b), (k, c) = self.rows
        return v[i] * a, v[j] * b, v[k] * c

    def apply(self, sample: Sample) -> Sample:
        """A sample in the body's frame."""
        mag = None if sample.mag is None else self.turn(sample.mag)
        return sample._replace(gyr=self.turn(sample.gyr), acc=self.turn(sample.acc), mag=mag)


IDENTITY = AxisMap(((0, 1.0), (1, 1.0), (2, 1.0)))


def _opposite(row: tuple[int, float]) -> str:
    return ("" if row[1] < 0.0 else "-") + NAMES[row[0]]


def find_axes(recording: Recording) -> AxisMap:
    """The axis map from a still pose and one turn.

    The body stands level and still for a second or more and is then leaned to its right side, by 30° or more, and left
    there or brought back. Gravity of the still pose says which of the sensor's axes is up, the turn which one is
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
    if np.linalg.norm(turned[far]) < LEAST_TURN:
        raise LevelheadError("there is no turn in the recording; lean the body to its right side, by 30° or more")
    _must_agree(t, gyr - bias, acc)
    forward = _nearest_axis(turned[far] / np.linalg.norm(turned[far]), "of the turn")
    if forward[0] == up[0]:
        raise LevelheadError("the turn is about the vertical, which adds nothing; lean the body to its right side")
    left = np.cross(_unit(up), _unit(forward))
    axis = int(np.abs(left).argmax())
    return AxisMap((forward, (axis, float(left[axis])), up))


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
    if score < AGREES:
        raise LevelheadError(
            f"gyroscope and accelerometer contradict each other about the turn (correlation {score:.2f}): "
            "one of them has a mirrored or swapped axis"
        )
