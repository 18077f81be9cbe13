"""ahrs 0.4.0 (M. Garcia): the textbook's filters, each with an earth frame of its own. Plain Python, SI units.

No page of it states the frame of the result; it follows from the source, and ``tests/bench`` proves it on motions whose
truth is known:

* ``Madgwick``: expects gravity at +z and the field in the x-z plane, so with specific force x is north, z up (NWU).
* ``Mahony``: expects gravity at +z and the field in the y-z plane: ENU.
* ``EKF``: its reference vectors are gravity and field in NED, so it is given gravity, which is minus the specific
  force, and body axes forward-right-down: in a z-up body its start would be in a singularity. Its default field is
  that of Munich with 3° of declination; it is given the dip of the place as measured, and no declination.
* ``AQUA``: earth to sensor, x is north, z up.
* ``Complementary``: Euler angles from x north, z up.
"""

import numpy as np

from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording
from levelhead.rotations import FRD_TO_FLU, NED_TO_ENU, conjugate, product, turn_heading

QUARTER = np.pi / 2  # rad, from x north to x east
DOWN = np.array([1.0, -1.0, -1.0])  # forward-left-up to forward-right-down and back


def madgwick(recording: Recording) -> Array:
    """(n, 4) by Madgwick's gradient descent."""
    from ahrs.filters import Madgwick

    return turn_heading(Madgwick(**_arguments(recording)).Q, QUARTER)


def mahony(recording: Recording) -> Array:
    """(n, 4) by Mahony's complementary filter."""
    from ahrs.filters import Mahony

    found: Array = Mahony(**_arguments(recording)).Q
    return found


def ekf(recording: Recording) -> Array:
    """(n, 4) by the extended Kalman filter."""
    from ahrs.filters import EKF

    given = _arguments(recording)
    given |= {name: values * DOWN for name, values in given.items() if name in ("gyr", "acc", "mag")}
    given["acc"] = -given["acc"]
    if recording.mag is not None:
        given["magnetic_ref"] = dip(recording)
    return from_ned(EKF(**given).Q)


def aqua(recording: Recording) -> Array:
    """(n, 4) by the algebraic quaternion algorithm."""
    from ahrs.filters import AQUA

    return turn_heading(conjugate(AQUA(**_arguments(recording)).Q), QUARTER)


def complementary(recording: Recording) -> Array:
    """(n, 4) by the complementary filter of Euler angles."""
    from ahrs.filters import Complementary

    return turn_heading(np.asarray(Complementary(**_arguments(recording)).Q), QUARTER)


def dip(recording: Recording) -> float:
    """Degrees by which the field points below the horizon: the median over the samples."""
    assert recording.mag is not None
    down = -np.sum(recording.mag * recording.acc, axis=1)
    length = np.linalg.norm(recording.mag, axis=1) * np.linalg.norm(recording.acc, axis=1)
    return float(np.degrees(np.arcsin(np.median(down / length))))


def from_ned(quat: Array) -> Array:
    """(n, 4) forward-right-down to NED as forward-left-up to ENU."""
    return product(NED_TO_ENU, quat, FRD_TO_FLU)


def _arguments(recording: Recording) -> JsonObject:
    given = {"gyr": recording.gyr, "acc": recording.acc, "frequency": recording.rate}
    return given if recording.mag is None else given | {"mag": recording.mag}
