"""imufusion 1.3.3 (x-io Technologies, Fusion): degrees per second and g, the earth frame by a setting, float32."""

from typing import Any

import numpy as np

from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording
from levelhead.units import GRAVITY

REJECTION = 10.0  # °, of accelerometer and magnetometer, as in the project's advanced example
TIMEOUT = 5.0  # s, there too


def run_plain(recording: Recording) -> Array:
    """(n, 4) by Ahrs with its default settings."""
    return _loop(recording, {})


def run_advanced(recording: Recording) -> Array:
    """(n, 4) by Ahrs with the additions of its advanced example: bias estimate, rejection of both references."""
    settings = {"acceleration_rejection": REJECTION, "magnetic_rejection": REJECTION, "rejection_timeout": TIMEOUT}
    return _loop(recording, settings)


def _loop(recording: Recording, settings: JsonObject) -> Array:
    """Sample by sample: imufusion has no batch call. The advanced settings bring the bias estimate along."""
    import imufusion

    one = imufusion.Ahrs()
    chosen = imufusion.AhrsSettings(sample_rate=recording.rate, **settings)
    chosen.convention = imufusion.CONVENTION_ENU  # as an argument of the constructor it is ignored
    one.set_settings(chosen)
    bias = _bias(recording.rate) if settings else None
    gyr, acc = np.degrees(recording.gyr), recording.acc / GRAVITY
    found = np.empty((len(recording), 4))
    for i in range(len(recording)):
        rate = gyr[i] if bias is None else bias.update(gyr[i])
        if recording.mag is None:
            one.update_no_magnetometer(rate, acc[i])
        else:
            one.update(rate, acc[i], recording.mag[i])
        found[i] = one.get_quaternion()
    return found


def _bias(rate: float) -> Any:
    import imufusion

    one = imufusion.Bias()
    one.set_settings(imufusion.BiasSettings(sample_rate=rate))
    return one
