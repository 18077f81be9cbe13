"""From measured noise with a temperature to a calibration whose biases follow it."""

import numpy as np

from levelhead.calibration import Calibration, Quantity
from levelhead.errors import LevelheadError
from levelhead.noise.model import NoiseModel

TURN_ON = 0.35  # rad/s (20 °/s), 1σ of a gyroscope's bias before any measurement


def calibrate_temperature(model: NoiseModel, known: Calibration | None = None) -> Calibration:
    """The calibration ``known``, with the change of its biases with temperature and the gyroscope's at the reference.

    Args:
        model: from ``measure_noise``, of a log with a temperature that changes.
        known: of the same sensor; None: nothing is known.

    Raises:
        LevelheadError: the log has no temperature, or no bias changes clearly with it.
    """
    drifts = {name: drift for name in ("gyr", "acc") if (drift := model.triads[name].drift) is not None}
    if not drifts:
        raise LevelheadError(
            "the still stretch has no temperature that changes by 0.5 K; expected a log with a column such as "
            "'temperature [°C]', from the start of a cold sensor"
        )
    curves = {name: drift.curve() for name, drift in drifts.items() if drift.clear}
    if not curves:
        raise LevelheadError(
            f"no change of a bias with temperature shows over {max(one.span for one in drifts.values()):.1f} K; "
            "expected one of 4σ: warm the sensor further, or leave --temperature out"
        )
    known = Calibration.of_nothing() if known is None else known
    bias = known.gyr_bias
    if "gyr" in curves:
        true = np.eye(3) - known.gyr_matrix.value
        at, sigma, before = drifts["gyr"].value[:, 0], drifts["gyr"].sigma[:, 0], np.full(3, TURN_ON)
        by_scale = np.sqrt(known.gyr_matrix.sigma**2 @ at**2)
        bias = Quantity(true @ at, np.hypot(sigma, by_scale), before, before)
    return known.with_temperature(curves, bias)
