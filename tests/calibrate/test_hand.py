"""Calibration of logs as hands make them: six sides, a tremor, known turns, and faults that no number corrects."""

import dataclasses

import numpy as np
import pytest

import levelhead as lh
from levelhead import LevelheadError, simulate

pytest.importorskip("scipy")
from scipy.spatial.transform import Rotation
from tests.reference.hand_motion import inertial_truth, move, sides


def observed(attitudes, seed, chip="MPU-6050", **motion):
    moved = move(attitudes, [1.5] * (len(attitudes) - 1), seed, **motion)
    return simulate.observe(moved, simulate.imu(chip), seed)


def tilt_errors(recording, calibration):
    """degrees, RMS over all directions, but for one rotation of the whole sensor: as read, and corrected."""
    drawn = recording.meta["true_errors"]["acc"]
    up = np.random.default_rng(5).standard_normal((300, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    read = 9.80665 * up @ drawn["matrix"].T + drawn["turn_on_bias"]
    matrix = np.zeros((3, 3)) if calibration.acc_matrix is None else calibration.acc_matrix.value
    errors = []
    for force in (read, read - read @ matrix.T - calibration.acc_bias.value):
        unit = force / np.linalg.norm(force, axis=1, keepdims=True)
        turned = Rotation.align_vectors(up, unit)[0].apply(unit)
        errors.append(np.degrees(np.sqrt(np.mean(np.sum((turned - up) ** 2, axis=1)))))
    return errors


@pytest.mark.slow
def test_sigma_is_true_on_a_table_and_in_the_hand():
    """RMS of error over σ, of the numbers that are known, over 4 sensors each; the bias counts S b₀."""
    over = {}
    for tremor in (0.0, 0.15):
        for seed in range(4):
            recording = observed(sides(seed, 6), seed, tremor=tremor)
            found = lh.calibrate_sensor(recording).calibration
            for name, value in inertial_truth(recording).items():
                part = getattr(found, name)
                errors = (part.value - value)[part.known] / part.sigma[part.known]
                over.setdefault((name, tremor), []).append(errors)
    for key, several in over.items():
        assert 0.4 < np.sqrt(np.mean(np.concatenate(several) ** 2)) < 1.5, key


@pytest.mark.slow
@pytest.mark.parametrize(("tremor", "chip"), [(0.0, "MPU-6050"), (0.15, "MPU-6050"), (0.0, "LSM6DSO32")])
def test_six_sides_make_tilt_better(tremor, chip):
    """Offsets and scales alone: no log is refused, each makes the tilt better, on average by three times or more."""
    errors = []
    for seed in range(3):
        recording = observed(sides(seed, askew=0.3), seed, chip, tremor=tremor)
        found = lh.calibrate_sensor(recording)
        assert "none could be left out" in found.verdict()[0]
        assert any("cross-axis" in line and "the edge between" in line for line in found.advice)
        errors.append(tilt_errors(recording, found.calibration))
    before, after = np.array(errors).T
    assert (after < before).all()
    assert np.sqrt(np.mean(before**2)) > 3.0 * np.sqrt(np.mean(after**2))


def test_a_tremor_costs_little():
    recording = observed(sides(3, 6), 3, tremor=0.15)
    before, after = tilt_errors(recording, lh.calibrate_sensor(recording).calibration)
    assert after < 0.1 * before


def test_a_sensor_without_errors_gets_no_numbers():
    perfect = simulate.Imu(acc=simulate.TriadErrors(white_noise_density=1e-3), gyr=simulate.TriadErrors(1e-4))
    with pytest.raises(LevelheadError, match="make no sensor better"):
        lh.calibrate_sensor(simulate.observe(move(sides(1), [1.5] * 5), perfect, 1))


def test_a_group_that_is_no_better_is_not_in_the_file():
    """A perfect gyroscope: the file has the accelerometer's numbers and no S, so a filter keeps its own prior."""
    board = simulate.Imu(gyr=simulate.TriadErrors(1e-5), acc=simulate.TriadErrors(1e-3, 0.2, scale_factor=0.01))
    found = lh.calibrate_sensor(simulate.observe(move(sides(2, 6), [1.5] * 11), board, 2))
    assert not found.gyroscope.better
    assert "the file leaves it out" in found.verdict()[1]
    assert not found.calibration.gyr_matrix.unlearned.any()
    assert found.calibration.acc_matrix.known.any()


def test_whole_turns_on_the_table_give_the_scale():
    """Three sides up, each turned by 720° against an edge: S of each axis, where gravity shows nothing."""
    attitudes, turns = [], []
    for up in np.eye(3):
        side = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])[0]
        nearly = Rotation.from_rotvec([0.0, 0.0, np.radians(0.2)]) * side
        attitudes += [side, nearly]
        turns += [(6.0, up * np.radians(720.2)), 1.5]
    recording = simulate.observe(move(attitudes, turns[:-1]), simulate.imu("MPU-6050"), 4)
    right = np.diag(inertial_truth(recording)["gyr_matrix"])
    known = lh.calibrate_sensor(recording, turn=360.0).calibration.gyr_matrix
    assert np.abs(np.diag(known.value) - right).max() < 0.001
    assert (np.diag(known.sigma) < 0.001).all()
    with pytest.raises(LevelheadError, match="3 directions of gravity; expected at least 4"):
        lh.calibrate_sensor(recording)
    with pytest.raises(LevelheadError, match="360 for a whole turn"):
        lh.calibrate_sensor(recording, turn=5.0)


def test_a_real_log_held_in_the_hand(data_dir):
    """xio's log beside imufusion: held in 18 poses; where held out, |a| is nearer to g by more than 4 times."""
    found = lh.calibrate_sensor(lh.read(data_dir / "samples" / "xio_sensor_data.csv"))
    assert len(found.force) > 12
    assert found.accelerometer.ratio > 4.0
    assert found.accelerometer.before < 0.1


def reverse(values, axis):
    changed = values.copy()
    changed[:, axis] *= -1.0
    return changed


FAULTS = {
    "gyroscope z reversed": lambda gyr, acc: (reverse(gyr, 2), acc),
    "accelerometer z reversed or gyroscope x and y reversed": lambda gyr, acc: (gyr, reverse(acc, 2)),
    "gyroscope x and y swapped": lambda gyr, acc: (gyr[:, [1, 0, 2]], acc),
    "accelerometer x and y swapped": lambda gyr, acc: (gyr, acc[:, [1, 0, 2]]),
    "gyroscope reads (1.9|2|2.0). times the true rate": lambda gyr, acc: (2.0 * gyr, acc),
    "gyroscope's x axis reads (0.5|0.49.) times the true rate": lambda gyr, acc: (gyr * [0.5, 1.0, 1.0], acc),
    "gyroscope's x axis is clipped in": lambda gyr, acc: (np.clip(gyr, [-0.5, -9, -9], [0.5, 9, 9]), acc),
    "accelerometer's z axis stands at 7.5": lambda gyr, acc: (gyr, np.clip(acc, [-99, -99, -7.5], [99, 99, 7.5])),
    "accelerometer's x axis reads 0.5. times": lambda gyr, acc: (gyr, acc * [0.5, 1.0, 1.0]),
    "gyroscope's y axis has the same reading": lambda gyr, acc: (gyr * [1.0, 0.0, 1.0], acc),
}


@pytest.fixture(scope="module")
def twelve():
    return observed(sides(1, 6), 1)


@pytest.mark.parametrize("words", FAULTS)
def test_a_fault_is_refused_by_its_name(twelve, words):
    gyr, acc = FAULTS[words](np.asarray(twelve.gyr), np.asarray(twelve.acc))
    with pytest.raises(LevelheadError, match=words):
        lh.calibrate_sensor(dataclasses.replace(twelve, gyr=gyr, acc=acc))


def test_turns_that_are_clipped_are_left_out(twelve):
    top = 1.3
    clipped = dataclasses.replace(twelve, gyr=np.clip(twelve.gyr, [-top, -9, -9], [top, 9, 9]))
    found = lh.calibrate_sensor(clipped)
    assert len(found.angles) < 11
    assert any(line.startswith("the gyroscope's x is clipped in") for line in found.advice)
    assert np.abs(found.calibration.gyr_matrix.value - inertial_truth(twelve)["gyr_matrix"]).max() < 0.01
