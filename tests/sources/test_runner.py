"""A runner's accelerometer feels more than gravity most of the time: its unit is told by what the strides leave."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.recording import Array
from levelhead.sources import read
from levelhead.sources.hints import NeedsHints
from levelhead.units import DEGREE, GRAVITY

RATE = 100.0
ACC = {"m/s²": 1.0, "g": GRAVITY, "mg": GRAVITY / 1000.0}
GYR = {"rad/s": 1.0, "deg/s": DEGREE}


def run(seconds: float = 30.0) -> tuple[Array, Array, Array, Rotation]:
    """(t, gyr, acc) in SI, and the orientation, of a runner's hand: 2.6 steps a second, an arm that swings, a curve."""
    t = np.arange(round(seconds * RATE)) / RATE
    arm = 2 * np.pi * 1.3 * t
    turned = Rotation.from_euler("zyx", np.stack([0.3 * t, 0.7 * np.sin(arm), 0.2 * np.cos(arm)], axis=1))
    gyr = np.zeros((len(t), 3))
    gyr[:-1] = (turned[:-1].inv() * turned[1:]).as_rotvec() * RATE
    ahead = 2.0 * GRAVITY * np.sin(arm + 0.6)
    steps = GRAVITY * np.pi * np.maximum(np.sin(2 * arm), 0.0)  # half of the time in flight; 1 g on average
    force = np.stack([ahead * np.cos(0.3 * t), ahead * np.sin(0.3 * t), steps], axis=1)
    rng = np.random.default_rng(1)
    acc = turned.inv().apply(force) + rng.normal(0, 0.1, gyr.shape)
    return t, gyr + rng.normal(0, 0.005, gyr.shape), acc, turned


def write(path: Path, t: Array, gyr: Array, acc: Array) -> Path:
    names = "t,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z"
    np.savetxt(path, np.column_stack([t, gyr, acc]), "%.5f", ",", header=names, comments="")
    return path


@pytest.mark.parametrize(("acc_unit", "gyr_unit"), [*itertools.product(ACC, GYR)])
def test_every_unit_is_told(tmp_path: Path, acc_unit: str, gyr_unit: str) -> None:
    t, gyr, acc, _ = run()
    path = write(tmp_path / "run.csv", t, gyr / GYR[gyr_unit], acc / ACC[acc_unit])
    recording = read(path)
    assert recording.meta["units"] == {"t": "s", "acc": acc_unit, "gyr": gyr_unit}
    note = next(one for one in recording.meta["notes"] if one.startswith("accelerometer"))
    assert "a guess" in note and "as on a runner" in note and f"--units acc={acc_unit} confirms it" in note
    np.testing.assert_allclose(recording.acc, acc, atol=2e-4)


def test_the_unit_of_the_gyroscope_may_be_said(tmp_path: Path) -> None:
    t, gyr, acc, _ = run()
    path = write(tmp_path / "run.csv", t, np.rint(gyr / DEGREE * 16.4), acc)
    assert read(path, counts={"gyr": "16.4/deg/s"}).meta["units"]["acc"] == "m/s²"


def test_without_gravity_it_is_refused(tmp_path: Path) -> None:
    t, gyr, acc, turned = run()
    path = write(tmp_path / "linear.csv", t, gyr, acc - turned.inv().apply([0.0, 0.0, GRAVITY]))
    with pytest.raises(lh.LevelheadError, match="gravity removed"):
        read(path)


@pytest.mark.parametrize("factor", [1.6, 2.0, 2.6])
@pytest.mark.parametrize("gyr_unit", [*GYR.values(), DEGREE / 16.4])
def test_numbers_of_another_size_are_not_a_runner(
    tmp_path: Path, hand: lh.Recording, factor: float, gyr_unit: float
) -> None:
    path = write(tmp_path / "counts.csv", hand.t, hand.gyr / gyr_unit, hand.acc / GRAVITY * factor)
    with pytest.raises(NeedsHints, match="gravity in neither") as refused:
        read(path)
    counts = float(refused.value.suggested["counts"]["acc"].removesuffix("/g"))
    assert counts == pytest.approx(factor, rel=0.02)  # the hint reads it


@pytest.mark.parametrize("acc_unit", ACC)
def test_a_short_run_is_refused_with_the_hint_that_reads_it(tmp_path: Path, acc_unit: str) -> None:
    t, gyr, acc, _ = run(6.0)
    path = write(tmp_path / "short.csv", t, gyr, acc / ACC[acc_unit])
    with pytest.raises(NeedsHints, match=f"expected the hint units acc={acc_unit}, or") as refused:
        read(path)
    np.testing.assert_allclose(read(path, **refused.value.suggested).acc, acc, atol=2e-4)


@pytest.mark.parametrize("place", ["RunningHand", "RunningPocket"])
@pytest.mark.parametrize("phone", ["Nexus5", "iPhone4S", "iPhone5"])
def test_runners_with_phones(tmp_path: Path, data_dir: Path, phone: str, place: str) -> None:
    source = data_dir / "truth" / "tyrex" / f"Guillaume_{phone}_NoDist_{place}.npz"
    if not source.exists():
        pytest.skip("no truth/tyrex here")
    with np.load(source) as data:
        path = write(tmp_path / "run.csv", data["t"], data["gyr"], data["acc"])
    assert read(path).meta["units"] == {"t": "s", "acc": "m/s²", "gyr": "rad/s"}
