"""C3D: rigid bodies of markers against the rotation that moved them, analog channels, what is written, and refusals."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.cli import main
from levelhead.publish.joint_files import write_joint
from levelhead.sources.formats.npz import write_npz

ezc3d = pytest.importorskip("ezc3d", reason="ezc3d is not installed (extra levelhead[c3d])")

RATE = 100.0
PLACES = np.array([[0.0, 0.0, 0.0], [80.0, 10.0, 0.0], [20.0, 120.0, 5.0], [-10.0, 30.0, 60.0]])  # mm
NAMES = ["TH1", "TH2", "TH3", "TH4"]


def write(path, bodies, up="+Z", analogs=None):
    """Markers of bodies, by the letter in front of their names, that turn as (n,) rotations."""
    file = ezc3d.c3d()
    group, points = file["parameters"]["POINT"], []
    for rotation in bodies.values():
        points += [rotation.apply(place).T + [[500.0], [0.0], [900.0]] for place in PLACES]
    group["RATE"]["value"] = [RATE]
    group["LABELS"]["value"] = [f"{letter}{name}" for letter in bodies for name in NAMES]
    file.add_parameter("POINT", "Y_SCREEN", [up])
    values = np.stack(points, axis=1)
    file["data"]["points"] = np.concatenate([values, np.ones((1, *values.shape[1:]))])
    if analogs is not None:
        labels, units, channels = analogs
        group = file["parameters"]["ANALOG"]
        group["RATE"]["value"], group["LABELS"]["value"], group["UNITS"]["value"] = [RATE], labels, units
        file["data"]["analogs"] = channels[None]
    file.write(str(path))
    return path


def turning(seed, n=1000):
    t = np.arange(n) / RATE
    phases = np.random.default_rng(seed).uniform(0.0, 6.0, 3)
    return Rotation.from_euler("xyz", 40.0 * np.sin(np.outer(t, [0.7, 1.1, 1.6]) + phases), degrees=True)


def angles(track, rotation):
    found = Rotation.from_quat(track.quat.copy(), scalar_first=True)
    return np.degrees((found * (rotation * rotation[0].inv()).inv()).magnitude())


def test_markers_of_a_rigid_body_are_a_track(tmp_path):
    rotation = turning(0)
    track = lh.read_c3d(write(tmp_path / "a.c3d", {"": rotation}), NAMES)
    np.testing.assert_allclose(track.t, np.arange(1000) / RATE)
    assert angles(track, rotation).max() < 1e-3
    assert track.relative is False


def test_the_axis_that_is_up_becomes_z(tmp_path):
    """Where y is up a turn about y is a turn about the vertical."""
    about = Rotation.from_euler("y", np.linspace(0.0, 90.0, 500)[:, None], degrees=True)
    track = lh.read_c3d(write(tmp_path / "a.c3d", {"": about}, up="+Y"), NAMES[:3])
    assert track.euler()[-1, 2] == pytest.approx(90.0, abs=0.01)


def test_sigma_is_that_of_the_markers_noise(tmp_path):
    rotation, noise = turning(1), np.random.default_rng(2)
    path = write(tmp_path / "a.c3d", {"": rotation})
    file = ezc3d.c3d(str(path))
    file["data"]["points"][:3] += noise.normal(0.0, 1.0, file["data"]["points"][:3].shape)
    file["data"]["points"][:3, 2, 300:400] = np.nan
    noisy = file["data"]["points"]
    again = ezc3d.c3d()
    for key in ("RATE", "LABELS"):
        again["parameters"]["POINT"][key]["value"] = file["parameters"]["POINT"][key]["value"]
    again["data"]["points"] = noisy
    again.write(str(path))
    track = lh.read_c3d(path, NAMES)
    assert len(track.t) == 900
    rows = np.round(track.t * RATE).astype(int)
    found = Rotation.from_quat(track.quat.copy(), scalar_first=True)
    error = ((rotation[rows] * rotation[0].inv()).inv() * found).as_rotvec()
    error -= error.mean(axis=0)  # of the first frame's shape
    assert np.mean(error**2) / np.mean(track.sigma**2) == pytest.approx(1.0, abs=0.1)


def test_a_joint_between_two_bodies_of_one_file(tmp_path):
    thigh = turning(3, 1500)
    knee = 40.0 - 40.0 * np.cos(2.0 * np.arange(1500) / RATE)
    shank = thigh * Rotation.from_euler("y", knee[:, None], degrees=True)
    path = write(tmp_path / "walk.c3d", {"L": thigh, "R": shank})
    bodies = [f"{path}:{','.join(letter + name for name in NAMES[:3])}" for letter in "LR"]
    call = [sys.executable, "-m", "levelhead", "joint", *bodies, "--format", "c3d", "--no-plot", "-o", str(tmp_path)]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    written = ezc3d.c3d(str(tmp_path / "LTH1-LTH2-LTH3-joint.c3d"))
    assert written["parameters"]["POINT"]["ANGLE_UNITS"]["value"] == ["deg"]
    found = written["data"]["points"][0, 0]
    sign = np.sign(np.corrcoef(found, knee)[0, 1])
    np.testing.assert_allclose(sign * found, knee - knee[0], atol=0.05)


def test_three_angles_are_a_point_at_one_rate(tmp_path):
    t = np.sort(np.arange(100) * 0.1 + np.random.default_rng(0).uniform(-0.01, 0.01, 100))
    joint = lh.Joint(t, np.stack([t, 2.0 * t, -t], axis=1), np.ones((100, 3)), fit=None, axes=3)
    write_joint(joint, tmp_path / "j.c3d")
    file = ezc3d.c3d(str(tmp_path / "j.c3d"))
    rate = file["parameters"]["POINT"]["RATE"]["value"][0]
    when = t[0] + np.arange(file["data"]["points"].shape[2]) / rate
    np.testing.assert_allclose(file["data"]["points"][:3, 0].T, when[:, None] * [1.0, 2.0, -1.0], atol=2e-3)


def test_analog_channels_are_a_log(tmp_path):
    recording = lh.simulate.recording("MPU-6050", "hand", duration=5)
    labels = ["gyr_x", "gyr_y", "gyr_z", "acc_x", "acc_y", "acc_z"]
    values = np.concatenate([recording.gyr, recording.acc], axis=1).T
    still = Rotation.identity(values.shape[1])
    path = write(tmp_path / "a.c3d", {"": still}, analogs=(labels, ["rad/s"] * 3 + ["m/s2"] * 3, values))
    read = lh.read(path)
    assert read.rate == pytest.approx(RATE)
    np.testing.assert_allclose(read.acc, recording.acc, atol=1e-4)
    np.testing.assert_allclose(read.gyr, recording.gyr, atol=1e-5)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["TH1", "TH2", "TH9"], "has no marker 'TH9'"),
        (["TH1", "TH2"], "TH1, TH2 is not a rigid body; expected three markers or more"),
    ],
)
def test_a_body_that_is_none_is_refused(tmp_path, names, words):
    path = write(tmp_path / "a.c3d", {"": turning(0, 20)})
    with pytest.raises(lh.LevelheadError, match=words):
        lh.read_c3d(path, names)


def test_markers_on_a_line_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(f"{__name__}.PLACES", np.outer(np.arange(4.0), [10.0, 0.0, 0.0]))
    with pytest.raises(lh.LevelheadError, match="TH1, TH2, TH3 lie on one line"):
        lh.read_c3d(write(tmp_path / "a.c3d", {"": turning(0, 20)}), NAMES[:3])


@pytest.mark.parametrize("kind", ["markers", "damaged", "empty", "absent"])
def test_a_file_without_readings_is_one_sentence(tmp_path, kind):
    path = write(tmp_path / "a.c3d", {"": turning(0, 20)})
    content = {"markers": path.read_bytes(), "damaged": path.read_bytes()[:900], "empty": b""}
    path.unlink()
    if kind in content:
        path.write_bytes(content[kind])
    call = [sys.executable, "-m", "levelhead", "fuse", str(path), "-o", str(tmp_path)]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 2 and "Traceback" not in done.stderr  # and the page of its family
    if kind == "markers":
        assert "4 markers and no analog channels" in done.stderr


def test_markers_are_the_truth_of_a_log(tmp_path, capsys):
    """In any mounting, heading and clock: the errors are small, and the note has the delay."""
    true = lh.simulate.recording("ICM-20948", "hand", duration=30.0, rate=RATE, seed=2)
    bare = replace(true, truth=None, mag=None)
    write_npz(bare, tmp_path / "imu.npz")
    mounted = Rotation.from_euler("xyz", [0.0, 90.0, 30.0], degrees=True)
    turned = Rotation.from_euler("z", 50.0, degrees=True) * Rotation.from_quat(true.truth.quat, scalar_first=True)
    walk = write(tmp_path / "walk.c3d", {"": (turned * mounted)[50:2500]})
    words = ["compare", str(tmp_path / "imu.npz"), "-f", "ESKF", "--json", "--truth", f"{walk}:TH1,TH2,TH3"]
    assert main(words) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["filters"][0]["score"]["tilt"] < 1.0
    assert main(["align", f"{walk}:TH1,TH2,TH3", str(tmp_path / "imu.npz"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["shift_ms"] == pytest.approx(-500.0, abs=5.0)
    assert found["truth"]["source"].endswith("walk.c3d:TH1,TH2,TH3")
    assert found["truth"]["shift_ms"] == pytest.approx(-500.0, abs=5.0)  # the gyroscope is late
