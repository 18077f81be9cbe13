"""Rows of several units of sensors that take turns in one table, told by their numbers."""

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, median

MOST = 6  # units that take turns
SMOOTH = 0.25  # of the usual change from row to row, at most, is the change from a unit's sample to its next
FEW = 60  # rows below which nothing is concluded
LOOK = 20_000  # rows that are looked at


def count_turns(acc: Array) -> int:
    """How many units take turns in the rows of (n, 3) ``acc``: 1 where each row goes on from the one before.

    A body moves little from one sample to the next, two bodies are apart: of rows that alternate, those of one unit
    differ much less than neighbours do.
    """
    rows = acc[np.isfinite(acc).all(axis=1)][:LOOK]
    if len(rows) < FEW:
        return 1
    steps = {k: median(np.linalg.norm(rows[k:] - rows[:-k], axis=1)) for k in range(1, MOST + 1)}
    return next((k for k in range(2, MOST + 1) if steps[k] < SMOOTH * steps[1]), 1)


def parts_of(labels: NDArray[np.str_], acc: Array) -> dict[str, NDArray[np.bool_]]:
    """The rows of each unit that (n,) words beside (n, 3) ``acc`` name; {} if the numbers do not take turns with them.

    Words such as a satellite's system change as often and mean nothing for the sensors: within each unit the numbers
    must change less from sample to sample than from row to row.
    """
    found = list(dict.fromkeys(labels.tolist()))
    changes = float((labels[1:] != labels[:-1]).mean()) if len(labels) > FEW else 0.0
    if not 1 < len(found) <= 3 * MOST or changes < 0.1:
        return {}
    parts: dict[str, NDArray[np.bool_]] = {str(word): np.asarray(labels == word) for word in found}
    if min(float(part.mean()) for part in parts.values()) < 0.02:
        return {}
    turned = np.flatnonzero(labels[1:] != labels[:-1])
    across = median(np.linalg.norm(acc[turned + 1] - acc[turned], axis=1))
    within = max(median(np.linalg.norm(np.diff(acc[part], axis=0), axis=1)) for part in parts.values())
    return parts if within < 2.0 * SMOOTH * across else {}
