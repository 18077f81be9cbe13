"""Faults on top of any recording, real or simulated: their kind, size, start and duration.

>>> from levelhead import simulate
>>> simulate.parse_fault("acc_spikes=4@20+5")
Fault('acc_spikes', size=4.0, start=20.0, length=5.0)
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError, nearest
from levelhead.recording import Recording
from levelhead.simulate import fault_effects as effects
from levelhead.simulate.noise import generator
from levelhead.units import GRAVITY, factor

MIN_DURATION = 20.0  # s of a recording that has room for a fault, and for the time before and after it
START, LONGEST_SHARE = 0.4, 0.3  # of the recording, by default
NEW_RANGE = 0.6  # of the largest reading: a full scale that this motion exceeds
NUMBER = r"(-?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)"
FAULTS_STREAM = 2  # of random numbers; a simulated recording's own are 0 and 1
BOUNDS = {"%": (0.0, 100.0), "of 3 axes": (1.0, 3.0)}  # unit: least and most


class FaultKind(NamedTuple):
    """A kind of fault.

    Attributes:
        name: as on the command line.
        words: its description, for people.
        unit: of its size.
        quantity: whose unit that is ("time", "gyr", "acc", "mag", "angle"), or "": it is SI or none.
        size: by default; a function where it depends on the recording.
        effect: its change of the readings.
        length: s by default, but at most 30 % of the recording; infinite: it stays to the end.
    """

    name: str
    words: str
    unit: str
    quantity: str
    size: float | Callable[[Recording], float]
    effect: effects.Effect
    length: float = 10.0

    @property
    def needs_field(self) -> bool:
        """Whether it is one of a magnetometer."""
        return self.name.startswith("mag")


def _gyr_range(recording: Recording) -> float:
    return NEW_RANGE * math.degrees(float(np.nanmax(np.abs(recording.gyr), initial=0.0))) or 1.0


def _acc_range(recording: Recording) -> float:
    """Between 1 g, which an accelerometer always has to see, and the largest reading."""
    largest = float(np.nanmax(np.abs(recording.acc), initial=0.0)) / GRAVITY
    return 1.0 + NEW_RANGE * max(largest - 1.0, 0.0)


KINDS = (
    FaultKind("jitter", "stamps jitter (1σ)", "ms", "time", 4.0, effects.jitter_stamps),
    FaultKind("dropped", "samples are dropped", "%", "", 20.0, effects.drop_samples),
    FaultKind("doubled", "samples are doubled: a row repeats the row before", "%", "", 20.0, effects.double_samples),
    FaultKind("bursts", "samples come in bursts, stamped on arrival, one burst every", "ms", "time", 100.0,
              effects.bunch_stamps),
    FaultKind("mag_late", "the magnetometer comes late by", "ms", "time", 100.0, effects.delay_field),
    FaultKind("mag_slow", "the magnetometer gives readings a second", "Hz", "", 5.0, effects.slow_field),
    FaultKind("gyr_stuck", "axes of the gyroscope are stuck", "of 3 axes", "", 1.0, effects.stick_gyr),
    FaultKind("acc_stuck", "axes of the accelerometer are stuck", "of 3 axes", "", 1.0, effects.stick_acc),
    FaultKind("gyr_spikes", "two spikes a second in the gyroscope", "deg/s", "gyr", 500.0, effects.spike_gyr),
    FaultKind("acc_spikes", "two spikes a second in the accelerometer", "g", "acc", 4.0, effects.spike_acc),
    FaultKind("gyr_clipping", "the gyroscope clips at a lower range", "deg/s", "gyr", _gyr_range, effects.clip_gyr),
    FaultKind("acc_clipping", "the accelerometer clips at a lower range", "g", "acc", _acc_range, effects.clip_acc),
    FaultKind("gyr_rounding", "the gyroscope's resolution is coarse", "deg/s", "gyr", 1.0, effects.round_gyr),
    FaultKind("acc_rounding", "the accelerometer's resolution is coarse", "g", "acc", 0.05, effects.round_acc),
    FaultKind("bias_ramp", "the gyroscope's bias changes as it warms up", "deg/s", "gyr", 1.0, effects.ramp_bias,
              length=60.0),
    FaultKind("shock", "a shock a second", "g", "acc", 20.0, effects.shock),
    FaultKind("vibration", "a motor vibrates", "g", "acc", 1.0, effects.vibrate),
    FaultKind("mag_passing", "a magnet passes", "µT", "mag", 60.0, effects.pass_magnet),
    FaultKind("mag_staying", "a magnet comes and stays with the sensor", "µT", "mag", 30.0, effects.place_magnet,
              length=math.inf),
    FaultKind("loose_mount", "the sensor loosens and turns on its mount", "deg", "angle", 10.0, effects.loosen),
    FaultKind("gyr_units", "the gyroscope's unit is mixed up: its numbers are too large", "times", "", 57.29578,
              effects.scale_gyr),
    FaultKind("acc_units", "the accelerometer's unit is mixed up: g for m/s²", "times", "", 0.1019716,
              effects.scale_acc),
)  # fmt: skip
BY_NAME = {kind.name: kind for kind in KINDS}


@dataclass(frozen=True)
class Fault:
    """A fault; ``None`` where the recording is to decide, see ``complete``.

    Attributes:
        name: of its kind, see ``KINDS``.
        size: in the kind's unit.
        start: s after the first sample.
        length: s; infinite: to the end of the recording.

    Raises:
        LevelheadError: an unknown kind (the nearest is named) or a number out of range.
    """

    name: str
    size: float | None = None
    start: float | None = None
    length: float | None = None

    def __post_init__(self) -> None:
        if self.name not in BY_NAME:
            raise LevelheadError(f"there is no fault '{self.name}'; {nearest(self.name, BY_NAME)}")
        low, high = BOUNDS.get(self.kind.unit, (0.0, math.inf))
        if self.size is not None and not (max(low, 0.0) <= self.size <= high and 0.0 < self.size < math.inf):
            wanted = f"{low:g} to {high:g}" if high < math.inf else "more than 0"
            raise LevelheadError(f"the size of {self.name} is {self.size:g}; expected {wanted} {self.kind.unit}")
        if self.start is not None and not 0.0 <= self.start < math.inf:
            raise LevelheadError(f"{self.name} starts at {self.start:g} s; expected 0 s or later")
        if self.length is not None and not self.length > 0.0:
            raise LevelheadError(f"{self.name} lasts {self.length:g} s; expected more than 0 s")

    @property
    def kind(self) -> FaultKind:
        """The kind, by its name."""
        return BY_NAME[self.name]

    def __str__(self) -> str:
        size = "" if self.size is None else f"={self.size:.4g}"
        when = "" if self.start is None else f"@{self.start:.4g}"
        end = "" if self.length is None or math.isinf(self.length) else f"+{self.length:.4g}"
        return f"{self.name}{size}{when}{end}"

    def __repr__(self) -> str:
        return f"Fault({self.name!r}, size={self.size}, start={self.start}, length={self.length})"


def parse_fault(word: str) -> Fault:
    """The fault that ``NAME[=SIZE][@START[+LENGTH]]`` writes, such as ``gyr_spikes=500@20+5``.

    Raises:
        LevelheadError: another form, an unknown name or a number out of range.
    """
    match = re.fullmatch(rf"(\w+)(?:={NUMBER})?(?:@{NUMBER}(?:\+{NUMBER})?)?", word.strip())
    if match is None:
        raise LevelheadError(
            f"'{word}' is not a fault; write NAME[=SIZE][@START[+LENGTH]], such as acc_spikes=4@20+5 (g, s, s)"
        )
    name, *numbers = match.groups()
    return Fault(name, *(None if one is None else float(one) for one in numbers))


@dataclass(frozen=True, eq=False)
class Faulted:
    """A recording with a fault in it.

    Attributes:
        recording: the sensor's readings; its truth is that of the body, at the times at which it was measured.
        fault: with all its numbers.
        rows: (n,) the row of the sound recording that each sample is.
        first, last: of ``recording``'s rows: from ``first`` to before ``last`` the fault lasts.
    """

    recording: Recording
    fault: Fault
    rows: NDArray[np.intp]
    first: int
    last: int


def complete(fault: Fault, recording: Recording) -> Fault:
    """The fault with a size, a start and a length: its own, or those that suit the recording.

    By default a fault starts at 40 % of the recording and lasts 10 s, but 30 % of it at most.

    Raises:
        LevelheadError: the recording is too short, ends before the fault starts, or has no magnetometer for it.
    """
    kind, duration = fault.kind, recording.duration
    if duration < MIN_DURATION:
        raise LevelheadError(
            f"the recording is {duration:.3g} s long; a fault needs {MIN_DURATION:g} s, so that there is a time "
            "before it and one after it"
        )
    if kind.needs_field and recording.mag is None:
        raise LevelheadError(f"{fault.name} is a fault of a magnetometer, and the recording has none")
    size = fault.size if fault.size is not None else kind.size
    start = START * duration if fault.start is None else fault.start
    if start >= duration:
        raise LevelheadError(f"{fault.name} starts at {start:g} s, but the recording ends at {duration:.4g} s")
    usual = kind.length if math.isinf(kind.length) else min(kind.length, LONGEST_SHARE * duration)
    length = usual if fault.length is None else fault.length
    return replace(fault, size=size(recording) if callable(size) else size, start=start, length=length)


def apply_fault(recording: Recording, fault: Fault, seed: int = 0) -> Faulted:
    """The recording with the fault in it, which is made ``complete`` first.

    Args:
        recording: any; it stays as it is.
        fault: the kind, size and time.
        seed: zero or more; the same seed gives the same bits.

    Raises:
        LevelheadError: see ``complete``; or the window has fewer than three samples.
    """
    fault = complete(fault, recording)
    kind = fault.kind
    assert fault.size is not None and fault.start is not None and fault.length is not None
    begin = float(recording.t[0]) + fault.start
    first, last = (int(row) for row in np.searchsorted(recording.t, [begin, begin + fault.length]))
    if last - first < 3:
        raise LevelheadError(f"{fault} has {last - first} samples; expected a time with three samples at least")
    readings = effects.Readings(
        recording.t.copy(),
        recording.gyr.copy(),
        recording.acc.copy(),
        None if recording.mag is None else recording.mag.copy(),
        np.arange(len(recording)),
    )
    scale = factor(kind.quantity, kind.unit) if kind.quantity else 0.01 if kind.unit == "%" else 1.0
    random = generator(seed, FAULTS_STREAM, KINDS.index(kind))
    kind.effect(readings, effects.Window(first, last), scale * fault.size, random)
    rows = readings.rows
    made = Recording(
        readings.t,
        readings.gyr,
        readings.acc,
        readings.mag,
        None if recording.truth is None else recording.truth[rows],
        {**recording.meta, "fault": str(fault)},
        recording.pressure,
        recording.gnss,
    )
    begins, ends = np.searchsorted(rows, [first, last])
    return Faulted(made, fault, rows, int(begins), int(ends))


def all_faults(recording: Recording) -> list[Fault]:
    """Every kind of fault that can happen to the recording's sensors, with its usual size and time."""
    return [
        complete(Fault(kind.name), recording) for kind in KINDS if recording.mag is not None or not kind.needs_field
    ]
