"""Each symptom is made by a cause that is known, and explained by that cause; clean logs have none."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate
from levelhead.errors import LevelheadError
from levelhead.guard.detectors import GROUP_DELAY
from levelhead.inspection.explain import explain

MOTIONS = ("hand", "walking", "drone", "robot", "still")
SKEW = np.array([0.6, -0.64, 0.48])


@pytest.fixture(scope="module")
def hand():
    return simulate.recording("BMI160", "hand", 90, seed=1, mag="HMC5883L")


def broken(recording, word):
    return simulate.apply_fault(recording, simulate.parse_fault(word)).recording


def only(found, symptom, cause):
    """The one symptom of that name and cause; there is no other."""
    assert [(one.name, one.cause) for one in found.symptoms] == [(symptom, cause)], str(found)
    assert found.exit_code == 1 and found.symptoms[0].what in str(found)
    return found.symptoms[0]


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("mag", ["HMC5883L", None])
def test_clean_logs_have_no_symptom(motion, mag):
    """Each starts with 3 s of rest, which tell the bias."""
    found = explain(simulate.recording("BMI160", motion, 90, seed=3, mag=mag))
    assert found.symptoms == [] and found.exit_code == 0, str(found)
    assert "no symptom" in str(found)


@pytest.mark.slow
def test_a_heading_that_nothing_holds_and_a_bias_that_nobody_could_read():
    """The same sensor and motion, with the rest at its start and without."""
    whole = simulate.recording("MPU-6050", "walking", 90, seed=1)
    assert not [one for one in explain(whole).symptoms if one.name == "drift"]
    one = next(one for one in explain(whole[600:]).symptoms if one.name == "drift")
    assert one.cause == "no_rest" and one.finding == "never_still" and one.size > 4.0
    assert "no magnetometer" in one.why and "1.5 s are needed" in one.why and "5 s at the start" in one.cure


@pytest.mark.parametrize(
    ("word", "cause", "at"), [("gyr_stuck@40+2", "gyr_stuck", 40.2), ("dropped=100@40+2", "gap", 42.0)]
)
def test_heading_that_is_lost_at_once_does_not_drift(word, cause, at):
    """The step of σ was divided by the minutes of the log and called a drift."""
    found = explain(broken(simulate.recording("BMI160", "hand", 90, seed=1), word))
    assert [(one.name, one.cause) for one in found.symptoms] == [("jump", cause), ("drift", cause)], str(found)
    one = found.symptoms[1]
    sigma = np.degrees(found.track.sigma_heading)
    assert one.unit == "deg" and one.at == pytest.approx(at, abs=0.1)
    assert one.size == pytest.approx(np.sqrt(sigma[4500] ** 2 - sigma[3990] ** 2), rel=0.02) and one.size > 60.0
    assert one.what == f"σ of heading grows by {one.size:.0f}° at {one.at:.1f} s" and "a minute" not in str(found)


@pytest.mark.slow
def test_what_drifts_beside_a_step_is_told_without_it():
    found = explain(broken(simulate.recording("MPU-6050", "walking", 90, seed=1)[600:], "gyr_stuck@40+2"))
    drift, lost = [one for one in found.symptoms if one.name == "drift"]
    assert (drift.cause, lost.cause) == ("no_rest", "gyr_stuck")
    assert 4.0 < drift.size < 40.0 and lost.size > 60.0, "50° a minute without the fault, 72 with its step"


@pytest.mark.parametrize(("cause", "value"), [("mag_missing", None), ("mag_refused", 400.0)])
def test_a_magnetometer_that_is_silent_or_refused(cause, value):
    raw = simulate.recording("MPU-6050", "walking", 120, seed=2, mag="HMC5883L")[600:]
    mag = raw.mag.copy()
    mag[2000:9000] = np.nan if value is None else mag[2000:9000] + np.random.default_rng(0).normal(0, value, (7000, 3))
    drifts = [one for one in explain(replace(raw, mag=mag)).symptoms if one.name == "drift"]
    assert [one.cause for one in drifts] == [cause]
    assert 20.0 <= drifts[0].at <= 25.0 or cause == "mag_refused"


def test_a_clipped_gyroscope(hand):
    """At 150 deg/s in a motion that reaches 260."""
    one = only(explain(broken(hand, "gyr_clipping=150@0+90")), "jump", "gyr_clipping")
    assert "clipped at 150 °/s for " in one.why and one.finding == "clipping_gyr" and one.size > 3.0
    most = np.abs(np.degrees(hand.gyr)).max(axis=1)
    assert most[round(one.at * 100)] >= 150.0


def test_spikes(hand):
    """Of 500 deg/s for 10 ms: 5°."""
    made = broken(hand, "gyr_spikes=500@40+5")
    one = only(explain(made), "jump", "gyr_spikes")
    assert one.size == pytest.approx(5.0, abs=0.3) and "500 °/s off" in one.why
    assert np.abs(np.degrees(made.gyr - hand.gyr)).max(axis=1)[round(one.at * 100)] == pytest.approx(500.0)


@pytest.mark.parametrize(
    ("word", "cause", "words"),
    [("dropped=100@40+2", "gap", "no sample for 2 s"), ("gyr_stuck@40+5", "gyr_stuck", "repeats one value")],
)
def test_what_stops(hand, word, cause, words):
    found = explain(broken(hand, word))
    one = only(found, "jump", cause)
    assert words in one.why and 39.0 <= one.at <= 42.1
    if cause == "gap":
        assert one.finding == "gaps" and "gaps" not in {other.name for other in found.others}, "it is told once"


def test_nan(hand):
    gyr = hand.gyr.copy()
    gyr[4000:4100] = np.nan
    found = explain(replace(hand, gyr=gyr))
    assert [(one.name, one.cause) for one in found.symptoms] == [
        ("missing", "missing_readings"),
        ("jump", "gyr_missing"),
    ]
    assert "100 samples, the longest stretch 1 s at 40.0 s" in found.symptoms[0].why
    assert np.isfinite(found.track.quat).all() and "never is NaN" in found.symptoms[0].cure


def test_a_vibration_and_its_line(hand):
    """A sensor that rotates to and fro by 1° (amplitude) at 31 Hz: 0.71° rms.

    The track has x/sin x of it, x = π 31/100, by |1 − s + s exp(−2ix)|, with a share s of the rate before.
    """
    t = hand.t
    gyr = hand.gyr + np.outer(2 * np.pi * 31.0 * np.radians(1.0) * np.cos(2 * np.pi * 31.0 * t), SKEW)
    one = only(explain(replace(hand, gyr=gyr)), "jitter", "vibration")
    x = np.pi * 31.0 / 100.0
    share = 0.5 - GROUP_DELAY * 100.0
    passed = abs(1.0 - share + share * np.exp(-2j * x)) * x / np.sin(x)
    assert one.size == pytest.approx(np.sqrt(0.5) * passed, rel=0.05) and one.finding == "vibration_gyr"
    assert "at 31 Hz" in one.what and "the gyroscope vibrates at 31 Hz" in one.why


def test_a_body_that_shakes_at_no_single_frequency(hand):
    """At 60 °/s the guard takes single rates for spikes. A field that does not shake would contradict the gyroscope."""
    shaken = hand.gyr + np.radians(45.0) * np.random.default_rng(1).standard_normal(hand.gyr.shape)
    (one,) = (one for one in explain(replace(hand, gyr=shaken, mag=None)).symptoms if one.name == "jitter")
    assert one.cause == "shaking" and "the gyroscope itself measures it" in one.why and "ESKF" not in one.cure


def test_a_filter_that_hands_noise_on(hand):
    found = explain(hand, lh.AccelTilt())
    assert ("jitter", "noise") in [(one.name, one.cause) for one in found.symptoms]


@pytest.mark.slow
def test_a_filter_that_takes_acceleration_for_gravity_and_one_of_angles(hand):
    assert {one.cause for one in explain(hand, lh.Complementary()).symptoms} == {"acceleration"}
    assert {one.cause for one in explain(hand, lh.Kalman()).symptoms} == {"near_vertical"}


def test_a_gyroscope_that_comes_late():
    """By 80 ms, in a hand that hurries less: the delay can be told from gravity's turn."""
    hand = simulate.recording("LSM6DSO32", "hand", 120, rate=100, seed=5)
    gravity = Rotation.from_quat(hand.truth.quat, scalar_first=True).inv().apply([0.0, 0.0, 9.80665])
    acc = gravity + 0.3 * (hand.acc - gravity)
    late = lh.Recording(hand.t[8:], hand.gyr[:-8], acc[8:])
    lags = [one for one in explain(late).symptoms if one.name == "lag"]
    assert [one.cause for one in lags] == ["sensor_delay"] and lags[0].finding == "sensor_delay"
    assert 50.0 <= lags[0].size <= 110.0 and lags[0].unit == "ms"


def test_a_filter_that_trails(hand):
    """The smoother's own track, 60 ms later, is late by that."""
    from levelhead.inspection import explain as module

    def slow(recording, params=None, **_):
        track = lh.smooth(recording)
        return replace(track, quat=np.roll(track.quat, 6, axis=0))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "fuse", slow)
        found = module.explain(hand)
    lags = [one for one in found.symptoms if one.name == "lag"]
    assert [one.cause for one in lags] == ["slow_filter"] and lags[0].size == pytest.approx(60.0, abs=5.0)


def test_too_short(hand):
    with pytest.raises(LevelheadError, match=r"4\.99 s long; expected 10 s"):
        explain(hand[:500])


def test_turns_that_the_filter_says_it_missed_are_told():
    from types import SimpleNamespace

    from levelhead.filters import health
    from levelhead.inspection.symptoms.missing import find_turns_missed

    def evidence(stretches):
        runs = {health.TURN_MISSED: stretches}
        return SimpleNamespace(runs=runs.__getitem__, t=0.01 * np.arange(1000), track=SimpleNamespace(name="ESKF"))

    assert not list(find_turns_missed(evidence([])))
    assert not list(find_turns_missed(evidence([(100, 120)])))
    (one,) = find_turns_missed(evidence([(100, 120), (300, 501)]))
    assert one.cause == "turn_missed"
    assert one.size == pytest.approx(2.19)
    assert one.at == pytest.approx(3.0)


def test_one_more_symptom_is_one_entry(hand, monkeypatch, tmp_path):
    """The report, the picture and the docs' table follow."""
    import runpy
    from pathlib import Path

    from levelhead.inspection import symptoms
    from levelhead.inspection.symptom import Symptom, SymptomKind

    def find(evidence):
        yield Symptom("wobble", 2.0, "deg", "it wobbles by 2°", "loose", "a screw is loose", "Tighten it.", at=5.0)

    wobble = SymptomKind("wobble", "deg", "the wobble", "1°", "does not wobble", "#123456", find, spectrum="acc")
    monkeypatch.setattr(symptoms, "ALL", (*symptoms.ALL, wobble))
    found = explain(hand)
    assert only(found, "wobble", "loose").size == 2.0
    assert "it wobbles by 2°: a screw is loose. Tighten it." in str(found)
    assert "does not lag, does not wobble" in str(replace(found, symptoms=()))
    pytest.importorskip("matplotlib", reason="matplotlib is not installed (extra levelhead[plot])")
    from levelhead.publish.plots.explanation_panels import explanation_picture

    explanation_picture(found, tmp_path / "wobble.svg")
    assert "#123456" in (tmp_path / "wobble.svg").read_text(encoding="utf-8")
    made = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "generate.py"))
    assert "| wobble | deg | the wobble | 1° |" in made["BLOCKS"]["symptoms"]()
