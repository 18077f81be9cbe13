"""A Calibration: learned within its σ, said in words, applied, saved and read to the bit; bad files in one sentence."""

import json

import numpy as np
import pytest

import levelhead as lh
from levelhead.calibration import Quantity
from levelhead.filters import ESKF

pytestmark = pytest.mark.slow

SEEDS = range(4)
SENSOR = lh.simulate.Imu(
    lh.simulate.TriadErrors(white_noise_density=1e-4, turn_on_bias=0.01, scale_factor=0.003, misalignment=0.003),
    lh.simulate.TriadErrors(white_noise_density=1e-3, turn_on_bias=0.05),
    lh.simulate.TriadErrors(white_noise_density=0.05),
    lh.simulate.Iron((0.2, -0.3, 0.25)),
)
LATE = 2  # samples by which the magnetometer is late


def known(seed):
    """A recording of a sensor whose every fault is known, 20 ms late in its magnetometer, and its calibration."""
    exact = lh.simulate.observe(lh.simulate.motion(seed, 120.0, 100.0, style="hand"), SENSOR, seed)
    rows = slice(LATE, None)
    rec = lh.Recording(
        exact.t[rows], exact.gyr[rows], exact.acc[rows], exact.mag[:-LATE],
        lh.Truth(exact.truth.quat[rows], exact.truth.bias[rows]), exact.meta,
    )  # fmt: skip
    return rec, lh.fuse(rec, ESKF()).calibration


@pytest.fixture(scope="module")
def runs():
    return [known(seed) for seed in SEEDS]


def truth(recording):
    """Name -> value of what the filter ought to find."""
    drawn = recording.meta["true_errors"]
    inverse = np.linalg.inv(drawn["gyr"]["matrix"])
    return {
        "gyr_matrix": np.eye(3) - inverse,
        "gyr_bias": inverse @ recording.truth.bias[-1],
        "acc_bias": drawn["acc"]["turn_on_bias"],
        "mag_offset": np.array(SENSOR.iron.hard),
        # A rate is held over the interval that ends at its stamp: the attitude is half an interval ahead of it.
        "mag_delay": np.array([(LATE + 0.5) * 0.01]),
    }


@pytest.mark.parametrize("name", ["gyr_matrix", "gyr_bias", "acc_bias", "mag_offset", "mag_delay"])
def test_learned_within_its_sigma(runs, name):
    """Over several seeds: every number within 3.5 σ, their RMS not above 1.4 σ, and σ smaller than it was.

    The delay is 1.3 σ early in each: its rate is taken for one with the delay of a usual filter, which these have not.
    """
    off = []
    for recording, found in runs:
        part = getattr(found, name)
        off.append(np.ravel((part.value - truth(recording)[name]) / part.sigma))
        assert (part.sigma < 0.75 * part.unlearned).all()
    off = np.concatenate(off)
    assert np.abs(off).max() < 3.5, off
    assert np.sqrt(np.mean(off**2)) < 1.4, off


def test_the_field_of_the_place(runs):
    for _, found in runs:
        np.testing.assert_allclose(found.field.value, lh.simulate.EARTH_FIELD[1:], atol=1.0)


def test_in_words(runs):
    words = str(runs[0][1])
    for start in (
        "gyroscope bias x 0.98 ± 0.04, y −1.0",
        "gyroscope scale x",
        "gyroscope cross-axis xy",
        "accelerometer bias x 0.06",
        "magnetometer offset x",
        "magnetometer 20 ± 3 ms later than the gyroscope",
        "field of the place 48.",
    ):
        assert any(line.startswith(start) for line in words.splitlines()), words
    assert "could not" not in words


def test_what_a_motion_cannot_teach():
    """On a table: biases, but neither scale nor delay; without a magnetometer nothing of it."""
    still = lh.fuse(lh.simulate.recording("LSM6DSO32", "still", seed=1, mag="HMC5883L"), ESKF()).calibration
    *words, missing = still.words()
    assert words[0].startswith("gyroscope bias x") and not any("scale" in line for line in words)
    assert missing.startswith("could not be learned from this motion: ")
    assert "gyroscope scale x y z (too little rotation about it)" in missing
    assert "magnetometer delay (too little rotation)" in missing and "accelerometer bias" in missing
    six = lh.fuse(lh.simulate.recording("LSM6DSO32", "still", seed=1), ESKF()).calibration
    assert six.mag_offset is six.mag_delay is six.field is None and "magnet" not in str(six)


def test_what_is_switched_off_is_not_said():
    params = ESKF(scale_start=0.0, scale_walk=0.0, acc_bias=0.0, acc_walk=0.0)
    words = str(lh.fuse(lh.simulate.recording("LSM6DSO32", "hand", duration=20.0), params).calibration)
    assert "scale" not in words and "cross" not in words and "accelerometer" not in words and "bias x" in words


def test_apply_corrects_the_readings(runs):
    recording, found = runs[1]
    before = recording.gyr.copy()
    better = found.apply(recording)
    np.testing.assert_array_equal(recording.gyr, before)
    matrix, exact = recording.meta["true_errors"]["gyr"]["matrix"], lh.simulate.motion(1, 120.0, 100.0, style="hand")
    rows = slice(LATE, None)

    def worst(one):
        return [
            np.sqrt(np.mean((one.gyr - exact.gyr[rows]) ** 2)),
            np.sqrt(np.mean((one.acc - exact.specific_force[rows]) ** 2)),
            np.sqrt(np.mean((one.mag - exact.to_body(np.array(lh.simulate.EARTH_FIELD))[rows]) ** 2)),
        ]

    shares = np.array(worst(better)) / worst(recording)
    assert (shares < [0.5, 0.5, 0.7]).all(), shares  # of the field half a µT is noise
    left = np.linalg.solve(matrix, recording.truth.bias[-1]) - found.gyr_bias.value
    np.testing.assert_allclose(better.truth.bias[-1], left, atol=1e-4)
    again = lh.fuse(better, ESKF()).calibration
    assert np.abs(again.gyr_bias.value).max() < 0.1 * np.abs(found.gyr_bias.value).max()


def test_apply_passes_what_is_missing():
    recording = lh.simulate.recording("LSM6DSO32", "hand", duration=5.0, mag="HMC5883L")
    found = lh.fuse(recording, ESKF()).calibration
    gyr, acc, mag = recording.gyr.copy(), recording.acc.copy(), recording.mag.copy()
    gyr[3, 1], acc[4, 0], mag[5] = np.nan, np.nan, np.nan
    part = found.apply(lh.Recording(recording.t, gyr, acc, mag))
    assert np.isnan(part.gyr[3]).any() and np.isfinite(part.mag[3]).all()
    assert np.isnan(part.acc[4]).any() and np.isfinite(np.delete(part.acc, 4, axis=0)).all()
    assert np.isnan(part.mag[5]).all() and np.isfinite(np.delete(part.mag, 5, axis=0)).all()
    assert found.apply(lh.Recording(recording.t, gyr, acc)).mag is None


def test_a_sensor_that_is_silent_stays_so(runs):
    recording, found = runs[0]
    acc, mag = recording.acc.copy(), recording.mag.copy()
    acc[3:5], mag[7] = 0.0, 0.0
    part = found.apply(lh.Recording(recording.t, recording.gyr, acc, mag))
    assert not part.acc[3:5].any() and not part.mag[7].any()
    whole = found.apply(recording)
    np.testing.assert_array_equal(np.delete(part.mag, 7, 0), np.delete(whole.mag, 7, 0))


def test_saved_and_read_to_the_bit(runs, tmp_path):
    for _, found in runs:
        found.save(tmp_path / "sensor.json")
        assert lh.Calibration.read(tmp_path / "sensor.json").to_dict() == found.to_dict()
    assert [path.name for path in tmp_path.iterdir()] == ["sensor.json"]
    six = lh.fuse(runs[0][0][:100], ESKF()).calibration
    six = six.without("mag_offset", "mag_delay", "field")
    six.save(tmp_path / "six.json")
    assert lh.Calibration.read(tmp_path / "six.json").mag_offset is None


def refused(path):
    with pytest.raises(lh.LevelheadError) as caught:
        lh.Calibration.read(path)
    words = str(caught.value)
    assert "\n" not in words and path.name in words
    return words


@pytest.mark.parametrize(
    "content", [b"", b"\x00\xff", b"[]", b"{}", b'{"format": 1}', b"t,x\n1,2\n", b"[" * 100_000, b" " * 2_000_000]
)
def test_foreign_files_are_refused(content, tmp_path):
    path = tmp_path / "sensor.json"
    path.write_bytes(content)
    assert "is not a calibration; expected the JSON that levelhead saved" in refused(path)


def test_missing_files_and_folders_are_refused(runs, tmp_path):
    assert "cannot read the calibration" in refused(tmp_path / "nowhere.json")
    assert "cannot read the calibration" in refused(tmp_path)
    with pytest.raises(lh.LevelheadError, match="there is no folder"):
        runs[0][1].save(tmp_path / "no" / "sensor.json")


@pytest.mark.parametrize(
    "name, change, words",
    [
        ("gyr_bias", None, "gyr_bias is missing"),
        ("gyr_bias", {"unit": "deg/s"}, "gyr_bias is missing or not in rad/s"),
        ("gyr_matrix", {"value": [[1, 2], [3, 4]]}, r"gyr_matrix.value has shape (2, 2); expected (3, 3)"),
        ("acc_bias", {"sigma": [0.1, -0.1, 0.1]}, "acc_bias.sigma is [0.1, -0.1, 0.1]; expected numbers of at least 0"),
        ("acc_bias", {"value": [0.1, float("nan"), 0.1]}, "expected finite numbers"),
        ("acc_bias", {"value": [0.1, float("inf"), 0.1]}, "acc_bias.value is infinite"),
        ("mag_offset", {"value": ["a", "b", "c"]}, "mag_offset.value holds"),
        ("mag_delay", 3, "mag_delay is missing or not in s"),
        ("format", "levelhead calibration 9", "has the format 'levelhead calibration 9'; this version reads"),
    ],
)
def test_damaged_files_are_refused(runs, tmp_path, name, change, words):
    path = tmp_path / "sensor.json"
    runs[0][1].save(path)
    whole = json.loads(path.read_text())
    whole[name] = whole[name] | change if isinstance(change, dict) else change
    path.write_text(json.dumps(whole))
    assert words in refused(path)


def test_known_means_that_sigma_has_shrunk():
    part = Quantity(np.zeros(3), np.array([0.5, 0.8, 0.0]), np.array([1.0, 1.0, 0.0]), np.ones(3))
    assert part.known.tolist() == [True, False, False]
