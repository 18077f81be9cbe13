"""Pictures: the geometry under them exactly, and every picture drawn once, also for hard data."""

import sys
import tracemalloc

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead.engine import fuse
from levelhead.engine.calibration_history import calibration_history
from levelhead.errors import LevelheadError
from levelhead.evaluate import compare
from levelhead.filters import ESKF, AccelTilt, Complementary, GyroIntegration, Kalman, RollPitchKalman, health
from levelhead.publish.plots import (
    calibration_picture,
    case_picture,
    curves,
    gain_picture,
    lesson_picture,
    sweep_picture,
    track_picture,
)
from levelhead.publish.plots.angles import euler_of, euler_sigma, most_active_axis, unwrap, wrap_degrees
from levelhead.publish.plots.calibration_panels import _finding as _learned_finding
from levelhead.publish.plots.curves import envelope, envelope_of, flagged_ranges, groups
from levelhead.publish.plots.orientation import _courses, _events, _finding
from levelhead.recording import Recording, Truth
from levelhead.simulate import hard_lesson, lesson, recording
from levelhead.track import Track
from levelhead.tune import find_convergence, sweep

PNG = b"\x89PNG\r\n\x1a\n"


def test_short_signals_are_drawn_as_they_are():
    t, y = np.arange(5.0), np.array([1.0, 2.0, 0.0, 5.0, 3.0])
    x, line = envelope(t, y)
    np.testing.assert_array_equal(x, t)
    np.testing.assert_array_equal(line, y)


def test_nan_gaps_and_wraps_break_the_line():
    t = np.array([0.0, 1, 2, 3, 4, 5, 50, 51])
    y = np.array([170.0, 179, -179, np.nan, -170, -160, -150, -140])
    x, line = envelope(t, y, period=360.0)
    assert np.isnan(line).sum() == 3  # the wrap, the NaN, the gap of 45 s
    np.testing.assert_array_equal(line[np.isfinite(line)], y[np.isfinite(y)])
    np.testing.assert_array_equal(np.isnan(x), np.isnan(line))
    assert np.isnan(envelope(t, y)[1]).sum() == 2  # on a line −179 after 179 is no wrap


def test_no_line_crosses_the_wrap_after_thinning():
    t = np.linspace(0.0, 100.0, 200_000)
    x, line = envelope(t, wrap_degrees(360.0 * t / 7.0 + 5.0 * np.random.default_rng(0).standard_normal(len(t))), 360.0)
    assert np.nanmax(np.abs(np.diff(line))) <= 180.0
    assert len(x) == len(line)


def test_thinning_keeps_every_spike_and_few_points():
    rng = np.random.default_rng(1)
    t = np.arange(500_000) * 0.001
    y = rng.standard_normal(len(t))
    y[123_456], y[400_001] = 50.0, -60.0
    x, line = envelope(t, y)
    assert len(line) <= 2 * 1202
    assert (line.max(), line.min()) == (50.0, -60.0)
    assert (np.diff(x) >= 0).all()
    assert abs(x[line.argmax()] - 123.456) < 0.5


def test_a_line_in_stretches_is_the_line(monkeypatch):
    t = np.arange(100_000) * 0.01
    t[50_000:] += 5.0
    y = wrap_degrees(np.cumsum(np.random.default_rng(4).standard_normal(len(t))))
    y[[20_000, 30_001]] = np.nan  # the former is where two stretches meet
    monkeypatch.setattr(curves, "STRETCH", 10_000)
    x, line = envelope_of(t, lambda rows: y[rows])
    whole_x, whole = envelope(t, y)
    assert len(line) < 1.1 * len(whole) and (np.diff(x[np.isfinite(x)]) >= 0.0).all()
    assert np.isnan(line).sum() == np.isnan(whole).sum() == 3  # two NaN and the gap
    assert (np.nanmin(line), np.nanmax(line)) == (np.nanmin(whole), np.nanmax(whole))
    assert (x[0], x[-1]) == (whole_x[0], whole_x[-1])


@pytest.mark.slow
def test_a_picture_takes_a_few_bytes_of_a_sample(tmp_path, monkeypatch):
    monkeypatch.setattr(curves, "STRETCH", 10_000)
    n = 300_000
    rec = Recording(np.arange(n) * 0.01, np.zeros((n, 3)), np.tile([0.0, 0.0, 9.81], (n, 1)))
    track = Track(rec.t, np.tile([1.0, 0, 0, 0], (n, 1)), np.zeros((n, 3)), np.full((n, 3), 0.01))
    track_picture(rec, track, tmp_path / "first.png")  # what is imported stays
    tracemalloc.start()
    track_picture(rec, track, tmp_path / "track.png")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30 * n + 12_000_000  # and the page itself; all angles at a time were 150 bytes of a sample


def test_groups_of_nothing():
    assert len(groups(np.arange(3.0), np.full(3, np.nan)).rows) == 0
    assert envelope(np.arange(1.0), np.array([4.0]))[1].tolist() == [4.0]


def test_runs():
    assert flagged_ranges(np.array([True, True, False, True])) == [(0, 1), (3, 3)]
    assert flagged_ranges(np.zeros(3, bool)) == []


def test_euler_angles_are_scipys():
    rotation = Rotation.random(50, rng=np.random.default_rng(2))
    got = euler_of(np.arange(50.0), rotation.as_quat(scalar_first=True))
    np.testing.assert_allclose(got, rotation.as_euler("ZYX", degrees=True)[:, ::-1], atol=1e-9)


@pytest.mark.parametrize(("axis", "letter"), [(0, "X"), (1, "Y"), (2, "Z")])
def test_the_busiest_angle(axis, letter):
    t = np.arange(300) * 0.01
    quat = Rotation.from_euler(letter, np.sin(t)[:, None]).as_quat(scalar_first=True)
    quat[3] = np.nan
    assert most_active_axis(euler_of(t, quat)) == axis


def test_sigma_of_euler_angles_by_monte_carlo():
    rng = np.random.default_rng(3)
    sigma = np.radians([0.2, 0.4, 0.3])
    middle = Rotation.from_euler("ZYX", [0.8, 0.6, -0.4])
    quat = np.tile(middle.as_quat(scalar_first=True), (2, 1))
    want = euler_sigma(Track([0.0, 1.0], quat, sigma=np.tile(sigma, (2, 1))))
    cloud = (Rotation.from_rotvec(sigma * rng.standard_normal((100_000, 3))) * middle).as_euler("ZYX", degrees=True)
    np.testing.assert_allclose(want[0], cloud.std(axis=0)[::-1], rtol=0.02)
    assert euler_sigma(Track([0.0], [[1.0, 0, 0, 0]])) is None


def test_unrolled_is_one_line_unless_it_spins():
    turn = np.linspace(0.0, 500.0, 1000)
    np.testing.assert_allclose(unwrap(wrap_degrees(turn)), turn, atol=1e-9)
    spin = wrap_degrees(np.linspace(0.0, 5000.0, 1000))
    np.testing.assert_array_equal(unwrap(spin), spin)


def test_rest_is_an_event_but_no_fault():
    bits = np.array([health.AT_REST, health.AT_REST | health.GAP, health.MAG_REJECTED, 0], np.uint32)
    track = Track(np.arange(4.0), np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)), health=bits)
    assert [(event.fault, event.spans) for event in _events(track)] == [
        (True, [(1, 1)]), (True, [(2, 2)]), (False, [(0, 1)]),
    ]  # fmt: skip
    resting = Track([0.0], [[1.0, 0.0, 0.0, 0.0]], health=bits[:1])
    rec = Recording(track.t, np.zeros((4, 3)), np.tile([0.0, 0.0, 9.81], (4, 1)))
    said = [_finding(one, _courses(rec[: len(one)], one)) for one in (resting, track)]
    assert said[0].endswith("no sample was bad") and "bad" not in said[1]


FILTERS = [GyroIntegration, AccelTilt, Complementary, Kalman(r_measure=4), RollPitchKalman]


@pytest.fixture(scope="module")
def cases():
    return {"lesson": compare(lesson(42), FILTERS), "hard lesson": compare(hard_lesson(42), FILTERS)}


def is_png(path) -> bool:
    return path.read_bytes().startswith(PNG) and path.stat().st_size > 10_000


@pytest.mark.slow
def test_the_lessons_pictures(cases, tmp_path):
    loaded = "matplotlib.pyplot" in sys.modules  # a peer's package in another test of this worker may load it
    lesson_picture(cases["lesson"], tmp_path / "four.png")
    case_picture(cases, tmp_path / "cases.png")
    assert is_png(tmp_path / "four.png")
    assert is_png(tmp_path / "cases.png")
    assert len(list(tmp_path.iterdir())) == 2
    assert ("matplotlib.pyplot" in sys.modules) == loaded


@pytest.mark.slow
def test_tuning_pictures(tmp_path):
    short = lesson(42)[:1000]
    sweep_picture(sweep(short, Complementary, "alpha", [0.9, 0.95, 0.99]), tmp_path / "alpha.svg")
    sweep_picture(sweep(short, Kalman, "r_measure", [0.1, 1.0, 10.0, 100.0]), tmp_path / "r.pdf")
    t = np.arange(1000) * 0.01
    gains = np.stack([1 + np.exp(-t), 2 + np.exp(-2 * t)], axis=1)
    gain_picture(t, gains, find_convergence(t, gains), tmp_path / "gains.png")
    gain_picture(t, gains[:, 0], find_convergence(t, gains[:, 0]), tmp_path / "gain.png")
    assert (tmp_path / "alpha.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF")
    assert is_png(tmp_path / "gains.png")


@pytest.fixture(scope="module")
def torn():
    """Fast motion through ±180° and ±90° with a gap, missing samples, and truth that is blind for a while."""
    whole = recording("MPU-6050", "hand", duration=20.0, rate=100.0)
    keep = np.ones(len(whole), bool)
    keep[700:900] = False
    gyr, acc, quat = whole.gyr.copy(), whole.acc.copy(), whole.truth.quat.copy()
    gyr[1200:1240], acc[::97], quat[400:500] = np.nan, np.nan, np.nan
    truth = Truth(quat[keep], None, None, north=False)
    return Recording(whole.t[keep], gyr[keep], acc[keep], None, truth)


@pytest.mark.slow
def test_hard_data_draws_too(torn, tmp_path):
    lesson_picture(compare(torn, [Complementary, Kalman, Kalman(r_measure=9)]), tmp_path / "four.png")
    track_picture(torn, fuse(torn, Kalman), tmp_path / "kalman.png")
    track_picture(torn, fuse(torn, Complementary), tmp_path / "complementary.png")
    assert all(is_png(path) for path in tmp_path.iterdir())


@pytest.mark.slow
def test_the_smallest_track_draws(tmp_path):
    one = Recording([0.0], np.zeros((1, 3)), [[0.0, 0.0, 9.8]])
    track_picture(one, fuse(one, Kalman), tmp_path / "one.png")
    assert is_png(tmp_path / "one.png")


@pytest.mark.slow
def test_what_cannot_be_drawn_is_said(cases, tmp_path, monkeypatch):
    blind = compare(Recording(np.arange(9) * 0.01, np.zeros((9, 3)), np.tile([0.0, 0, 9.8], (9, 1))), [Kalman])
    with pytest.raises(LevelheadError, match="track_picture"):
        lesson_picture(blind, tmp_path / "four.png")
    with pytest.raises(LevelheadError, match="no true orientation"):
        case_picture({"blind": blind}, tmp_path / "cases.png")
    with pytest.raises(LevelheadError, match="did you mean 'png'"):
        case_picture(cases, tmp_path / "cases.pgn")
    with pytest.raises(LevelheadError, match="no folder"):
        case_picture(cases, tmp_path / "missing" / "cases.png")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(LevelheadError, match=r"pip install 'levelhead\[plot\]'"):
        case_picture(cases, tmp_path / "cases.png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("mag", [None, "HMC5883L"])
def test_the_learned_picture(tmp_path, mag):
    rec = recording("LSM6DSO32", "hand", duration=5.0, mag=mag)
    course = calibration_history(rec, ESKF())
    calibration_picture(course, tmp_path / "learned.png")
    assert (tmp_path / "learned.png").read_bytes().startswith(PNG)
    asked = 24 if mag else 15
    known = sum(int(getattr(course.known[-1], name).known.sum()) for name in ("gyr_matrix", "gyr_bias", "acc_bias"))
    known += (
        0
        if mag is None
        else int(sum(getattr(course.known[-1], name).known.sum() for name in ("mag_offset", "soft_iron", "mag_delay")))
    )
    assert _learned_finding(course) == f"{known} of the sensor's {asked} errors are known from this motion"
    calibration_picture(calibration_history(rec[:1], ESKF(scale_start=0.0, acc_bias=0.0)), tmp_path / "one.svg")


def test_a_filter_with_many_parameters_leaves_room_for_its_panel(tmp_path):
    """Three columns of 12.5 inches, as `levelhead stress` draws: the label beside a panel takes less than the panel."""
    from levelhead.publish.plots.chart import draw
    from levelhead.publish.plots.picture import Line, Panel, Picture
    from levelhead.publish.plots.stress import MAX_LABEL, short

    label = short("EKF(gyr_noise=0.0338138, bias_walk=0.00168052)")
    assert label == "EKF(…)" and len(label) <= MAX_LABEL
    assert short("imufusion.Ahrs") == "imufusion.Ahrs"
    line = Line(np.arange(3.0), np.arange(3.0), "#000000", 1.0, label)
    draw(
        Picture("errors", [Panel("", "error [°]", [line], (0.0, 2.0))] * 3, (0.0, 2.0), 12.5, 2.5, 3),
        tmp_path / "a.png",
    )
    assert (tmp_path / "a.png").stat().st_size > 1000
