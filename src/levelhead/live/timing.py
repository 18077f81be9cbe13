"""When ticks came and how long they took; and what keeps interpreter and system from disturbing them."""

import gc
import math
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

STEP = math.log(1.05)  # a bucket is 5 % wide
SMALLEST = 1e-6  # s
BUCKETS = 400  # up to 5 minutes
PRIORITY = 50
SWITCH = 5e-4  # s after which another thread must give the interpreter to the node


class Spread:
    """Durations, counted in buckets of 5 %, so that hours cost no memory."""

    def __init__(self) -> None:
        self._counts = [0] * BUCKETS
        self.count = 0
        self.largest = 0.0

    def add(self, seconds: float) -> None:
        """One more."""
        self.count += 1
        self.largest = max(self.largest, seconds)
        bucket = int(math.log(seconds / SMALLEST) / STEP) if seconds > SMALLEST else 0
        self._counts[min(bucket, BUCKETS - 1)] += 1

    def quantile(self, share: float) -> float:
        """The duration that ``share`` of all do not exceed, to 5 %; NaN without any."""
        if self.count == 0:
            return math.nan
        left = share * self.count
        for bucket, count in enumerate(self._counts):
            left -= count
            if left <= 0.0:
                return min(SMALLEST * math.exp(STEP * (bucket + 1)), self.largest)
        return self.largest

    def figures(self) -> dict[str, float]:
        """p50, p99, p99.9 and the largest, in µs."""
        return {
            name: round(1e6 * value, 1)
            for name, value in (
                ("p50_us", self.quantile(0.5)),
                ("p99_us", self.quantile(0.99)),
                ("p99.9_us", self.quantile(0.999)),
                ("max_us", self.largest),
            )
            if value == value
        }


def _hurry() -> dict[int, tuple[int, Any]]:
    """Real-time priority for this thread, and a little less for the others that run Python: one that is pushed aside
    while it holds the interpreter keeps the node waiting. What they had before; empty where it is not allowed.
    """
    before: dict[int, tuple[int, Any]] = {}
    for thread in threading.enumerate():
        one = thread.native_id
        with suppress(OSError, AttributeError):
            if one is not None:
                had = os.sched_getscheduler(one), os.sched_getparam(one)
                less = one != threading.get_native_id()
                os.sched_setscheduler(one, os.SCHED_FIFO, os.sched_param(PRIORITY - less))
                before[one] = had
    return before


@contextmanager
def undisturbed(realtime: bool) -> Iterator[str]:
    """No garbage collection in the loop, quick changes of thread, and real-time priority where that is allowed.

    Gives "" or a sentence with what could not be had.
    """
    switch, collected = sys.getswitchinterval(), gc.isenabled()
    sys.setswitchinterval(SWITCH)
    gc.collect()
    gc.freeze()
    gc.disable()
    before, said = _hurry() if realtime else {}, ""
    if realtime and not before:
        said = "no real-time priority (it needs CAP_SYS_NICE): expect ticks that are some ms late on a busy machine"
    try:
        yield said
    finally:
        for thread, what in before.items():
            with suppress(OSError):  # a thread that has ended
                os.sched_setscheduler(thread, *what)
        sys.setswitchinterval(switch)
        gc.unfreeze()
        if collected:
            gc.enable()
