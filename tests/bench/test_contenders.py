"""Units and frames of the contenders are converted rightly: none may look bad because it was fed wrongly."""

import warnings

import numpy as np
import pytest

from levelhead.bench import contenders
from levelhead.bench.contenders.ahrs_ import dip, from_ned
from levelhead.bench.error_figures import measure_errors
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.recording import Recording
from levelhead.track import Track

from .conftest import headed

SETTLED = 500  # samples after which a start has been forgotten
# Wide enough for what a filter does with shaking, far too narrow for a wrong unit, sign or axis.
TILT, HEADING = 2.5, 3.0
NO_HEADING = "riann.RIANN"


def orientation(contender: contenders.Contender, recording: Recording) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.asarray(contender.run(recording))[SETTLED:]


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.parametrize("heading", range(20, 380, 45))
def test_inclination_and_heading_in_all_octants(contender, heading):
    recording = headed(heading, rotation=4.0 if contender.name == "ahrs.Complementary" else 20.0)
    errors = split_error(error_quaternion(orientation(contender, recording), recording.truth.quat[SETTLED:]))
    tilt, turn = (np.degrees(np.sqrt(np.mean(np.square(values)))) for values in (errors.tilt, errors.heading))
    assert tilt < TILT and (turn < HEADING or contender.name == NO_HEADING), (
        f"{contender.name}: tilt {tilt:.2f}°, heading {turn:.2f}°"
    )


@pytest.mark.slow
def test_without_a_magnetometer_inclination_is_right_and_heading_turns_the_right_way(contender):
    whole = headed(110.0, rotation=4.0 if contender.name == "ahrs.Complementary" else 20.0)
    recording = Recording(whole.t, whole.gyr, whole.acc, None, whole.truth)
    found = measure_errors(recording[SETTLED:], orientation(contender, recording), absolute=False)
    # Euler angles without a magnetometer have no third one there.
    assert found.tilt < TILT and (found.heading < HEADING or contender.name in ("ahrs.Complementary", NO_HEADING)), (
        found
    )


def test_dip_is_the_angle_of_the_field_below_the_horizon():
    assert dip(headed(0.0)) == pytest.approx(np.degrees(np.arctan2(45.0, 19.0)), abs=0.5)


def test_from_ned_is_what_a_track_calls_ned():
    quat = np.random.default_rng(1).normal(size=(20, 4))
    quat /= np.linalg.norm(quat, axis=1)[:, None]
    there = Track(np.arange(20.0), quat).as_rotation("NED").as_quat(scalar_first=True)
    assert np.abs(np.sum(from_ned(there) * quat, axis=1)) == pytest.approx(1.0)


def test_every_contender_names_its_package():
    assert {contender.package for contender in contenders.ALL} == {"vqf", "imufusion", "ahrs", "riann"}
