"""The gyroscope's unit on a body that never rests: what is left of the force, turned back, must keep its mean."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead.recording import Array
from levelhead.sources import read
from levelhead.sources.interpret.gyroscope import gyr_unit
from levelhead.units import DEGREE, GRAVITY

RATE = 100.0
BIAS = np.array([2.5, -2.0, 2.0]) * DEGREE  # 3.8 deg/s
GYR = {"rad/s": 1.0, "deg/s": DEGREE}
Log = tuple[Array, Array, Array]  # t s, gyr rad/s, acc m/s²


def sensed(t: Array, turned: Rotation, accelerated: Array, shaking: float, noise: float = 0.005) -> Log:
    """What a sensor feels that is ``turned`` and ``accelerated`` (n, 3) m/s² in the frame of the earth."""
    rng = np.random.default_rng(1)
    gyr = np.zeros((len(t), 3))
    gyr[:-1] = (turned[:-1].inv() * turned[1:]).as_rotvec() * RATE
    acc = turned.inv().apply(accelerated + [0.0, 0.0, GRAVITY])
    return t, gyr + rng.normal(0.0, noise, gyr.shape), acc + rng.normal(0.0, shaking, acc.shape)


def times(seconds: float = 24.0) -> Array:
    return np.arange(round(seconds * RATE)) / RATE


def swinging() -> Log:
    """A phone in the hand of an arm of 0.7 m that swings by 30 degrees: gravity seems to turn against the gyroscope."""
    t = times()
    angle = 0.5 * np.sin(2 * np.pi * 0.9 * t) + 0.1
    place = 0.7 * np.stack([np.sin(angle), np.zeros_like(t), -np.cos(angle)], axis=1)
    heading = Rotation.from_rotvec(np.outer(0.2 * np.sin(0.4 * t), [0.0, 0.0, 1.0]))
    accelerated = np.gradient(np.gradient(place, t, axis=0), t, axis=0)
    return sensed(t, heading * Rotation.from_rotvec(np.outer(angle, [0.0, -1.0, 0.0])), heading.apply(accelerated), 0.3)


def walking() -> Log:
    """A phone in a back pocket: a hip that turns about all axes, with steps of half of gravity."""
    t = times()
    step = 2 * np.pi * 0.95 * t
    angles = np.stack([0.15 * np.sin(step), 0.2 * np.sin(step + 1.0), 0.12 * np.sin(2 * step)], axis=1)
    accelerated = np.stack([3.0 * np.sin(2 * step + 0.5), 2.5 * np.sin(step), 4.0 * np.sin(2 * step)], axis=1)
    return sensed(t, Rotation.from_euler("zyx", angles), accelerated, 0.3)


def flying() -> Log:
    """A drone, which thrusts along its own axis whatever it tilts: what it feels does not turn at all, but shakes."""
    t = times()
    angles = np.stack([0.2 * np.sin(0.3 * t), 0.12 * np.sin(1.9 * t), 0.1 * np.sin(2.3 * t + 1.0)], axis=1)
    turned = Rotation.from_euler("zyx", angles)
    thrust = GRAVITY / np.cos(angles[:, 1]) / np.cos(angles[:, 2])
    along = turned.apply(np.stack([np.zeros_like(t), np.zeros_like(t), thrust], axis=1))
    return sensed(t, turned, along - [0.0, 0.0, GRAVITY], 0.9)


@pytest.mark.parametrize("unit", GYR)
@pytest.mark.parametrize("bias", [0.0, 1.0])
@pytest.mark.parametrize("motion", [swinging, walking, flying])
def test_a_body_that_never_rests(tmp_path: Path, motion: Callable[[], Log], bias: float, unit: str) -> None:
    t, gyr, acc = motion()
    path = tmp_path / "moved.csv"
    columns = np.column_stack([t, (gyr + bias * BIAS) / GYR[unit], acc / GRAVITY])
    np.savetxt(path, columns, "%.5f", ",", header="t,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z", comments="")
    recording = read(path)
    assert recording.meta["units"]["gyr"] == unit
    assert any("gyroscope" in note and "a guess" in note for note in recording.meta["notes"])


@pytest.mark.parametrize("motion", [swinging, walking, flying])
def test_the_mean_force_is_the_evidence(motion: Callable[[], Log]) -> None:
    t, gyr, acc = motion()
    assert gyr_unit(t, gyr, acc).reason == "force_keeps_mean"
    assert gyr_unit(t, gyr / DEGREE, acc).reason == "force_cancels"


@pytest.mark.parametrize(("noise", "unit"), [(0.1 * DEGREE, "rad/s"), (0.1 * DEGREE, "deg/s")])
def test_at_rest_its_noise_still_tells(noise: float, unit: str) -> None:
    t = times()
    t, gyr, acc = sensed(t, Rotation.identity(len(t)), np.zeros((len(t), 3)), 0.05, noise)
    found = gyr_unit(t, (gyr + BIAS * 0.2) / GYR[unit], acc)
    assert found.unit == unit and found.reason in ("quiet", "loud")


@pytest.mark.parametrize("shaking", [0.03, 1.0])
@pytest.mark.parametrize("unit", GYR)
def test_about_the_vertical_nothing_is_turned_back(unit: str, shaking: float) -> None:
    t = times()
    turned = Rotation.from_rotvec(np.outer(np.sin(0.5 * t) + 0.3 * t, [0.0, 0.0, 1.0]))
    t, gyr, acc = sensed(t, turned, np.zeros((len(t), 3)), shaking, 0.05 * DEGREE)
    found = gyr_unit(t, gyr / GYR[unit], acc)
    assert found.unit == unit and found.reason != "force_keeps_mean"


@pytest.mark.parametrize(
    ("tilt", "bias", "shaking", "bumps"), [(0.1, 0.2, 0.4, 0.9), (0.08, 0.0, 0.05, 0.9), (0.03, 0.0, 0.2, 0.2)]
)
def test_a_calm_vehicle_in_degrees(tilt: float, bias: float, shaking: float, bumps: float) -> None:
    """Its tilt of 1 deg/s would hardly scatter the force if it were rad/s.

    A bias does, or the force shows no tilt, or it is shaken too little to tell.
    """
    t = times()
    angles = DEGREE * np.stack([20 * np.sin(0.3 * t), tilt * np.sin(8 * t), tilt * np.sin(7.1 * t + 1)], axis=1)
    accelerated = np.stack([0.4 * np.sin(0.5 * t), 0.2 * np.sin(0.7 * t), bumps * np.sin(9.0 * t)], axis=1)
    t, gyr, acc = sensed(t, Rotation.from_euler("zyx", angles), accelerated, shaking, 0.05 * DEGREE)
    found = gyr_unit(t, (gyr + bias * BIAS) / DEGREE, acc)
    assert found.unit == "deg/s" and found.reason == "loud"


@pytest.mark.parametrize("unit", GYR)
@pytest.mark.parametrize(
    "name", ["tyrex/Guillaume_iPhone5_Dist_BackPocket", "tyrex/Guillaume_Nexus5_Dist_Swinging", "euroc/V1_02_medium"]
)
def test_recordings_of_moving_bodies(data_dir: Path, name: str, unit: str) -> None:
    source = data_dir / "truth" / f"{name}.npz"
    if not source.exists():
        pytest.skip("no truth here")
    with np.load(source) as data:
        t, gyr, acc = (data[key].astype(np.float64) for key in ("t", "gyr", "acc"))
    piece = (t - t[0] >= 30.0) & (t - t[0] < 50.0)
    assert gyr_unit(t[piece], gyr[piece] / GYR[unit], acc[piece]).unit == unit


def test_a_torn_number_leaves_the_same_windows_in_both_units() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(4000) * 0.01
    gyr, acc = rng.normal(0.0, 60.0, (4000, 3)), rng.normal([0.0, 0.0, 9.8], 3.0, (4000, 3))
    gyr[2000, 1] = 3e6  # too large for rad/s, not for deg/s
    assert gyr_unit(t, gyr, acc).unit in ("deg/s", None)
