"""Numbers that the doctor prints with their interval, and how sure a finding is."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.inspection.test_turns import changed, findings, made

import levelhead as lh
from levelhead.inspection import examine
from levelhead.inspection.agreement import IDENTITY, LIKELY_ODDS, SURE_ODDS, Agreement, Hypothesis, Seen, faults
from levelhead.inspection.findings import Measurement
from levelhead.inspection.physics import scale_in_motion
from levelhead.inspection.repair import repair
from levelhead.recording import Array, Recording
from levelhead.signals.turn_matrix import cut, fit


@pytest.fixture(scope="module")
def clean() -> Recording:
    return made()


def measured(recording: Recording) -> dict[str, Measurement]:
    return {one.name: one for one in examine(recording).measured}


def push(recording: Recording, size: float) -> Array:
    """Accelerations that stay along the body, which hide gravity's turn, m/s²."""
    waves = ((0.35, 0.0), (0.5, 1.0), (0.42, 2.0))
    return size * np.stack([np.sin(2.0 * np.pi * f * recording.t + phase) for f, phase in waves], axis=1)


def test_intervals_hold_what_was_put_in(clean: Recording) -> None:
    """Each fault is too small for a finding, and its number is in the interval."""
    assert clean.mag is not None
    late = np.stack([np.interp(clean.t - 0.005, clean.t, one) for one in clean.mag.T], axis=1)
    iron = np.array([0.0, 0.05 * np.linalg.norm(clean.mag[0]), 0.0])
    for recording, name, true in (
        (changed(clean, gyr=1.02 * clean.gyr), "gyro_scale", 1.02),
        (clean, "gyro_scale", 1.0),
        (clean, "sensor_delay", 0.0),
        (changed(clean, mag=late), "mag_delay", 5.0),
        (changed(clean, mag=clean.mag + iron), "mag_offset", 5.0),
        (changed(clean, mag=clean.mag * [1.0, 1.03, 1.0]), "mag_shape", 3.0),
        (changed(clean, acc=0.99 * clean.acc), "acc_scale", 0.99),
        (changed(clean, gyr=clean.gyr + np.radians([0.0, 0.3, 0.0])), "gyro_bias", 0.3),
    ):
        report = examine(recording)
        one = next(one for one in report.measured if one.name == name)
        assert one.interval[0] - 1e-3 <= true <= one.interval[1] + 1e-3, one
        assert name not in report.names()


def test_an_interval_is_wide_where_forces_hide_the_turn(clean: Recording) -> None:
    hidden = measured(changed(clean, acc=clean.acc + push(clean, 4.0), mag=None))
    for name in ("gyro_scale", "sensor_delay"):
        known, vague = measured(clean)[name].interval, hidden[name].interval
        assert vague[1] - vague[0] > 1.5 * (known[1] - known[0])


def test_the_report_prints_each_measurement(clean: Recording) -> None:
    report = examine(clean)
    scale = next(one for one in report.measured if one.name == "gyro_scale")
    low, high = scale.interval
    assert f"measured: scale of the gyroscope {scale.value:.3f} (95 %: {low:.3f} to {high:.3f})" in str(report)
    told = json.loads(json.dumps(report.to_dict()))["measured"]
    assert [one["name"] for one in told] == [one.name for one in report.measured]


def test_a_likely_fault_is_a_note_with_a_motion_that_decides(clean: Recording) -> None:
    pushed = changed(clean, acc=clean.acc + push(clean, 2.0), mag=None)
    likely = findings(changed(pushed, gyr=1.04 * clean.gyr))["gyro_scale"]
    assert (
        not likely.sure
        and likely.severity == "note"
        and "may read 1.0" in likely.what
        and "that decides" in likely.cure
    )
    sure = findings(changed(pushed, gyr=1.1 * clean.gyr))["gyro_scale"]
    assert sure.sure and sure.severity == "warning" and "reads 1.1" in sure.what and "--fix does" in sure.cure


@pytest.mark.parametrize(("gain", "found", "sure"), [(2.9, False, False), (3.1, True, False), (8.1, True, True)])
def test_odds_decide(gain: float, found: bool, sure: bool) -> None:
    """Twice the logarithm of the odds, over the excess of χ² that a model leaves."""
    assert (LIKELY_ODDS, SURE_ODDS) == (3.0, 8.0)
    none, scale = (
        Hypothesis("none", "", IDENTITY, 40.0, 0.0),
        Hypothesis("scale", "gyr", IDENTITY, 34.0 - 2 * gain, 6.0),
    )
    agreement = Agreement((), (scale, none), 2.0)
    assert agreement.gain == pytest.approx(gain)
    assert (agreement.fault is not None, agreement.is_sure) == (found, sure)


def test_a_fault_of_the_gyroscope_is_one_for_all_sensors(clean: Recording) -> None:
    """A steady turn at an arm's length: forces show 1.9 times the turn about z, the field shows it right."""
    segments = cut(clean.t, clean.gyr, clean.acc, True)
    assert segments is not None
    one = fit(segments, IDENTITY)
    turning = np.diag([1.0, 1.0, 1.9])

    def judge(*matrices: Array) -> Agreement:
        seen = [
            Seen(role, one._replace(matrix=matrix), np.eye(9) / 0.05**2, 10.0, 0.0, segments)
            for role, matrix in zip(("acc", "mag"), matrices, strict=False)
        ]
        judged = faults(seen)
        return Agreement(seen, judged, max(1.0, judged[0].chi / (9.0 * len(seen))))

    agreed, contrary = judge(turning, turning), judge(turning, IDENTITY)
    assert agreed.fault is not None and agreed.fault.kind == "axis_scale" and agreed.is_sure
    assert contrary.fault is None and contrary.is_contradictory


def test_a_force_that_is_too_small_is_told_from_a_wrong_gyroscope(clean: Recording) -> None:
    found = scale_in_motion(changed(clean, acc=0.93 * clean.acc))
    assert found is not None and abs(found.ratio - 0.93) < 0.005 and found.sigma < 0.005 and found.is_wrong
    for wrong in (2.0 * clean.gyr, 0.5 * clean.gyr, clean.gyr * [1.0, -1.0, 1.0]):
        assert scale_in_motion(changed(clean, gyr=wrong)) is None


def test_a_wrong_scale_of_the_accelerometer_is_no_scale_of_the_gyroscope(clean: Recording) -> None:
    for factor in (1.1, 0.9):
        found = findings(changed(clean, acc=factor * clean.acc))
        assert "gyro_scale" not in found and "mounting" not in found


def test_an_axis_that_stands_from_the_start_leaves_nothing_to_compare(clean: Recording) -> None:
    gyr = np.array(clean.gyr)
    gyr[:, 0] = 0.01
    report = examine(changed(clean, gyr=gyr))
    assert "stuck_gyr" in report.names() and not report.names() & {"axes_order", "gyro_scale", "gyro_inverted"}


def test_an_axis_that_stands_from_the_middle_on_leaves_the_first_half(clean: Recording) -> None:
    gyr = 1.1 * np.array(clean.gyr)
    gyr[len(gyr) // 2 :, 0] = gyr[len(gyr) // 2, 0]
    found = findings(changed(clean, gyr=gyr))
    assert set(found) == {"gyro_scale"} and found["gyro_scale"].value == pytest.approx(1.1, abs=0.02)


def test_no_accelerometer_is_late_by_a_third_of_a_second(clean: Recording) -> None:
    """So long a delay is a filter's, whichever of the two leaves less: forces hide the difference."""
    late = np.stack([np.interp(clean.t - 0.3, clean.t, one) for one in clean.acc.T], axis=1)
    found = findings(changed(clean, acc=late, mag=None))
    assert "acc_low_passed" in found and "sensor_delay" not in found


def low_passed(recording: Recording, corner: float) -> Recording:
    """Behind a filter of first order, by its exact response to a constant between samples."""
    acc, share = np.array(recording.acc), 1.0 - np.exp(-2.0 * np.pi * corner / recording.rate)
    for i in range(1, len(acc)):
        acc[i] = acc[i - 1] + share * (acc[i] - acc[i - 1])
    return changed(recording, acc=acc)


@pytest.mark.parametrize("corner", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("size", [0.0, 1.0])
def test_the_likeliest_filter_is_the_one_put_in(clean: Recording, corner: float, size: float) -> None:
    """Forces move the zero of the delay; the likelihood they do not, eq. 1 of ``delays``."""
    pushed = changed(clean, acc=clean.acc + push(clean, size), mag=None)
    one = findings(low_passed(pushed, corner))["acc_low_passed"]
    assert one.value == pytest.approx(corner, rel=0.2) and one.interval is not None
    assert one.severity == "broken" and one.interval[0] < corner < one.interval[1]


def test_no_filter_is_found_where_there_is_none(clean: Recording) -> None:
    for size in (0.0, 2.0, 4.0):
        for seed in (0, 1):
            pushed = changed(made(seed), acc=made(seed).acc + push(clean, size), mag=None)
            assert "acc_low_passed" not in findings(pushed)


def test_a_filter_is_mended_where_it_proves_to_be(clean: Recording) -> None:
    mended, changes = repair(examine(low_passed(changed(clean, mag=None), 0.5)))
    assert [one.startswith("mended: the accelerometer is low-passed") for one in changes] == [True]
    inner = slice(50, -50)
    assert np.abs(mended.acc - clean.acc)[inner].mean() < 0.3


@pytest.mark.full
def test_sensors_that_contradict_each_other_leave_no_fault(data_dir: Path) -> None:
    log = data_dir / "wild2" / "xio_fusion.csv"
    if not log.exists():
        pytest.skip("no log of x-io here: $LEVELHEAD_DATA holds none")
    found = {one.name: one for one in lh.inspect(log).findings}
    assert "gyro_scale" not in found and "no fault explains" in found["acc_gyr_test_invalid"].what


@pytest.mark.full
@pytest.mark.parametrize(("name", "corner", "proved"), [("AR", 0.3, True), ("FrontPocket", 0.5, False)])
def test_a_mend_that_adds_noise_only_is_refused(data_dir: Path, name: str, corner: float, proved: bool) -> None:
    """Of a walker the mended track has 2.3° of tilt for 1.2°, though the residual of the turn is smaller."""
    log = data_dir / "truth" / "tyrex" / f"Guillaume_{'Nexus5_NoDist' if proved else 'iPhone5_Dist'}_{name}.npz"
    if not log.exists():
        pytest.skip("no recordings with truth here: $LEVELHEAD_DATA holds none")
    _, changes = repair(examine(low_passed(lh.read(log), corner)))
    said = [one for one in changes if "low-passed" in one]
    assert len(said) == 1 and said[0].startswith("mended" if proved else "not mended")
    assert ("noise grows" in said[0]) is not proved
