"""Rows of several units of sensors that take turns in one table, distinguished by their numbers."""

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, median
from levelhead.sources.interpret.interleaved_rows import MAX_SHARE, MAX_UNITS, MIN_ROWS


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
