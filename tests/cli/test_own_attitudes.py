"""An autopilot's own attitude beside its sensors: logs written by others' code, or byte by byte, and compared."""

import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate
from levelhead.sources import attitudes
from levelhead.units import GRAVITY

TO_NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
TO_FRD = Rotation.from_matrix(np.diag([1, -1, -1]))


@pytest.fixture(scope="module")
def flight():
    """Readings in forward-right-down, and the true attitude of that in north-east-down."""
    rec = simulate.recording("ICM-20948", "drone", duration=8.0, rate=100.0)
    truth = TO_NED * Rotation.from_quat(rec.truth.quat, scalar_first=True) * TO_FRD
    field = truth.inv().apply([20.0, 0.0, 45.0])  # of a magnetometer without errors
    return rec, *(TO_FRD.apply(np.array(one)) for one in (rec.gyr, rec.acc)), field, truth


def write_tlog(path: Path, flight, fine: bool, quaternion: bool) -> None:
    """As a ground station does it, by pymavlink."""
    dialect = pytest.importorskip("pymavlink.dialects.v20.common", reason="pymavlink is not installed")
    rec, gyr, acc, mag, truth = flight
    sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    with open(path, "wb") as out:
        for i, t in enumerate(rec.t):
            ms = round(1e3 * t) + 5000
            if fine:
                values = (1000 * ms, *acc[i], *gyr[i], *(mag[i] / 100.0), 1013.0, 0.0, 0.0, 25.0, 0)
                messages = [dialect.MAVLink_highres_imu_message(*values)]
            else:
                counts = [*np.rint(acc[i] / GRAVITY * 1e3), *np.rint(gyr[i] * 1e3), *np.rint(mag[i] * 10.0)]
                messages = [dialect.MAVLink_raw_imu_message(1000 * ms, *(int(one) for one in counts))]
            if i % 4 == 0 and quaternion:
                quat = 0.98 * truth[i].as_quat(scalar_first=True)  # rounded: only about of length 1
                messages.append(dialect.MAVLink_attitude_quaternion_message(ms, *quat, 0.0, 0.0, 0.0))
            elif i % 4 == 0:
                yaw, pitch, roll = truth[i].as_euler("ZYX")
                messages.append(dialect.MAVLink_attitude_message(ms, roll, pitch, yaw, 0.0, 0.0, 0.0))
            messages.append(dialect.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3))
            for message in messages:
                out.write(struct.pack(">Q", 1_700_000_000_000_000 + 1000 * ms) + message.pack(sender))
            if i == 100:
                out.write(b"\xfd damage \xfe")


@pytest.mark.parametrize("fine, quaternion", [(True, True), (False, False)])
def test_a_log_of_mavlink(flight, tmp_path, fine, quaternion):
    rec, gyr, acc, mag, truth = flight
    write_tlog(tmp_path / "flight.tlog", flight, fine, quaternion)
    read = lh.read(tmp_path / "flight.tlog")
    bits = (1e-6, 1e-5, 1e-4) if fine else (0.51e-3, 0.51e-3 * GRAVITY, 0.051)
    assert len(read) == len(rec) and read.t == pytest.approx(rec.t + 5.0)
    for have, want, bit in zip((read.gyr, read.acc, read.mag), (gyr, acc, mag), bits, strict=True):
        np.testing.assert_allclose(have, want, atol=bit)
    ((name, track),) = attitudes(tmp_path / "flight.tlog").items()
    assert name == ("ATTITUDE_QUATERNION of 1.1" if quaternion else "ATTITUDE of 1.1")
    np.testing.assert_allclose(np.linalg.norm(track.quat, axis=1), 1.0, atol=1e-12)
    off = Rotation.from_quat(track.quat, scalar_first=True).inv() * truth[::4]
    assert len(track.t) == len(rec.t[::4]) and np.degrees(off.magnitude()).max() < 1e-3


def write_dataflash(path: Path, flight) -> None:
    """FMT, IMU and ATT messages as ArduPilot's guide describes them; angles in hundredths of a degree ('c')."""
    rec, gyr, acc, _, truth = flight

    def kind(number: int, name: str, letters: str, columns: str, size: int) -> bytes:
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, size, *(s.encode() for s in (name, letters, columns)))  # fmt: skip # noqa: E501

    data = kind(129, "IMU", "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", 3 + 8 + 24)
    data += kind(130, "ATT", "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw", 3 + 8 + 12)
    for i, t in enumerate(rec.t):
        us = round(1e6 * t) + 1_000_000
        data += b"\xa3\x95\x81" + struct.pack("<Q6f", us, *gyr[i], *acc[i])
        yaw, pitch, roll = (round(100.0 * one) for one in truth[i].as_euler("ZYX", degrees=True))
        data += b"\xa3\x95\x82" + struct.pack("<Q4h2H", us, 0, roll, 0, pitch, 0, yaw % 36000)
    path.write_bytes(data)


def test_ardupilot_s_own_log(flight, tmp_path):
    _, gyr, _, _, truth = flight
    write_dataflash(tmp_path / "flight.bin", flight)
    read = lh.read(tmp_path / "flight.bin")
    np.testing.assert_allclose(read.gyr, gyr, atol=1e-5)
    ((name, track),) = attitudes(tmp_path / "flight.bin").items()
    off = Rotation.from_quat(track.quat, scalar_first=True).inv() * truth
    assert name == "ATT" and track.t == pytest.approx(read.t) and np.degrees(off.magnitude()).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".tlog", ".bin"])
def test_compare_shows_the_autopilot_beside_our_filter(flight, tmp_path, levelhead, suffix):
    path = tmp_path / f"flight{suffix}"
    write_dataflash(path, flight) if suffix == ".bin" else write_tlog(path, flight, True, True)
    table = levelhead("compare", path, "-f", "ESKF", "--json").json
    own = table["filters"][1]
    assert own["filter"].startswith("ATT") and own["tilt_difference_deg"] < 2.0
    assert "NED" in next(note for note in table["notes"] if note.startswith("ATT"))


def test_px4_s_own_attitude_in_a_real_flight(levelhead, data_dir):
    """Two estimators of a real flight agree about its vertical."""
    pytest.importorskip("pyulog", reason="pyulog is not installed (extra levelhead[formats])")
    own = levelhead("compare", data_dir / "wild" / "px4_sample.ulg", "-f", "ESKF", "--json").json["filters"][1]
    assert own["filter"] == "vehicle_attitude" and own["tilt_difference_deg"] < 0.3


def test_files_without_one(tmp_path):
    (tmp_path / "plain.csv").write_text("t,gx,gy,gz,ax,ay,az\n0,0,0,0,0,0,9.8\n")
    assert attitudes(tmp_path / "plain.csv") == {} and attitudes(tmp_path) == {}
    with pytest.raises(lh.LevelheadError, match="there is no"):
        attitudes(tmp_path / "none.tlog")
