"""Logs as well-known programs write them are read right, or refused with a command line that does it."""

from pathlib import Path

import numpy as np
import pytest
from tests.reference import (  # noqa: F401  (each registers its dialects)
    dialects_of_boards,
    dialects_of_consoles,
    dialects_of_datasets,
    dialects_of_devices,
    dialects_of_labs,
    dialects_of_loggers,
    dialects_of_phones,
    dialects_of_protocols,
    dialects_of_serial,
    dialects_of_streams,
    dialects_of_tables,
    dialects_of_vehicles,
    wild,
)
from tests.reference.dialects import DIALECTS, REFUSED, Motion, off, simulate

import levelhead as lh

COMMAND = {  # they have no time, or no known names
    "x_imu_packets", "adafruit_sensor", "sparkfun_icm20948", "mpu6050_words", "vectornav_ascii", "unknown_names",
    "motion_sense", "uci_hapt", "usc_had", "career_con", "esense", "razor_ahrs",
    "minimu9_raw", "motion_cal", "nano33_bursts", "mhealth",
    "rotation_letters", "words_and_triples",
    "unit_in_the_word",
    "packet_numbers", "header_with_time_rows_without", "xsens_look_alike", "kalibr_imu", "colons_and_semicolons",
    "a_line_for_each_sensor", "bars_between_sensors", "two_delimiters",
    "state_rows", "no_time_but_position", "tabs_without_time", "comments_and_rates", "clock_in_pieces",
    "sentences_for_axes",
    "along_across_through", "underlined_header", "misspelt_axis", "value_of_each", "axis_lines_with_units",
    "one_line_of_java", "padded_words", "arrow_and_two_semicolons", "words_in_braces", "health_line",
    "signs_and_angles", "gyroscope_first_two_blanks",
    "razor_with_angles", "thousandths",
}  # fmt: skip
GUESS = {
    "betaflight_explorer",
    "blackbox_decode",
    "razor_m0",
    "putty_log",
    "witmotion_chinese",
    *("russian_table", "pamap2", "shl", "oxiod", "kaist_urban", "nclt", "ros2_echo_csv", "livox_text", "gps_time_ms"),
    "two_boards_numbered",
    *("hololens", "zurich_mav", "ranges_in_columns", "korean_degrees"),
    *("text_book_recording", "increments", "matlab_two_clocks", "data_and_times_apart", "quaternion_first_no_names"),
    "whole_mg_and_mrad",
    *("sentences_with_checksums", "tuples_in_tuples", "labview_measurement"),
    *("numpy_array", "matlab_one_matrix"),
}  # physics; code page


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate("hand")


def marked() -> list[object]:
    """The third tier reads every other log; of the rest the first reads a quarter, but none with a command line."""
    slow, full = [(pytest.mark.slow,), (pytest.mark.full,)]
    marks = [full if k % 2 else slow if k % 8 else () for k in range(len(DIALECTS))]
    names = sorted(DIALECTS.keys() - REFUSED)
    return [
        pytest.param(name, marks=slow if mark == () and name in COMMAND else mark)
        for name, mark in zip(names, marks, strict=False)
    ]


@pytest.mark.parametrize("name", marked())
def test_a_log_of_a_known_program(name: str, motion: Motion, tmp_path: Path) -> None:
    path = DIALECTS[name](tmp_path, motion)
    if name in COMMAND:
        with pytest.raises(lh.LevelheadError) as caught:
            lh.read(path)
        found = wild.COMMAND.search(str(caught.value))
        assert found is not None, caught.value
        recording = wild.run(found.group(1))
    else:
        recording = lh.read(path)
        assert name in GUESS or not any("a guess" in note for note in recording.meta["notes"]), recording.meta["notes"]
    assert off(recording, motion) == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(REFUSED))
def test_a_log_that_no_hint_makes_right_is_refused(name: str, motion: Motion, tmp_path: Path) -> None:
    path = DIALECTS[name](tmp_path, motion)
    for hints in ({}, {"rate": 100.0}):
        with pytest.raises(lh.LevelheadError):
            lh.read(path, **hints)


@pytest.mark.parametrize("rate", [10, 20, 50])
def test_the_rate_in_the_command_heeds_the_unit_in_the_header(rate: int, motion: Motion, tmp_path: Path) -> None:
    """In rad/s 20 Hz would be 1146, which is a rate too."""
    slower = motion.deg * rate / 100
    body = "\n".join(",".join(f"{v:.3f}" for v in (*a, *g)) for a, g in zip(motion.acc, slower, strict=True))
    path = tmp_path / "log.csv"
    path.write_text("ax_mps2,ay_mps2,az_mps2,gx_dps,gy_dps,gz_dps\n" + body + "\n")
    with pytest.raises(lh.LevelheadError, match=rf"--rate {rate}\b"):
        lh.read(path)


@pytest.mark.parametrize("rate", [10, 50])
def test_the_rate_in_the_command_is_that_of_raw_counts_where_they_are_usual(
    rate: int, motion: Motion, tmp_path: Path
) -> None:
    """Counts of an MPU-6050 as it comes; a gyroscope's 131 per deg/s were a rate far beyond any sensor's before."""
    counts = np.rint(np.hstack([motion.acc / 9.80665 * 16384, motion.deg * rate / 100 * 131])).astype(int)
    path = tmp_path / "log.csv"
    path.write_text("ax,ay,az,gx,gy,gz\n" + "\n".join(",".join(map(str, row)) for row in counts) + "\n")
    with pytest.raises(lh.LevelheadError, match=rf"if these are raw counts, 131 per deg/s; try: .* --rate {rate}\b"):
        lh.read(path)
    with pytest.raises(lh.LevelheadError, match=rf"--rate {rate}\b"):
        lh.read(path, counts={"gyr": "131/deg/s", "acc": "16384/g"})


@pytest.mark.parametrize(
    "name", ["sensor_logger_android", "sensor_logger_without_total", "sensor_logger_zip_ios", "physics_toolbox"]
)
def test_linear_acceleration_at_rest_is_not_taken_for_gravity(name: str, tmp_path: Path) -> None:
    """Its mean is a bias, not short beside its usual length; but no unit makes it as long as gravity."""
    still = simulate("still")
    assert off(lh.read(DIALECTS[name](tmp_path, still)), still) == ""


@pytest.mark.parametrize(("unit", "head"), [("g", "t,accX,accY,accZ,gyroX,gyroY,gyroZ"), ("mg", "t,ax,ay,az,wx,wy,wz")])
def test_minus_1_g_along_z_is_noted_and_a_minus_before_the_unit_turns_it(
    unit: str, head: str, motion: Motion, tmp_path: Path
) -> None:
    """Core Motion's sign, and a sensor upside down: both turn as the gyroscope says, and the names tell neither."""
    acc = -(motion.g if unit == "g" else 1000 * motion.g)
    path = tmp_path / "watch.csv"
    body = (f"{t:.3f}," + ",".join(f"{v:.5f}" for v in (*a, *g)) for t, a, g in zip(motion.t, acc, motion.gyr))  # noqa: B905
    path.write_text(head + "\n" + "\n".join(body) + "\n")
    said = [note for note in lh.read(path).meta["notes"] if "its sign is a guess" in note]
    assert len(said) == 1 and said[0].endswith(f"--units acc=-{unit}")
    turned = lh.read(path, units={"acc": f"-{unit}"})
    assert off(turned, motion) == ""
    kept = lh.read(path, units={"acc": unit})
    np.testing.assert_allclose(kept.acc, -turned.acc)
    assert not any("sign is a guess" in note for one in (turned, kept) for note in one.meta["notes"])


def test_there_are_enough_of_them() -> None:
    assert len(DIALECTS) >= 289
