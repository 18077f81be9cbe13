"""Layouts that say little of themselves, written from one simulated motion and read back."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.recording import Recording
from levelhead.units import GRAVITY


def up(made: Recording) -> np.ndarray:
    """(n, 3) m/s²: gravity's reaction in the sensor's frame."""
    assert made.truth is not None
    return Rotation.from_quat(made.truth.quat[:, [1, 2, 3, 0]]).inv().apply([0.0, 0.0, GRAVITY])


def check(read: Recording, made: Recording, acc: float = 1e-3, gyr: float = 1e-3) -> None:
    assert len(read) == len(made)
    np.testing.assert_allclose(read.gyr, made.gyr, atol=gyr)
    np.testing.assert_allclose(read.acc, made.acc, atol=acc)


@pytest.mark.parametrize("order", ["ag", "ga", "agme"])
def test_rows_of_sensors_by_turns_without_names(tmp_path: Path, hand: Recording, order: str) -> None:
    angles = np.degrees(np.cumsum(hand.gyr, axis=0) * 0.01)
    parts = {"a": hand.acc / GRAVITY, "g": np.degrees(hand.gyr), "m": up(hand)[:, [1, 0, 2]] * 5.0, "e": angles}
    rows = np.stack([parts[sign] for sign in order], axis=1).reshape(-1, 3)
    np.savetxt(tmp_path / "lines.txt", rows, "%.5f", " ")
    with pytest.raises(lh.LevelheadError, match="--rate"):
        lh.read(tmp_path / "lines.txt")
    read = lh.read(tmp_path / "lines.txt", rate=hand.rate)
    check(read, hand)
    assert any(one.reason == "stacked_rows" for one in read.meta["conclusions"])


@pytest.mark.parametrize("more", [2, 3, 6])
def test_more_cells_than_names(tmp_path: Path, hand: Recording, more: int) -> None:
    rest = np.random.default_rng(0).normal(0.0, 1.0, (len(hand), more))
    np.savetxt(
        tmp_path / "more.csv", np.column_stack([hand.t, hand.acc, hand.gyr, rest]), "%.6f", ",",
        header="t,ax,ay,az,gx,gy,gz", comments="",
    )  # fmt: skip
    read = lh.read(tmp_path / "more.csv")
    check(read, hand)
    assert any(one.reason == "rest_unnamed" for one in read.meta["conclusions"])


def test_gravity_in_a_file_whose_name_does_not_say_so(tmp_path: Path, hand: Recording) -> None:
    parts = {"Gyroscope": hand.gyr, "LinearAcceleration": hand.acc - up(hand), "ForceVector": up(hand)}
    for name, values in parts.items():
        rows = np.column_stack([hand.t, values])
        np.savetxt(tmp_path / f"{name}.csv", rows, "%.6f", ",", header="time,x,y,z", comments="")
    check(lh.read(tmp_path), hand)


def test_a_python_dictionary_on_each_line(tmp_path: Path, hand: Recording) -> None:
    def sample(k: int) -> dict[str, object]:
        acc, gyro = ({axis: float(value) for axis, value in zip("xyz", part[k], strict=True)}
                     for part in (hand.acc, np.degrees(hand.gyr)))  # fmt: skip
        return {"time": float(hand.t[k]), "acc": acc, "gyro": gyro, "mag": None, "still": False}

    (tmp_path / "dicts.txt").write_text("".join(f"{sample(k)}\n" for k in range(len(hand))))
    check(lh.read(tmp_path / "dicts.txt"), hand)


def test_streams_of_gopro_telemetry(tmp_path: Path, hand: Recording) -> None:
    import json

    def stream(name: str, key: str, unit: str, values: np.ndarray) -> dict[str, object]:
        samples = [{"value": row, "cts": 1000.0 * t} for t, row in zip(hand.t.tolist(), values.tolist(), strict=True)]
        return {"TSMP": len(samples), "STNM": name, "SIUN": unit, key: samples}

    streams = [
        stream("Accelerometer (z,x,y)", "ACCL", "m/s2", hand.acc),
        stream("Gyroscope (z,x,y)", "GYRO", "rad/s", hand.gyr),
        *({"TSMP": k, "STNM": f"Face {k}", "FACE": []} for k in range(5)),
    ]  # fmt: skip
    whole = {"1": {"DEVC": [{"DVID": 1, "DVNM": "Hero6 Black", "STRM": streams}]}, "frames/second": 29.97}
    (tmp_path / "devc.json").write_text(json.dumps(whole))
    check(lh.read(tmp_path / "devc.json"), hand)


@pytest.mark.parametrize("scale", [1.0, np.pi / 180.0], ids=["deg/s", "rad/s"])
def test_the_digit_tells_the_unit_of_a_spin(tmp_path: Path, scale: float) -> None:
    """A rocket on its pad, then a spin at full scale: gravity tells nothing, the converter's step does."""
    rng = np.random.default_rng(0)
    t = np.arange(6000) * 0.01
    spin = np.where(t < 20.0, 0.0, np.minimum(200.0 * (t - 20.0), 2293.0))
    rate = np.column_stack([spin, *rng.normal(0.0, 3.0, (2, 6000)) * (1.0 + spin / 50.0)])
    rate = np.rint((rate + rng.normal(0.0, 0.1, rate.shape)) / 0.07) * 0.07
    acc = np.column_stack([np.full(6000, GRAVITY), np.zeros(6000), 0.02 * np.radians(spin) ** 2])
    acc += rng.normal(0.0, 0.02, acc.shape) * (1.0 + spin[:, None])
    np.savetxt(tmp_path / "rocket.csv", np.column_stack([t, acc, rate * scale]), "%.8f", ",",
               header="t,ax,ay,az,wx,wy,wz", comments="")  # fmt: skip
    read = lh.read(tmp_path / "rocket.csv")
    np.testing.assert_allclose(read.gyr, np.radians(rate), atol=1e-6)
    np.testing.assert_allclose(read.acc, acc, atol=1e-6)
