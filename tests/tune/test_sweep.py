"""Sweeps: the lesson's known minimum, the flat region, and everything that can be asked wrongly."""

import importlib
import json
from dataclasses import replace

import numpy as np
import pytest

from levelhead.engine import fuse
from levelhead.errors import LevelheadError
from levelhead.evaluate import evaluate
from levelhead.filters import Complementary, Kalman
from levelhead.filters.parameters import Param
from levelhead.simulate import lesson, recording
from levelhead.tune import Sweep, sweep
from levelhead.tune.sweep import grid, set_value

SCORE = importlib.import_module("levelhead.tune.score_sets")


@pytest.fixture(scope="module")
def alpha():
    return sweep(lesson(42), Complementary, "alpha", guard=None)


def made(values: list[float], total: list[float]) -> Sweep:
    array = np.array(total)
    param = Param("deg²", "variance", sweep=(0.1, 100.0), log=True)
    return Sweep(Kalman(), "r_measure", param, np.array(values), array, array, 0 * array, "total")


@pytest.mark.compiled
def test_the_lessons_minimum(alpha):
    assert alpha.values.tolist() == [round(0.80 + 0.01 * i, 2) for i in range(20)]
    assert alpha.minimum == 0.99
    assert alpha.scores[alpha.index] == pytest.approx(0.2651, abs=5e-5)
    assert alpha.edge == "highest"
    assert "at the edge: widen the range" in str(alpha)
    assert "tau = 0.99" in alpha.finding


@pytest.mark.compiled
def test_every_score_is_that_of_evaluate(alpha):
    score = evaluate(lesson(42), fuse(lesson(42), Complementary(alpha=0.9), guard=None))
    assert alpha.total[10] == score.total
    assert alpha.tilt[10] == score.tilt


@pytest.mark.full
@pytest.mark.compiled
@pytest.mark.parametrize("north", [False, True])
def test_side_by_side_the_scores_are_the_same(north, monkeypatch):
    rec = recording("ICM-20948", "walking", duration=8)
    truth = replace(rec.truth, north=north)
    holes = truth.quat.copy()
    holes[100:120] = np.nan
    rec = replace(rec, truth=replace(truth, quat=holes))
    values = np.geomspace(0.1, 100.0, 70)
    seen: list[float] = []
    beside = sweep(rec, Complementary, "tau", values, engine="compiled", progress=seen.append)
    monkeypatch.setattr(SCORE, "lanes_are_faster", lambda flt, sets: False)
    single = sweep(rec, Complementary, "tau", values, engine="compiled")
    for name in ("total", "tilt", "heading"):
        np.testing.assert_allclose(getattr(beside, name), getattr(single, name), rtol=1e-13)
    assert seen == sorted(seen) and seen[-1] == 1.0


@pytest.mark.compiled
def test_best_is_ready_to_use(alpha):
    assert alpha.best == Complementary(alpha=0.99)


def test_the_other_parameters_stay():
    found = sweep(lesson(42)[:300], Kalman(q_bias=0.5), "r_measure", [10.0, 0.1, 1.0, 1.0])
    assert found.values.tolist() == [0.1, 1.0, 10.0]
    assert found.best.q_bias == 0.5


def test_flat_is_the_unbroken_run_within_five_percent():
    found = made([1, 2, 3, 4, 5, 6], [1.04, 1.2, 1.05, 1.0, 1.049, 1.06])
    assert found.index == 3
    assert found.flat == (2, 4)
    assert found.edge == ""
    assert "3 to 5 deg²" in found.finding
    alone = made([1, 2, 3], [2.0, 1.0, 2.0])
    assert alone.flat == (1, 1)
    assert "no other value" in alone.finding


def test_default_grids():
    r = grid("Kalman", "r_measure", Param("deg²", "", sweep=(0.1, 100.0), log=True))
    assert (len(r), r[0], r[1], r[10], r[-1]) == (31, 0.1, 0.126, 1.0, 100.0)
    with pytest.raises(LevelheadError, match="give the values"):
        grid("Kalman", "x", Param("", "", low=0.0))


def test_a_switch_is_tried_both_ways():
    found = sweep(lesson(42)[:300], Kalman, "joseph")
    assert found.values.tolist() == [0.0, 1.0]


@pytest.mark.compiled
def test_json(alpha):
    plain = json.loads(json.dumps(alpha.to_dict(), allow_nan=False))
    assert plain["minimum"] == {"value": 0.99, "error_deg": pytest.approx(0.2651, abs=5e-5), "edge": "highest"}
    assert plain["flat"]["within"] == 0.05
    assert len(plain["total_deg"]) == 20


def test_derived_names_replace_their_field():
    assert set_value(Complementary(tau=3.0, adaptive=True), "alpha", 0.5) == Complementary(alpha=0.5, adaptive=True)


def test_what_is_wrong_is_said():
    short = lesson(42)[:50]
    with pytest.raises(LevelheadError, match="needs the true orientation"):
        sweep(replace(short, truth=None), Complementary, "alpha")
    with pytest.raises(LevelheadError, match="did you mean 'r_measure'"):
        sweep(short, Kalman, "r_mesure")
    with pytest.raises(LevelheadError, match=r"alpha = 1\.5 is not allowed"):
        sweep(short, Complementary, "alpha", [0.5, 1.5])
    with pytest.raises(LevelheadError, match="'total'"):
        sweep(short, Complementary, "alpha", metric="totl")  # type: ignore[arg-type]
    with pytest.raises(LevelheadError, match="no value"):
        sweep(short, Complementary, "alpha", [])


def test_progress_and_metric():
    seen: list[float] = []
    found = sweep(lesson(42)[:100], Complementary, "alpha", [0.9, 0.98], metric="tilt", progress=seen.append)
    assert seen == [0.5, 1.0]
    assert (found.scores == found.tilt).all()
