"""Fair timing. No time is asserted, only that everything is timed, in turn, and shown."""

import pytest

from levelhead import LevelheadError, filters
from levelhead.bench import contenders, inputs
from levelhead.bench.speed import batch, live, speed
from levelhead.bench.timing import Case, Timing, machine, time_interleaved


@pytest.mark.slow
def test_cases_run_in_turn_and_the_first_run_does_not_count():
    calls, fractions = [], []
    cases = [Case(name, lambda name=name: calls.append(name), 10) for name in "ab"]
    timings = time_interleaved(cases, 3, fractions.append)
    assert calls == ["a", "b"] * 4
    assert [len(timing.ns) for timing in timings] == [3, 3]
    assert fractions == sorted(fractions) and fractions[-1] == 1.0


def test_a_ratio_is_the_median_of_ratios():
    assert Timing("a", (2.0, 9.0, 4.0)).over(Timing("b", (1.0, 3.0, 4.0))) == 2.0


def test_inputs_with_and_without_magnetometer_are_the_same_motion():
    six, nine = inputs.imu_recording(50), inputs.imu_recording(50, mag=True)
    assert six.mag is None and nine.mag is not None and (six.gyr == nine.gyr).all()


@pytest.mark.compiled
@pytest.mark.parametrize("mag", [False, pytest.param(True, marks=pytest.mark.full)])
def test_every_filter_and_contender_is_timed(mag):
    names = [flt.name for flt in filters.ALL]
    there = [one.name for one in contenders.ALL if one.installed]
    together = batch(mag, 1_000, 1)
    assert [row["case"] for row in together.rows] == ["default", "smoother", *names, *there]
    one_by_one = [row["case"] for row in live(mag, 50, 1).rows]
    assert all(f"Stream({name}), {rows}" in one_by_one for name in names for rows in ("tuples", "NumPy rows"))
    assert ("AxisStream(Kalman)" in one_by_one) is not mag
    for row in together.rows:
        assert ("slower" in row) == (row["case"] in there)


def test_the_machine_names_all_that_took_part():
    assert {"cpu", "python", "levelhead", "numpy", "vqf", "imufusion", "ahrs"} <= set(machine())


@pytest.mark.parametrize("samples, repeats", [(10, 9), (200_000, 0)])
def test_too_little_to_time(samples, repeats):
    with pytest.raises(LevelheadError, match="too few to time anything; expected at least"):
        speed(samples, repeats)
