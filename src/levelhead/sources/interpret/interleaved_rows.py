"""Rows of several units of sensors that alternate in one table."""

import numpy as np

from levelhead.recording import Array, median

MAX_UNITS = 6  # that alternate
MAX_SHARE = 0.25  # of the usual change from row to row, at most, is the change from a unit's sample to its next
MIN_ROWS = 60  # below which nothing is concluded
MAX_ROWS = 20_000  # that are looked at


def count_interleaved(acc: Array) -> int:
    """How many units of sensors alternate in the rows of (n, 3) ``acc``; 1 where each row continues the one before.

    A body moves little from one sample to the next, two bodies are apart: of rows that alternate, those of one unit
    differ much less than neighbours do.
    """
    rows = acc[np.isfinite(acc).all(axis=1)][:MAX_ROWS]
    if len(rows) < MIN_ROWS:
        return 1
    steps = {k: median(np.linalg.norm(rows[k:] - rows[:-k], axis=1)) for k in range(1, MAX_UNITS + 1)}
    return next((k for k in range(2, MAX_UNITS + 1) if steps[k] < MAX_SHARE * steps[1]), 1)
