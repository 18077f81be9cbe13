"""``levelhead joint``, ``align``, ``sync``, ``fuse --place`` and ``gait``: two sensors, a place, a foot."""

import numpy as np
import pytest

from levelhead import simulate
from levelhead.recording import Recording
from levelhead.sources.formats import npz


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Two sensors on one body, the second one turned and late by 0.2 s."""
    folder = tmp_path_factory.mktemp("pair")
    rec = simulate.recording("ICM-20948", "hand", duration=20.0, seed=3)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    npz.write_npz(Recording(rec.t, rec.gyr, rec.acc), folder / "a.npz")
    npz.write_npz(Recording(rec.t + 0.2, rec.gyr @ turn, rec.acc @ turn), folder / "b.npz")
    return folder


def test_sync_and_align(levelhead, pair):
    said = levelhead("sync", pair / "a.npz", pair / "b.npz", "--json").json
    (clock,) = said["clocks"]
    assert clock["offset"] == pytest.approx(0.2, abs=1e-4)
    assert "ms at" in levelhead("sync", pair / "a.npz", pair / "b.npz").out
    assert levelhead("sync", pair / "a.npz").code == 2
    assert "200.0 ms late" in levelhead("align", pair / "b.npz", pair / "a.npz").out


def test_a_stiff_joint_has_a_verdict_and_its_files(levelhead, pair, tmp_path):
    said = levelhead("joint", pair / "a.npz", pair / "b.npz", "--format", "mot", "-o", tmp_path)
    assert said.code == 1 and "not trusted" in said.out
    text = (tmp_path / "a-joint.mot").read_text()
    assert "inDegrees=yes\nendheader\ntime\tjoint_angle\n" in text
    assert (tmp_path / "a-joint.png").read_bytes().startswith(b"\x89PNG")
    assert levelhead("joint", pair / "a.npz", pair / "a.npz").code == 2


def test_a_place_gives_the_declination(levelhead, tmp_path):
    pytest.importorskip("pygeomag")
    rec = simulate.recording("ICM-20948", "hand", duration=5.0)
    npz.write_npz(Recording(rec.t, rec.gyr, rec.acc, 3.0 * rec.mag), tmp_path / "a.npz")
    words = ["fuse", tmp_path / "a.npz", "-f", "EKF", "--place", "47.6,-122.3", "--no-plot", "-o", tmp_path]
    said = levelhead(*words, "--date", "2026-06-01")
    assert said.code == 0 and "52.6 µT, dip 68.8°, declination 14.9° by the WMM; measured" in said.out
    assert "iron, or a wrong unit or scale" in said.out and "14.9" in said.out
    assert "needs the date, which is not in the log" in levelhead(*words).err
    assert "the log has no satellite position" in levelhead(*words[:5], "auto", *words[6:]).err
    assert "give the place too" in levelhead("fuse", tmp_path / "a.npz", "--date", "2026-06-01").err


def test_each_sensor_of_a_log_gets_a_track(levelhead, tmp_path):
    rec = simulate.recording("ICM-20948", "hand", duration=3.0, seed=3)
    turned = rec.gyr @ np.diag([1.0, -1.0, -1.0]), rec.acc @ np.diag([1.0, -1.0, -1.0])
    kinds = [f"{place}.{kind}" for place in ("foot", "shank") for kind in ("gyr", "acc")]
    columns = ["t", *(f"{kind}.{axis}" for kind in kinds for axis in "xyz")]
    table = np.column_stack([rec.t, rec.gyr, rec.acc, *turned])
    np.savetxt(tmp_path / "legs.csv", table, delimiter=",", header=",".join(columns), comments="")
    said = levelhead("fuse", tmp_path / "legs.csv", "-f", "Mahony", "--sensor", "all", "--no-plot", "-o", tmp_path)
    assert said.code == 0 and "legs-foot" in said.out and "legs-shank" in said.out
    foot, shank = (np.loadtxt(tmp_path / f"legs-{n}-track.csv", delimiter=",", skiprows=1) for n in ("foot", "shank"))
    assert np.abs(foot[:, 1:5] - shank[:, 1:5]).max() > 0.5
    np.savetxt(tmp_path / "one.csv", table[:, :7], delimiter=",", header="t,gx,gy,gz,ax,ay,az", comments="")
    one = levelhead("fuse", tmp_path / "one.csv", "--sensor", "all", "-o", tmp_path)
    assert one.code == 2 and "leave --sensor all out" in one.err


def test_gait_writes_strides_and_refuses_a_hand(levelhead, pair, tmp_path):
    motion = simulate.foot(6)
    npz.write_npz(simulate.observe(motion, simulate.imu("LSM6DSO32")), tmp_path / "shoe.npz")
    said = levelhead("gait", tmp_path / "shoe.npz", "-o", tmp_path)
    assert said.code == 0 and "6 strides" in said.out
    assert len((tmp_path / "shoe-strides.csv").read_text().splitlines()) == 7
    assert "position_east [m]" in (tmp_path / "shoe-gait.csv").read_text()[:600]
    assert (tmp_path / "shoe-gait.png").read_bytes().startswith(b"\x89PNG")
    refused = levelhead("gait", pair / "a.npz", "-o", tmp_path / "none")
    assert refused.code == 2 and "needs a sensor on a foot" in refused.err
    assert not (tmp_path / "none").exists()
