from pathlib import Path

import numpy as np
import pytest

from levelhead import interpret, simulate
from levelhead.recording import Recording
from levelhead.signals.field_turn import field_turn
from levelhead.signals.gravity_turn import turn_of_gravity
from levelhead.sources.conclusions import Basis
from levelhead.sources.formats.npz import load_arrays
from levelhead.sources.interpret.accelerometer import acc_unit
from levelhead.sources.interpret.clock_choice import guess_unit
from levelhead.sources.interpret.gyroscope import _against_field, _by_length, contradicts_rad_s, gyr_unit
from levelhead.sources.interpret.magnetometer import mag_unit


@pytest.mark.parametrize(("norm", "unit"), [(9.81, "m/s²"), (1.02, "g"), (995.0, "mg"), (16384.0, None), (0.2, None)])
def test_unit_of_the_accelerometer(norm: float, unit: str | None) -> None:
    assert acc_unit(norm) == unit


@pytest.mark.parametrize(("norm", "unit"), [(48.0, "µT"), (0.48, "G"), (480.0, "mG"), (48e3, "nT"), (1.0, None)])
def test_unit_of_the_magnetometer(norm: float, unit: str | None) -> None:
    assert mag_unit(norm) == unit


def test_turn_of_gravity_measures_the_scale(hand: Recording) -> None:
    for factor in (1.0, 180.0 / np.pi, 131.0 * 180.0 / np.pi):
        turn = turn_of_gravity(hand.t, hand.gyr * factor, hand.acc)
        assert turn is not None and turn.clear
        assert turn.scale * factor == pytest.approx(1.0, abs=0.02)


def test_raw_counts_are_recognised(hand: Recording) -> None:
    found = gyr_unit(hand.t, np.rint(np.degrees(hand.gyr) * 131.0), hand.acc)
    assert found.unit is None and found.counts == 131.0 and found.basis is Basis.GUESS
    odd = gyr_unit(hand.t, np.rint(np.degrees(hand.gyr) * 5000.0), hand.acc)
    assert odd.unit is None and odd.counts is None and odd.facts["measured"] == pytest.approx(4900, rel=0.05)


@pytest.mark.parametrize(("noise", "unit"), [(0.002, "rad/s"), (0.1, "deg/s")])
def test_a_sensor_at_rest_is_guessed_from_its_noise(noise: float, unit: str) -> None:
    rng = np.random.default_rng(0)
    t = np.arange(1000) * 0.01
    gyr, acc = rng.normal(0.0, noise, (1000, 3)), rng.normal([0.0, 0.0, 9.81], 0.05, (1000, 3))
    found = gyr_unit(t, gyr, acc)
    assert found.unit == unit and found.basis is Basis.GUESS


def test_gravity_that_turns_against_the_gyroscope_is_said_to_do_so(hand: Recording) -> None:
    found = gyr_unit(hand.t, -hand.gyr, hand.acc)
    assert found.unit == "rad/s" and found.reversed and found.basis is Basis.GUESS
    assert not gyr_unit(hand.t, hand.gyr, hand.acc).reversed


def test_fast_motion_and_wheels_are_legitimate() -> None:
    t = np.arange(6000) * 0.01
    spin = np.zeros((6000, 3))
    spin[:, 2] = 20.0
    acc = np.stack([np.full(6000, 30.0) + 9.8 * np.cos(20 * t), 9.8 * np.sin(20 * t), np.zeros(6000)], axis=1)
    assert contradicts_rad_s(t, spin, acc) is None  # a sensor on the rim of a wheel
    flat = np.tile([0.0, 0.0, 9.81], (6000, 1))
    assert contradicts_rad_s(t, spin, flat) is None  # a turntable: gravity cannot tell
    spike = np.zeros((6000, 3))
    spike[100] = 4000.0
    assert contradicts_rad_s(t, spike, flat) is None


def test_gaps_and_missing_values(hand: Recording) -> None:
    t, gyr = hand.t.copy(), hand.gyr.copy()
    t[800:] += 30.0
    gyr[100:140] = np.nan
    turn = turn_of_gravity(t, gyr, hand.acc)
    assert turn is not None and turn.scale == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(("start", "step", "unit"), [(0, 0.0035, "s"), (0, 10, "ms"), (0, 1000, "us"), (0, 10**7, "ns"),
                                                     (1.7e9, 0.01, "s"), (1.7e12, 10, "ms")])  # fmt: skip
def test_unit_of_time(start: float, step: float, unit: str) -> None:
    assert guess_unit(start + step * np.arange(100.0)) == unit


def test_the_length_of_a_field_is_that_of_the_part_that_turns():
    """Iron of 600 µT beside a field of 49 µT is as long as a field in mG; only the field turns with the body."""
    hand = simulate.recording("ICM-20948", "hand", duration=60, rate=100, seed=2)
    turn = field_turn(hand.t, hand.gyr, hand.mag + np.array([500.0, -300.0, 100.0]))
    assert turn.shows_field and mag_unit(turn.length) == "µT"
    assert turn.length == pytest.approx(48.5, abs=4.0 * turn.error) and turn.error < 1.0
    still = simulate.recording("ICM-20948", "still", duration=60, rate=100, seed=2)
    assert not field_turn(still.t, still.gyr, still.mag).shows_field


@pytest.mark.slow
@pytest.mark.parametrize("name", ["advio_07", "advio_11"])
def test_the_unit_of_a_phone_with_much_iron(name: str, data_dir: Path, tmp_path: Path) -> None:
    """Phones in a calm hand: 630 to 660 of their numbers are their own field, which is no field in mG."""
    path = data_dir / "truth" / "advio" / f"{name}.npz"
    if not path.is_file():
        pytest.skip("no truth/advio among the real recordings")
    log = load_arrays(path)
    table = np.column_stack([log["t"], log["acc"], log["gyr"], log["mag_raw"]])
    head = "t,ax,ay,az,gx,gy,gz,mx,my,mz"
    np.savetxt(tmp_path / "log.csv", table, "%.7g", ",", header=head, comments="")
    units = interpret(tmp_path / "log.csv").units
    assert units["mag"] == "µT" and units["gyr"] == "rad/s"


def test_a_raw_magnetometer_tells_the_unit_of_a_gyroscope():
    """Its own field is ten times the earth's; in the other unit what turns would be 57 times too long, or too short."""
    hand = simulate.recording("ICM-20948", "hand", duration=60, rate=100, seed=2)
    field = hand.mag + np.array([500.0, -300.0, 100.0])
    for unit, factor in (("rad/s", 1.0), ("deg/s", 180.0 / np.pi)):
        assert _by_length(_against_field(hand.t, hand.gyr * factor, field)) == unit
