"""Times of arrival give way to the sensor's own clock, and stamps that are true are left alone."""

from contextlib import suppress

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.evaluate import evaluate
from levelhead.recording import Recording
from levelhead.sources.formats.csv_writer import write_csv
from levelhead.sources.interpret.arrival import restore_clock
from levelhead.sources.interpret.clock_repair import repair_stamps

SOUND = simulate.recording("BMI160", "hand", 60.0, 100.0, seed=1)
KINDS = {
    "uniform": lambda random, n: random.uniform(-0.005, 0.005, n),
    "normal": lambda random, n: random.normal(0.0, 0.003, n),
    "exponential": lambda random, n: random.exponential(0.01, n),
    "spikes": lambda random, n: np.where(random.random(n) < 0.01, 0.05, 0.0),
}
READINGS = np.hstack([SOUND.gyr, SOUND.acc])


def in_order(t):
    """Samples are handed over one after another, 20 µs apart at least."""
    row = np.arange(len(t)) * 2e-5
    return np.maximum.accumulate(t - row) + row


def steps_off(t, true):
    """s, rms by which intervals are wrong."""
    return float(np.sqrt(np.mean((np.diff(t) - np.diff(true)) ** 2)))


@pytest.mark.parametrize("kind", KINDS)
def test_the_sensors_clock_is_put_back(kind):
    random = np.random.default_rng(1)
    true = SOUND.t * (1.0 + 1e-4) + 1e-3 * np.sin(SOUND.t / 60.0)  # 100 ppm slow, and wandering by 17 ppm
    late = in_order(true + KINDS[kind](random, len(true)))
    restored = restore_clock(late, READINGS)
    assert restored is not None
    assert restored.lost == 0
    assert restored.rows == len(true)
    assert steps_off(restored.t, true) < 1e-5
    assert np.std(restored.t - true) < 0.1 * np.std(late - true)
    np.testing.assert_allclose(restored.jitter, np.std(late - true), rtol=0.1)


@pytest.mark.parametrize(
    ("kind", "share"), [("uniform", 0.01), ("normal", 0.01), ("exponential", 0.01), ("spikes", 0.01)]
)
def test_lost_samples_stay_gaps(kind, share):
    random = np.random.default_rng(1)
    keep = np.flatnonzero(random.random(len(SOUND)) >= share)
    late = in_order(SOUND.t[keep] + KINDS[kind](random, len(keep)))
    restored = restore_clock(late, READINGS[keep])
    assert restored is not None
    assert abs(restored.lost - (len(SOUND) - len(keep))) <= 3
    assert steps_off(restored.t, SOUND.t[keep]) < 0.25 * steps_off(late, SOUND.t[keep])


def test_tilt_is_that_of_true_stamps(tmp_path):
    late = in_order(SOUND.t + np.random.default_rng(1).exponential(0.01, len(SOUND)))
    write_csv(Recording(late, SOUND.gyr, SOUND.acc), tmp_path / "log.csv")
    read = lh.read(tmp_path / "log.csv")
    np.testing.assert_array_equal(read.gyr, SOUND.gyr)
    assert any("times of arrival" in note for note in read.meta["notes"])
    stamps = {"true": SOUND.t, "late": late, "read": read.t}
    recordings = {name: Recording(t, SOUND.gyr, SOUND.acc, truth=SOUND.truth) for name, t in stamps.items()}
    tilt = {name: evaluate(one, lh.fuse(one)).tilt for name, one in recordings.items()}
    assert tilt["read"] < 1.05 * tilt["true"]
    assert tilt["late"] > 1.3 * tilt["true"]


def test_the_doctor_says_so(tmp_path):
    late = in_order(SOUND.t + np.random.default_rng(1).exponential(0.01, len(SOUND)))
    write_csv(Recording(late, SOUND.gyr, SOUND.acc), tmp_path / "log.csv")
    found = {one.name: one for one in lh.inspect(tmp_path / "log.csv").findings}
    assert found["arrival"].severity == "note"
    assert "jitter_ms" in found["arrival"].evidence
    assert "jitter" not in found


def test_a_change_of_rate_and_a_pause_stay():
    random = np.random.default_rng(2)
    fine = simulate.recording("BMI160", "hand", 120.0, 400.0, seed=2)
    rows = np.concatenate([np.arange(0, 16000, 4), np.arange(20000, 32000, 4), np.arange(32000, 48000, 5)])
    true = fine.t[rows]
    late = in_order(true + random.exponential(0.003, len(true)))
    restored = restore_clock(late, np.hstack([fine.gyr, fine.acc])[rows])
    assert restored is not None
    pause = int(np.argmax(np.diff(true)))
    np.testing.assert_allclose(np.diff(restored.t)[pause], 10.01, atol=0.003)
    np.testing.assert_allclose(np.median(np.diff(restored.t)[-3000:]), 0.0125, rtol=1e-3)
    np.testing.assert_allclose(np.median(np.diff(restored.t)[:3000]), 0.01, rtol=1e-3)
    assert steps_off(restored.t, true) < 0.3 * steps_off(late, true)


@pytest.mark.parametrize("spread", [0.1, 0.3, 1.0])
def test_a_loop_that_samples_unevenly_is_left_alone(spread):
    random = np.random.default_rng(3)
    fine = simulate.recording("BMI160", "hand", 60.0, 1000.0, seed=3)
    rows = np.cumsum(np.maximum(1, np.rint(random.gamma(1.0 / spread**2, 10.0 * spread**2, 8000)).astype(int)))
    rows = rows[rows < len(fine)]
    assert restore_clock(fine.t[rows], np.hstack([fine.gyr, fine.acc])[rows]) is None


def test_a_timer_that_reads_late_and_stamps_when_it_reads_is_left_alone():
    random = np.random.default_rng(4)
    fine = simulate.recording("BMI160", "hand", 60.0, 1000.0, seed=4)
    rows = np.arange(0, 59_900, 10) + random.integers(0, 9, 5990)  # bounded, and true all the same
    readings = np.hstack([fine.gyr, fine.acc])
    assert restore_clock(fine.t[rows], readings[rows]) is None
    assert (
        restore_clock(fine.t[rows], readings[np.arange(0, 59_900, 10)]) is not None
    )  # the same stamps, regular readings


def test_a_long_log_is_decided_as_a_short_one():
    times, random = 14, np.random.default_rng(7)
    true, readings = np.arange(len(SOUND) * times) * 0.01, np.tile(READINGS, (times, 1))
    restored = restore_clock(in_order(true + random.exponential(0.01, len(true))), readings)
    assert restored is not None
    assert steps_off(restored.t, true) < 1e-5
    assert restore_clock(np.cumsum(random.gamma(10.0, 0.001, len(true))), readings) is None


def test_where_nothing_moves_nothing_is_known():
    still = simulate.recording("BMI160", "still", 60.0, 100.0, seed=5)
    late = in_order(still.t + np.random.default_rng(5).exponential(0.01, len(still)))
    assert restore_clock(late, np.hstack([still.gyr, still.acc])) is None


def test_even_stamps_and_rounded_ones_are_left_alone():
    random = np.random.default_rng(6)
    assert restore_clock(SOUND.t, READINGS) is None
    assert restore_clock(np.floor(SOUND.t * 0.99e3) * 1e-3, READINGS) is None
    keep = np.flatnonzero(random.random(len(SOUND)) > 0.05)
    assert restore_clock(SOUND.t[keep], READINGS[keep]) is None
    assert restore_clock(SOUND.t, None) is None


@pytest.mark.slow
def test_no_recording_with_a_reference_is_changed(data_dir):
    logs = sorted([*data_dir.glob("broad/*.mat"), *data_dir.glob("repoimu/*.csv"), *data_dir.glob("truth/*/*.npz")])
    seen = 0
    for log in logs:
        with suppress(lh.LevelheadError):  # two phones that run
            recording = lh.read(log)
            assert all(one.reason != "arrival" for one in recording.meta.get("conclusions", ())), log
            assert restore_clock(recording.t, np.hstack([recording.gyr, recording.acc])) is None, log
            seen += 1
    assert seen > 0.9 * len(logs)


@pytest.mark.parametrize(("jitter", "rate"), [(0.004, 200.0), (0.02, 100.0), (0.05, 100.0)])
def test_jitter_that_steps_back_loses_no_row(jitter, rate):
    even = np.arange(4000) / rate
    stamps = np.rint(1e3 * (even + np.random.default_rng(1).normal(0.0, jitter, 4000)))
    made = repair_stamps(stamps, None)
    assert made.rows is None and [one.reason for one in made.conclusions] == ["jitter"]
    clock = 1e-3 * (made.stamps - made.stamps[0])
    assert (np.diff(clock) > 0.0).all() and np.abs(clock - even).max() < 0.1 * jitter


def test_jitter_over_lost_samples_keeps_the_gap():
    even = np.arange(4000) / 100.0
    even[2000:] += 3.0
    made = repair_stamps(even + np.random.default_rng(1).normal(0.0, 0.01, 4000), None)
    assert made.rows is None and np.abs(made.stamps - made.stamps[0] - even)[[500, 3500]].max() < 0.02


def test_a_clock_that_begins_again_is_no_jitter():
    for size in (100, 1000):
        stamps = np.concatenate([np.arange(size) / 100.0] * (4000 // size))
        assert repair_stamps(stamps, None).conclusions[0].reason == "longest"
