"""The motion of emulated chips: a recording, played over and over by a clock."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from levelhead.recording import Recording
from levelhead.sample import Triple, Wxyz

STANDARD_PRESSURE = 101325.0  # Pa


class Moment(NamedTuple):
    """Rate (rad/s), specific force (m/s²) and field (µT) at one instant, in the sensor's frame."""

    gyr: Triple
    acc: Triple
    mag: Triple


class World:
    """A recording as something that goes on for ever.

    Args:
        recording: without missing rows; played from the start again when it ends.
        clock: host time in s.
        pressure: Pa, the same for ever.
        temperature: °C, the same for ever.

    Attributes:
        began: host time at which the first chip began to measure, and the recording with it, however long the program
            took until then; None before.
    """

    def __init__(
        self, recording: Recording, clock: Callable[[], float] = time.monotonic,
        pressure: float = STANDARD_PRESSURE, temperature: float = 25.0,
    ) -> None:  # fmt: skip
        self.clock, self.pressure, self.temperature = clock, pressure, temperature
        self._rate, self._n = recording.rate, len(recording)
        self._values = {"gyr": recording.gyr, "acc": recording.acc}
        self._values["mag"] = np.zeros((self._n, 3)) if recording.mag is None else recording.mag
        self._quat = np.zeros((self._n, 4)) if recording.truth is None else recording.truth.quat
        self._coded: dict[tuple[str | float, ...], list[bytes]] = {}
        self.began: float | None = None

    def since(self, at: float) -> float:
        """Seconds from the beginning to host time ``at``; the first one who asks sets the beginning."""
        if self.began is None:
            self.began = at
        return at - self.began

    def row(self, seconds: float) -> int:
        """The row of the recording that is felt ``seconds`` after the beginning."""
        return int(seconds * self._rate + 1e-6) % self._n

    def rows(self, order: str, acc_scale: float, gyr_scale: float) -> list[bytes]:
        """Every row as a FIFO has it: accelerometer, then gyroscope, 12 bytes."""
        key = ("rows", order, acc_scale, gyr_scale)
        if key not in self._coded:
            pairs = zip(self.coded("acc", order, acc_scale), self.coded("gyr", order, gyr_scale), strict=True)
            self._coded[key] = [acc + gyr for acc, gyr in pairs]
        return self._coded[key]

    def mag(self, row: int) -> Triple:
        """The field of a row, µT."""
        x, y, z = self._values["mag"][row].tolist()
        return x, y, z

    def at(self, seconds: float) -> Moment:
        """The motion ``seconds`` after the beginning."""
        return self.row_moment(self.row(seconds))

    def attitude(self, row: int) -> Wxyz:
        """The reference orientation of a row; zeros where there is none."""
        w, x, y, z = np.nan_to_num(self._quat[row]).tolist()
        return w, x, y, z

    def row_moment(self, row: int) -> Moment:
        """The motion in a row."""
        return Moment(*(tuple(self._values[name][row].tolist()) for name in ("gyr", "acc", "mag")))

    def coded(self, name: str, order: str, scale: float) -> list[bytes]:
        """Every row of "gyr", "acc" or "mag" as three 16-bit numbers of bits of size ``scale``, clipped at the end of
        the word; ``order`` is ">" or "<". Made once, so that a measurement costs its reader nothing, as in a real chip.
        """
        key = (name, order, scale)
        if key not in self._coded:
            codes = np.clip(np.rint(self._values[name] / scale), -32768, 32767).astype(f"{order}i2")
            whole = codes.tobytes()
            self._coded[key] = [whole[start : start + 6] for start in range(0, len(whole), 6)]
        return self._coded[key]
