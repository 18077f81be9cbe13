"""The loop of a node: ticks at absolute deadlines; those that come too late are skipped and counted."""

from collections.abc import Callable

from levelhead.live.latency import LatencyHistogram


class DeadlineLoop:
    """Calls a function at start + k / rate.

    Args:
        rate: ticks per second, Hz.
        clock: host time in s.
        sleep: waits for a number of seconds.
        free_running: does not wait at all, for a source that gives its samples as fast as they are read.

    Attributes:
        lateness: how late the ticks began.
        missed: ticks that were skipped, because the one before them ended too late.
    """

    def __init__(
        self, rate: float, clock: Callable[[], float], sleep: Callable[[float], None], free_running: bool = False
    ) -> None:
        self._period, self._clock, self._sleep, self._free_running = 1.0 / rate, clock, sleep, free_running
        self.lateness = LatencyHistogram()
        self.missed = 0
        self._stopped = self._restarted = False

    def stop(self) -> None:
        """Ends ``run`` after this tick; may be called from any thread and from a signal handler."""
        self._stopped = True

    def restart(self) -> None:
        """Counts deadlines from the end of this tick on."""
        self._restarted = True

    def run(self, duration: float, tick: Callable[[bool], None], skip: Callable[[int, float], None]) -> None:
        """Ticks for ``duration`` s, or until ``stop``.

        Args:
            duration: s; inf: without end.
            tick: gets whether ticks were skipped before it.
            skip: gets how many ticks were skipped, and how late the last one is in s.
        """
        period = self._period
        began = start = self._clock()
        count = 0
        while not self._stopped:
            now = self._clock()
            if now - began >= duration:
                return
            late = 0.0
            if not self._free_running:
                deadline = start + count * period
                if deadline > now:
                    self._sleep(deadline - now)
                    now = self._clock()
                late = now - deadline
                self.lateness.add(late)
            skipped = int(late / period)
            if skipped > 0:
                self.missed += skipped
                skip(skipped, late)
            tick(skipped > 0)
            count += 1 + skipped
            if self._restarted:
                self._restarted, start, count = False, self._clock(), 0
