"""``levelhead run``: the first live command, and what it refuses."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

import levelhead as lh
from levelhead.cli import main
from levelhead.cli.node_terminal import StatusLines
from levelhead.sources.devices.serial_lines import SerialLines
from levelhead.sources.formats import npz
from levelhead.sources.sensors.bus import SensorError

RUN = ("run", "--no-realtime", "--source")


@pytest.mark.slow
def test_the_first_live_command_works(levelhead):
    said = levelhead(*RUN, "emulated:mpu6050", "--calibrate", "100", "--duration", "2.3")
    assert said.code == 0 and said.err == ""
    assert "    calibrated: the gyroscope's bias is" in said.out and "! started" not in said.out
    lines = [line for line in said.out.splitlines() if "Hz  roll" in line]
    assert len(lines) >= 1 and "σ" in lines[0] and "late p99" in lines[0]
    assert "samples, 0 losses" in said.out.splitlines()[-1]


@pytest.mark.slow
def test_a_replay_into_a_black_box_is_what_fuse_makes_of_the_file(levelhead, logs, tmp_path):
    pytest.importorskip("mcap", reason="mcap is not installed (extra levelhead[box])")
    box = tmp_path / "box.mcap"
    said = levelhead(
        *RUN, f"replay:{logs / 'nine.npz'}", "--speed", "inf", "--box", box, "--filter", "Mahony", "--json"
    )
    assert said.code == 0 and said.json["samples"] == 800
    done = levelhead("fuse", box, "--no-plot", "-o", tmp_path, "--json")
    assert done.code == 0 and done.json["filter"].startswith("Mahony")
    levelhead("fuse", logs / "nine.npz", "--filter", "Mahony", "--no-first-pass", "--no-plot", "-o", tmp_path)
    ours, theirs = (
        np.genfromtxt(tmp_path / f"{name}-track.csv", delimiter=",", names=True) for name in ("box", "nine")
    )
    assert ours.dtype.names == theirs.dtype.names
    for name in ("qw", "qx", "qy", "qz"):
        np.testing.assert_array_equal(ours[name], theirs[name])


@pytest.mark.parametrize(
    "words, said",
    [
        (["nonsense"], "there is no source 'nonsense'"),
        (["emulated"], "emulated: names no chip; expected such as emulated:mpu6050"),
        (["emulated:mpu6051"], "did you mean 'mpu6050'"),
        (["mpu6050@77"], "no I²C bus /dev/i2c-77"),
        (["serial:/dev/no-such-port"], "cannot open /dev/no-such-port"),
        (["replay:no-such-file.csv"], "there is no file no-such-file.csv"),
        (["replay:"], "names no file"),
        (["emulated:mpu6050", "--axes", "x,y,-z"], "mirror image"),
        (["emulated:mpu6050", "--axes", "-x,y,z"], "mirror image"),
        (["emulated:mpu6050", "--speed", "2"], "--speed is for a replay"),
        (["emulated:mpu6050", "--gyr-range", "300"], "gyr range 300 deg/s does not exist"),
        (["emulated:mpu6050", "--rate", "0"], "rate is 0.0"),
        (["emulated:mpu6050", "--duration", "-1"], "the duration is -1"),
        (["emulated:mpu6050", "--calibrate", "-5"], "--calibrate -5"),
        (["emulated:mpu6050", "--box", "box.csv"], "must end in .mcap"),
        (["emulated:mpu6050", "--set", "beat=1"], "beat"),
    ],
)
def test_bad_input(refused, words, said):
    assert said in refused(*RUN, *words)


@pytest.mark.slow
def test_a_source_that_takes_long_to_fail_prints_its_error_only(refused, monkeypatch):
    def fail(_):
        time.sleep(1.2)  # the first status line would come after 1 s
        raise SensorError("bus_error", "the port does not answer")

    monkeypatch.setattr(SerialLines, "start", fail)
    assert "the port does not answer" in refused(*RUN, "serial:/dev/ttyUSB0")


@pytest.mark.parametrize("port", ["0", "80000", "-1"])
def test_a_port_that_does_not_exist_is_refused(refused, logs, port):
    assert f"there is no port {port}; expected 1 to 65535" in refused("view", logs / "nine.npz", "--port", port)


@pytest.mark.slow
def test_a_replay_as_fast_as_it_goes_prints_its_figures(levelhead, logs):
    said = levelhead(*RUN, f"replay:{logs / 'nine.npz'}", "--speed", "inf", "--filter", "Mahony")
    assert said.code == 0 and said.out.splitlines()[-1].startswith("800 samples, 0 losses") and said.err == ""


def test_what_is_refused_leaves_no_box_behind(refused, logs, tmp_path):
    pytest.importorskip("mcap", reason="mcap is not installed (extra levelhead[box])")
    source = f"replay:{logs / 'nine.npz'}"
    assert "the rate is 0 Hz" in refused(*RUN, source, "--rate", "0", "--box", tmp_path / "box.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_second_node_on_the_same_endpoint_is_refused(refused):
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed (extra levelhead[bus])")
    from levelhead.live.zenoh_bus import ZenohBus

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    first = ZenohBus(endpoint)
    try:
        said = refused(*RUN, "emulated:mpu6050", "--publish", endpoint)
    finally:
        first.close()
    assert said.startswith(f"cannot use {endpoint}") and "is another node there?" in said


def test_axes_are_found_from_a_still_pose_and_one_turn(levelhead, refused, logs, tmp_path):
    t = np.arange(0.0, 4.0, 0.01)
    lean = np.clip(t - 2.0, 0.0, 1.0)
    gyr, acc = np.zeros((400, 3)), np.zeros((400, 3))
    gyr[:, 1] = -np.gradient(lean, t)
    acc[:, 0], acc[:, 2] = 9.81 * np.sin(lean), 9.81 * np.cos(lean)
    npz.write_npz(lh.Recording(t, gyr, acc), tmp_path / "lean.npz")
    assert levelhead("axes", tmp_path / "lean.npz").out == "-y,x,z\n"
    assert "an axis is mirrored or swapped" in _mirrored(refused, t, gyr, acc, tmp_path)


def _mirrored(refused, t, gyr, acc, folder) -> str:
    npz.write_npz(lh.Recording(t, gyr, acc * [-1.0, 1.0, 1.0]), folder / "mirrored.npz")
    return refused("axes", folder / "mirrored.npz")


@pytest.mark.slow
def test_sigterm_ends_it_in_order(tmp_path):
    pytest.importorskip("mcap", reason="mcap is not installed (extra levelhead[box])")
    box = tmp_path / "box.mcap"
    words = ("emulated:mpu6050", "--calibrate", "0", "--filter", "Complementary", "--box", str(box))
    command = [sys.executable, "-m", "levelhead", *RUN, *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in process.stdout:
        if "Hz  roll" in line:
            break
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0 and err == "" and f"written: {box}" in out
    (note,) = lh.read(box).meta["notes"]  # and none of a box that breaks off
    assert note.startswith("the node ran Complementary with parameters of its own")


@pytest.mark.slow
def test_a_full_disk_ends_the_box_and_is_said_and_the_node_goes_on(levelhead, tmp_path):
    """The kernel refuses to let the file grow, as it does when the disk is full."""
    pytest.importorskip("mcap", reason="mcap is not installed (extra levelhead[box])")
    resource = pytest.importorskip("resource", reason="there are no limits on files here")
    npz.write_npz(lh.simulate.recording("MPU-6050", "hand", duration=20.0, rate=200.0), tmp_path / "log.npz")
    source, box = f"replay:{tmp_path / 'log.npz'}", tmp_path / "box.mcap"
    assert levelhead(*RUN, source, "--speed", "inf", "--json").json["samples"] == 4000  # whatever compiles has
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, limits[1]))
    try:
        said = levelhead(*RUN, source, "--speed", "20", "--box", box)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert said.code == 0 and "4000 samples" in said.out, said
    assert "! box_failed: the black box" in said.out
    assert said.out.splitlines()[-1] == f"the black box {box} ends here: File too large"
    kept = lh.read(box)
    assert 0 < len(kept) < 4000 and "was cut off" in kept.meta["notes"][0]


@pytest.mark.slow
def test_an_unplugged_source_ends_with_its_own_exit_code(capsys):
    """A serial device that goes away and does not come back: exit code 3, and a sentence."""
    pytest.importorskip("serial", reason="pyserial is not installed (extra levelhead[live])")
    import threading
    import tty

    end, slave = os.openpty()
    tty.setraw(slave)

    def talk():
        for i in range(150):
            if i % 20 == 0:  # opening the port drops what was said before
                os.write(end, b"t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s^2],ay [m/s^2],az [m/s^2]\n")
            os.write(end, f"{i / 100},0.001,0.0,{i % 3 * 1e-3},0.0,0.1,9.8\n".encode())
            time.sleep(0.01)
        os.close(end)

    talking = threading.Thread(target=talk)
    talking.start()
    code = main([*RUN, f"serial:{os.ttyname(slave)}", "--calibrate", "0", "--give-up", "1.5"])
    talking.join()
    os.close(slave)
    said = capsys.readouterr()
    assert code == 3, said
    assert "has given no sample for" in said.err and "unplugged" in said.out


def test_ports_lists_what_is_there(levelhead, monkeypatch):
    pytest.importorskip("serial", reason="pyserial is not installed (extra levelhead[live])")
    monkeypatch.setattr("levelhead.sources.devices.ports.i2c_buses", lambda: [1])
    chips = [SimpleNamespace(address=0x68, name="mpu6050"), SimpleNamespace(address=0x76, name="")]
    monkeypatch.setattr("levelhead.sources.devices.ports.find_chips", lambda bus: chips)
    monkeypatch.setattr("levelhead.sources.devices.ports.open_bus", lambda number: SimpleNamespace(close=lambda: None))
    port = SimpleNamespace(device="/dev/ttyUSB0", description="CP2102")
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [port])
    lines = levelhead("ports").out.splitlines()
    assert lines[0] == "serial:/dev/ttyUSB0  CP2102" and lines[1] == "I²C bus 1"
    assert lines[2:] == ["  mpu6050@1  at 0x68", "  a chip that is not known  at 0x76"]
    assert levelhead("ports", "--json").json["i2c"][0]["chips"][0]["source"] == "mpu6050@1"


@pytest.mark.slow
def test_a_sweep_that_is_useless_is_named(levelhead):
    """A hand with a bias that Complementary cannot remove: its best value is worse than the default filter."""
    words = ("sweep", "--simulate", "hand", "-f", "Complementary", "-p", "tau", "--values", "0.2", "1")
    assert "warning: the default filter, untuned, has" in levelhead(*words).out
    said = levelhead(*words, "--json")
    assert said.json["warning"].startswith("warning: the default filter") and said.json["warning"] in said.err
    words = ("sweep", "--simulate", "hard", "-f", "ESKF", "-p", "gyr_noise", "--values", "0.04", "0.08")
    assert "warning" not in levelhead(*words).out
    said = levelhead(*words, "--json")
    assert said.json["warning"] is None and said.err == ""


def test_a_sweep_that_is_worse_than_standing_still_is_named(levelhead, tmp_path, monkeypatch):
    """A sensor that rests on a table, with a bias, and no filter that knows of biases."""
    monkeypatch.setattr("levelhead.filters.default", lh.GyroIntegration)
    n = 500
    truth = lh.Truth(np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)))
    gyr, acc = np.tile([0.0, 0.0, 0.1], (n, 1)), np.tile([0.0, 0.0, 9.80665], (n, 1))
    acc[1:, 0] = 3.0 * (-1.0) ** np.arange(1, n)  # the first sample is level
    npz.write_npz(lh.Recording(np.arange(n) * 0.01, gyr, acc, truth=truth), tmp_path / "rest.npz")
    words = (
        "sweep",
        tmp_path / "rest.npz",
        "-f",
        "Complementary",
        "-p",
        "tau",
        "--values",
        "0.05",
        "1",
        "--guard",
        "off",
    )
    assert "warning: a sensor that never moved from its first orientation has 0.00°, less than" in levelhead(*words).out


def test_late_ticks_are_printed_once_and_counted_by_the_status_line(capsys):
    """So that the status line is not drowned on a busy machine; other warnings are printed each time."""
    lines = StatusLines(SimpleNamespace(bus=None), quiet=False)
    for name in ("late", "silent", "late", "over_budget", "silent", "over_budget", "late"):
        lines._print_event(SimpleNamespace(name=name, on=True, text="words"))
    printed = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in printed] == ["late:", "silent:", "over_budget:", "silent:"]
    assert [line.endswith("(counted from here on)") for line in printed] == [True, False, True, False]


def test_motion_that_is_no_fault_does_not_drown_the_status_line(capsys):
    """A hand exceeds 2 m/s² many times a minute: one line, then the name in the status line while it holds."""
    lines = StatusLines(SimpleNamespace(bus=None), quiet=False)
    for on in (True, False, True, False):
        lines._print_event(SimpleNamespace(name="acceleration", on=on, text="words"))
    assert capsys.readouterr().out == "  ! acceleration: words (from here on in the status line)\n"


@pytest.mark.slow
def test_a_node_serves_foxglove_from_the_command_line(levelhead, tmp_path):
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed (extra levelhead[foxglove])")
    from levelhead.live.viewer_messages import SCHEMAS

    run = ("run", "--no-realtime", "--source", "emulated:mpu6050", "--calibrate", "50", "--duration", "1.5")
    done = levelhead(*run, "--foxglove", "--foxglove-layout", tmp_path / "layout.json", "--foxglove-port", "0")
    assert done.code == 0 and "ws://127.0.0.1:" in done.out and "layout.json" in done.out
    panels = json.loads((tmp_path / "layout.json").read_text())["configById"]
    named = [path["value"] for panel in panels.values() for path in panel.get("paths", ())]
    for path in named:
        topic, _, rest = path.partition(".")
        schema = SCHEMAS[topic][1]
        for part in rest.split("."):
            schema = schema["properties"][part]
        assert schema == {"type": "number"}
