"""The live loop: what it takes, what it refuses, what can be changed while it runs."""

import math

import numpy as np
import pytest
from tests.reference.engines import EVERY_ENGINE, NATIVE

import levelhead as lh
from levelhead.guard.detectors import GROUP_DELAY

LEVEL = ((0.0, 0.0, 0.0), (0.0, 0.0, 9.81))


@EVERY_ENGINE
@pytest.mark.parametrize("kind", [tuple, list, np.array, lambda v: np.array(v, np.float32)])
def test_any_triple_is_taken(engine, kind):
    live = lh.Stream(lh.EKF(), engine=engine)
    for _ in range(3):
        quat = live.update(gyr=kind((0.25, 0.5, 0.0)), acc=kind((0.0, 1.0, 9.5)), mag=kind((1.0, 19.0, -45.0)), dt=0.01)
    reference = lh.Stream(lh.EKF(), engine="python")
    for _ in range(3):
        expected = reference.update((0.25, 0.5, 0.0), (0.0, 1.0, 9.5), (1.0, 19.0, -45.0), 0.01)
    assert tuple(quat) == tuple(expected)
    assert math.degrees(live.euler.roll) == pytest.approx(6.0, abs=1.0)


@EVERY_ENGINE
@pytest.mark.parametrize("bad", [(1.0, 2.0), np.zeros(2), np.zeros((3, 1)), "abc", 3.0, (1.0, None, 2.0), np.zeros(4)])
def test_what_is_no_row_is_refused_and_not_taken(engine, bad):
    live = lh.Stream(lh.EKF(), engine=engine)
    live.update(*LEVEL, dt=0.01)
    before = live.numbers
    with pytest.raises(lh.LevelheadError, match="(?s)gyr is .*; it must be three numbers in rad/s"):
        live.update(bad, LEVEL[1], dt=0.01)
    with pytest.raises(lh.LevelheadError, match="mag is"):
        live.update(*LEVEL, bad, dt=0.01)
    assert live.numbers == before


ROWS = {
    "columns of a wider array": lambda values: np.ascontiguousarray(np.hstack([values, values]))[:, 3:],
    "every other row backwards": lambda values: np.repeat(values, 2, axis=0)[::-2][::-1],
    "Fortran order": np.asfortranarray,
    "big endian": lambda values: values.astype(">f8"),
}


@EVERY_ENGINE
@pytest.mark.parametrize("layout", ROWS.values(), ids=ROWS)
def test_rows_of_any_array_are_taken(engine, layout):
    recording = lh.simulate.recording("ICM-20948", "walking", 1.0, seed=3)
    live, expected = lh.Stream(lh.EKF(), engine=engine), lh.Stream(lh.EKF(), engine=engine)
    for gyr, acc in zip(layout(recording.gyr), layout(recording.acc), strict=True):
        quat = live.update(gyr, acc, dt=0.01)
    for gyr, acc in zip(recording.gyr.tolist(), recording.acc.tolist(), strict=True):
        wanted = expected.update(tuple(gyr), tuple(acc), dt=0.01)
    assert quat == wanted


@EVERY_ENGINE
@pytest.mark.parametrize("stamped", [False, True])
@pytest.mark.parametrize("with_mag", [False, True])
def test_rows_at_once_are_updates_one_by_one(engine, stamped, with_mag):
    """In parts of 1, 7 and 92 samples, among them missing readings and a gap; then one by one again."""
    recording = lh.simulate.recording("ICM-20948", "walking", 1.0, seed=5, mag="AK09916")
    gyr, acc, t = np.array(recording.gyr), np.array(recording.acc), np.array(recording.t)
    mag = np.array(recording.mag) if with_mag else None
    gyr[50], acc[60:62], t[70:] = math.nan, math.nan, t[70:] + 1.0
    dt = np.diff(t, prepend=t[0] - 1.0)
    rows, single = lh.Stream(lh.EKF(), engine=engine), lh.Stream(lh.EKF(), engine=engine)
    quats = []
    for part in (slice(0, 1), slice(1, 8), slice(8, 100)):
        field = None if mag is None else mag[part]
        given = {"t": t[part]} if stamped else {"dt": dt[part]}
        quats.append(rows.update_rows(gyr[part], acc[part], field, **given))
    for i in range(100):
        given = {"t": t[i]} if stamped else {"dt": float(dt[i])}
        quat = single.update(gyr[i], acc[i], None if mag is None else mag[i], **given)
        assert tuple(np.concatenate(quats)[i]) == quat
    assert rows.save() == single.save()


@EVERY_ENGINE
def test_rows_that_are_refused_leave_the_stream_as_it_was(engine):
    live = lh.Stream(lh.EKF(), engine=engine)
    live.update(*LEVEL, t=1.0)
    before, gyr, acc = live.save(), np.zeros((3, 3)), np.full((3, 3), 5.0)
    refused = [
        ({"gyr": gyr[0], "acc": acc, "dt": 0.01}, r"gyr has the shape \(3,\); it must be \(n, 3\) numbers in rad/s"),
        ({"gyr": gyr, "acc": acc[:2], "dt": 0.01}, r"acc has the shape \(2, 3\); it must be \(3, 3\)"),
        ({"gyr": gyr, "acc": acc}, "update_rows needs dt .* or t"),
        ({"gyr": gyr, "acc": acc, "dt": 0.01, "t": [1.0, 2.0, 3.0]}, "update_rows needs dt .* or t"),
        ({"gyr": gyr, "acc": acc, "dt": [0.01, 0.01]}, "dt has another length than gyr: expected 3 numbers"),
        ({"gyr": gyr, "acc": acc, "dt": [0.01, math.nan, 0.01]}, "row 1 comes nan s after the one before"),
        ({"gyr": gyr, "acc": acc, "t": [2.0, 3.0, 3.0]}, "row 2 comes 0.0 s after the one before"),
        ({"gyr": gyr, "acc": acc, "t": [1.0, 3.0, 4.0]}, "row 0 comes 0.0 s after the one before"),
        ({"gyr": [["a", "b", "c"]], "acc": acc, "dt": 0.01}, "gyr has the shape"),
    ]
    for given, sentence in refused:
        with pytest.raises(lh.LevelheadError, match=sentence):
            live.update_rows(**given)
        assert live.save() == before
    assert live.update_rows(gyr[:0], acc[:0], dt=0.01).shape == (0, 4)
    assert live.save() == before


@EVERY_ENGINE
@pytest.mark.parametrize("dt", [0.0, -0.01, math.nan, math.inf])
def test_a_bad_dt_is_refused_and_the_sample_not_taken(engine, dt):
    live = lh.Stream(lh.EKF(), engine=engine)
    live.update(*LEVEL, dt=0.01)
    before = live.quat
    with pytest.raises(lh.LevelheadError, match="dt is .*; it must be the seconds since the last sample"):
        live.update((1.0, 1.0, 1.0), (1.0, 2.0, 3.0), dt=dt)
    assert live.quat == before
    axis = lh.AxisStream(engine=engine)
    with pytest.raises(lh.LevelheadError, match="dt is"):
        axis.update(1.0, 1.0, dt)
    assert axis.angle == 0.0


def test_time_must_be_given_and_go_forward():
    live = lh.Stream(engine="python")
    with pytest.raises(lh.LevelheadError, match="update needs dt"):
        live.update(*LEVEL)
    live.update(*LEVEL, t=10.0)
    for bad, words in ((9.0, "stamps must increase"), (10.0, "stamps must increase"), (math.nan, "t is nan")):
        with pytest.raises(lh.LevelheadError, match=words):
            live.update(*LEVEL, t=bad)
    with pytest.raises(lh.LevelheadError, match="gyr is"):
        live.update((1.0, 2.0), LEVEL[1], t=10.5)
    live.update((0.1, 0.0, 0.0), (0.0, 0.0, 0.0), t=10.1)  # the refused ones left no trace: dt is 0.1
    assert live.euler.roll == pytest.approx(0.01 * (0.5 + GROUP_DELAY / 0.1))  # a mean of 0 and 0.1 rad/s
    assert live.health == 0


@EVERY_ENGINE
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize("sensor", [0, 1, 2])
def test_nonsense_readings_are_bridged_and_said(engine, bad, sensor):
    live = lh.Stream(lh.EKF(), engine=engine)
    sample = [(0.1, 0.0, 0.0), (0.0, 0.0, 9.81), (0.0, 19.0, -45.0)]
    for _ in range(5):
        live.update(*sample, dt=0.01)
    sample[sensor] = (0.0, bad, 0.0)
    quat = live.update(*sample, dt=0.01)
    assert all(math.isfinite(x) for x in quat)
    assert live.health == 1 << sensor


@EVERY_ENGINE
def test_the_habit_of_the_arduino_class(engine):
    """setAngle, getAngle(newAngle, newRate, dt), getRate, and Q and R on the fly, against the textbook recurrence."""
    kalman = lh.AxisStream(lh.Kalman(p_angle=0.0, p_bias=0.0), engine=engine)
    kalman.angle = 10.0
    x, bias, p = 10.0, 0.0, np.zeros((2, 2))
    r = 0.03
    for i in range(200):
        if i == 100:
            kalman.set(r_measure=0.5)
            r = 0.5
        z, u, dt = 10.0 + math.sin(i), 0.5, 0.01
        got = kalman.update(z, u, dt)
        free = u - bias
        x += dt * free
        f = np.array([[1, -dt], [0, 1]])
        p = f @ p @ f.T + np.diag([0.001, 0.003]) * dt
        k = p[:, 0] / (p[0, 0] + r)
        y = z - x
        x, bias, p = x + k[0] * y, bias + k[1] * y, p - np.outer(k, p[0])
        assert got == pytest.approx(x, rel=1e-12)
        assert kalman.rate == pytest.approx(free, rel=1e-9)
        assert kalman.bias == pytest.approx(bias, rel=1e-9, abs=1e-15)
    assert kalman.report.gain_level == pytest.approx(k[0])
    assert kalman.report.innovation == pytest.approx(y)
    assert kalman.params.r_measure == 0.5


@EVERY_ENGINE
def test_a_bad_pair_is_refused_and_not_taken(engine):
    kalman = lh.AxisStream(lh.Kalman(), angle=5.0, engine=engine)
    for pair in ((math.nan, 0.0), (0.0, math.inf)):
        with pytest.raises(lh.LevelheadError, match="must be a finite number"):
            kalman.update(*pair, 0.01)
    assert kalman.angle == 5.0
    with pytest.raises(lh.LevelheadError, match="did you mean 'r_measure'"):
        kalman.set(r_mesure=1.0)
    with pytest.raises(lh.LevelheadError, match="period"):
        lh.AxisStream(period=-1.0)


@EVERY_ENGINE
def test_angles_wrap(engine):
    kalman = lh.AxisStream(lh.Kalman(), angle=179.0, engine=engine)
    for _ in range(50):
        angle = kalman.update(-179.0, 0.0, 0.01)
    assert 178.9 < abs(angle) <= 180.0


@pytest.mark.parametrize("engine", ["python", NATIVE])
def test_parameters_change_on_the_fly_and_reset_forgets(engine):
    live = lh.Stream(lh.Complementary(tau=100.0), engine=engine)
    for _ in range(20):
        live.update((0.0, 0.0, 0.0), (0.0, 0.0, 9.81), dt=0.01)
    live.set(alpha=0.0)
    live.update((0.0, 0.0, 0.0), (0.0, 9.81, 9.81), dt=0.01)
    assert math.degrees(live.euler.roll) == pytest.approx(45.0)
    live.reset()
    live.update((0.0, 0.0, 0.0), (0.0, 0.0, 9.81), dt=0.01)
    assert live.euler.roll == 0.0
    assert live.params.alpha == 0.0 and live.bias == (0.0, 0.0, 0.0)
    assert lh.Stream(lh.Complementary(), guard=None, engine=engine).bias is None


@pytest.mark.compiled
def test_all_that_is_said_at_once_is_what_is_said_one_by_one():
    stream = lh.Stream()
    for i in range(50):
        quat = stream.update((0.01, 0.0, 0.02), (0.0, 0.1 * (i % 3), 9.8), dt=0.01)
    said = stream.output
    assert said == (stream.quat, stream.bias, stream.sigma, stream.health) and said.quat == quat
    assert stream.numbers == (*said.quat, *said.bias, *said.sigma, said.health)
