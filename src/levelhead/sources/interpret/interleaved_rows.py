"""Rows of several units of sensors that alternate in one table."""

import numpy as np
from numpy.typing import NDArray

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
    rows = acc[np.flatnonzero(np.isfinite(acc).all(axis=1))[:MAX_ROWS]]
    if len(rows) < MIN_ROWS:
        return 1
    steps = {k: median(np.linalg.norm(rows[k:] - rows[:-k], axis=1)) for k in range(1, MAX_UNITS + 1)}
    return next((k for k in range(2, MAX_UNITS + 1) if steps[k] < MAX_SHARE * steps[1]), 1)


def parts_of(labels: NDArray[np.str_], acc: Array) -> dict[str, NDArray[np.bool_]]:
    """The rows of each unit that (n,) words beside (n, 3) ``acc`` name; {} if the numbers do not take turns with them.

    Words such as a satellite's system change as often and mean nothing for the sensors: within each unit the numbers
    must change less from sample to sample than from row to row.
    """
    if len(labels) != len(acc):  # torn lines were left out of one of them
        return {}
    found = list(dict.fromkeys(labels.tolist()))
    changes = float((labels[1:] != labels[:-1]).mean()) if len(labels) > MIN_ROWS else 0.0
    if not 1 < len(found) <= 3 * MAX_UNITS or changes < 0.1:
        return {}
    parts: dict[str, NDArray[np.bool_]] = {str(word): np.asarray(labels == word) for word in found}
    if min(float(part.mean()) for part in parts.values()) < 0.02:
        return {}
    turned = np.flatnonzero(labels[1:] != labels[:-1])
    across = median(np.linalg.norm(acc[turned + 1] - acc[turned], axis=1))
    within = max(median(np.linalg.norm(np.diff(acc[part], axis=0), axis=1)) for part in parts.values())
    return parts if within < 2.0 * MAX_SHARE * across else {}
