"""Comparisons: what goes in, what is printed, and the published numbers of the lesson."""

import json
from dataclasses import replace

import numpy as np
import pytest

from levelhead.errors import LevelheadError
from levelhead.evaluate import compare
from levelhead.evaluate.text_table import Column, best_rows, plain_table
from levelhead.filters import ESKF, AccelTilt, Complementary, Kalman
from levelhead.simulate import lesson


@pytest.fixture(scope="module")
def lesson_comparison():
    return compare(
        lesson(42),
        ["gyro-integration", AccelTilt, Complementary(alpha=0.98), Kalman(r_measure=4)],
        engine="python",
        guard=None,
    )


@pytest.mark.slow
def test_the_lessons_published_errors(lesson_comparison):
    gyroscope, accelerometer, complementary, _ = (row.score for row in lesson_comparison.rows)
    assert accelerometer.total == pytest.approx(3.3346, abs=5e-5)
    assert gyroscope.total == pytest.approx(1.3213, abs=5e-5)
    assert complementary.total == pytest.approx(0.3357, abs=5e-5)


@pytest.mark.slow
def test_the_table_names_units_filters_and_the_engine(lesson_comparison):
    text = str(lesson_comparison)
    head = text.splitlines()[0]
    assert "total [°]" in head
    assert "time [ns/sample]" in head
    assert "Kalman(r_measure=4)" in text
    assert "python engine" in text
    assert lesson_comparison.engine == "python"
    assert all(row.ns > 0 for row in lesson_comparison.rows)
    assert lesson_comparison.best.score.total == min(row.score.total for row in lesson_comparison.rows)


def test_json_holds_no_nan(lesson_comparison):
    plain = json.loads(json.dumps(lesson_comparison.to_dict(), allow_nan=False))
    assert plain["filters"][2]["params"]["tau"] == pytest.approx(0.49)
    assert plain["filters"][0]["score"]["bias"] is None


def test_without_truth_tilt_is_compared_with_the_filter_of_the_smallest_sigma():
    blind = replace(lesson(42)[:500], truth=None)
    found = compare(blind, [Complementary, Kalman])
    assert found.rows[0].score is None
    surest = min(found.rows, key=lambda row: np.median(np.hypot(*row.track.sigma[:, :2].T)))
    assert [row.difference == 0.0 for row in found.rows] == [row is surest for row in found.rows]
    assert found.reference is surest and found.reference.name in found.notes[0]
    assert all(row.difference < 5.0 for row in found.rows)
    assert "tilt against the reference" in str(found)
    json.dumps(found.to_dict(), allow_nan=False)


def test_without_truth_the_default_filter_is_the_reference():
    """Not Kalman, whose σ is smaller and wrong."""
    blind = replace(lesson(42)[:300], truth=None)
    found = compare(blind, [Kalman, ESKF], engine="python")
    assert found.reference.name == "ESKF" and "that of ESKF, the default filter" in found.notes[0]
    assert found.rows[1].difference == 0.0 and found.rows[0].difference > 0.0


def test_progress_rises_to_one():
    seen: list[float] = []
    compare(lesson(42)[:200], [Complementary, Kalman], progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_wrong_filters_are_refused():
    with pytest.raises(LevelheadError, match="did you mean 'Kalman'"):
        compare(lesson(42), ["kalmann"])
    with pytest.raises(LevelheadError, match="at least one"):
        compare(lesson(42), [])


def test_columns_without_values_are_left_out_and_the_best_are_marked():
    columns = (
        Column("name", "name"),
        Column("a", "a", "°", 1, "low"),
        Column("b", "b", "", 1, "one"),
        Column("c", "c"),
    )
    rows = [{"name": "p", "a": 2.0, "b": 0.4, "c": None}, {"name": "q", "a": -1.04, "b": 1.5, "c": None}]
    rows.append({"name": "rr", "a": None, "b": None, "c": None})
    assert plain_table(columns, rows).splitlines() == [
        "name  a [°]    b",
        "p       2.0  0.4",
        "q      −1.0  1.5",
        "rr        –    –",
    ]
    assert best_rows(columns[1], rows) == {1}
    assert best_rows(columns[2], rows) == {1}
    assert best_rows(columns[0], rows) == set()
