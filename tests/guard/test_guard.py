"""The guard: every detector and gate alone, against signals whose truth is known."""

import math
from typing import NamedTuple

import numpy as np
import pytest

import levelhead as lh
from levelhead.engine import binding
from levelhead.engine.driver import Settings
from levelhead.filters import health
from levelhead.filters.contract import Filter, Output, Settling
from levelhead.filters.parameters import param_table
from levelhead.guard import GuardState, rest
from levelhead.guard.detectors import GROUP_DELAY
from levelhead.kernels.quat import IDENTITY
from levelhead.kernels.vec3 import ZERO, Vec3

G = 9.80665
UP = Vec3(0.0, 0.0, G)
FIELD = Vec3(0.0, 19.0, -45.0)


def vec(v):
    return Vec3(*map(float, v))


class Own(NamedTuple):
    """What a filter would take away by itself."""

    own: Vec3


class Saw(NamedTuple):
    """What it was shown last."""

    own: Vec3
    gyr: Vec3
    acc: Vec3
    mag: Vec3


class Shown(NamedTuple):
    """A sample as the filter saw it, and what is known about it."""

    gyr: Vec3
    acc: Vec3
    mag: Vec3
    health: int
    guard: GuardState


LEVEL = Filter(
    name="Level",
    params=Own,
    init=lambda params, gyr, acc, mag: Saw(params.own, gyr, acc, mag),
    step=lambda params, state, gyr, acc, mag, dt: Saw(params.own, gyr, acc, mag),
    output=lambda params, state: Output(IDENTITY, params.own, ZERO, 0),
    estimates=frozenset({"sigma"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="",
    settles=Settling(0.0, 0.0),
)


def watched(gyr, acc=None, mag=None, rate=100.0, params=None, own=ZERO):
    """Every sample as a filter sees it that is always level, for rows of readings."""
    driver = binding.bind(LEVEL)
    settings = Settings(Own(own), params or lh.Guard())
    carry = driver.begin(settings)
    looks = []
    for k in range(len(gyr)):
        force = UP if acc is None else vec(acc[k])
        field = ZERO if mag is None else vec(mag[k])
        carry = driver.advance(settings, carry, vec(gyr[k]), force, field, 1.0 / rate)
        state, found, kept, _ = carry.run
        looks.append(Shown(state.gyr, state.acc, state.mag, found, kept))
    return looks


def said(looks, bit):
    return np.array([look.health & bit != 0 for look in looks])


def at_rest(n, bias=(0.0, 0.0, 0.0), seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(0, 0.002, (n, 3)) + bias, rng.normal(0, 0.05, (n, 3)) + [0, 0, G]


@pytest.mark.parametrize("rest_time", [0.5, 1.5, 4.0])
def test_rest_is_said_after_its_time(rest_time):
    looks = watched(*at_rest(1000), params=lh.Guard(rest_time=rest_time))
    first = int(np.argmax(said(looks, health.AT_REST)))
    assert rest_time * 20 <= first <= rest_time * 100


def test_a_rest_after_the_first_motion_takes_all_of_its_time():
    """A smooth turn about the vertical may be as quiet as a sensor on a table."""
    gyr, acc = at_rest(1000)
    gyr[400:420, 2] += 0.5
    rest = said(watched(gyr, acc), health.AT_REST)
    assert 30 <= np.argmax(rest) <= 150 and rest[399]
    assert not rest[400:570].any() and rest[-1]


@pytest.mark.parametrize("bias", [0.02, 0.09, 0.2])
def test_a_large_bias_is_read_off_from_the_first_rest_on(bias):
    """The first mean counts whole, or the next would be too far from what is known and taken for a turn."""
    looks = watched(*at_rest(600, bias=(0.0, bias, 0.0)))
    rest = said(looks, health.AT_REST)
    first = int(np.argmax(rest))
    assert rest[first:].all()
    for look in looks[first:]:
        assert look.guard.rest.bias.y == pytest.approx(bias, abs=2e-3)
    assert said(looks, health.AT_REST)[first:].all()


def test_a_tap_ends_rest():
    gyr, acc = at_rest(1000)
    acc[500, 0] += 2.0
    rest = said(watched(gyr, acc), health.AT_REST)
    assert rest[499] and not rest[502:600].any() and rest[800:].all()


@pytest.mark.parametrize("hertz", [0.2, 1.0, 3.0])
def test_slow_motion_is_no_rest(hertz):
    """A hand that turns by ±4 °/s and more: its mean rate is zero, but it does not stay there."""
    gyr, acc = at_rest(2000)
    gyr[:, 1] += math.radians(6.0) * np.sin(2 * np.pi * hertz * np.arange(2000) / 100)
    assert not said(watched(gyr, acc), health.AT_REST).any()


@pytest.mark.slow
def test_rest_is_no_lie_on_a_real_hand(data_dir):
    recording = lh.read(data_dir / "broad" / "05_undisturbed_slow_rotation_with_breaks_B.mat")
    track = lh.fuse(recording)
    rest = (track.health & health.AT_REST) != 0
    assert rest[~recording.truth.moving].mean() > 0.3, "its breaks are rests"
    q = recording.truth.quat
    turned = 2.0 * np.arccos(np.clip(np.abs((q[286:] * q[:-286]).sum(axis=1)), 0.0, 1.0))  # rad in a second
    known = np.isfinite(turned) & rest[286:]
    assert np.degrees(np.percentile(turned[known], 99)) < 2.0


def test_the_bias_is_read_off_as_the_mean_of_rest():
    """Its error is that of a mean of so many samples; what the filter itself takes away is not taken twice."""
    bias = np.radians([1.5, -2.0, 0.7])
    own = np.radians([0.5, 0.0, 0.0])
    n = 2500
    for taken in (np.zeros(3), own):
        gyr, acc = at_rest(n, bias)
        looks = watched(gyr, acc, own=vec(taken))
        found = np.array(looks[-1].guard.rest.bias) + taken
        samples = min(rest.BIAS_TIME * 100 * 2, n)
        share = 0.5 - GROUP_DELAY * 100.0
        np.testing.assert_allclose(found, bias, atol=4 * 0.002 / math.sqrt(samples) + 2e-4)
        np.testing.assert_allclose(looks[-1].gyr, gyr[-1] - share * (gyr[-1] - gyr[-2]) - found + taken, atol=1e-12)


@pytest.mark.parametrize(("rate", "is_rest"), [(12.0, True), (18.0, False)])
def test_a_turn_beyond_the_limit_is_no_bias(rate, is_rest):
    gyr, acc = at_rest(1000, np.radians([0.0, 0.0, rate]))
    looks = watched(gyr, acc)
    assert said(looks, health.AT_REST)[-1] == is_rest
    assert (np.linalg.norm(looks[-1].guard.rest.bias) > 0.0) == is_rest


RATES = pytest.mark.parametrize("rate", [100.0, 286.0, 1000.0])


@RATES
@pytest.mark.parametrize("both", [1.0, 0.97], ids=["symmetric", "calibrated"])
def test_clipping_is_found_and_then_said_at_every_sample(rate, both):
    """A hand that shakes at 2 Hz with 12 rad/s, and a full scale of 250 °/s, less at one end after calibration."""
    full = math.radians(250.0)
    t = np.arange(int(4 * rate)) / rate
    gyr, _ = at_rest(len(t))
    gyr[:, 0] += 12.0 * np.sin(2 * np.pi * 2.0 * t)
    gyr[:, 0] = np.clip(gyr[:, 0], -both * full, full)
    clipped = (gyr[:, 0] == full) | (gyr[:, 0] == -both * full)
    found = said(watched(gyr, rate=rate), health.GYR_SATURATED)
    later = t > 1.0
    np.testing.assert_array_equal(found[later & clipped], True)
    assert (np.abs(gyr[found, 0]) > 0.985 * both * full).all()


@RATES
@pytest.mark.parametrize("hertz", [0.5, 1.0, 2.0, 5.0])
def test_smooth_peaks_are_no_full_scale(rate, hertz):
    t = np.arange(int(6 * rate)) / rate
    gyr, _ = at_rest(len(t), seed=int(10 * hertz))
    gyr[:, 1] += 10.0 * np.sin(2 * np.pi * hertz * t) * (1.0 + 0.1 * np.sin(0.7 * t))
    assert not said(watched(gyr, rate=rate), health.GYR_SATURATED).any()


def test_a_full_scale_that_is_known_is_said_at_once():
    gyr, acc = at_rest(30)
    gyr[10], acc[20] = [0, -math.radians(500.0), 0], [0, 0, 4 * G]
    looks = watched(gyr, acc, params=lh.Guard(gyr_range=500.0, acc_range=4 * G))
    assert np.flatnonzero(said(looks, health.GYR_SATURATED)).tolist() == [10]
    assert np.flatnonzero(said(looks, health.ACC_SATURATED)).tolist() == [20]
    assert looks[20].acc == pytest.approx((0.0, 0.0, 4 * G), abs=0.1)


def test_a_turntable_that_starts_abruptly_is_taken_for_full_scale_unless_that_is_known():
    """A jump from rest to one steady rate beyond 250 °/s: no reading can tell it from a clip. ``gyr_range`` can."""
    gyr, _ = at_rest(600)
    gyr[200:, 2] += 6.0
    assert said(watched(gyr), health.GYR_SATURATED)[210:].any()
    assert not said(watched(gyr, params=lh.Guard(gyr_range=2000.0)), health.GYR_SATURATED).any()
    gyr, _ = at_rest(600)
    gyr[200:, 2] += 6.0 * np.minimum(np.arange(400) / 200.0, 1.0)  # two seconds to its speed
    assert not said(watched(gyr), health.GYR_SATURATED).any()


@pytest.mark.parametrize("axis", range(3))
def test_a_stuck_axis_is_said_after_a_second(axis):
    gyr, acc = at_rest(500)
    gyr[100:400, axis] = 0.3
    bits = said(watched(gyr, acc), health.GYR_STUCK)
    assert np.flatnonzero(bits).tolist() == list(range(201, 400))
    looks = watched(*at_rest(500)[:1], acc=np.where(np.arange(500)[:, None] > 99, [1.0, 0.5, G], acc))
    assert not said(looks, health.ACC_STUCK).any(), "all axes at once: a sensor without noise"


def test_rates_of_two_decimals_repeat_at_rest_and_no_axis_is_stuck():
    """rad/s as examples for microcontrollers print it, less a bias: one axis stays on its digit while others change."""
    rng, digits = np.random.default_rng(3), 0.01
    gyr = digits * np.round(rng.normal(0.0, [0.006, 0.006, 0.0008], (1000, 3)) / digits) - [0.0131, -0.0323, 0.0277]
    _, acc = at_rest(1000)
    assert len(np.unique(gyr[:, 2])) == 1 and not said(watched(gyr, acc), health.GYR_STUCK).any()
    t = 0.01 * np.arange(1000)
    gyr[500:, :2] += digits * np.round(np.stack([np.sin(4.0 * t), np.cos(5.0 * t)], axis=1)[500:] / digits)
    assert said(watched(gyr, acc), health.GYR_STUCK)[800:].all(), "the others turn, and it does not"


def test_acceleration_is_refused_and_believed_again_after_its_time():
    gyr, acc = at_rest(800)
    acc[100:] += [30.0, 0.0, 0.0]
    looks = watched(gyr, acc, params=lh.Guard(acc_gate=5.0, acc_time=3.0, acc_range=160.0))
    refused = np.flatnonzero(said(looks, health.ACC_REJECTED))
    assert refused.tolist() == list(range(100, 100 + len(refused)))
    assert len(refused) == pytest.approx(300, abs=2)
    assert looks[150].acc == ZERO and looks[700].acc != ZERO
    acc[100:] += [-30.0, 0.0, 30.0]
    upright = watched(gyr, acc, params=lh.Guard(acc_gate=5.0, acc_range=160.0))
    assert not said(upright, health.ACC_REJECTED).any(), "along the vertical it says nothing wrong about it"


@pytest.mark.slow
def test_the_field_is_learned_refused_and_learned_again():
    n = 6000
    rng = np.random.default_rng(2)
    mag = rng.normal(0, 0.5, (n, 3)) + FIELD
    mag[2000:2500] *= 1.3  # 5 s of iron
    mag[3000:] = rng.normal(0, 0.5, (n - 3000, 3)) + [0.0, 50.0, -20.0]  # another room, as strong: by its dip
    looks = watched(at_rest(n)[0], mag=mag)
    field = looks[1999].guard.field
    assert field.norm == pytest.approx(np.linalg.norm(FIELD), rel=0.01)
    assert field.dip == pytest.approx(-45.0 / np.linalg.norm(FIELD), abs=0.01)
    refused = said(looks, health.MAG_REJECTED)
    assert refused[2000:2500].all() and not refused[:2000].any() and not refused[2500:3000].any()
    assert looks[2400].mag == ZERO
    assert refused[3000:4999].all() and not refused[5005:].any()
    assert looks[-1].guard.field.dip == pytest.approx(-20.0 / math.hypot(50.0, 20.0), abs=0.01)


def test_a_field_learned_for_a_moment_is_given_up_as_soon():
    """The first sample may have been taken upside down: its dip has the wrong sign, and is not kept for 20 s."""
    n = 400
    mag = np.tile(np.array(FIELD), (n, 1))
    mag[:50, 2] *= -1.0
    refused = said(watched(at_rest(n)[0], mag=mag), health.MAG_REJECTED)
    assert refused[50:98].all() and not refused[104:].any()


@pytest.mark.parametrize("name", param_table(lh.Guard))
def test_every_parameter_has_its_range(name):
    param = param_table(lh.Guard)[name]
    ends = param.sweep or (0.0, 2000.0)
    for value in (*ends, math.sqrt(max(ends[0], 1e-3) * ends[1])):
        params = lh.Guard(**{name: value})
        assert getattr(params, name) == value
        gyr, acc = at_rest(60)
        looks = watched(gyr, acc, np.tile(np.array(FIELD), (60, 1)), params=params)
        assert all(math.isfinite(x) for x in (*looks[-1].gyr, *looks[-1].acc, *looks[-1].mag))
    for value in (-1.0, math.nan, math.inf):
        with pytest.raises(lh.LevelheadError, match=f"Guard: {name} = .* is not allowed; it must be at least 0"):
            lh.Guard(**{name: value})
