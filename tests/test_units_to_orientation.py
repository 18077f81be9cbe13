"""A log in rad/s under names that mean deg/s to others, from file to orientation: nobody has to notice."""

import numpy as np
import pytest

import levelhead as lh

HEADER = "time,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z"


def written(path, recording, of_a_rate, of_a_force):
    """A log of nothing but numbers; the units are nowhere said."""
    table = np.column_stack([recording.t, recording.gyr * of_a_rate, recording.acc * of_a_force])
    np.savetxt(path, table, "%.9g", ",", header=HEADER, comments="")
    return path


@pytest.fixture(scope="module")
def hand():
    return lh.simulate.recording("BMI160", "hand", 30.0, seed=4)


@pytest.mark.parametrize("params", [lh.Complementary(), lh.Mahony(), lh.EKF()], ids=repr)
@pytest.mark.parametrize("force", [1.0, 1.0 / 9.80665], ids=["m/s²", "g"])
def test_the_unit_of_the_rate_makes_no_difference(hand, params, force, tmp_path):
    tracks = []
    for name, factor in (("radians", 1.0), ("degrees", 180.0 / np.pi)):
        read = lh.read(written(tmp_path / f"{name}.csv", hand, factor, force))
        assert read.meta["units"]["gyr"] == {"radians": "rad/s", "degrees": "deg/s"}[name]
        tracks.append(lh.fuse(read, params))
    off = (tracks[0].as_rotation() * tracks[1].as_rotation().inv()).magnitude()
    assert np.degrees(off).max() < 0.01
    up = tracks[0].as_rotation().inv().apply([0.0, 0.0, 1.0])
    true = lh.Track(hand.t, hand.truth.quat, None, tracks[0].sigma, tracks[0].health, params)
    tilt = np.degrees(np.arccos(np.clip((up * true.as_rotation().inv().apply([0.0, 0.0, 1.0])).sum(axis=1), -1, 1)))
    assert tilt[500:].mean() < 6.0, "57 times too fast or too slow it would be anything"


def test_the_wrong_unit_of_a_user_is_taken_with_a_warning(hand, tmp_path):
    path = written(tmp_path / "degrees.csv", hand, 180.0 / np.pi, 1.0)
    read = lh.read(path, units={"gyr": "rad/s"})
    np.testing.assert_allclose(read.gyr, np.degrees(hand.gyr), rtol=1e-6, atol=1e-6)
    assert any(
        "taken as rad/s, by the hint; a warning: its numbers look like deg/s" in note for note in read.meta["notes"]
    ), read.meta["notes"]
