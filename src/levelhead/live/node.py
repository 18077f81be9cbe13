"""The node: samples in, orientations out, at absolute deadlines."""

import math
import os
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.stream import Stream
from levelhead.errors import LevelheadError
from levelhead.gaits.live import StanceDetector
from levelhead.gaits.stance import LEAST_RATE
from levelhead.guard import Guard
from levelhead.live.box import BlackBox
from levelhead.live.bus import LocalBus, MessageBus
from levelhead.live.deadline_loop import DeadlineLoop
from levelhead.live.events import Event, Journal
from levelhead.live.latency import LatencyHistogram
from levelhead.live.messages import CONFIG, HEALTH, ORIENTATION, TOPICS, Health, Orientation
from levelhead.live.realtime import realtime_scheduling
from levelhead.live.recorder import Recorder
from levelhead.live.safe_state import SafeState
from levelhead.live.sample_path import SamplePath
from levelhead.live.sensor_motion import SensorMotion
from levelhead.live.static_calibration import SAMPLES, StaticCalibration
from levelhead.open_types import JsonObject
from levelhead.sample import Sample
from levelhead.sources.devices.source import Source
from levelhead.sources.sensors.bus import SensorError
from levelhead.version import VERSION

BUDGET = 200e-6  # s for fusing, publishing and logging in one tick
CHECK_INTERVAL = 0.25  # s between two checks of bus and black box
REFRESH = 1.0  # s between two looks at the filter's calibration, which takes 0.3 ms
GIVE_UP = 10.0  # s without a sample
NO_PARAMETERS = ("heading", "record")  # that ``set`` takes as well
SOURCE_FAULTS = ("bus_error", "bus_stuck", "implausible", "unplugged", "wrong_chip")  # over when samples come


class Node:
    """Runs a filter on a live source.

    Args:
        source: where samples come from; the node starts and closes it.
        params: the filter, as for ``Stream``; None: the best one.
        guard: as for ``Stream``; the source's full scales are filled in.
        rate: ticks per second, Hz.
        calibrate: samples at rest from which the gyroscope's bias is measured before the first orientation; 0: none.
        bus: where messages go; None: a bus of its own, ``node.bus``.
        box: a black box, which the node closes, or None.
        realtime: ask the system for real-time priority.
        budget: s that fusing, publishing and logging may take in a tick.
        give_up: s without a sample after which ``run`` ends with ``SourceLost``.
        known: errors of the sensor: the prior of a filter that learns them, else its calibration (``Stream``). Biases
            with curves follow the source's temperature.
        foot: the sensor is on a foot, whose stances bound position; the journal tells each with the position there.
        clock: host time in s.
        sleep: waits for a number of seconds.

    Attributes:
        bus: the bus.
        guard: the guard in use.
        journal: warnings that hold, and counts of all events.
        loop: how late ticks came, and how many were missed.
        path: the filter, its last orientation, and how many samples it took.

    Raises:
        LevelheadError: a rate or a filter that does not exist, another node on the bus's topics, or a foot below 50 Hz
            or with a filter that takes no zero velocity.
    """

    def __init__(
        self, source: Source, params: Any = None, *, guard: Guard | None = DEFAULT_GUARD, rate: float = 200.0,
        calibrate: int = SAMPLES, bus: MessageBus | None = None, box: BlackBox | None = None, realtime: bool = False,
        budget: float = BUDGET, give_up: float = GIVE_UP, known: Calibration | None = None,
        foot: bool = False, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        if not 1.0 <= rate <= 10_000.0:
            raise LevelheadError(f"the rate is {rate:g} Hz; expected 1 to 10000")
        self.source, self.rate = source, rate
        self._budget, self._clock = budget, clock
        self.guard = guard
        if guard is not None and source.gyr_range > 0.0:
            self.guard = guard._replace(
                gyr_range=guard.gyr_range or source.gyr_range, acc_range=guard.acc_range or source.acc_range
            )
        chosen = filters.live() if params is None else params
        learns = filters.of(chosen).calibration is not None
        if foot and filters.of(chosen).aiding is None:
            raise LevelheadError(
                f"{filters.of(chosen).name} takes no zero velocity: nothing bounds position; ESKF does"
            )
        if foot and rate < LEAST_RATE:
            raise LevelheadError(f"the rate is {rate:g} Hz; a stance shows from {LEAST_RATE:g} on")
        self._stream = Stream(
            chosen, guard=self.guard, prior=known if learns else None, calibration=None if learns else known
        )
        self._motion = SensorMotion(self._stream, known)
        self.bus: Any = LocalBus() if bus is None else bus
        self.id = int.from_bytes(os.urandom(4), "little")
        for topic in TOPICS:
            self.bus.advertise(topic, self.id)
        free_running = math.isinf(getattr(source, "speed", 1.0))  # a replay as fast as it goes
        self._realtime = realtime and not free_running
        self.loop = DeadlineLoop(rate, clock, sleep, free_running)
        self.journal = Journal(self._publish_event, clock)
        self.recorder = Recorder(box, self.journal, self._config)
        self.safe_state = SafeState(source, self.journal, self._publish_invalid, give_up)
        calibration = StaticCalibration(calibrate) if calibrate > 0 else None
        self.path = SamplePath(
            self.id,
            self._stream,
            calibration,
            self.bus,
            self.recorder,
            self.journal,
            self._motion,
            self.safe_state,
            self._apply,
            StanceDetector() if foot else None,
        )
        self.ticks = self.over_budget = 0
        self.reading, self.work, self.whole = LatencyHistogram(), LatencyHistogram(), LatencyHistogram()
        self._changes: deque[dict[str, float]] = deque()
        self._lacking = ""  # rights that the system denies
        self._refreshed = 0.0  # host time of the last look at the filter's calibration
        self._checked = 0.0  # host time of the last check of bus and black box
        self._began = self._closed = False

    # For other threads

    @property
    def params(self) -> Any:
        """The filter's parameters in use."""
        return self._stream.params

    @property
    def last(self) -> Orientation | None:
        """The last orientation."""
        return self.path.last

    @property
    def samples(self) -> int:
        """How many samples were taken."""
        return self.path.samples

    def set(self, **changes: float) -> None:
        """Changes the filter's parameters from the next tick on; may be called from any thread.

        Two names are not parameters. ``heading`` turns the orientation to this yaw in degrees (``Stream.set_heading``),
        as soon as there is one. ``record`` begins a black box (True) or ends it (False).

        Raises:
            LevelheadError: no such parameter, or a value out of its range; nothing is changed.
        """
        heading, record = changes.get("heading", 0.0), changes.get("record", False)
        if isinstance(heading, bool) or not isinstance(heading, int | float) or not math.isfinite(heading):
            raise LevelheadError(f"the heading is {heading!r}; expected degrees")
        if not isinstance(record, bool):
            raise LevelheadError(f"record is {record!r}; expected True or False")
        self.params._replace(**{name: value for name, value in changes.items() if name not in NO_PARAMETERS})
        self._changes.append(
            {name: value if isinstance(value, bool) else float(value) for name, value in changes.items()}
        )

    def stop(self) -> None:
        """Ends ``run`` after this tick; may be called from any thread and from a signal handler."""
        self.loop.stop()

    # Running

    def run(self, duration: float | None = None) -> JsonObject:
        """Works until ``duration`` s are over, the source ends, ``stop`` is called or Ctrl-C is pressed.

        Returns:
            The figures of the run, see ``figures``.

        Raises:
            SensorError: the source cannot be started.
            SourceLost: it was silent for too long.
            LevelheadError: the sensor never was at rest for long enough to calibrate it.
        """
        try:
            with realtime_scheduling(self._realtime) as lacking:
                self.begin(lacking)
                self.loop.run(math.inf if duration is None else duration, self.tick, self._skip)
        finally:
            self.close()
        return self.figures()

    def begin(self, lacking: str = "") -> None:
        """Starts the source; ``lacking``: the rights that the system denies, for the event."""
        self.source.start()
        self._began, self._lacking = True, lacking
        self.recorder.begin()
        config = self._config()
        self.journal.note("started", f"{self.source.name} at {self.rate:g} Hz through {config['filter']}", **config)
        self._publish_config(self.source.name)
        self.safe_state.begin(self._clock())
        if self.path.calibration is not None:
            self.journal.begin("calibrating", f"hold still for {self.path.calibration.samples} samples")

    def _config(self) -> JsonObject:
        calibration = self.path.calibration
        return {
            "version": VERSION,
            "source": self.source.name,
            "rate": self.rate,
            "source_rate": self.source.rate,
            "filter": filters.of(self.params).name,
            "params": self.params._asdict(),
            "guard": None if self.guard is None else self.guard._asdict(),
            "calibrate": 0 if calibration is None else calibration.samples,
            "bias": list(self.path.bias),
            "record": self.recorder.path,
            "lacking": self._lacking,
        }

    def _skip(self, skipped: int, late: float) -> None:
        """Ticks that were missed are not made up for: their orientations would be stale."""
        missed = "1 tick was missed" if skipped == 1 else f"{skipped} ticks were missed"
        self.journal.note("late", f"{missed}: the next one came {1e3 * late:.1f} ms late")

    def tick(self, late: bool = False) -> None:
        """Reads, fuses, publishes and logs the new samples; after a missed tick only the newest orientation is
        published.

        Raises:
            SourceLost: the source was silent for too long.
            LevelheadError: the sensor never was at rest for long enough to calibrate it.
        """
        began = self._clock()
        self.ticks += 1
        if self._changes or self.bus.commands:
            self._apply_changes()
        samples = self._read()
        read = self._clock()
        newest = len(samples) - 1
        for i, sample in enumerate(samples):
            self.path.add(sample, publish=i == newest or not late)
        if samples:
            self.safe_state.add_samples(read, len(samples))
        elif self.safe_state.check(read):
            self.loop.restart()
        self._check(read)
        end = self._clock()
        self.reading.add(read - began)
        self.work.add(end - read)
        self.whole.add(end - began)
        if end - read > self._budget * max(1, len(samples)):
            self.over_budget += 1
            self.journal.note(
                "over_budget", f"a tick took {1e6 * (end - read):.0f} µs, its budget is {1e6 * self._budget:.0f}"
            )
        if end - self._refreshed >= REFRESH:  # behind the tick, in the time that is left of its period
            self._refreshed = end
            self._motion.refresh()

    def _apply_changes(self) -> None:
        """Parameters that other threads and processes asked for."""
        while self.bus.commands:
            command = self.bus.commands.popleft()
            try:
                self.set(**command.changes)
                command.answer("")
            except (LevelheadError, TypeError) as error:
                self.journal.note("not_set", str(error))
                command.answer(str(error))
        changes: dict[str, float] = {}
        while self._changes:
            changes |= self._changes.popleft()
        if "record" in changes:
            self._record(bool(changes.pop("record")))
        if "heading" in changes:
            self._set_heading(changes.pop("heading"))
        if changes:
            self._apply(changes)

    def _record(self, on: bool) -> None:
        try:
            self.recorder.switch(on)
        except LevelheadError as error:
            self.journal.note("not_set", str(error))
        self._publish_config(self.recorder.path)

    def _set_heading(self, heading: float) -> None:
        if self.path.last is None:
            self._changes.append({"heading": heading})
            return
        try:
            self._stream.set_heading(heading)
        except LevelheadError as error:
            self.journal.note("not_set", str(error))
            return
        self.journal.counts.setdefault("heading", 0)
        data = {"heading": heading, "from": self.samples}
        self._publish_event(Event("heading", True, f"yaw is {heading:g}° from here on", data))

    def _apply(self, changes: JsonObject) -> None:
        """Sets parameters from the next sample on, and publishes them."""
        self._stream.set(**changes)
        text = ", ".join(f"{name}={value:g}" for name, value in changes.items())
        self.journal.counts.setdefault("parameters", 0)
        data = {"params": self.params._asdict(), "from": self.samples}
        self._publish_event(Event("parameters", True, text, data))
        self._publish_config(text)

    def _publish_config(self, text: str) -> None:
        self.bus.publish(CONFIG, self._message(Event("config", True, text, self._config())))

    def _read(self) -> list[Sample]:
        try:
            samples = self.source.poll()
        except SensorError as error:
            self.journal.begin(error.kind, str(error))
            return []
        if samples and self.journal.active:
            for kind in SOURCE_FAULTS:
                self.journal.end(kind)
        if not samples and self.source.ended:
            self.journal.note("ended", f"{self.source.name} is over")
            self.loop.stop()
        return samples

    def _check(self, now: float) -> None:
        """Reports the troubles of source, bus and black box."""
        for name, text in self.source.troubles():
            self.journal.note(name, text)
        if now - self._checked < CHECK_INTERVAL:
            return
        self._checked = now
        for name, text in self.bus.troubles():
            self.journal.note(name, text)
        self.recorder.check()

    def close(self) -> None:
        """Enters the safe state, reports the figures, closes black box and source; may be called twice."""
        if self._closed:
            return
        self._closed = True
        if self._began:
            self.recorder.check()  # a short run may end before the next look
            self.safe_state.end()
            text = f"{self.samples} samples, ticks missed: {self.loop.missed}"
            self.journal.note("stopped", text, **self.figures())
        for topic in TOPICS:
            self.bus.withdraw(topic, self.id)
        self.recorder.close()
        self.source.close()

    def figures(self) -> JsonObject:
        """Samples, losses, lateness and duration of ticks: for reading, for the work after it, as a whole."""
        return {
            "samples": self.samples,
            "lost": self.journal.counts.get("samples_lost", 0),
            "ticks": self.ticks,
            "missed": self.loop.missed,
            "over_budget": self.over_budget,
            "lateness": self.loop.lateness.figures(),
            "reading": self.reading.figures(),
            "work": self.work.figures(),
            "whole": self.whole.figures(),
            "events": dict(self.journal.counts),
        }

    # Messages

    def _publish_invalid(self) -> bool:
        if self.last is None:
            return False
        self.bus.publish(ORIENTATION, self.last._replace(valid=False))
        return True

    def _publish_event(self, event: Event) -> None:
        message = self._message(event)
        self.bus.publish(HEALTH, message)
        if self.recorder.box is not None:
            self.recorder.box.event(message)

    def _message(self, event: Event) -> Health:
        t = self.path.time if math.isfinite(self.path.time) else 0.0
        return Health(self.id, self.samples, t, time.time_ns(), event.name, event.on, event.text, event.data)

    def __enter__(self) -> "Node":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
