"""Means that keep interpreter and system from interrupting the node's loop."""

import gc
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

PRIORITY = 50
SWITCH_INTERVAL = 5e-4  # s after which another thread must give the interpreter to the node


def _raise_priority() -> dict[int, tuple[int, Any]]:
    """Sets real-time priority for this thread, and one less for the others that run Python: a thread that is preempted
    while it holds the interpreter keeps the node waiting.

    Returns:
        Thread id → scheduler and parameters before; empty where it is not allowed.
    """
    before: dict[int, tuple[int, Any]] = {}
    for thread in threading.enumerate():
        one = thread.native_id
        with suppress(OSError, AttributeError):
            if one is not None:
                old = os.sched_getscheduler(one), os.sched_getparam(one)
                less = one != threading.get_native_id()
                os.sched_setscheduler(one, os.SCHED_FIFO, os.sched_param(PRIORITY - less))
                before[one] = old
    return before


@contextmanager
def realtime_scheduling(realtime: bool) -> Iterator[str]:
    """Switches garbage collection off, shortens the interpreter's switch interval, and sets real-time priority.

    Args:
        realtime: whether to ask for real-time priority.

    Gives "" or a sentence that names the denied right.
    """
    interval, collects = sys.getswitchinterval(), gc.isenabled()
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()
    gc.disable()
    before, lacking = _raise_priority() if realtime else {}, ""
    if realtime and not before:
        lacking = "no real-time priority (it needs CAP_SYS_NICE): expect ticks that are some ms late on a busy machine"
    try:
        yield lacking
    finally:
        for thread, scheduling in before.items():
            with suppress(OSError):  # a thread that has ended
                os.sched_setscheduler(thread, *scheduling)
        sys.setswitchinterval(interval)
        gc.unfreeze()
        if collects:
            gc.enable()
