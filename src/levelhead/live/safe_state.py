"""The safe state: a source that is silent makes the orientation invalid, and is restarted until it answers."""

from collections.abc import Callable

from levelhead.errors import LevelheadError
from levelhead.live.events import EVENTS, Journal
from levelhead.sources.devices.source import Source

SILENCE = 0.1  # s without a sample, at least, before the source counts as silent
SILENT_INTERVALS = 5.0  # mean intervals between samples, at least, before it does
START_LIMIT = 5.0  # s before the first sample: a microcontroller that is opened begins anew, and names come first
FIRST_LIMIT, FIRST_GAPS = 1.0, 5  # s, and gaps, before the mean interval is known
LONGEST_GAP, WEIGHT = 2.0, 0.05  # s, and weight of a gap in the running mean of the interval
RETRY = 1.0  # s between two attempts to restart a silent source


class SourceLost(LevelheadError):
    """The source went away and did not come back."""

    exit_code = 3


class SafeState:
    """Decides when there is nothing to publish.

    Args:
        source: the thing that may fall silent.
        journal: takes the events "silent" and "invalid".
        publish_invalid: publishes the last orientation as invalid; False: there is none.
        give_up: s without a sample after which ``check`` raises ``SourceLost``.
    """

    def __init__(self, source: Source, journal: Journal, publish_invalid: Callable[[], bool], give_up: float) -> None:
        self._source, self._journal, self._publish_invalid, self._give_up = source, journal, publish_invalid, give_up
        self._last = self._tried = 0.0  # host time of the last sample, and of the last restart
        self._interval, self._gaps, self._limit = 0.0, 0, getattr(source, "start_limit", START_LIMIT)
        self._shortest = getattr(source, "silence_limit", SILENCE)

    def begin(self, now: float) -> None:
        """The source was started at host time ``now``."""
        self._last = self._tried = now

    def add_samples(self, now: float, count: int) -> None:
        """``count`` samples came: the mean interval between samples decides when their absence is silence."""
        gap = min(now - self._last, LONGEST_GAP) / count
        self._gaps += 1
        self._interval += max(WEIGHT, 1.0 / self._gaps) * (gap - self._interval)
        self._limit = FIRST_LIMIT
        if self._gaps >= FIRST_GAPS:
            self._limit = max(self._shortest, SILENT_INTERVALS * self._interval)
        self._last = now

    def check(self, now: float) -> bool:
        """A tick without a sample.

        Returns:
            Whether the source was restarted.

        Raises:
            SourceLost: it has been silent for too long.
        """
        since = now - self._last
        if since <= self._limit:
            return False
        self._journal.begin("silent", f"{self._source.name} has given no sample for {since:.2f} s")
        self.enter("the source is silent")
        if since > self._give_up:
            why = "; ".join(text for name, text in self._journal.active.items() if name not in ("invalid", "silent"))
            raise SourceLost(f"{self._source.name} has given no sample for {since:.0f} s{': ' + why if why else ''}")
        if now - self._tried <= RETRY:
            return False
        self._tried = now
        try:
            self._source.restart()
        except LevelheadError as error:
            self._journal.begin(getattr(error, "kind", "bus_error"), str(error))
        return True

    def enter(self, why: str) -> None:
        """Publishes the last orientation once more, marked invalid; then nothing until there are samples."""
        if "invalid" not in self._journal.active and self._publish_invalid():
            self._journal.begin("invalid", f"{EVENTS['invalid']}: {why}")

    def end(self) -> None:
        """As ``enter`` when the node ends, which is not a fault and has an event of its own."""
        if "invalid" not in self._journal.active:
            self._publish_invalid()

    def leave(self) -> None:
        """An orientation is about to be published."""
        if self._journal.active:
            self._journal.end("silent")
            self._journal.end("invalid")
