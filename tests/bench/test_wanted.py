"""What ``benchmarks/accuracy/wanted.py`` and ``causes.py`` make of figures and of recordings whose faults are known."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.accuracy import against_reference, causes, leave_one_out, wanted

from levelhead import simulate
from levelhead.bench.error_figures import ErrorFigures
from levelhead.bench.ratios import Ratio, Ratios
from levelhead.bench.timing import Table
from levelhead.filters import ESKF
from levelhead.rotations import from_rotvec, product

FIGURES = ErrorFigures(1, 1, 1, 1, 1, 1, 1, beyond_tilt=0.02, beyond_heading=0.0, tilt_ratio=1.0, heading_ratio=0.2)


@pytest.fixture(scope="module")
def swung():
    """By a sensor without errors."""
    return simulate.recording(simulate.Imu(), "hand", 20.0, seed=3)


def ratio(dataset, ours, recording="one", **figures):
    return Ratio(recording, dataset, dataset, ours, 1.0, 1.0, FIGURES._replace(**figures))


def cells(row):
    return row.cells["measured"], row.cells["wanted"], row.cells["met"], row.cells["shown"]


def test_a_constant_bias_is_found_from_the_reference(swung):
    bias = np.radians([0.8, -3.0, 0.3])
    found = against_reference.constant_bias(replace(swung, gyr=swung.gyr + bias), swung.truth.quat)
    assert np.degrees(found) == pytest.approx(np.degrees(bias), abs=0.01)


def test_a_matrix_is_found_from_the_reference_beside_the_bias(swung):
    """The true rate is ω − S ω − b: readings are (1 − S)⁻¹ (w + b)."""
    bias = np.radians([0.8, -3.0, 0.3])
    matrix = np.array([[-0.018, 0.002, 0.0], [0.004, 0.006, -0.001], [0.0, 0.003, -0.01]])
    gyr = np.linalg.solve(np.eye(3) - matrix, (swung.gyr + bias).T).T
    found, found_bias = against_reference.constant_errors(replace(swung, gyr=gyr), swung.truth.quat)
    assert found == pytest.approx(matrix, abs=5e-4)
    assert np.degrees(found_bias) == pytest.approx(np.degrees(bias), abs=0.02)


def test_missing_rates_and_a_missing_reference_only_leave_windows_out(swung):
    bias = np.radians([0.8, -3.0, 0.3])
    gyr, quat = swung.gyr + bias, swung.truth.quat.copy()
    gyr[400:450], quat[900:1100] = np.nan, np.nan
    found = against_reference.constant_bias(replace(swung, gyr=gyr), quat)
    assert np.degrees(found) == pytest.approx(np.degrees(bias), abs=0.01)


def test_of_an_estimated_bias_the_part_about_the_vertical_turns_heading():
    quat = np.tile(from_rotvec(np.array([np.pi / 2, 0.0, 0.0])), (5, 1))  # y stands upwards
    estimates = np.tile(np.radians([7.0, 2.0, 9.0]), (5, 1))
    assert against_reference.vertical_error(estimates, np.radians([0.0, 0.5, 0.0]), quat) == pytest.approx(1.5)


def aside(swung):
    """The reference is lost three times; between the second and the third time it stands 8° aside."""
    t, quat = swung.t, swung.truth.quat.copy()
    askew = (t >= 7.0) & (t < 13.0)
    quat[askew] = product(from_rotvec(np.radians([8.0, 0.0, 0.0])), quat[askew])
    for start in (3.0, 7.0, 13.0):
        quat[(t >= start) & (t < start + 0.3)] = np.nan
    return quat


def test_jumps_of_a_reference_are_those_that_the_gyroscope_does_not_see(swung):
    quat = aside(swung)
    known = ~np.isnan(quat[:, 0])
    errors = against_reference.tilt_errors(swung.truth.quat, quat, known & (swung.t < 7.0))
    found = against_reference.jumps(swung, quat, errors)
    assert [round(float(swung.t[one.first]), 1) for one in found] == [7.3, 13.3]
    assert [one.apart for one in found] == pytest.approx([8.0, 8.0], abs=0.3)
    assert [one.after - one.before for one in found] == pytest.approx([8.0, -8.0], abs=0.1)
    assert not any(one.lost for one in found)
    rows = known & against_reference.after_jumps(len(swung), found)
    assert (rows == known & (swung.t >= 7.3) & (swung.t < 13.0)).all()
    assert len(against_reference.gaps(quat)) == 3


def test_an_error_of_the_filter_is_no_jump_of_the_reference(swung):
    quat = swung.truth.quat.copy()
    quat[(swung.t >= 7.0) & (swung.t < 7.3)] = np.nan
    assert against_reference.jumps(swung, quat, np.where(swung.t < 7.1, 0.0, 8.0)) == []


def test_a_table_of_biases_counts_what_they_explain():
    ratios = [ratio("a", 2.0, heading_ratio=0.3), ratio("a", 4.0, heading_ratio=3.0)]
    table = causes.bias_table(False, ratios, [causes.Bias(1.1, 0.1), causes.Bias(3.0, 0.3)])
    assert "bias given 1 of 2 are no worse. On 1 σ" in table.note
    assert table.rows[-1]["known"] == pytest.approx(2.05)


def test_a_row_says_once_what_holds_of_all_its_figures():
    row = wanted.Row("errors", (wanted.at_most(0.5, 0.6), wanted.at_most(0.7, 0.6)), "command", "cause")
    assert cells(row) == ("0.5; 0.7", "0.6", "yes; no", "`cause`")
    assert cells(row._replace(figures=row.figures[:1])) == ("0.5", "0.6", "yes", "`command`")
    assert cells(wanted.left_out_row(None))[:3] == ("not run", "0.58", "–")


def test_ratios_and_what_is_beyond_sigma():
    known = Ratios("default", "vqf.VQF", (ratio("a", 0.5), ratio("b", 1.3, beyond_tilt=0.0)))
    blind = Ratios("default", "vqf.VQF", (ratio("a", 2.0), ratio("b", 4.0)))
    means = wanted.means_row("means", known, blind, "command", (0.42, 0.48, 0.45))
    assert cells(means)[0] == "0.806; 2.83; 1.51"
    worse, worst, with_mag, without = wanted.ratio_rows(known, blind)
    assert cells(worse)[:3] == ("1; 2", "5; 13", "yes")
    assert cells(worst)[:3] == ("1.3; 4", "2; 3", "yes; no")
    assert cells(with_mag)[:3] == ("1.0 %; 0.0 %", "1 %", "yes")
    assert cells(without)[:3] == ("2.0 %; 0.0 %", "1 %", "no; yes")


def test_sets_whose_sigma_is_off_are_named():
    known = Ratios("default", "vqf.VQF", (ratio("a", 0.5), ratio("b", 0.5, tilt_ratio=2.0, heading_ratio=1.0)))
    tilt, heading = wanted.sigma_rows(known, Ratios("default", "vqf.VQF", known.recordings[:1]))
    assert cells(tilt)[0] == "1 of 2 sets outside (b 2.00); 0 of 1 sets outside"
    assert cells(heading)[0] == "1 of 2 sets outside (a 0.20); 1 of 1 sets outside (a 0.20)"


def test_a_set_left_out_counts_by_its_recordings():
    found = {
        "tyrex": leave_one_out.Found(1.0, 1.0, ESKF(), [0.9, 0.9], [0.7, 0.7]),
        "other": leave_one_out.Found(1.0, 1.0, ESKF(), [0.3], [0.2]),
    }
    assert cells(wanted.left_out_row(found))[:3] == ("0.624", "0.58", "no")
    assert wanted.left_out_note(found) == (
        "Left out: tyrex by numbers chosen on the other sets 0.900, by the default's 0.700; the other sets, each left "
        "out, 0.300."
    )


def test_times_are_ratios():
    whole = {"default": 0.8, "smoother": 3.0, "vqf.VQF": 1.0, "vqf.offlineVQF": 2.0}
    batch = Table("", {}, [{"case": name, "vqf": value} for name, value in whole.items()])
    live = Table("", {}, [{"case": "AxisStream(Kalman)", "vqf.VQF": None}, {"case": wanted.STREAM, "vqf.VQF": 0.6}])
    rows = wanted.time_rows(batch, live)
    assert [row.cells["measured"] for row in rows] == ["0.8", "1.5", "0.6"]
    assert [row.cells["met"] for row in rows] == ["yes", "no", "yes"]


def test_the_commands_name_causes_that_exist():
    known = Ratios("default", "vqf.VQF", (ratio("a", 9.0),) * 20)
    rows = [*wanted.ratio_rows(known, known), *wanted.sigma_rows(known, known)]
    named = {row.cause.rpartition(" ")[2] for row in rows if row.cause.startswith(wanted.CAUSE)}
    assert named <= set(causes.CAUSES)
