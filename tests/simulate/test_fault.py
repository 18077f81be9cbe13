"""Every fault does what its words say, within its time and nowhere else."""

import math

import numpy as np
import pytest

from levelhead import simulate
from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.simulate.fault import KINDS

G = 9.80665
WITHIN = ["jitter", "doubled", "bursts", "mag_late", "mag_slow", "gyr_stuck", "acc_stuck", "gyr_spikes", "acc_spikes",
          "gyr_clipping", "acc_clipping", "gyr_rounding", "acc_rounding", "shock", "vibration", "mag_passing",
          "gyr_units", "acc_units"]  # fmt: skip


@pytest.fixture(scope="module")
def sound():
    return simulate.recording("BMI160", "hand", 60, seed=4, mag="HMC5883L")


def broken(sound, word):
    return simulate.apply_fault(sound, simulate.parse_fault(word))


def columns(recording):
    return {"t": recording.t, "gyr": recording.gyr, "acc": recording.acc, "mag": recording.mag}


@pytest.mark.parametrize("name", [kind.name for kind in KINDS])
def test_a_fault_changes_something_in_its_time_and_nothing_before(sound, name):
    made = broken(sound, f"{name}@20+10")
    assert made.fault.start == 20.0 and made.fault.length == 10.0 and made.fault.size > 0.0
    assert made.first == 2000 and len(made.recording) == len(made.rows)
    changed = []
    for role, values in columns(made.recording).items():
        before = getattr(sound, role)
        np.testing.assert_array_equal(values[:2000], before[:2000])
        same = np.array_equal(values, before[made.rows], equal_nan=True)
        changed += [] if same else [role]
        if name in WITHIN:
            np.testing.assert_array_equal(values[3000:], before[3000:])
    assert changed or len(made.rows) < len(sound)
    assert np.array_equal(made.recording.truth.quat, sound.truth.quat[made.rows]), "the truth is that of the body"
    again = broken(sound, f"{name}@20+10")
    for role, values in columns(again.recording).items():
        np.testing.assert_array_equal(values, getattr(made.recording, role))


def test_stamps(sound):
    off = broken(sound, "jitter=3@20+20").recording.t[2000:4000] - sound.t[2000:4000]
    assert np.std(off) == pytest.approx(3e-3, rel=0.1) and np.abs(off).max() < 0.02
    stamps = broken(sound, "bursts=100@20+20").recording.t[2000:4000]
    steps = np.diff(stamps)
    assert (steps > 0.05).sum() == pytest.approx(200, abs=2), "a burst every 100 ms"
    assert np.median(steps) < 1e-3


def test_dropped_and_doubled(sound):
    dropped = broken(sound, "dropped=30@20+20")
    assert len(sound) - len(dropped.recording) == pytest.approx(600, abs=90)
    np.testing.assert_array_equal(dropped.recording.gyr, sound.gyr[dropped.rows])
    assert (dropped.first, dropped.last) == (2000, 2000 + len(dropped.rows) - 4000)
    doubled = broken(sound, "doubled=30@20+20").recording
    repeats = (np.diff(doubled.gyr[2000:4000], axis=0) == 0.0).all(axis=1)
    assert repeats.mean() == pytest.approx(0.3, abs=0.05)
    np.testing.assert_array_equal(doubled.t, sound.t)


def test_a_magnetometer_late_slow_and_beside_magnets(sound):
    np.testing.assert_array_equal(broken(sound, "mag_late=200@20+10").recording.mag[2000:3000], sound.mag[1980:2980])
    slow = np.isfinite(broken(sound, "mag_slow=5@20+10").recording.mag[2000:3000, 0])
    assert slow.sum() == 50 and slow[0]
    added = np.linalg.norm(broken(sound, "mag_passing=60@20+10").recording.mag - sound.mag, axis=1)
    assert added.max() == pytest.approx(60.0, rel=1e-6) and int(added.argmax()) == 2500
    stays = np.linalg.norm(broken(sound, "mag_staying=30@20").recording.mag - sound.mag, axis=1)
    np.testing.assert_allclose(stays[2000:], 30.0)


def test_axes_and_readings(sound):
    stuck = broken(sound, "gyr_stuck=2@20+10").recording.gyr[2000:3000]
    assert sorted(len(np.unique(axis)) == 1 for axis in stuck.T) == [False, True, True]
    for name, role, unit in (("gyr", "gyr", math.radians(1.0)), ("acc", "acc", G)):
        off = np.abs(getattr(broken(sound, f"{name}_spikes=100@20+10").recording, role) - getattr(sound, role))
        rows = np.flatnonzero(off.max(axis=1))
        assert len(rows) == 20 and np.allclose(off.sum(axis=1)[rows], 100.0 * unit)
        limit = np.abs(getattr(broken(sound, f"{name}_clipping=1@20+10").recording, role)[2000:3000]).max()
        assert limit == pytest.approx(unit)
        coarse = getattr(broken(sound, f"{name}_rounding=0.5@20+10").recording, role)[2000:3000] / (0.5 * unit)
        np.testing.assert_allclose(coarse, np.rint(coarse), atol=1e-9)


def test_a_bias_ramp_ends_at_its_size_and_stays(sound):
    off = np.degrees(broken(sound, "bias_ramp=2@20+10").recording.gyr - sound.gyr)
    assert np.linalg.norm(off[2500]) == pytest.approx(1.0, rel=1e-3)
    np.testing.assert_allclose(np.linalg.norm(off[3000:], axis=1), 2.0)


def test_shocks_and_vibration(sound):
    hit = np.linalg.norm(broken(sound, "shock=30@20+20").recording.acc - sound.acc, axis=1) / G
    assert 15.0 < hit.max() <= 60.0 and 0 < (hit > 0.0).sum() < 200
    shaken = (broken(sound, "vibration=2@20+20").recording.acc - sound.acc)[2000:4000] @ np.array([0.6, -0.64, 0.48])
    assert np.std(shaken) == pytest.approx(2.0 * G / math.sqrt(2.0), rel=0.01)
    power = np.abs(np.fft.rfft(shaken))
    assert np.fft.rfftfreq(2000, 0.01)[power.argmax()] == pytest.approx(31.0, abs=0.1)


def test_a_sensor_that_turns_on_its_mount_feels_that_it_turns():
    """The loosened gyroscope, integrated, ends where the loosened accelerometer says: 10° from where it was."""
    perfect = simulate.recording(simulate.Imu(), "still", 40)
    made = broken(perfect, "loose_mount=10@10+5").recording
    turned = np.diff(made.t, prepend=0.0) @ (made.gyr - perfect.gyr)
    assert math.degrees(np.linalg.norm(turned)) == pytest.approx(10.0, abs=0.01)
    np.testing.assert_allclose(np.linalg.norm(made.acc, axis=1), np.linalg.norm(perfect.acc, axis=1))
    between = np.degrees(np.arccos((made.acc[-1] @ perfect.acc[-1]) / G**2))
    across = np.linalg.norm(np.cross(perfect.acc[-1] / G, [0.6, -0.64, 0.48]))
    assert between == pytest.approx(10.0 * across, rel=0.01)


def test_units(sound):
    for name, role in (("gyr_units=57.3", "gyr"), ("acc_units=0.102", "acc")):
        times = float(name.partition("=")[2])
        inside = slice(2000, 3000)
        np.testing.assert_allclose(
            getattr(broken(sound, f"{name}@20+10").recording, role)[inside], times * getattr(sound, role)[inside]
        )


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("acc_spike", "did you mean 'acc_spikes'"),
        ("acc_spikes=4@20+", "write NAME"),
        ("acc_spikes=0", "more than 0 g"),
        ("gyr_stuck=4", "1 to 3 of 3 axes"),
        ("dropped=101", "0 to 100 %"),
        ("shock@60", "starts at 60 s, but the recording ends at 59.99 s"),
        ("shock@-1", "0 s or later"),
        ("shock@10+0", "more than 0 s"),
        ("shock@10+0.01", "three samples at least"),
        ("shock=1e", "write NAME"),
    ],
)
def test_what_cannot_be_is_refused(sound, word, sentence):
    with pytest.raises(LevelheadError, match=sentence):
        broken(sound, word)


def test_recordings_that_are_too_short_or_have_no_magnetometer(sound):
    with pytest.raises(LevelheadError, match=r"9\.99 s long; a fault needs 20 s"):
        broken(sound[:1000], "shock")
    blind = Recording(sound.t, sound.gyr, sound.acc)
    with pytest.raises(LevelheadError, match="a fault of a magnetometer, and the recording has none"):
        broken(blind, "mag_late")
    names = {fault.name for fault in simulate.all_faults(blind)}
    assert names == {kind.name for kind in KINDS if not kind.name.startswith("mag")}
