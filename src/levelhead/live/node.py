"""The node: samples in, orientations out, at absolute deadlines, and a safe state when there is nothing to say."""

import math
import os
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from levelhead import filters
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.stream import Stream
from levelhead.errors import LevelheadError
from levelhead.guard import Guard
from levelhead.live.box import BlackBox
from levelhead.live.bus import LocalBus, MessageBus
from levelhead.live.events import EVENTS, Happening, Journal
from levelhead.live.health_monitor import Watch
from levelhead.live.messages import CONFIG, HEALTH, ORIENTATION, RAW, TOPICS, Health, Orientation, Raw
from levelhead.live.static_calibration import LEFT, TICKS, StillCalibration
from levelhead.live.timing import Spread, undisturbed
from levelhead.sample import Sample, Triple
from levelhead.sources.sensors.bus import SensorError
from levelhead.sources.source import Source
from levelhead.version import VERSION

BUDGET = 200e-6  # s for fusing, publishing and logging in one tick
SILENCE = 0.1  # s without a sample, at least, before the source counts as silent
SILENT_SAMPLES = 5.0
FIRST_PATIENCE, FIRST_GAPS = 1.0, 5  # s, and gaps, before it is known how often samples come
LONGEST_GAP, SHARE = 2.0, 0.05  # s, and weight of a gap in the running mean of the interval
AGAIN = 1.0  # s between two attempts to reach a source that is silent
ASK = 0.25  # s between two questions to bus and black box, whether all is well
WHOLE = 2.1  # the components of a unit quaternion add up to 2 at most
GIVE_UP = 10.0  # s without a sample


class SourceLost(LevelheadError):
    """The source went away and did not come back."""

    exit_code = 3


class Node:
    """Runs a filter on a live source.

    Args:
        source: where samples come from; the node starts and closes it.
        params: the filter, as for ``Stream``; None: the best one.
        guard: as for ``Stream``; full scales that the source knows are filled in.
        rate: ticks a second, Hz.
        calibrate: still samples from which the gyroscope's bias is read off before the first orientation; 0: none.
        bus: where messages go; None: a bus of its own, ``node.bus``.
        box: a black box, which the node closes, or None.
        realtime: ask the system for real-time priority.
        budget: s that fusing, publishing and logging may take in a tick.
        give_up: s without a sample after which ``run`` ends with ``SourceLost``.
        clock: host time in s.
        sleep: waits so many seconds.

    Attributes:
        bus: the bus.
        journal: warnings that hold, and counts of all events.
        samples: how many were taken.
        missed: ticks that were skipped, because they came too late.

    Raises:
        LevelheadError: a rate or a filter that is none, or another node on the bus's topics.
    """

    def __init__(
        self, source: Source, params: Any = None, *, guard: Guard | None = DEFAULT_GUARD, rate: float = 200.0,
        calibrate: int = TICKS, bus: MessageBus | None = None, box: BlackBox | None = None, realtime: bool = False,
        budget: float = BUDGET, give_up: float = GIVE_UP,
        clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        if not 1.0 <= rate <= 10_000.0:
            raise LevelheadError(f"the rate is {rate:g} Hz; expected 1 to 10000")
        self.source, self.rate, self._box, self._realtime = source, rate, box, realtime
        self._budget, self._give_up, self._clock, self._sleep = budget, give_up, clock, sleep
        self.guard = guard
        if guard is not None and source.gyr_range > 0.0:
            self.guard = guard._replace(
                gyr_range=guard.gyr_range or source.gyr_range, acc_range=guard.acc_range or source.acc_range
            )
        self._stream = Stream(filters.best() if params is None else params, guard=self.guard)
        self.bus: Any = LocalBus() if bus is None else bus
        self.id = int.from_bytes(os.urandom(4), "little")
        for topic in TOPICS:
            self.bus.advertise(topic, self.id)
        self._calibration = StillCalibration(calibrate) if calibrate > 0 else None
        self._bias: Triple = (0.0, 0.0, 0.0)
        self.journal = Journal(self._tell, clock)
        self._watch = Watch(self.journal)
        self.samples = self.missed = self.ticks = self.over_budget = 0
        self.lateness, self.reading, self.work, self.whole = Spread(), Spread(), Spread(), Spread()
        self.last: Orientation | None = None
        self._time = -math.inf  # stamp of the last sample, s on the source's clock
        self._fused_at: float | None = None  # stamp of the last sample that the filter took
        self._seen = self._tried = self._asked = (
            0.0  # host time of the last sample, and of the last attempt to wake the source
        )
        self._changes: deque[dict[str, float]] = deque()
        self._stopped = self._began = self._closed = False
        self._again = False  # deadlines begin anew
        self._hurried = math.isinf(getattr(source, "speed", 1.0))  # nothing to wait for, and no priority to do it with
        self._interval, self._gaps, self._limit = 0.0, 0, FIRST_PATIENCE

    # For other threads

    @property
    def params(self) -> Any:
        """The filter's parameters in use."""
        return self._stream.params

    def set(self, **changes: float) -> None:
        """Changes the filter's parameters from the next tick on; may be called from any thread.

        Raises:
            LevelheadError: no such parameter, or a value out of its range; nothing is changed.
        """
        self.params._replace(**changes)
        self._changes.append(
            {name: value if isinstance(value, bool) else float(value) for name, value in changes.items()}
        )

    def stop(self) -> None:
        """Ends ``run`` after this tick; may be called from any thread and from a signal handler."""
        self._stopped = True

    # Running

    def run(self, duration: float | None = None) -> dict[str, Any]:
        """Works until ``duration`` s are over, the source ends, ``stop`` is called or Ctrl-C is pressed.

        Returns:
            The figures of the run, see ``figures``.

        Raises:
            SensorError: the source cannot be started.
            SourceLost: it was silent for too long.
            LevelheadError: the sensor never was still enough for the calibration.
        """
        try:
            with undisturbed(self._realtime and not self._hurried) as lacking:
                self.begin(lacking)
                self._loop(math.inf if duration is None else duration)
        finally:
            self.close()
        return self.figures()

    def begin(self, lacking: str = "") -> None:
        """Starts the source and says so; ``lacking``: what could not be had."""
        self.source.start()
        self._began = True
        config = self._config(lacking)
        if self._box is not None:
            self._box.begin(config)
        self.journal.note("started", f"{self.source.name} at {self.rate:g} Hz through {config['filter']}", **config)
        self.bus.publish(CONFIG, self._message(Happening("config", True, self.source.name, config)))
        self._seen = self._tried = self._clock()
        if self._calibration is not None:
            self.journal.begin("calibrating", f"hold still for {self._calibration.ticks} samples")

    def _config(self, lacking: str) -> dict[str, Any]:
        return {
            "version": VERSION,
            "source": self.source.name,
            "rate": self.rate,
            "source_rate": self.source.rate,
            "filter": filters.of(self.params).name,
            "params": self.params._asdict(),
            "guard": None if self.guard is None else self.guard._asdict(),
            "calibrate": 0 if self._calibration is None else self._calibration.ticks,
            "lacking": lacking,
        }

    def _loop(self, duration: float) -> None:
        period = 1.0 / self.rate
        began = start = self._clock()
        tick = 0
        while not self._stopped:
            now = self._clock()
            if now - began >= duration:
                return
            late = 0.0
            if not self._hurried:
                deadline = start + tick * period
                if deadline > now:
                    self._sleep(deadline - now)
                    now = self._clock()
                late = now - deadline
                self.lateness.add(late)
            skipped = int(late / period)
            if skipped > 0:
                self._skip(skipped, late)
            self.tick(late=skipped > 0)
            tick += 1 + skipped
            if self._again:
                self._again, start, tick = False, self._clock(), 0

    def _skip(self, skipped: int, late: float) -> None:
        """What is stale is worse than what is missing: ticks are not made up for."""
        self.missed += skipped
        self.journal.note("late", f"{skipped} ticks were missed: the last one came {1e3 * late:.1f} ms late")

    def tick(self, late: bool = False) -> None:
        """One turn: reads what is new, fuses it, publishes, logs. After a late one only the newest is published."""
        began = self._clock()
        self.ticks += 1
        if self._changes or self.bus.commands:
            self._change()
        samples = self._read()
        read = self._clock()
        newest = len(samples) - 1
        for i, sample in enumerate(samples):
            self._take(sample, publish=i == newest or not late)
        if samples:
            self._heard(read, len(samples))
        elif read - self._seen > self._limit:
            self._silent(read)
        self._report(read)
        over = self._clock()
        self.reading.add(read - began)
        self.work.add(over - read)
        self.whole.add(over - began)
        if over - read > self._budget * max(1, len(samples)):
            self.over_budget += 1
            self.journal.note(
                "over_budget", f"a tick took {1e6 * (over - read):.0f} µs, its budget is {1e6 * self._budget:.0f}"
            )

    def _heard(self, now: float, count: int) -> None:
        """How often samples come decides when their absence is silence."""
        gap = min(now - self._seen, LONGEST_GAP) / count
        self._gaps += 1
        self._interval += max(SHARE, 1.0 / self._gaps) * (gap - self._interval)
        if self._gaps >= FIRST_GAPS:
            self._limit = max(SILENCE, SILENT_SAMPLES * self._interval)
        self._seen = now

    def _change(self) -> None:
        while self.bus.commands:
            try:
                self.set(**self.bus.commands.popleft())
            except (LevelheadError, TypeError) as error:
                self.journal.note("not_set", str(error))
        changes: dict[str, float] = {}
        while self._changes:
            changes |= self._changes.popleft()
        if changes:
            self._changed(changes)

    def _changed(self, changes: dict[str, float]) -> None:
        """Other parameters, from the next sample on."""
        self._stream.set(**changes)
        said = ", ".join(f"{name}={value:g}" for name, value in changes.items())
        self.journal.counts.setdefault("parameters", 0)
        self._tell(Happening("parameters", True, said, {"params": self.params._asdict(), "from": self.samples}))
        self.bus.publish(CONFIG, self._message(Happening("config", True, said, self._config(""))))

    def _read(self) -> list[Sample]:
        try:
            samples = self.source.poll()
        except SensorError as error:
            self.journal.begin(error.kind, str(error))
            return []
        if samples and self.journal.active:
            for kind in ("bus_error", "bus_stuck", "implausible", "unplugged", "wrong_chip"):
                self.journal.end(kind)
        if not samples and self.source.ended:
            self.journal.note("ended", f"{self.source.name} is over")
            self._stopped = True
        return samples

    def _report(self, now: float) -> None:
        for name, words in self.source.troubles():
            self.journal.note(name, words)
        if now - self._asked < ASK:
            return
        self._asked = now
        for name, words in self.bus.troubles():
            self.journal.note(name, words)
        if self._box is not None and self._box.failure:
            self.journal.begin("box_failed", self._box.failure)

    # One sample

    def _take(self, sample: Sample, publish: bool) -> None:
        if not sample.t > self._time:
            self.journal.note("time_backwards", f"a sample came with the stamp {sample.t!r} after {self._time!r}")
            return
        self._time = sample.t
        seq, stamp = self.samples, time.time_ns()
        self.samples += 1
        self.bus.publish(RAW, Raw(self.id, seq, sample.t, stamp, sample.gyr, sample.acc, sample.mag, sample.pressure))
        waits = self._calibration is not None and self._calibrating(self._calibration, sample)
        said = None if waits else self._fused(sample, seq, stamp)
        if said is not None:
            self._watch.look(sample, said.health)
            self.last = said
            if publish:
                if self.journal.active:
                    self.journal.end("silent")
                    self.journal.end("invalid")
                self.bus.publish(ORIENTATION, said)
        if self._box is not None:
            self._box.sample(seq, stamp, sample, said)

    def _calibrating(self, calibration: StillCalibration, sample: Sample) -> bool:
        """Spends the sample on reading off the bias."""
        why = calibration.take(sample.gyr, sample.acc)
        if why:
            self.journal.note("calibration_refused", why)
        if calibration.hopeless:
            raise LevelheadError(
                f"the sensor was not still for {calibration.ticks} samples on end, in {calibration.taken}; hold it "
                "still at the start, or run without calibration (--calibrate 0)"
            )
        if calibration.done:
            self._calibration, self._bias = None, calibration.bias
            self.journal.end("calibrating")
            degrees = ", ".join(f"{math.degrees(rate):.3f}" for rate in self._bias)
            self.journal.note("calibrated", f"the gyroscope's bias is {degrees} °/s", bias=list(self._bias))
            if getattr(self.params, "bias_start", 0.0) > LEFT:  # the filter cannot know that it was taken off
                self._changed({"bias_start": LEFT})
        return True

    def _fused(self, sample: Sample, seq: int, stamp: int) -> Orientation | None:
        (x, y, z), (a, b, c) = sample.gyr, self._bias
        dt = 1.0 if self._fused_at is None else sample.t - self._fused_at  # before the first sample any will do
        try:
            w, i, j, k = self._stream.update((x - a, y - b, z - c), sample.acc, sample.mag, dt)
        except LevelheadError as error:
            self.journal.note("refused", str(error))
            return None
        self._fused_at = sample.t
        if not abs(w) + abs(i) + abs(j) + abs(k) <= WHOLE:  # no filter does that; if one does, nobody may steer by it
            self.journal.note("refused", "the filter's orientation is not finite")
            self._invalid("the filter's orientation is not finite")
            self._stream.reset()
            return None
        _, _, _, _, x, y, z, east, north, up, health = self._stream.numbers
        bias, sigma = (x + a, y + b, z + c), (east, north, up)
        return Orientation(self.id, seq, sample.t, stamp, (w, i, j, k), sigma, bias, int(health))

    # When there is nothing to say

    def _silent(self, now: float) -> None:
        since = now - self._seen
        self.journal.begin("silent", f"{self.source.name} has given nothing for {since:.2f} s")
        self._invalid("the source is silent")
        if since > self._give_up:
            why = "; ".join(words for name, words in self.journal.active.items() if name not in ("invalid", "silent"))
            raise SourceLost(f"{self.source.name} has given nothing for {since:.0f} s{': ' + why if why else ''}")
        if now - self._tried > AGAIN:
            self._tried = now
            try:
                self.source.restart()
            except LevelheadError as error:
                self.journal.begin(getattr(error, "kind", "bus_error"), str(error))
            self._again = True

    def _invalid(self, why: str) -> None:
        """The safe state: the last orientation once more, marked invalid, then nothing until there are samples."""
        if "invalid" in self.journal.active or self.last is None:
            return
        self.journal.begin("invalid", f"{EVENTS['invalid']}: {why}")
        self.bus.publish(ORIENTATION, self.last._replace(valid=False))

    def close(self) -> None:
        """The safe state, the last words, and everything let go of; may be called twice."""
        if self._closed:
            return
        self._closed = True
        if self._began:
            self._invalid("the node ends")
            self.journal.note("stopped", f"{self.samples} samples, {self.missed} ticks missed", **self.figures())
        for topic in TOPICS:
            self.bus.withdraw(topic, self.id)
        if self._box is not None:
            self._box.close()
        self.source.close()

    def figures(self) -> dict[str, Any]:
        """Samples, losses, how late ticks came, and what they took: for reading, for the work after it, as a whole."""
        return {
            "samples": self.samples,
            "lost": self.journal.counts.get("samples_lost", 0),
            "ticks": self.ticks,
            "missed": self.missed,
            "over_budget": self.over_budget,
            "lateness": self.lateness.figures(),
            "reading": self.reading.figures(),
            "work": self.work.figures(),
            "whole": self.whole.figures(),
            "events": dict(self.journal.counts),
        }

    def _tell(self, what: Happening) -> None:
        message = self._message(what)
        self.bus.publish(HEALTH, message)
        if self._box is not None:
            self._box.event(message)

    def _message(self, what: Happening) -> Health:
        t = self._time if math.isfinite(self._time) else 0.0
        return Health(self.id, self.samples, t, time.time_ns(), what.name, what.on, what.text, what.data)

    def __enter__(self) -> "Node":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
