"""Layouts of public code that were not read at first; ``benchmarks.reader.layouts`` judges all of their rounds."""

from pathlib import Path

import numpy as np
import pytest
from tests.reference.dialects import EPOCH, Motion, rows, simulate, write
from tests.reference.layout_verdicts import ROUNDS, judge

import levelhead as lh

MENDED = {
    "firmware": ("chiptime", "blank_for_the_time", "zephyr_shell"),
    "apps": ("device_motion", "core_motion_short_names", "connect_iq_seconds", "g_force_recorder"),
    "robots": ("pandas_of_a_bag", "vectornav_control_center", "gazebo_echo", "mongo_export", "ulog2csv_vehicle_imu"),
    "laboratories": ("sis_fall",),
}

STRANGERS = {"temperature_called_t": "command", "comma_behind_a_name": "command", "rotation_in_german": "command"}
STRANGERS |= {"clock_before_date": "guess"}

INSTRUMENTS = {name: "command" for name in ("stray_scanner", "vn_ascii")}
INSTRUMENTS |= {name: "guess" for name in ("cats_tag", "nicla_ble", "joycon_counts", "dataframe_multi")}


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate("hand")


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, names in MENDED.items() for name in names])
def test_a_layout_that_was_not_read_at_first(kind: str, name: str, motion: Motion, tmp_path: Path) -> None:
    verdict, why = judge(name, ROUNDS[kind][name], motion, tmp_path)
    assert verdict == ("command" if name == "sis_fall" else "right"), why


@pytest.mark.slow
@pytest.mark.parametrize("name", ROUNDS["strangers"])
def test_a_layout_that_a_stranger_chose(name: str, motion: Motion, tmp_path: Path) -> None:
    verdict, why = judge(name, ROUNDS["strangers"][name], motion, tmp_path)
    assert verdict == STRANGERS.get(name, "right"), why


@pytest.mark.slow
@pytest.mark.parametrize("name", ROUNDS["instruments"])
def test_a_layout_of_an_instrument(name: str, motion: Motion, tmp_path: Path) -> None:
    verdict, why = judge(name, ROUNDS["instruments"][name], motion, tmp_path)
    assert verdict == INSTRUMENTS.get(name, "right"), why


HEAD = "time [s]," + ",".join(
    f"{name}_{axis} [{unit}]" for name, unit in (("gyr", "rad/s"), ("acc", "m/s²")) for axis in "xyz"
)


def test_a_row_without_a_reading_is_no_sample(motion: Motion, tmp_path: Path) -> None:
    stamps = motion.t.tolist()
    lines = [
        f"{t:.3f},{','.join(f'{v:.6f}' for v in (*g, *a))},"
        for t, g, a in zip(stamps, motion.gyr, motion.acc, strict=True)
    ]
    lines.insert(200, f"{stamps[200]:.3f},,,,,,,blink")
    recording = lh.read(write(tmp_path / "log.csv", f"{HEAD},event\n", "\n".join(lines)))
    np.testing.assert_array_equal(recording.t, motion.t.round(3))
    assert np.isfinite(recording.gyr).all()


def test_one_stamp_that_repeats_leaves_the_others(motion: Motion, tmp_path: Path) -> None:
    stamps = (motion.t + 0.1 * np.sin(motion.t)).round(6)  # a clock that is no straight line
    stamps[700] = stamps[699]
    recording = lh.read(write(tmp_path / "log.csv", f"{HEAD}\n", rows(stamps, motion.gyr, motion.acc)))
    kept = np.delete(np.arange(len(stamps)), 700)
    np.testing.assert_allclose(recording.t[kept], stamps[kept], atol=1e-9)
    assert recording.t[699] < recording.t[700] < recording.t[701]


def test_a_field_is_read_without_the_bias_that_a_phone_wrote_beside_it(motion: Motion, tmp_path: Path) -> None:
    recording = lh.read(ROUNDS["strangers"]["android_uncalibrated"](tmp_path, motion))
    assert recording.mag is not None
    np.testing.assert_allclose(recording.mag[:500], motion.mag[: len(recording)][:500], atol=2.0)


@pytest.mark.parametrize("ticks", [200, 10_000, 32_768])
def test_a_counter_has_the_ticks_that_the_clock_beside_it_shows(ticks: int, motion: Motion, tmp_path: Path) -> None:
    arrival = np.sort(motion.t + np.random.default_rng(1).uniform(0.0, 0.02, len(motion.t)))
    stamps, host = np.floor(motion.t * ticks + 777).astype(int), np.rint(arrival * 1e3).astype(int) + EPOCH
    head = "SampleTimestamp,HostTimestamp," + ",".join(
        f"{name}_{axis} [{unit}]" for name, unit in (("gyr", "rad/s"), ("acc", "m/s²")) for axis in "xyz"
    )
    log = write(tmp_path / "log.csv", f"{head}\n", rows(stamps, host, motion.gyr, motion.acc))
    assert lh.interpret(log).units["t"] == f"ticks of 1/{ticks} s"
    assert lh.read(log).duration == pytest.approx(motion.t[-1], abs=0.02)


@pytest.mark.parametrize(("unit", "factor"), [("us", 1e6), ("s", 1.0)])
def test_increments_become_rates_whatever_the_unit_of_their_interval(
    unit: str, factor: float, motion: Motion, tmp_path: Path
) -> None:
    interval = np.full(len(motion.t), 0.01)
    interval[100:] = 0.012  # gaps in the firmware: the row's own interval counts
    text = rows(np.rint(motion.t * 1e6).astype(int), motion.gyr * interval[:, None], motion.acc * interval[:, None],
                interval * factor, interval * factor, form="%.9f")  # fmt: skip
    head = ",".join(["timestamp", *(f"delta_{kind}[{i}]" for kind in ("angle", "velocity") for i in range(3))])
    log = write(tmp_path / f"imu_{unit}.csv", f"{head},delta_angle_dt,delta_velocity_dt\n", text)
    recording = lh.read(log)
    np.testing.assert_allclose(recording.gyr, motion.gyr, atol=1e-5)
    np.testing.assert_allclose(recording.acc, motion.acc, atol=1e-4)
