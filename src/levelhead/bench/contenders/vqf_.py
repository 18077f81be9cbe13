"""vqf 2.1.2: D. Laidig, T. Seel, VQF, Information Fusion 2023, 91, 187-204.

It is in SI units and its earth frame is ENU: nothing to convert. The magnetometer may be in any unit.
``offlineVQF`` uses the whole recording for every instant, which no live filter can do.
"""

from typing import Any

import numpy as np

from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording


def full(recording: Recording) -> Array:
    """(n, 4) by VQF: with bias estimation, rest detection and rejection of magnetic disturbances."""
    from vqf import VQF

    return _batch(VQF(1.0 / recording.rate), recording)


def basic(recording: Recording) -> Array:
    """(n, 4) by BasicVQF: without any of these."""
    from vqf import BasicVQF

    return _batch(BasicVQF(1.0 / recording.rate), recording)


def run_offline(recording: Recording) -> Array:
    """(n, 4) by offlineVQF: forwards and backwards over the whole recording."""
    from vqf import offlineVQF

    return _orientation(offlineVQF(recording.gyr, recording.acc, recording.mag, 1.0 / recording.rate))


def _batch(one: Any, recording: Recording) -> Array:
    given = [recording.gyr, recording.acc] + ([] if recording.mag is None else [recording.mag])
    return _orientation(one.updateBatch(*given))


def _orientation(found: JsonObject) -> Array:
    return np.asarray(found["quat9D" if "quat9D" in found else "quat6D"])
