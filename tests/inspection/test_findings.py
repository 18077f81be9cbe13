"""Faults put into a clean recording are found, and nothing else is."""

import ast
import inspect
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.cli import main
from levelhead.inspection import behaviour, examine, short_form, spectrum, spikes
from levelhead.inspection.physics import scale_in_motion
from levelhead.recording import Recording
from levelhead.sources.formats.csv_writer import write_csv


@pytest.fixture(scope="module")
def clean() -> Recording:
    made = lh.simulate.recording("MPU-6050", "hand", duration=60.0, seed=1)
    assert made.truth is not None
    mag = Rotation.from_quat(made.truth.quat, scalar_first=True).inv().apply([0.0, 18.0, -45.0])
    return Recording(made.t, made.gyr, made.acc, mag + np.random.default_rng(0).normal(0.0, 0.3, mag.shape))


def changed(recording: Recording, **parts: object) -> Recording:
    kept = {name: getattr(recording, name) for name in ("t", "gyr", "acc", "mag")}
    return Recording(**(kept | parts))  # type: ignore[arg-type]


def bad(recording: Recording) -> set[str]:
    return {one.name for one in examine(recording).findings if one.severity != "note"}


def test_a_clean_recording_has_no_finding(clean: Recording) -> None:
    assert bad(clean) == set()
    assert short_form(clean) == []


def test_an_inverted_gyroscope(clean: Recording) -> None:
    report = examine(changed(clean, gyr=-clean.gyr))
    assert "gyro_inverted" in report.names() and report.exit_code == 1
    assert len(short_form(changed(clean, gyr=-clean.gyr))) in (1, 2)


def test_the_short_form_leaves_out_notes_only() -> None:
    """``fuse`` does not run the checks of these two files, which may say nothing worse than a note."""
    for module in (behaviour, spectrum):
        said = [
            node.args[1].value
            for node in ast.walk(ast.parse(inspect.getsource(module)))
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Finding"
        ]
        assert said and set(said) == {"note"}


def test_spikes(clean: Recording) -> None:
    gyr, acc = clean.gyr.copy(), clean.acc.copy()
    gyr[[500, 2400, 4000]] += [[4.0, 0.0, 0.0], [0.0, -3.0, 0.0], [0.6, 0.6, 0.0]]  # rad/s
    acc[[1000, 3000], 2] += [20.0, -40.0]  # m/s²
    found = {one.name: one for one in examine(changed(clean, gyr=gyr, acc=acc)).findings}
    assert found["spikes_gyr"].rows == (500, 4000) and found["spikes_gyr"].what.startswith("3 readings")
    assert found["spikes_gyr"].severity == "warning" and "229 deg/s" in found["spikes_gyr"].what
    assert found["spikes_acc"].rows == (1000, 3000) and "40 m/s²" in found["spikes_acc"].what


def test_a_knock_and_a_vibration_are_no_spikes(clean: Recording) -> None:
    ring = 30.0 * np.exp(-np.arange(60) / 6.0) * np.cos(2.0 * np.arange(60))
    acc, gyr = clean.acc.copy(), clean.gyr.copy()
    for row in range(200, 5600, 400):
        acc[row : row + 60, 2] += ring
        gyr[row - 1 : row + 2, 1] += [1.5, 4.0, 1.5]  # a short turn has flanks
    gyr[:, 0] += 0.5 * (-1.0) ** np.arange(len(gyr))
    assert not {"spikes_gyr", "spikes_acc"} & bad(changed(clean, gyr=gyr, acc=acc))


def test_clipping(clean: Recording) -> None:
    limit = np.radians(125.0)
    assert np.abs(clean.gyr).max() > 1.1 * limit
    assert "clipping_gyr" in bad(changed(clean, gyr=np.clip(clean.gyr, -limit, limit)))


def test_scale_of_the_accelerometer(clean: Recording) -> None:
    rest = np.tile([0.0, 0.0, 9.81 * 1.06], (len(clean), 1)) + np.random.default_rng(1).normal(0, 0.02, clean.acc.shape)
    quiet = np.random.default_rng(2).normal(0, 0.001, clean.gyr.shape)
    found = bad(changed(clean, acc=rest, gyr=quiet, mag=None))
    assert found == {"acc_scale"}


def test_gaps(clean: Recording) -> None:
    t = clean.t.copy()
    t[2000:] += 5.0
    assert "gaps" in bad(changed(clean, t=t))


def test_a_magnetometer_that_does_not_turn(clean: Recording) -> None:
    assert clean.mag is not None
    fixed = np.tile([20.0, 5.0, -40.0], (len(clean), 1)) + np.random.default_rng(1).normal(0, 0.3, clean.acc.shape)
    turned = clean.mag[:, [1, 2, 0]]
    assert "mag_axes" in bad(changed(clean, mag=turned))
    assert "mag_axes" not in bad(changed(clean, mag=fixed))


def test_iron_is_one_finding(clean: Recording) -> None:
    """Its length varies and is no earth field, but both follow from the offset; nothing about it is unknown."""
    assert clean.mag is not None
    iron = 3.0 * float(np.linalg.norm(clean.mag, axis=1).mean()) * np.array([0.6, -0.5, 0.62])
    raw = changed(clean, mag=clean.mag + iron)
    assert bad(raw) == {"mag_offset"}
    assert not [one for one in examine(raw).unknown if "magnetometer" in one]


@pytest.mark.slow
def test_the_command_line(clean: Recording, tmp_path, capsys) -> None:
    write_csv(changed(clean, gyr=-clean.gyr, mag=None), tmp_path / "log.csv")
    assert main(["doctor", str(tmp_path / "log.csv"), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)["reports"][0]
    assert report["findings"][0]["name"] == "gyro_inverted"
    assert main(["doctor", str(tmp_path / "missing.csv")]) == 2
    capsys.readouterr()
    assert main(["doctor", str(tmp_path / "log.csv"), "--fix", "-o", str(tmp_path / "mended.parquet")]) == 1
    last = capsys.readouterr().out.splitlines()[-2:]
    assert last[0].startswith("mended: gravity turns against the gyroscope") and last[1].startswith("written: ")
    mended = lh.read(tmp_path / "mended.parquet")
    np.testing.assert_allclose(mended.gyr, clean.gyr, rtol=1e-12)
    assert main(["doctor", str(tmp_path / "log.csv"), "--picture", str(tmp_path / "log.png")]) == 1
    assert (tmp_path / "log.png").stat().st_size > 10_000


def test_an_offset_of_the_magnetometer_that_a_room_full_of_iron_makes_is_none(clean: Recording) -> None:
    assert clean.mag is not None
    slow = 12.0 * np.sin(2 * np.pi * clean.t / 17.0)[:, None] * np.array([1.0, -0.6, 0.8])  # another field elsewhere
    assert "mag_offset" not in bad(changed(clean, mag=clean.mag + slow))


def test_scale_in_motion_is_that_of_the_accelerometer(clean: Recording) -> None:
    found = scale_in_motion(changed(clean, acc=1.07 * clean.acc))
    assert (
        found is not None and abs(found.ratio - 1.07) < 0.02 and found.sigma < 0.01
    )  # the data sheet allows an offset of 0.02 g


def test_samples_held_in_motion(clean: Recording) -> None:
    rows = np.arange(len(clean)) // 2 * 2
    assert "held_samples" in bad(changed(clean, acc=clean.acc[rows], gyr=clean.gyr[rows]))


def test_spikes_are_the_same_wherever_blocks_end(monkeypatch):
    rng = np.random.default_rng(3)
    values = rng.normal(0.0, 0.01, (400, 3))
    values[[57, 98, 199, 301, 395]] += 50.0
    whole = spikes.find_spikes(values, 3.0)
    assert whole.rows.tolist() == [57, 98, 199, 301, 395]
    for block in (1, 7, 99, 100, 398):
        monkeypatch.setattr(spikes, "BLOCK", block)
        found = spikes.find_spikes(values, 3.0)
        assert np.array_equal(found.rows, whole.rows) and np.array_equal(found.off, whole.off)
