"""The reader's conclusion as a value: applied, printed, and turned into a command line that leaves nothing to guess."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.reference import (  # noqa: F401  (each registers its dialects)
    dialects_of_boards,
    dialects_of_consoles,
    dialects_of_datasets,
    dialects_of_devices,
    dialects_of_labs,
    dialects_of_loggers,
    dialects_of_phones,
    dialects_of_protocols,
    dialects_of_serial,
    dialects_of_streams,
    dialects_of_tables,
    dialects_of_vehicles,
)
from tests.reference.dialects import DIALECTS, REFUSED, Motion, simulate

import levelhead as lh
from levelhead.recording import Recording
from levelhead.sources.conclusions import Basis
from levelhead.sources.hints import SuggestsCommand
from levelhead.sources.interpret import apply, interpret
from levelhead.sources.interpretation import Interpretation
from levelhead.sources.table import ArrayTable

TIERS = (pytest.mark.slow, pytest.mark.full)


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate("hand")


def interpretation(path: Path) -> Interpretation:
    """Without hints, or with those that its error suggests."""
    try:
        return lh.interpret(path)
    except SuggestsCommand as error:
        return lh.interpret(path, **error.suggested)


def same(one: Recording, other: Recording) -> bool:
    pairs = [(getattr(one, name), getattr(other, name)) for name in ("t", "gyr", "acc", "mag", "temperature")]
    return all(a is b or (a is not None and b is not None and np.array_equal(a, b, equal_nan=True)) for a, b in pairs)


def sample() -> list[object]:
    """Every 16th dialect in the first tier, every other in the second, all in the third."""
    names = sorted(DIALECTS.keys() - REFUSED)
    return [pytest.param(name, marks=() if k % 16 == 0 else TIERS[k % 2]) for k, name in enumerate(names)]


@pytest.mark.parametrize("name", sample())
def test_the_command_reads_the_same_and_guesses_nothing(name: str, motion: Motion, tmp_path: Path) -> None:
    path = DIALECTS[name](tmp_path, motion)
    found = interpretation(path)
    settled = lh.interpret(path, **found.settled())
    assert [one.about for one in settled.guesses] == [one.about for one in found.open_guesses]
    assert same(lh.read(path, **found.settled()), lh.read(path, **found.hints.options()))


SI = {"t": 0.01 * np.arange(400)}
SI |= {f"gyr_{axis} [rad/s]": (axis == "z") * np.sin(0.01 * np.arange(400)) for axis in "xyz"}  # about the vertical
SI |= {f"acc_{axis} [m/s²]": np.full(400, 9.81 * (axis == "z")) for axis in "xyz"}


def test_each_conclusion_has_its_basis(tmp_path: Path, hand: Recording) -> None:
    rows = np.column_stack([1e3 * hand.t, np.degrees(hand.gyr), 16384 / 9.80665 * hand.acc, hand.mag, hand.t])
    log = tmp_path / "log.csv"
    head = "t,gx [deg/s],gy [deg/s],gz [deg/s],ax,ay,az,mx,my,mz,serial"
    np.savetxt(log, rows, ["%.0f", *["%.4f"] * 3, *["%.0f"] * 3, *["%.2f"] * 4], ",", header=head, comments="")
    found = lh.interpret(log, units={"mag": "uT"})
    basis = {one.about: one.basis for one in found.conclusions}
    assert basis["mag.unit"] is Basis.HINT and basis["gyr.unit"] is Basis.HEADER
    assert basis["t.unit"] is Basis.NUMBERS and basis["acc.unit"] is Basis.GUESS
    assert found.columns["acc"] == ("ax", "ay", "az") and found.ignored == ("serial",) and found.streamable
    assert [one.about for one in found.guesses] == ["acc.unit"] and not found.open_guesses
    assert found.settled() == {"units": {"mag": "uT", "t": "ms"}, "counts": {"acc": "16384/g"}}
    command = f"levelhead fuse {log} --units mag=uT --units t=ms --counts acc=16384/g"
    assert found.command() == command and str(found).endswith(f"command  {command}")
    assert not lh.interpret(log, **found.settled()).guesses


def test_it_holds_for_another_part_of_the_log() -> None:
    """Columns may stand elsewhere; the rows that follow are not judged again."""
    table = ArrayTable("log", SI)
    found = interpret(table, lh.sources.hints.Hints())
    whole = apply(found, table)
    later = ArrayTable("later", {"other": np.zeros(100), **{name: column[300:] for name, column in SI.items()}})
    part = apply(found, later)
    for name in ("t", "gyr", "acc"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[300:])
    scale = found.scales["gyr"]
    doubled = replace(found, scales={**found.scales, "gyr": replace(scale, factor=2.0 * scale.factor)})
    np.testing.assert_array_equal(apply(doubled, table).gyr, 2.0 * whole.gyr)
    with pytest.raises(lh.LevelheadError, match=r"later has no column 'gyr_x \[rad/s\]', which its beginning has"):
        apply(found, ArrayTable("later", {"t": SI["t"]}))


def test_a_field_that_was_left_out_can_be_taken_back(tmp_path: Path, hand: Recording) -> None:
    """So the calibration gets a magnetometer that does not turn with the body as its axes are."""
    assert hand.mag is not None
    rows = np.column_stack([hand.t, hand.gyr, hand.acc, hand.mag[:, [1, 0, 2]] * [-1, -1, 1]])
    log = tmp_path / "log.csv"
    head = "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s2],ay [m/s2],az [m/s2],mx [uT],my [uT],mz [uT]"
    np.savetxt(log, rows, "%.5f", ",", header=head, comments="")
    found = lh.interpret(log)
    assert found.unused == {"mag"} and "mag" not in found.units and lh.read(log).mag is None
    kept = lh.sources.pipeline.read_file(log, found.hints, lambda one: one.without("mag.used", "does_not_turn"))
    assert same(kept, lh.read(log, map={"mag": ["mx [uT]", "my [uT]", "mz [uT]"]}))


@pytest.mark.parametrize("swapped", [False, True])
def test_a_field_with_an_offset_is_kept_and_one_with_other_axes_is_not(
    tmp_path: Path, hand: Recording, swapped: bool
) -> None:
    assert hand.mag is not None
    iron = 4.0 * np.linalg.norm(hand.mag, axis=1).mean() * np.array([0.6, -0.5, 0.6])
    mag = (hand.mag[:, [1, 2, 0]] if swapped else hand.mag) + iron
    head = "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s2],ay [m/s2],az [m/s2],mx [uT],my [uT],mz [uT]"
    rows = np.column_stack([hand.t, hand.gyr, hand.acc, mag])
    np.savetxt(tmp_path / "log.csv", rows, "%.5f", ",", header=head, comments="")
    found = lh.interpret(tmp_path / "log.csv")
    (used,) = (one for one in found.conclusions if one.about == "mag.used")
    assert (used.reason, used.value, used.confirm) == (
        ("does_not_turn", False, {"map": {"mag": []}}) if swapped else ("offset", True, {})
    )
    assert (lh.read(tmp_path / "log.csv").mag is None) == swapped


def test_a_file_of_its_own_needs_no_interpretation(tmp_path: Path, hand: Recording) -> None:
    from levelhead.sources.formats.npz import write_npz

    write_npz(hand, tmp_path / "log.npz")
    with pytest.raises(lh.LevelheadError, match="there is nothing to interpret"):
        lh.interpret(tmp_path / "log.npz")
