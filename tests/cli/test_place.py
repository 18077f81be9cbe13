"""``levelhead fuse --place``: true north by the log's own position and clock."""

import numpy as np
import pytest

from levelhead import simulate

PLACE, DAY = {"lat": 48.137, "lon": 11.575, "alt": 520.0}, 1_780_272_000.0  # Munich, 2026-06-01


@pytest.fixture
def log(tmp_path):
    rec = simulate.recording("ICM-20948", "hand", duration=20.0, rate=50.0, mag="AK09916", seed=1)
    sensors = (("gyr", "rad/s"), ("acc", "m/s2"), ("mag", "uT"))
    names = ["time [s]", *(f"{sensor}_{axis} [{unit}]" for sensor, unit in sensors for axis in "xyz"), *PLACE]
    rows = np.column_stack([DAY + rec.t, rec.gyr, rec.acc, rec.mag, *(np.full(len(rec), x) for x in PLACE.values())])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=",".join(names), comments="", fmt="%.9f")
    return tmp_path / "a.csv"


def test_true_north_by_the_log_itself(levelhead, log, tmp_path):
    pytest.importorskip("pygeomag")
    tracks = []
    for more in (["--place", "auto"], ["--place", "48.137,11.575,520", "--date", "2026-06-01"],
                 ["--place", "48.137,11.575,520"], []):  # fmt: skip
        said = levelhead("fuse", log, "-f", "EKF", "--no-plot", "-o", tmp_path, *more)
        assert said.code == 0, said.err
        assert "place 48.1370,11.5750 by lat, lon; --place auto turns heading to true north there" in said.out
        assert ("declination 4." in said.out) is bool(more)
        tracks.append(np.loadtxt(tmp_path / "a-track.csv", delimiter=",", skiprows=1))
    np.testing.assert_array_equal(tracks[0], tracks[1])
    np.testing.assert_array_equal(tracks[0], tracks[2])
    yaw = np.radians(tracks[3][:, 7] - tracks[0][:, 7])
    off = np.angle(np.exp(1j * (yaw - np.radians(4.45))))  # declination of Munich in 2026 (WMM2025)
    assert np.abs(off).max() < np.radians(0.3)


def test_no_place_in_the_log(refused, tmp_path):
    rec = simulate.recording("ICM-20948", "hand", duration=2.0)
    np.savetxt(tmp_path / "b.csv", np.column_stack([rec.t, rec.gyr, rec.acc, rec.mag]), delimiter=",", comments="",
               header="time [s],gx,gy,gz,ax,ay,az,mx,my,mz")  # fmt: skip
    said = refused("fuse", tmp_path / "b.csv", "-f", "EKF", "--place", "auto", "-o", tmp_path)
    assert "the log has no satellite position; give --place LAT,LON" in said
    said = refused("fuse", tmp_path / "b.csv", "--place", "48,x", "-o", tmp_path)
    assert "the place is '48,x'; expected LAT,LON" in said
