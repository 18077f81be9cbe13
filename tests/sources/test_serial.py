"""Serial lines over a pty, and replays: the same names and units as files, and nothing bad gets through."""

import json
import math
import os
import tty

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.filters.health import GAP
from levelhead.sources.devices.line_parser import UNIT_LINES
from levelhead.sources.devices.replay import Replay
from levelhead.sources.devices.serial_lines import SerialLines, parse_serial
from levelhead.sources.formats.csv_writer import write_csv
from levelhead.sources.hints import Hints, check
from levelhead.sources.sensors import SensorError

pytest.importorskip("serial", reason="pyserial is not installed (extra levelhead[live])")


class Device:
    """The other end of a pty."""

    def __init__(self) -> None:
        self.end, slave = os.openpty()
        tty.setraw(slave)
        self.path, self.slave, self.now = os.ttyname(slave), slave, 50.0

    def __call__(self) -> float:
        return self.now

    def say(self, *lines: str | bytes) -> None:
        for line in lines:
            os.write(self.end, (line if isinstance(line, bytes) else line.encode()) + b"\r\n")

    def unplug(self) -> None:
        os.close(self.end)
        self.end = -1


@pytest.fixture
def device():
    one = Device()
    yield one
    for handle in (one.end, one.slave):
        if handle >= 0:
            os.close(handle)


@pytest.fixture(scope="module")
def recording():
    return simulate.recording("ICM-20948", "hand", duration=3.0)


def opened(device: Device, hints: Hints | None = None) -> SerialLines:
    line = SerialLines(device.path, hints=hints, clock=device)
    line.start()
    return line


def everything(device: Device, line: SerialLines, lines: list[str], at_a_time: int = 7) -> list:
    samples = []
    for start in range(0, len(lines), at_a_time):
        device.say(*lines[start : start + at_a_time])
        device.now += 0.01 * at_a_time
        samples += line.poll()
    return samples


def csv_lines(recording, tmp_path) -> list[str]:
    write_csv(recording, tmp_path / "log.csv")
    return (tmp_path / "log.csv").read_text(encoding="utf-8").splitlines()


def json_lines(recording) -> list[str]:
    acc = recording.acc / 9.80665
    return [
        json.dumps(
            {"time_ms": t * 1e3, "gyro": g.tolist(), "accel": dict(zip("xyz", a, strict=True)), "mag": m.tolist()}
        )
        for t, g, a, m in zip(recording.t, np.degrees(recording.gyr), acc.tolist(), recording.mag, strict=True)
    ]


def test_csv_over_a_pty_is_the_file_to_the_bit(device, recording, tmp_path):
    lines = csv_lines(recording, tmp_path)
    line = opened(device)
    samples = everything(device, line, lines)
    line.close()
    assert [sample.t for sample in samples] == recording.t.tolist()
    for name in ("gyr", "acc", "mag"):
        np.testing.assert_array_equal([getattr(sample, name) for sample in samples], getattr(recording, name))
    assert line.garbage == 0 and line.troubles() == []


def test_json_in_other_units(device, recording):
    """Lists and objects, ms, deg/s and g, none of which is said: the numbers themselves say it."""
    hints = check(None, {"gyr": "deg/s"}, None, None)  # 20 lines at rest cannot tell deg/s from rad/s
    line = opened(device, hints)
    samples = everything(device, line, json_lines(recording))
    np.testing.assert_allclose([sample.t for sample in samples], recording.t, atol=1e-12)
    np.testing.assert_allclose([sample.gyr for sample in samples], recording.gyr, rtol=1e-12)
    np.testing.assert_allclose([sample.acc for sample in samples], recording.acc, rtol=1e-12)
    np.testing.assert_allclose([sample.mag for sample in samples], recording.mag, rtol=1e-12)


@pytest.mark.parametrize("name", ["log.jsonl", "serial.log"])
def test_what_the_device_said_is_fused_from_a_file_as_well(device, recording, tmp_path, name):
    """JSON lines that somebody kept, from the middle of a line to the middle of another: the same samples."""
    lines = json_lines(recording)
    hints = {"units": {"gyr": "deg/s"}}
    live = everything(device, opened(device, check(None, {"gyr": "deg/s"}, None, None)), lines)
    (tmp_path / name).write_text("\n".join([lines[0][20:], *lines, lines[-1][:40]]), encoding="utf-8")
    read = lh.read(tmp_path / name, **hints)
    np.testing.assert_array_equal(read.gyr, [sample.gyr for sample in live])
    np.testing.assert_array_equal(read.acc, [sample.acc for sample in live])
    assert len(read) == len(recording) and [note[:30] for note in read.meta["notes"][:2]] == [
        "line 1 is cut off and was left",
        f"line {len(lines) + 2} is cut off and was lef"[:30],
    ]
    (tmp_path / name).write_text("\n".join([*lines[:5], '{"gyr": 1e999}', *lines[5:]]), encoding="utf-8")
    with pytest.raises(lh.LevelheadError, match="line 6: .* is not a JSON object of numbers"):
        lh.read(tmp_path / name, **hints)
    (tmp_path / name).write_text('{"t": \n')
    with pytest.raises(lh.LevelheadError, match="holds no JSON objects"):
        lh.read(tmp_path / name)


@pytest.mark.parametrize("torn", ["0.1,9", "9," * 16 + "9"])
def test_csv_that_somebody_kept_may_begin_in_the_middle_of_a_line(recording, tmp_path, torn):
    lines = csv_lines(recording, tmp_path)
    (tmp_path / "serial.log").write_text("\n".join([torn, *lines]), encoding="utf-8")
    read = lh.read(tmp_path / "serial.log")
    np.testing.assert_array_equal(read.gyr, recording.gyr)
    assert "before the header stands 1 line of numbers; left out" in read.meta["notes"]
    (tmp_path / "serial.log").write_text("\n".join([torn, *lines[:50], "a,b", *lines[50:]]), encoding="utf-8")
    read = lh.read(tmp_path / "serial.log")
    np.testing.assert_array_equal(read.gyr, recording.gyr)
    assert any("1 line was torn" in note and "line 52" in note for note in read.meta["notes"])
    (tmp_path / "serial.log").write_text("\n".join([torn, *lines[:50], *["a,b"] * 9, *lines[50:]]), encoding="utf-8")
    with pytest.raises(lh.LevelheadError, match="line 52: 2 cells"):
        lh.read(tmp_path / "serial.log")


def test_garbage_is_counted_and_said_and_never_a_sample(device, recording, tmp_path):
    lines = csv_lines(recording, tmp_path)
    line = opened(device)
    samples = everything(device, line, ["", "9,0.1,-4", *lines[:101]])  # begins in the middle of a line
    assert len(samples) == 100
    device.say("1.0,2.0", b"\xff\xfe\x80,,,", "nan,nan", "0,0,0,0,0,0,inf,0,0,0", lines[0], "x" * 5000)
    device.say(lines[101])
    assert [sample.t for sample in line.poll()] == [recording.t[100]]
    assert line.garbage >= 5
    name, words = line.troubles()[-1]
    assert name == "garbage" and "were no numbers" in words


def test_a_missing_value_is_nan_and_a_silent_magnetometer_none(device, recording, tmp_path):
    lines = csv_lines(recording, tmp_path)
    line = opened(device)
    everything(device, line, lines[:30])
    cells = lines[30].split(",")
    device.say(",".join([cells[0], "", *cells[2:7], "", "", "", *cells[10:]]))
    (sample,) = line.poll()
    assert math.isnan(sample.gyr[0]) and sample.gyr[1] == recording.gyr[29, 1] and sample.mag is None


def test_time_that_goes_back_is_dropped_and_said_until_the_device_began_anew(device, recording, tmp_path):
    lines = csv_lines(recording, tmp_path)
    line = opened(device)
    before = everything(device, line, lines[:101])
    assert everything(device, line, [lines[90]]) == []
    assert line.troubles()[0][0] == "time_backwards"
    assert len(everything(device, line, lines[101:111])) == 10  # one late line is forgotten
    after = everything(device, line, lines[:60])  # a reset: header and all
    stamps = [sample.t for sample in after]
    assert len(stamps) == 50 and stamps[0] > before[-1].t and (np.diff(stamps) > 0.0).all()
    assert np.diff(stamps) == pytest.approx(0.01, abs=1e-9)
    assert line.garbage == 0


@pytest.mark.parametrize("unit, ticks", [("us", 2**32), ("ms", 2**32)])
def test_a_counter_of_32_bits_may_wrap(device, recording, unit, ticks):
    per = {"us": 10_000, "ms": 10}[unit]
    line = opened(device)
    stamps = [(ticks - 50 * per + i * per) % ticks for i in range(100)]
    rows = [
        ",".join(map(str, [stamp, *g, *a]))
        for stamp, g, a in zip(stamps, recording.gyr[:100].tolist(), recording.acc[:100].tolist(), strict=True)
    ]
    names = "gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"
    samples = everything(device, line, [f"time [{unit}],{names}", *rows])
    assert np.diff([sample.t for sample in samples]) == pytest.approx(0.01, abs=1e-6) and len(samples) == 100
    assert line.troubles() == []


@pytest.mark.parametrize("rate", [None, 100.0, 400.0])  # the last one is not the device's
def test_lines_without_stamps_get_the_host_s(device, recording, rate):
    line = opened(device, Hints(rate=rate))
    rows = [",".join(map(str, [*g, *a])) for g, a in zip(recording.gyr.tolist(), recording.acc.tolist(), strict=True)]
    names = "gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"
    samples = everything(device, line, [names, *rows], at_a_time=1)
    stamps = np.array([sample.t for sample in samples])
    assert len(stamps) == len(recording) and (np.diff(stamps) > 0.0).all()
    assert np.median(np.diff(stamps[100:])) == pytest.approx(0.01, rel=0.02)
    assert np.abs(stamps[150:] - (50.0 + 0.01 * np.arange(152, 302)[: len(stamps) - 150])).max() < 0.03
    assert 50.0 < stamps[0] < stamps[-1] <= device.now


@pytest.mark.slow
def test_columns_by_number_without_a_header(device, recording):
    rows = [
        ";".join(map(str, [t, *g, *a]))
        for t, g, a in zip(recording.t.tolist(), recording.gyr.tolist(), recording.acc.tolist(), strict=True)
    ]
    hints = check({"t": "1", "gyr": ["2", "3", "4"], "acc": ["5", "6", "7"]}, {"gyr": "rad/s"}, None, None)
    line = opened(device, hints)
    assert [sample.t for sample in everything(device, line, rows)] == recording.t.tolist()
    again = opened(device)
    names = "t [s];gx [rad/s];gy [rad/s];gz [rad/s];ax [m/s²];ay [m/s²];az [m/s²]"
    late = everything(device, again, [*rows[:60], names, *rows[60:]])  # a header that comes late holds for all
    assert [sample.t for sample in late] == recording.t.tolist() and again.garbage == 0


def test_lines_without_a_header_are_told_with_what_is_missing(device):
    """Ten lines a second: first that more are needed, then that none names the columns, each once."""
    line, said = opened(device), []
    for i in range(60):
        device.say(f"{i / 10},0.001,0.0,{i % 3 * 1e-3},0.0,0.1,9.8")
        device.now += 0.1
        assert line.poll() == []
        said += line.troubles()
    assert [name for name, _ in said] == ["unnamed", "unnamed"]
    assert "has sent 6 lines so far; columns and units need 20" in said[0][1]
    assert "sends lines such as '1.9,0.001,0.0,0.001,0.0,0.1,9.8', and none that names" in said[1][1]
    assert "--map t=1 --map gyr=5,6,7" in said[1][1]
    device.say(
        "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s^2],ay [m/s^2],az [m/s^2]",
        "6,0,0,0,0,0.1,9.8",
        "6.1,0,0,0,0,0.1,9.8",
    )
    assert len(line.poll()) == 62 and line.troubles() == []


def _numbers(values, digits: int = 6) -> list[str]:
    return [f"{value:.{digits}f}" for value in values]


def _counts(gyr, acc) -> list[str]:
    return [f"{x:.0f}" for x in (*(acc / 9.80665 * 16384), *(np.degrees(gyr) * 131))]


NAMES = ("ax", "ay", "az", "gx", "gy", "gz")
DIALECTS = {  # as tutorials print it: gyr (rad/s) and acc (m/s²) of a sample → its lines
    "equals": lambda g, a: [" ".join(f"{k}={x:.6f}" for k, x in zip(NAMES, (*a, *g), strict=True))],
    "plotter": lambda g, a: [",".join(f"{k}:{x:.6f}" for k, x in zip(NAMES, (*a, *g), strict=True))],
    "bars": lambda g, a: ["AcX = {} | AcY = {} | AcZ = {} | Tmp = 24.1 | GyX = {} | GyY = {} | GyZ = {}".format(
        *_counts(g, a))],
    "prefixed": lambda g, a: ["a/g:\t" + "\t".join(_counts(g, a))],
    "lines": lambda g, a: [
        "\t\tAccel X: {} \tY: {} \tZ: {} m/s^2 ".format(*_numbers(a)),
        "\t\tGyro X: {} \tY: {} \tZ: {} rad/s ".format(*_numbers(g)), ""],
    "semicolons": lambda g, a: [";".join(_numbers((*g, *a)))],
    "tabs": lambda g, a: ["\t".join(_numbers((*g, *a)))],
}  # fmt: skip
HEADERS = {"semicolons": "gx;gy;gz;ax;ay;az", "tabs": "gx\tgy\tgz\tax\tay\taz"}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_lines_as_lessons_print_them(device, recording, dialect):
    line = opened(device)
    lines = [HEADERS[dialect]] if dialect in HEADERS else []
    for gyr, acc in zip(recording.gyr, recording.acc, strict=True):
        lines += DIALECTS[dialect](gyr, acc)
    samples = everything(device, line, lines)
    assert len(recording) - len(samples) <= 1 and line.garbage == 0  # a sample of several lines may still wait
    gyr, acc = (np.array([getattr(sample, name) for sample in samples]) for name in ("gyr", "acc"))
    np.testing.assert_allclose(gyr, recording.gyr[: len(gyr)], atol=math.radians(0.5 / 131) + 1e-6)
    np.testing.assert_allclose(acc, recording.acc[: len(acc)], atol=0.5 * 9.80665 / 16384 + 1e-6)
    notes = [words for name, words in line.troubles() if name == "assumed"]
    assert len(notes) == (dialect in ("bars", "prefixed")) and all("16384 per g and 131 per °/s" in w for w in notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    "line, said",
    [
        ("1,2", "sends 2 numbers per line; expected a gyroscope and an accelerometer"),
        (
            "1,2,3,4,5,6",
            "names its 6 columns, .*; turn the sensor while it starts, or name them, such as --map gyr=4,5,6 --map acc",
        ),
        ("1,2,3,4,5,6,7", "names its 7 columns, .*, or name them, such as --map t=1 --map gyr=5,6,7 --map acc=2,3,4"),
        (
            "roll:1.2,pitch:3.4",
            "no gyroscope among the columns roll, pitch; .* roll and pitch are made of such readings",
        ),
    ],
)
def test_hints_fit_what_was_seen(device, line, said):
    with pytest.raises(lh.LevelheadError, match=said):
        everything(device, opened(device), [line] * 300)


@pytest.mark.slow
@pytest.mark.parametrize("order", ["t gyr acc mag", "acc gyr", "t acc gyr"])
def test_columns_without_a_header_are_guessed_from_the_first_seconds_as_in_a_file(device, tmp_path, order):
    recording = lh.simulate.recording("ICM-20948", "hand", duration=9.0, rate=100.0)[300:]  # in motion
    parts = {"t": recording.t[:, None], "gyr": recording.gyr, "acc": recording.acc, "mag": recording.mag}
    rows = [",".join(f"{x:.6f}" for x in row) for row in np.hstack([parts[name] for name in order.split()])]
    file = tmp_path / "kept.csv"
    file.write_text("\n".join(rows))
    read = lh.read(file, rate=None if "t" in order.split() else 100.0)
    line = opened(device)
    samples = everything(device, line, rows)
    assert len(samples) == len(recording) and line.garbage == 0
    for name in ("gyr", "acc"):
        live = np.array([getattr(sample, name) for sample in samples])
        np.testing.assert_array_equal(live, getattr(read, name))
        np.testing.assert_allclose(live, getattr(recording, name), atol=1e-6)
    assert ("mag" in order) == (samples[0].mag is not None) == (read.mag is not None)
    said = [words for name, words in line.troubles() if name == "assumed"]
    assert any("columns found by their numbers, a guess" in words for words in said)


@pytest.mark.slow
def test_the_hint_names_the_columns_that_look_like_sensors(device, recording):
    """A line of two numbers gets no hint that it cannot follow."""
    line = opened(device)
    for _ in range(UNIT_LINES + 1):
        device.say("0.1,0.2")
        device.now += 0.1
        assert line.poll() == []
    assert "six numbers are needed" in line.troubles()[-1][1]


def test_what_makes_no_sense_is_said(device):
    line = opened(device)
    with pytest.raises(lh.LevelheadError, match="no gyroscope among the columns"):
        everything(device, line, ["t,ax,ay,az", *["0.1,0,0,9.8"] * 30])


def test_unplugged_and_plugged_in_again(device, recording, tmp_path):
    lines = csv_lines(recording, tmp_path)
    line = opened(device)
    everything(device, line, lines[:30])
    device.unplug()
    with pytest.raises(SensorError, match="is gone; was it unplugged") as caught:
        for _ in range(3):
            line.poll()
    assert caught.value.kind == "unplugged"
    line.close()
    with pytest.raises(SensorError, match="is it plugged in"):
        SerialLines("/dev/no-such-port").start()


def test_serial_lines_in_words():
    assert parse_serial("/dev/ttyUSB0") == ("/dev/ttyUSB0", 115_200)
    assert parse_serial("/dev/ttyUSB0@9600") == ("/dev/ttyUSB0", 9600)
    for bad in ("", "@9600", "/dev/ttyUSB0@fast"):
        with pytest.raises(lh.LevelheadError, match="is not a serial line"):
            parse_serial(bad)


# Replay


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_a_replay_keeps_the_pace_that_it_is_told(recording, speed):
    now = [7.0]
    replay = Replay(recording, speed, clock=lambda: now[0])
    replay.start()
    samples, lag = [], []
    while not replay.ended:
        now[0] += 0.004
        new = replay.poll()
        samples += new
        lag += [(now[0] - 7.0) - (sample.t - recording.t[0]) / speed for sample in new]
    assert [sample.t for sample in samples] == recording.t.tolist()
    assert min(lag[1:]) >= 0.0 and max(lag) < 0.005
    np.testing.assert_array_equal([sample.gyr for sample in samples], recording.gyr)


def test_a_replay_as_fast_as_it_goes(recording):
    replay, samples = Replay(recording, math.inf), []
    while not replay.ended:
        samples += replay.poll()
    assert len(samples) == len(recording) and replay.poll() == []
    with pytest.raises(lh.LevelheadError, match="the speed is 0"):
        Replay(recording, 0.0)


def test_a_slow_magnetometer_is_nothing_new_in_between(recording):
    mag = recording.mag.copy()
    mag[1::2] = np.nan
    replay = Replay(lh.Recording(recording.t, recording.gyr, recording.acc, mag), math.inf)
    samples = replay.poll()
    assert samples[0].mag == tuple(recording.mag[0].tolist()) and samples[1].mag is None


NAMES_SI = "gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"


@pytest.mark.parametrize("rate", [100.0, 200.0, 400.0])
def test_a_pause_of_lines_without_stamps_is_a_gap_and_not_spread(device, rate):
    """4 s without a line while the body turns on: one dt of 4 s, the others as ever; σ of tilt grows and is honest."""
    turning = simulate.recording("ICM-20948", "hand", duration=20.0)
    kept = np.r_[0:1000, 1400:2000]
    line, samples = opened(device, Hints(rate=rate)), []
    device.say(NAMES_SI)
    for before, i in zip(np.r_[-1, kept[:-1]], kept, strict=True):
        device.now += 0.01 * (i - before)
        device.say(",".join(map(str, [*turning.gyr[i], *turning.acc[i]])))
        samples += line.poll()
    stamps = np.array([sample.t for sample in samples])
    gaps = np.diff(stamps)
    at = int(gaps.argmax())
    assert gaps[at] == pytest.approx(4.01, abs=0.02) and len(samples) == len(kept) and at == 999
    assert gaps[at + 1 :].max() < 0.03 and abs(gaps[at + 20 :].mean() - 0.01) < 2e-4
    track = lh.fuse(lh.Recording(stamps, turning.gyr[kept], turning.acc[kept]))
    assert np.flatnonzero(track.health & GAP).tolist() == [1000]
    assert track.sigma[1000, 0] > 3.0 * track.sigma[999, 0]
    up, true = (2.0 * np.stack([q[:, 1] * q[:, 3] - q[:, 0] * q[:, 2], q[:, 2] * q[:, 3] + q[:, 0] * q[:, 1]], 1)
                for q in (track.quat, turning.truth.quat[kept]))  # fmt: skip
    off = np.linalg.norm(up - true, axis=1)  # rad, of tilt
    assert (off[1000:] < 3.5 * np.hypot(track.sigma[1000:, 0], track.sigma[1000:, 1])).all()
    assert off[-1] < math.radians(3.0)


def test_a_host_that_pauses_is_no_gap(device, recording):
    """The device goes on, and its lines wait in the terminal: they are stamped evenly up to now."""
    line, samples = opened(device, Hints(rate=100.0)), []
    device.say(NAMES_SI)
    rows = [",".join(map(str, [*g, *a])) for g, a in zip(recording.gyr.round(4), recording.acc.round(3), strict=True)]
    samples = everything(device, line, rows[:200], at_a_time=1)
    samples += everything(device, line, rows[200:240], at_a_time=40)
    samples += everything(device, line, rows[240:], at_a_time=1)
    gaps = np.diff([sample.t for sample in samples])
    assert len(samples) == len(recording) and gaps.max() < 0.05 and (gaps > 0.0).all()


@pytest.mark.parametrize("rate", [900.0, 1500.0])
def test_a_clock_of_milliseconds_drops_nothing(device, rate):
    count = 4000
    true = np.arange(count) / rate + np.random.default_rng(1).uniform(0.0, 0.4e-3, count)  # a loop is never even
    gyr = 0.1 * np.sin(0.01 * np.arange(count))
    rows = [
        f"{stamp},{x:.6f},{0.1 + 1e-6 * i:.6f},0.001,0.0,0.1,9.8"
        for i, (stamp, x) in enumerate(zip((1e3 * true).astype(int), gyr, strict=True))
    ]
    line = opened(device)
    samples = everything(device, line, [f"time [ms],{NAMES_SI}", *rows])
    stamps = np.array([sample.t for sample in samples])
    assert len(samples) >= count - 5 and (np.diff(stamps) > 0.0).all() and line.troubles() == []
    assert np.abs(stamps[500:] - true[-len(stamps) + 500 :] - 0.0005).max() < 0.0016
    assert np.diff(stamps[500:]).mean() == pytest.approx(1.0 / rate, rel=1e-3)


def test_the_wrong_speed_of_the_line_is_an_event(device):
    """At another speed bytes come, mostly no text, with hardly a line end; the sentence comes once."""
    line, rng = opened(device), np.random.default_rng(0)
    said = []
    for _ in range(30):
        os.write(device.end, rng.choice([0x00, 0x80, 0xE0, 0xF8, 0x78, 0x1C], 20).astype(np.uint8).tobytes())
        device.now += 0.1
        assert line.poll() == []
        said += line.troubles()
    (told,) = [words for name, words in said if name == "garbage" and "bits a second" in words]
    assert "115200 bits a second are not the device's speed" in told and "@9600" in told


def test_deep_json_is_garbage_and_never_an_error(device, recording):
    line = opened(device, check(None, {"gyr": "deg/s"}, None, None))
    lines = json_lines(recording)
    deep = '{"a":' * 700 + "1" + "}" * 700
    assert len(everything(device, line, [*lines[:30], deep, *lines[30:60]])) == 60 and line.garbage == 1


@pytest.mark.parametrize("verb", [["run", "--source", "emulated:mpu6050"], ["fuse", "log.csv"]])
@pytest.mark.parametrize("width", [6, 7])
def test_hints_can_be_pasted_as_they_are_printed(verb, width):
    """Every word behind an option of its own, in both commands."""
    from levelhead.cli import app
    from levelhead.sources.interpret.by_numbers import map_words

    words = map_words(np.zeros((5, width))).split()
    _, bound, *_ = app.parse_args([*verb, *words], exit_on_error=False, print_error=False)
    given = bound.arguments["map"] if verb[0] == "run" else bound.arguments["arguments"].reading.map
    assert list(given) == words[1::2] and len(given) == (3 if width == 7 else 2)
