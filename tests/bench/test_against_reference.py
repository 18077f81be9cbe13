"""The gyroscope's errors and a reference's jumps are found in recordings whose faults are known."""

from dataclasses import replace

import numpy as np
import pytest
from tests.reference import against_reference

from levelhead import simulate
from levelhead.rotations import from_rotvec, product


@pytest.fixture(scope="module")
def swung():
    """By a sensor without errors."""
    return simulate.recording(simulate.Imu(), "hand", 20.0, seed=3)


def test_a_constant_bias_is_found_from_the_reference(swung):
    bias = np.radians([0.8, -3.0, 0.3])
    found = against_reference.constant_bias(replace(swung, gyr=swung.gyr + bias), swung.truth.quat)
    assert np.degrees(found) == pytest.approx(np.degrees(bias), abs=0.01)


def test_a_matrix_is_found_from_the_reference_beside_the_bias(swung):
    """The true rate is ω − S ω − b: readings are (1 − S)⁻¹ (w + b)."""
    bias = np.radians([0.8, -3.0, 0.3])
    matrix = np.array([[-0.018, 0.002, 0.0], [0.004, 0.006, -0.001], [0.0, 0.003, -0.01]])
    gyr = np.linalg.solve(np.eye(3) - matrix, (swung.gyr + bias).T).T
    found, found_bias = against_reference.constant_errors(replace(swung, gyr=gyr), swung.truth.quat)
    assert found == pytest.approx(matrix, abs=5e-4)
    assert np.degrees(found_bias) == pytest.approx(np.degrees(bias), abs=0.02)


def test_missing_rates_and_a_missing_reference_only_leave_windows_out(swung):
    bias = np.radians([0.8, -3.0, 0.3])
    gyr, quat = swung.gyr + bias, swung.truth.quat.copy()
    gyr[400:450], quat[900:1100] = np.nan, np.nan
    found = against_reference.constant_bias(replace(swung, gyr=gyr), quat)
    assert np.degrees(found) == pytest.approx(np.degrees(bias), abs=0.01)


def test_of_an_estimated_bias_the_part_about_the_vertical_turns_heading():
    quat = np.tile(from_rotvec(np.array([np.pi / 2, 0.0, 0.0])), (5, 1))  # y stands upwards
    estimates = np.tile(np.radians([7.0, 2.0, 9.0]), (5, 1))
    assert against_reference.vertical_error(estimates, np.radians([0.0, 0.5, 0.0]), quat) == pytest.approx(1.5)


def aside(swung):
    """The reference is lost three times; between the second and the third time it stands 8° aside."""
    t, quat = swung.t, swung.truth.quat.copy()
    askew = (t >= 7.0) & (t < 13.0)
    quat[askew] = product(from_rotvec(np.radians([8.0, 0.0, 0.0])), quat[askew])
    for start in (3.0, 7.0, 13.0):
        quat[(t >= start) & (t < start + 0.3)] = np.nan
    return quat


def test_jumps_of_a_reference_are_those_that_the_gyroscope_does_not_see(swung):
    quat = aside(swung)
    known = ~np.isnan(quat[:, 0])
    errors = against_reference.tilt_errors(swung.truth.quat, quat, known & (swung.t < 7.0))
    found = against_reference.jumps(swung, quat, errors)
    assert [round(float(swung.t[one.first]), 1) for one in found] == [7.3, 13.3]
    assert [one.apart for one in found] == pytest.approx([8.0, 8.0], abs=0.3)
    assert [one.after - one.before for one in found] == pytest.approx([8.0, -8.0], abs=0.1)
    assert not any(one.lost for one in found)
    rows = known & against_reference.after_jumps(len(swung), found)
    assert (rows == known & (swung.t >= 7.3) & (swung.t < 13.0)).all()
    assert len(against_reference.gaps(quat)) == 3


def test_an_error_of_the_filter_is_no_jump_of_the_reference(swung):
    quat = swung.truth.quat.copy()
    quat[(swung.t >= 7.0) & (swung.t < 7.3)] = np.nan
    assert against_reference.jumps(swung, quat, np.where(swung.t < 7.1, 0.0, 8.0)) == []
