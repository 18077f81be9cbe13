"""Orientations from elsewhere in a comparison: what is corrected, what stays an error, and what is said."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead.engine import fuse
from levelhead.errors import LevelheadError
from levelhead.evaluate import compare
from levelhead.publish.plots import lesson_picture
from levelhead.publish.plots.lesson import short_names
from levelhead.recording import Recording, Truth
from levelhead.simulate import recording
from levelhead.track import Track

SWAP = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FLIP = Rotation.from_matrix(np.diag([1, -1, -1]))


@pytest.fixture(scope="module")
def nine() -> Recording:
    return recording("ICM-20948", "hand", duration=20.0)


@pytest.fixture(scope="module")
def truth(nine) -> Rotation:
    return Rotation.from_quat(nine.truth.quat, scalar_first=True)


def about(axis: str, degrees: float) -> Rotation:
    return Rotation.from_euler(axis, degrees, degrees=True)


def vendor(nine, rotation: Rotation, rows: slice = slice(None)) -> Track:
    """As NED, forward-right-down, xyzw."""
    return Track(nine.t[rows], (SWAP * rotation * FLIP).as_quat()[rows])


@pytest.mark.slow
def test_convention_is_corrected_and_tilt_stays(nine, truth):
    found = compare(nine, ["Complementary"], tracks={"vendor": vendor(nine, about("X", 2.0) * truth)})
    row = found.rows[1]
    assert row.name == "vendor" and row.ns is None and row.track.name == "orientation"
    assert row.score.total == pytest.approx(2.0, abs=1e-6) and row.score.tilt == pytest.approx(2.0, abs=1e-6)
    assert row.score.heading_offset is None
    assert any(note.startswith("vendor: order xyzw, frames NED and forward-right-down; ") for note in found.notes)
    assert str(found).splitlines()[2].startswith("vendor") and str(found).splitlines()[2].endswith("–")
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))["filters"]
    assert plain[0]["alignment"] is None and plain[1]["alignment"]["order"] == "xyzw"
    assert plain[1]["filter"] == "vendor" and plain[1]["ns_per_sample"] is None


@pytest.mark.slow
def test_a_small_heading_is_an_error_and_a_large_one_a_zero(nine, truth):
    tracks = {"small": vendor(nine, about("Z", 8.0) * truth), "large": vendor(nine, about("Z", 40.0) * truth)}
    found = compare(nine, [], tracks=tracks)
    small, large = (row.score for row in found.rows)
    assert small.total == pytest.approx(8.0, abs=1e-6) and small.heading_offset is None
    assert small.total_aligned == pytest.approx(0.0, abs=1e-6)
    assert large.total == pytest.approx(0.0, abs=1e-6) and large.heading_offset == pytest.approx(40.0, abs=1e-6)
    assert any("Its heading stays in its errors." in note for note in found.notes)
    assert "engine" not in str(found)


def test_a_delay_is_reported_and_stays(nine, truth):
    from scipy.spatial.transform import Slerp

    late = nine.t[nine.t >= 0.1]
    quat = Slerp(nine.t, truth)(late - 0.04).as_quat(scalar_first=True)
    found = compare(nine, [], tracks={"late": Track(late, quat)})
    assert found.rows[0].external.alignment.ms == pytest.approx(40.0, abs=0.5)
    assert found.rows[0].score.lag == pytest.approx(40.0, abs=1.0)
    assert found.rows[0].score.total > 1.0
    assert any("40.0 ms late" in note and "Its delay stays in its errors." in note for note in found.notes)


@pytest.mark.slow
def test_another_rate_and_gaps_count_where_known(nine, truth, tmp_path):
    half = vendor(nine, truth, slice(None, None, 2))
    holes = half.quat.copy()
    holes[100:200] = np.nan
    found = compare(nine, ["Complementary"], tracks={"half": Track(half.t, holes)})
    row = found.rows[1]
    assert 0.85 * len(nine) < row.score.samples < 0.95 * len(nine)
    assert row.score.total < 0.5  # interpolated over 20 ms
    assert any(
        note.startswith("half is known at 1,7") or note.startswith("half is known at 1,8") for note in found.notes
    )
    assert np.isnan(row.track.quat).any() and np.isfinite(row.difference)
    lesson_picture(found, tmp_path / "compare.png")
    assert (tmp_path / "compare.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_picture_calls_a_contender_by_its_name_whoever_made_it(nine):
    made = fuse(nine, "Complementary")
    found = compare(nine, ["Complementary"], tracks={"mine": made})
    assert short_names(list(found.rows)) == ["Complementary", "mine"]
    assert found.rows[1].score.total == pytest.approx(found.rows[0].score.total)


def test_relative_truth_makes_every_heading_relative(nine, truth):
    turned = replace(nine, truth=Truth((about("Z", 100.0) * truth).as_quat(scalar_first=True), north=False))
    found = compare(turned, ["Complementary"], tracks={"vendor": vendor(nine, truth)})
    assert found.rows[1].score.heading_offset == pytest.approx(-100.0, abs=1e-6)
    assert found.rows[1].score.total == pytest.approx(0.0, abs=1e-6)
    assert all(cells["total_aligned"] is None for cells in found.table)  # it would repeat the total


@pytest.mark.slow
def test_without_truth_it_is_held_against_the_first_filter(nine, truth):
    blind = replace(nine, truth=None)
    found = compare(blind, ["RollPitchKalman"], tracks={"vendor": vendor(nine, about("Y", 3.0) * truth)})
    assert found.rows[1].score is None and 1.0 < found.rows[1].difference < 6.0
    assert any(note.startswith("vendor: order xyzw, frames NED") for note in found.notes)
    with pytest.raises(LevelheadError, match="expected at least one"):
        compare(blind, [], tracks={"vendor": vendor(nine, truth)})


def test_the_reference_itself_is_called_so(nine):
    found = compare(nine, [], tracks={"opt": Track(nine.t, nine.truth.quat)})
    assert found.rows[0].score.total < 1e-9
    assert "opt is the reference itself." in found.notes


def test_a_contender_from_another_time_is_refused(nine, truth):
    with pytest.raises(LevelheadError, match="vendor: estimate .* share 0 instants"):
        compare(nine, [], tracks={"vendor": Track(nine.t + 900.0, truth.as_quat(scalar_first=True))})
