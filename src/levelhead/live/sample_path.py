"""The path of a sample through the node: stamp, start-up bias, filter, health, publication, black box."""

import math
import time
from collections.abc import Callable

from levelhead import filters
from levelhead.engine.stream import Stream
from levelhead.errors import LevelheadError
from levelhead.filters.health import AT_REST
from levelhead.gaits.live import StanceDetector
from levelhead.gaits.stance import LONGEST_SWING
from levelhead.live.bus import MessageBus
from levelhead.live.events import Journal
from levelhead.live.health_monitor import HealthMonitor
from levelhead.live.messages import ORIENTATION, RAW, Orientation, Raw
from levelhead.live.recorder import Recorder
from levelhead.live.safe_state import SafeState
from levelhead.live.sensor_motion import SensorMotion
from levelhead.live.static_calibration import SIGMA, StaticCalibration
from levelhead.open_types import JsonObject
from levelhead.sample import Sample, Triple

MAX_NORM_SUM = 2.1  # the absolute components of a unit quaternion add up to 2 at most


class SamplePath:
    """Makes an orientation of each sample.

    Args:
        node: id of the node.
        stream: the filter.
        calibration: of the gyroscope's bias at the start, or None.
        bus: where raw samples and orientations are published.
        recorder: holds the black box, if there is one.
        journal: takes the events.
        motion: rate and specific force without the known errors of the sensor.
        safe_state: left when an orientation is published, entered when the filter fails.
        set_params: changes the filter's parameters.
        detector: of stances, where the sensor is on a foot.

    Attributes:
        samples: how many were taken.
        time: stamp of the last sample, s on the source's clock.
        bias: gyroscope bias that is subtracted before the filter, rad/s.
        last: the last orientation, published or not.
        monitor: the warnings.
    """

    def __init__(
        self, node: int, stream: Stream, calibration: StaticCalibration | None, bus: MessageBus, recorder: Recorder,
        journal: Journal, motion: SensorMotion, safe_state: SafeState, set_params: Callable[[JsonObject], None],
        detector: StanceDetector | None = None,
    ) -> None:  # fmt: skip
        self._node, self._stream, self._bus, self._recorder, self._journal = node, stream, bus, recorder, journal
        self.calibration, self._safe_state, self._set_params = calibration, safe_state, set_params
        self._motion = motion
        self.monitor = HealthMonitor(journal)
        self._detector = detector
        self.samples = 0
        self.time = -math.inf
        self.bias: Triple = (0.0, 0.0, 0.0)
        self.last: Orientation | None = None
        self._temperature = math.nan  # °C that the filter was given last
        self._fused_time: float | None = None  # stamp of the last sample that the filter took

    def add(self, sample: Sample, publish: bool) -> None:
        """Takes one sample; ``publish``: whether its orientation is published."""
        if not sample.t > self.time:
            self._journal.note("time_backwards", f"a sample came with the stamp {sample.t!r} after {self.time!r}")
            return
        self.time = sample.t
        seq, stamp = self.samples, time.time_ns()
        self.samples += 1
        raw = Raw(self._node, seq, sample.t, stamp, sample.gyr, sample.acc, sample.mag, sample.pressure)
        self._bus.publish(RAW, raw)
        orientation = None
        if self.calibration is None:
            orientation = self._fuse(sample, seq, stamp)
        else:
            self._calibrate(self.calibration, sample)
        if orientation is not None:
            self.monitor.add(sample, orientation.health)
            self.last = orientation
            if publish:
                self._safe_state.leave()
                self._bus.publish(ORIENTATION, orientation)
        if (box := self._recorder.box) is not None:
            box.sample(seq, stamp, sample, orientation)

    def _calibrate(self, calibration: StaticCalibration, sample: Sample) -> None:
        """Uses the sample for the gyroscope's bias.

        Raises:
            LevelheadError: the sensor has moved for too long.
        """
        why = calibration.add(sample.gyr, sample.acc)
        if why:
            self._journal.note("calibration_refused", why)
        if calibration.failed:
            raise LevelheadError(
                f"the sensor was not still for {calibration.samples} samples on end, in {calibration.taken}; hold it "
                "still at the start, or run without calibration (--calibrate 0)"
            )
        if calibration.done:
            self.calibration, self.bias = None, calibration.bias
            self._journal.end("calibrating")
            degrees = ", ".join(f"{math.degrees(rate):.3f}" for rate in self.bias)
            self._journal.note("calibrated", f"the gyroscope's bias is {degrees} °/s", bias=list(self.bias))
            self._tell_filter()

    def _tell_filter(self) -> None:
        """The filter starts with the σ that is left of the bias, where it has such a parameter."""
        params = self._stream.params
        with_known_bias = filters.of(params).with_known_bias
        if with_known_bias is not None:
            before, after = params._asdict(), with_known_bias(params, SIGMA)._asdict()
            changes = {name: value for name, value in after.items() if value != before[name]}
            if changes:
                self._set_params(changes)

    def _fuse(self, sample: Sample, seq: int, stamp: int) -> Orientation | None:
        (x, y, z), (a, b, c) = sample.gyr, self.bias
        rate = x - a, y - b, z - c
        if sample.temperature is not None and sample.temperature != self._temperature:
            self._stream.update_temperature(sample.temperature)
            self._motion.set_temperature(sample.temperature)
            self._temperature = sample.temperature
        dt = 1.0 if self._fused_time is None else sample.t - self._fused_time  # any dt will do before the first sample
        try:
            w, i, j, k = self._stream.update(rate, sample.acc, sample.mag, dt)
        except LevelheadError as error:
            self._journal.note("refused", str(error))
            return None
        self._fused_time = sample.t
        if self._detector is not None:
            self._find_stance(self._detector, sample, (x - a, y - b, z - c), dt)
        if (
            not abs(w) + abs(i) + abs(j) + abs(k) <= MAX_NORM_SUM
        ):  # no filter gives that; if one does, it is not published
            self._journal.note("refused", "the filter's orientation is not finite")
            self._safe_state.enter("the filter's orientation is not finite")
            self._stream.reset()
            return None
        _, _, _, _, x, y, z, east, north, up, health = self._stream.numbers
        bias, sigma = (x + a, y + b, z + c), (east, north, up)
        motion = self._motion.measure(rate, sample.acc, (x, y, z), bool(int(health) & AT_REST))
        return Orientation(self._node, seq, sample.t, stamp, (w, i, j, k), sigma, bias, int(health), True, *motion)

    def _find_stance(self, detector: StanceDetector, sample: Sample, gyr: Triple, dt: float) -> None:
        """Tells the filter of a foot that stands, and the journal of each stance with the position there."""
        sigma = detector.update(gyr, sample.acc, dt)
        if sigma is not None:
            self._stream.update_zero_velocity(sigma)
        if detector.swung >= LONGEST_SWING:
            self._journal.begin("unbounded", f"no stance for {LONGEST_SWING:g} s: nothing bounds position")
        if detector.begins and (now := self._stream.nav_state) is not None:
            self._journal.end("unbounded")
            x, y, z = now.position
            off = math.hypot(*now.sigma_position)
            data = {"t": sample.t, "position": list(now.position), "sigma": list(now.sigma_position)}
            self._journal.tell("stance", f"at {x:.2f}, {y:.2f}, {z:.2f} m ± {off:.2f} m", **data)
