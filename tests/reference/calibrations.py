"""Errors of a sensor that are known: what ``levelhead export --calibration`` is given."""

import numpy as np

import levelhead as lh
from levelhead.calibration import Quantity


def sure(*values):
    """Numbers that are known well."""
    value = np.array(values)
    return Quantity(value, 0.01 * np.abs(value), np.ones(len(value)), np.ones(len(value)))


WRONG = lh.Calibration(
    gyr_matrix=Quantity(
        *(np.array([[0.01, 0.002, -0.003], [0.004, -0.02, 0.005], [-0.006, 0.001, 0.015]]) for _ in range(4))
    ),
    gyr_bias=sure(0.03, -0.02, 0.01),
    acc_bias=sure(0.1, -0.2, 0.15),
    mag_offset=sure(4.0, -6.0, 3.0),
    mag_delay=sure(0.012),
)
