"""The error of heading that a bending field is expected to cause, against fields bent by known angles."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.inspection.field_azimuth import FOLLOWS, WINDOW, expected_heading_error

NORTH = np.array([0.0, 20.0, -45.0])  # µT, earth frame: x east, y north, z up


def bent(recording: lh.Recording, angles: np.ndarray) -> lh.Recording:
    """The recording with a field whose azimuth is off by (n,) angles in deg."""
    field = Rotation.from_euler("z", angles[:, None], degrees=True).apply(NORTH)
    body = Rotation.from_quat(recording.truth.quat, scalar_first=True).inv()
    return lh.Recording(recording.t, recording.gyr, recording.acc, body.apply(field))


@pytest.fixture(scope="module")
def walk() -> lh.Recording:
    return lh.simulate.recording("ICM-20948", "walking", duration=200.0, seed=3)


def test_a_steady_field_causes_none_and_a_drift_of_the_track_is_no_error_of_the_field(walk: lh.Recording) -> None:
    drifting = Rotation.from_euler("z", 0.3 * walk.t[:, None], degrees=True)  # 18 deg a minute
    turned = drifting * Rotation.from_quat(walk.truth.quat, scalar_first=True)
    plain = SimpleNamespace(quat=turned.as_quat(scalar_first=True))
    assert expected_heading_error(bent(walk, np.zeros(len(walk))), plain) == pytest.approx(0.0, abs=0.01)


def test_it_is_the_known_part_of_how_the_azimuth_wanders_from_window_to_window(walk: lh.Recording) -> None:
    windows = np.random.default_rng(5).normal(0.0, 20.0, 20)
    angles = windows[np.minimum((walk.t - walk.t[0]) / WINDOW, 19).astype(int)]
    middle = np.arange(20.0)
    rest = windows - np.polyval(np.polyfit(middle, windows, 1), middle)
    expected = FOLLOWS * np.sqrt((rest**2).sum() / 18)
    plain = SimpleNamespace(quat=walk.truth.quat)
    assert expected_heading_error(bent(walk, angles), plain) == pytest.approx(expected, rel=0.02)
    fast = 40.0 * np.sin(2 * np.pi * walk.t)  # a swing of one second: within the windows it averages out
    assert expected_heading_error(bent(walk, fast), plain) < 0.5


def test_a_short_recording_does_not_tell_it(walk: lh.Recording) -> None:
    first = bent(walk, np.zeros(len(walk)))[:3000]
    assert expected_heading_error(first, SimpleNamespace(quat=walk.truth.quat[:3000])) is None
