"""Calibration by poses: what was put into simulated sensors is found within its σ; verdicts, refusals, hand-over."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from tests.reference.hand_motion import frame, inertial_truth

import levelhead as lh
from levelhead import LevelheadError, simulate
from levelhead.calibrate.poses import find_poses
from levelhead.calibration import Calibration

pytest.importorskip("scipy")
IRON = simulate.Iron((12.0, -8.0, 20.0), ((1.05, 0.02, 0.0), (0.02, 0.97, -0.03), (0.0, -0.03, 1.0)))


def put_down(seed, count=14, mag="HMC5883L", **motion):
    board = simulate.imu("MPU-6050", mag=mag, iron=IRON if mag else None)
    return simulate.observe(simulate.poses(count, seed, **motion), board, seed)


def truth(recording):
    """What poses ought to find."""
    drawn, found = recording.meta["true_errors"], inertial_truth(recording)
    turned = frame(drawn)
    if "mag" in drawn:
        field = turned @ np.linalg.inv(drawn["mag"]["matrix"] @ np.array(IRON.soft))
        field *= 3.0 / np.trace(field)
        hard = drawn["mag"]["matrix"] @ np.array(IRON.hard) + drawn["mag"]["turn_on_bias"]
        found |= {"mag_matrix": np.eye(3) - field, "mag_offset": field @ hard}
    return found


@pytest.fixture(scope="module")
def recording():
    return put_down(3)


@pytest.fixture(scope="module")
def found(recording):
    return lh.calibrate_sensor(recording)


@pytest.mark.full
def test_thirty_sensors_are_found_within_their_sigma():
    """Errors over σ of 30 specimens: hardly more beyond 3σ than a normal distribution has, and σ of the right size."""
    over: dict[str, list[np.ndarray]] = {}
    for seed in range(30):
        recording = put_down(seed, mag="HMC5883L" if seed % 6 == 0 else None, rate=50.0, turn=1.5)
        calibration = lh.calibrate_sensor(recording).calibration
        for name, value in truth(recording).items():
            part = getattr(calibration, name)
            over.setdefault(name, []).append((part.value - value)[part.known] / part.sigma[part.known])
    for name, several in over.items():
        every = np.abs(np.concatenate(several))
        assert (every > 3.0).mean() < 0.02, name  # 0.0027 of a normal distribution
        assert every.max() < 4.5, name
        spread = np.sqrt(np.mean(every**2))
        assert 0.4 < spread < 1.3, (name, spread)


@pytest.mark.slow
def test_readings_become_right(recording, found):
    better = found.calibration.apply(recording)
    poses, _ = find_poses([better])
    lengths = [np.linalg.norm(pose.acc) for pose in poses]
    np.testing.assert_allclose(lengths, 9.80665, atol=0.01)
    fields = [np.linalg.norm(pose.mag) for pose in poses]
    assert np.ptp(fields) < 0.02 * np.mean(fields)
    raw = [np.linalg.norm(pose.mag) for pose in find_poses([recording])[0]]
    assert np.ptp(raw) > 0.3 * np.mean(raw)


@pytest.mark.slow
def test_the_verdict_says_how_much_better(found):
    words = found.verdict()
    assert [line.split(":")[0] for line in words] == ["accelerometer", "gyroscope", "magnetometer"]
    assert all("better than no calibration by" in line for line in words)
    assert found.accelerometer.ratio > 5.0
    assert found.gyroscope.ratio > 5.0
    assert found.accelerometer.after <= found.accelerometer.held_out < found.accelerometer.before


def test_sides_that_are_missing_are_named():
    """Poses whose z axis is level: neither the scale of z nor its bias can be told."""
    motion = simulate.poses(12, 1)
    half = 0.5 * np.linspace(0.0, 1.6 * np.pi, 10)
    quat, rate = [], []
    level = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])  # x down, z level
    from levelhead.rotations import from_rotvec, product

    for angle in half:
        one = product(level, from_rotvec(np.array([0.0, 0.0, 2.0 * angle])))
        quat.append(np.tile(one, (250, 1)))
    rate = np.zeros((2500, 3))
    zero = np.zeros_like(rate)
    motion = simulate.Motion(np.arange(2500) / 100.0, np.concatenate(quat), rate, zero, zero, zero)
    weak = lh.calibrate_sensor(simulate.observe(motion, simulate.imu("MPU-6050"), 1))
    (line,) = [line for line in weak.advice if "do not determine the accelerometer's" in line]
    assert "scale z" in line
    assert "bias z" in line
    assert "z" in line.partition("put the sensor down with")[2]
    assert not weak.calibration.acc_matrix.known[2, 2]
    assert weak.calibration.acc_bias.known[:2].all()


@pytest.mark.slow
def test_half_a_sphere_is_weak_and_says_which_side_is_missing():
    """Only poses with +z up: not refused, but the verdict names what they cannot tell, and the pose that would."""
    recording = put_down(3, mag=None, rate=50.0, turn=1.5)
    upper = replace(recording, acc=np.where(recording.acc[:, 2:] > 1.0, recording.acc, np.nan))
    assert not [line for line in lh.calibrate_sensor(recording).advice if "the accelerometer's" in line]
    weak = lh.calibrate_sensor(upper)
    (line,) = [line for line in weak.verdict() if "do not determine the accelerometer's" in line]
    assert "put the sensor down with" in line


@pytest.mark.parametrize(
    ("recording", "sentence"),
    [
        (simulate.recording("MPU-6050", "hand", 40.0)[1000:], "never still in 30 s"),
        (simulate.recording("MPU-6050", "still", 30.0), "1 pose with 1 direction of gravity; expected at least 4"),
    ],
)
def test_what_cannot_be_calibrated_is_refused(recording, sentence):
    with pytest.raises(LevelheadError, match=sentence):
        lh.calibrate_sensor(recording)


def test_no_better_than_none_is_refused():
    """A perfect sensor on poses whose lengths of gravity contradict each other: the poses left out show it."""
    perfect = simulate.Imu(acc=simulate.TriadErrors(white_noise_density=1e-3), gyr=simulate.TriadErrors(1e-4))
    recording = simulate.observe(simulate.poses(16, 2), perfect, 2)
    acc = recording.acc.copy()
    for i, pose in enumerate(find_poses([recording])[0]):
        rows = (recording.t >= pose.start - 0.3) & (recording.t <= pose.end + 0.3)
        acc[rows] *= 1.0 + 0.01 * (-1) ** i
    with pytest.raises(LevelheadError, match="make no sensor better"):
        lh.calibrate_sensor(dataclasses.replace(recording, acc=acc))


def test_gravity_of_another_planet_is_refused(recording):
    with pytest.raises(LevelheadError, match="a place on earth"):
        lh.calibrate_sensor(recording, gravity=3.7)


def test_the_file_is_a_calibration(found, tmp_path):
    found.calibration.save(tmp_path / "sensor.json")
    again = Calibration.read(tmp_path / "sensor.json")
    assert again.to_dict() == found.calibration.to_dict()
    assert "accelerometer scale x" in str(again)


def test_a_prior_takes_the_matrices_off_the_readings(found):
    """Batch and stream with a prior from poses: as the corrected readings with the rest of the prior, to the bit."""
    board = simulate.imu("MPU-6050", mag="HMC5883L", iron=IRON)
    flight = simulate.observe(simulate.motion(7, 8.0, 100.0, style="hand"), board, 3)  # the same specimen
    matrices = found.calibration.matrices()
    rest = found.calibration.without("acc_matrix", "mag_matrix")
    by_hand = lh.fuse(matrices.apply(flight), prior=rest)
    track = lh.fuse(flight, prior=found.calibration)
    np.testing.assert_array_equal(track.quat, by_hand.quat)
    np.testing.assert_array_equal(track.calibration.acc_matrix.value, found.calibration.acc_matrix.value)
    live = lh.Stream(prior=found.calibration)
    last = [live.update(tuple(g), tuple(a), tuple(m), t=t)
            for t, g, a, m in zip(flight.t, flight.gyr, flight.acc, flight.mag, strict=True)][-1]  # fmt: skip
    np.testing.assert_array_equal(last, track.quat[-1])
    with pytest.raises(LevelheadError, match="cannot be saved"):
        live.save()


def test_directions_become_better(found):
    """In poses that it has not seen: but for one rotation of the whole sensor, gravity is where the truth has it."""
    from scipy.spatial.transform import Rotation

    board = simulate.imu("MPU-6050", mag="HMC5883L", iron=IRON)
    other = simulate.observe(simulate.poses(8, 77), board, 3)

    def spread(one):
        poses, _ = find_poses([one])
        acc = np.array([pose.acc for pose in poses])
        middle = np.searchsorted(one.t, [0.5 * (pose.start + pose.end) for pose in poses])
        true = Rotation.from_quat(one.truth.quat[middle], scalar_first=True).inv().apply([0.0, 0.0, 1.0])
        return Rotation.align_vectors(true, acc / np.linalg.norm(acc, axis=1, keepdims=True))[1]

    assert spread(found.calibration.apply(other)) < 0.1 * spread(other)
