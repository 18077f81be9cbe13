"""What goes wrong with sensors, on purpose, one thing at a time: said at the right samples, doubted, and left behind.

A body rests, turns to and fro for ten seconds, and rests again. Whatever happens while it turns, the filter has to be
right again in the time that it states, and every other sample's health has to be what it is without the fault.
The reader's part (gyroscopes in rad/s that are taken for deg/s) stands in tests/sources/test_evidence.py.
"""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference.hard import assert_same

import levelhead as lh
from levelhead import filters
from levelhead.engine import binding
from levelhead.engine.parallel import fuse_parameter_sets
from levelhead.filters import health

pytestmark = pytest.mark.slow

G = 9.80665
FIELD = np.array([0.0, 19.0, -45.0])
RATE = 100.0
START, END = 1000, 2000  # the body turns between these samples
CORRECTING = [f for f in filters.ALL if "acc" in f.uses]
GUARDED = [f for f in CORRECTING if binding.is_guarded(f)]
EVERY = pytest.mark.parametrize("flt", CORRECTING, ids=lambda f: f.name)
EVERY_GUARDED = pytest.mark.parametrize("flt", GUARDED, ids=lambda f: f.name)
HEADED = pytest.mark.parametrize("flt", [f for f in GUARDED if "mag" in f.uses], ids=lambda f: f.name)


def body(n=18_000, fastest=3.0, hertz=0.3, seed=0):
    """Truth and readings: t, gyr, acc, mag with noise. The axis is skew, and the fastest turn is so many rad/s."""
    t = np.arange(n) / RATE
    u = np.clip(t - START / RATE, 0.0, (END - START) / RATE)
    turns = np.sin(2.0 * np.pi * hertz * u) * np.sin(0.1 * np.pi * u) ** 2  # smooth at both ends
    speed = np.gradient(turns, t)
    angle = turns * fastest / np.abs(speed).max()
    axis = np.array([0.6, 0.64, 0.48])
    start = Rotation.from_euler("ZYX", [40, 10, -20], degrees=True)
    true = start * Rotation.from_rotvec(np.outer(angle, axis))
    rng = np.random.default_rng(seed)
    gyr = np.outer(np.gradient(angle, t), axis) + rng.normal(0, 0.002, (n, 3))
    acc = true.inv().apply([0, 0, G]) + rng.normal(0, 0.05, (n, 3))
    mag = true.inv().apply(FIELD) + rng.normal(0, 0.3, (n, 3))
    return true, t, gyr, acc, mag


def errors(track, true):
    """Tilt and heading error in degrees."""
    off = track.as_rotation() * true.inv()
    up, east = off.apply([0.0, 0.0, 1.0]), off.apply([1.0, 0.0, 0.0])
    tilt = np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2])
    return np.degrees(tilt), np.degrees(np.abs(np.arctan2(east[:, 1], east[:, 0])))


def no_fault(health_bits):
    """Whether all is well with these samples; roll may be ambiguous, which is no fault of a sensor."""
    return not (health_bits.astype(int) & health.FAULTS & ~health.NEAR_VERTICAL).any()


def sound(track):
    assert np.isfinite(track.quat).all() and np.isfinite(track.sigma).all()
    np.testing.assert_allclose(np.linalg.norm(track.quat, axis=1), 1.0, atol=1e-12)


def forgotten(flt, track, true, end):
    """Whether the filter is right again in the time that it states, ``end`` being the fault's last sample."""
    tilt, heading = errors(track, true)
    after = max(end, END)  # the time is stated for rest
    assert tilt[after + int(RATE * flt.settles.tilt) + 1 :].max() < 2.0
    if "mag" in flt.uses and flt.settles.heading > 0.0:  # a compass without memory has the noise of every sample
        rest = slice(after + int(RATE * flt.settles.heading) + 1, None)
        # no better than the field of a place; at rest an offset and the field are one number
        known = np.degrees(track.sigma[rest, 2]) if "sigma" in flt.estimates else 0.0
        known = 2.0 * known if "field" in flt.handles else known
        assert (heading[rest] < np.maximum(2.0, known)).all()


def late(flt):
    """By how many samples a filter that judges the field by itself may say so later: it does at the ends of blocks."""
    return round(RATE * flt.params().block) if "field" in flt.handles else 0


def only_there(track, clean, bit, rows, late=0):
    """The bit is set at these samples and at no others, where nothing was wrong in the clean run either.

    Who is late says so from the end of the block that the first of them is in, to the end of the one after the last's.
    """
    found = np.flatnonzero((track.health & bit).astype(bool) & ~(clean.health & bit).astype(bool))
    if late == 0:
        np.testing.assert_array_equal(found, rows)
        return
    assert 0 <= found[0] - rows[0] < late and 0 <= found[-1] - rows[-1] < 2 * late
    assert len(found) == found[-1] - found[0] + 1


@pytest.fixture(scope="module")
def clean():
    """Filter -> its track of the body to which nothing happens."""
    _, *readings = body()
    recording = lh.Recording(*readings)
    return {flt.name: lh.fuse(recording, flt.params()) for flt in CORRECTING}


@EVERY
def test_nothing_is_wrong_when_nothing_is_wrong(flt, clean):
    true, *_ = body()
    assert no_fault(clean[flt.name].health)
    forgotten(flt, clean[flt.name], true, 0)


SENSORS = {"gyr": health.GYR_MISSING, "acc": health.ACC_MISSING, "mag": health.MAG_MISSING}


@EVERY
@pytest.mark.parametrize("sensor", SENSORS)
def test_readings_missing_in_bursts(flt, sensor, clean):
    """A burst of 1 ms to 3 s: the last rate is held for half a second, after that nobody knows."""
    true, *readings = body()
    column = 1 + list(SENSORS).index(sensor)
    gone = np.r_[1100:1101, 1200:1210, 1300:1600, 1700:1702]
    readings[column][gone] = np.nan
    readings[column][1201, 0] = 0.0  # one axis is enough to lose a reading
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    only_there(track, clean[flt.name], SENSORS[sensor], gone)
    assert no_fault(track.health[gone].astype(int) & ~SENSORS[sensor])
    forgotten(flt, track, true, gone[-1])
    before, during = clean[flt.name].sigma[1599], track.sigma[1599]
    relative = sensor == "gyr" and "heading" not in flt.estimates  # σ of a relative heading grows with time alone
    if sensor in flt.uses and "gyr" in flt.uses and not relative:
        grows = {"gyr": [2], "acc": [0, 1], "mag": [2]}[sensor]
        assert (during[grows] > before[grows]).all()


@EVERY
def test_one_nan_of_the_accelerometer_is_forgotten_at_once(flt, clean):
    """Peers: imufusion says NaN ever after, vqf stays up to 49° off for the rest of the recording."""
    _, *readings = body()
    readings[2][1500] = np.nan
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    only_there(track, clean[flt.name], health.ACC_MISSING, [1500])
    off = np.degrees((track.as_rotation() * clean[flt.name].as_rotation().inv()).magnitude())
    assert off[:1500].max() == 0.0
    assert off[1501:].max() < 3.0 and off[1600:].max() < 0.5


@EVERY
@pytest.mark.parametrize("bad", [math.inf, -math.inf, 1e30, math.nan])
def test_infinity_in_a_stream_is_a_missing_reading(flt, bad):
    _, *readings = body(n=1140)
    _, gyr, acc, mag = (values[1080:].copy() for values in readings)
    broken, bridged = (lh.Stream(flt.params(), engine="python") for _ in range(2))
    for i in range(60):
        sample = [gyr[i], acc[i], mag[i]]
        lost = [math.nan] * 3
        hit = {20: 0, 21: 0, 30: 1, 40: 2}.get(i)
        said = []
        for live, value in ((broken, [0.1, bad, 0.1]), (bridged, lost)):
            live.update(*(value if k == hit else v for k, v in enumerate(sample)), dt=0.01)
            said.append((live.quat, live.sigma, live.health))
        assert said[0] == said[1]
        assert all(map(math.isfinite, said[0][0]))


def test_a_recording_refuses_infinity_and_stamps_that_do_not_increase():
    _, *readings = body(n=1300)
    for column, name in ((1, "gyr"), (2, "acc"), (3, "mag")):
        broken = [values.copy() for values in readings]
        broken[column][7, 1] = np.inf
        with pytest.raises(lh.LevelheadError, match=f"{name} is infinite at row 7"):
            lh.Recording(*broken)
    for stamp in (0.99, 0.5):
        broken = [values.copy() for values in readings]
        broken[0][100] = stamp
        with pytest.raises(lh.LevelheadError, match="t does not increase at row 100"):
            lh.Recording(*broken)


# Madgwick's step has one length for gravity and field together: while the field is far off, gravity gets the rest.
TILTED_BY_FIELD = {"Madgwick": 15.0}


@HEADED
def test_a_magnetometer_that_comes_back_90_degrees_off_slams_no_tilt(flt, clean):
    true, *readings = body(n=24_000)
    readings[3][3000:15_000] = np.nan  # two minutes
    readings[3][15_000:] = Rotation.from_euler("z", 90, degrees=True).apply(readings[3][15_000:])
    readings[3][15_000:] = (true.inv() * Rotation.from_euler("z", 90, degrees=True)).apply(FIELD)[15_000:]
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    tilt, heading = errors(track, true)
    assert tilt[2500:].max() < TILTED_BY_FIELD.get(flt.name, 2.0)
    assert track.sigma[14_999, 2] > track.sigma[2999, 2]
    new = 0.0 if "field" in flt.handles else 90.0  # who estimates the field knows that a body at rest has not turned
    assert np.abs(heading[-1] - new) < 5.0, "norm and dip are right: it is believed"


@EVERY
@pytest.mark.parametrize("sensor", ["gyr", "acc", "mag"])
def test_zero_vectors_are_no_readings(flt, sensor, clean):
    true, *readings = body()
    readings[1 + list(SENSORS).index(sensor)][1300:1500] = 0.0
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    forgotten(flt, track, true, 1500)


@EVERY
@pytest.mark.parametrize("size", [1e-320, 1e-200, 1e-160])
def test_vectors_too_short_to_have_a_direction(flt, size):
    """Their squares are zero or lose their digits; nothing physical is that small, but nothing may break."""
    live = lh.Stream(flt.params(), engine="python")
    short = (size, -2.0 * size, 3.0 * size)
    for k in range(12):
        acc, mag = short if k in (3, 4, 7) else (0.1, 0.2, G), short if k in (3, 5, 8) else (0.0, 19.0, -45.0)
        quat = live.update((0.1, 0.0, 0.0), acc, mag, dt=0.01)
        assert math.hypot(*quat) == pytest.approx(1.0, abs=1e-12)


@EVERY
@pytest.mark.parametrize("jump", [10.0, 3e8], ids=["10 s", "ten years"])
def test_a_gap_in_the_middle_of_a_turn(flt, jump, clean):
    true, *readings = body()
    readings[0][1500:] += jump
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    only_there(track, clean[flt.name], health.GAP, [1500])
    if "gyr" in flt.uses:
        assert (track.sigma[1500, 2] > track.sigma[1499, 2]) and track.sigma[1500].max() < 2.0
    forgotten(flt, track, true, 1500)


@EVERY_GUARDED
def test_a_gyroscope_at_its_known_full_scale(flt):
    true, *readings = body(fastest=8.0)
    full = math.radians(250.0)
    readings[1][:] = np.clip(readings[1], -full, full)
    clipped = np.flatnonzero(np.abs(readings[1]).max(axis=1) == full)
    assert len(clipped) > 20
    recording = lh.Recording(*readings)
    track = lh.fuse(recording, flt.params(), guard=lh.Guard(gyr_range=250.0))
    sound(track)
    said = np.flatnonzero(track.health & health.GYR_SATURATED)
    assert set(clipped) <= set(said)
    assert (np.abs(readings[1][said]).max(axis=1) > 0.996 * full).all()
    tilt, _ = errors(track, true)  # the rate beyond full scale is estimated from its slope, and σ knows how well
    assert (tilt[clipped] < 4.0 * np.degrees(np.hypot(*track.sigma[clipped, :2].T)) + 1.0).all()
    forgotten(flt, track, true, END)


@EVERY_GUARDED
def test_a_full_scale_that_nobody_told_is_found(flt):
    """The second time at the latest: before there was a plateau it could have been a turn at a constant rate."""
    true, *readings = body(fastest=12.0, hertz=1.0)
    full = math.radians(300.0)
    readings[1][:] = np.clip(readings[1], -full, full)
    clipped = np.abs(readings[1]).max(axis=1) == full
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    said = (track.health & health.GYR_SATURATED) != 0
    where = np.flatnonzero(clipped)
    assert said[where].mean() > 0.4 and said[where[-len(where) // 4 :]].all()
    assert (np.abs(readings[1][said]).max(axis=1) > 0.98 * full).all()
    forgotten(flt, track, true, END)


@EVERY_GUARDED
def test_a_push_beyond_full_scale_disturbs_no_more_than_one_within(flt):
    """The reading is used: left out, the mean of all others would be no specific force of this body."""
    true, *readings = body()
    readings[2][1400:1420] += [150.0, 30.0, 0.0]
    full = 4 * G
    whole = errors(lh.fuse(lh.Recording(*readings), flt.params(), guard=None), true)[0]
    readings[2][:] = np.clip(readings[2], -full, full)
    track = lh.fuse(lh.Recording(*readings), flt.params(), guard=lh.Guard(acc_range=full))
    sound(track)
    np.testing.assert_array_equal(np.flatnonzero(track.health & health.ACC_SATURATED), range(1400, 1420))
    assert errors(track, true)[0][1400:1450].max() < max(whole[1400:1450].max(), 5.0)
    forgotten(flt, track, true, 1420)


@EVERY_GUARDED
@pytest.mark.parametrize("sensor", ["gyr", "acc"])
def test_an_axis_that_is_stuck(flt, sensor, clean):
    """It is said when it can no longer be chance: after a second, or so much of a gyroscope's noise that is known."""
    true, *readings = body()
    column, bit, after = (1, health.GYR_STUCK, 21) if sensor == "gyr" else (2, health.ACC_STUCK, 101)
    readings[column][1150:1700, 1] = readings[column][1150, 1]
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    only_there(track, clean[flt.name], bit, np.arange(1150 + after, 1700))
    of_tilt = track.sigma[1699, :2] > clean[flt.name].sigma[1699, :2]
    assert of_tilt.all()
    forgotten(flt, track, true, 1700)


@EVERY_GUARDED
def test_shocks_of_100_g_move_nothing(flt, clean):
    true, *readings = body()
    rng = np.random.default_rng(3)
    hits = np.arange(1200, 1900, 50)
    sideways = rng.normal(size=(len(hits), 3))
    up = readings[2][hits] / np.linalg.norm(readings[2][hits], axis=1)[:, None]
    sideways -= (sideways * up).sum(axis=1)[:, None] * up
    readings[2][hits] += 100.0 * G * sideways / np.linalg.norm(sideways, axis=1)[:, None]
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    only_there(track, clean[flt.name], health.ACC_REJECTED, hits)
    assert (errors(track, true)[0] - errors(clean[flt.name], true)[0])[1200:].max() < 0.2
    forgotten(flt, track, true, 1900)


@HEADED
def test_a_magnet_that_passes_is_refused(flt, clean):
    true, *readings = body()
    near = slice(2500, 2700)
    readings[3][near] += true.inv().apply([60.0, 0.0, 0.0])[near]
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    only_there(track, clean[flt.name], health.MAG_REJECTED, np.arange(2500, 2700), late=late(flt))
    there, without = (errors(one, true)[1][2500:2800].max() for one in (track, clean[flt.name]))
    assert there < without + 1.0
    assert track.sigma[2699, 2] > (0.99 if "field" in flt.handles else 1.0) * clean[flt.name].sigma[2699, 2]
    forgotten(flt, track, true, 2700)


@HEADED
def test_a_lasting_new_field_is_taken_for_the_earths(flt, clean):
    """The room was changed: half as strong again and 30° round the vertical, accepted after Guard.mag_time."""
    true, *readings = body(n=19_000)
    turned = true.inv() * Rotation.from_euler("z", 30, degrees=True)
    readings[3][3000:] = 1.5 * turned.apply(FIELD)[3000:]
    track = lh.fuse(lh.Recording(*readings), flt.params())
    sound(track)
    refused = np.flatnonzero(track.health & health.MAG_REJECTED)
    assert 3000 <= refused[0] <= 3000 + late(flt) and len(refused) == refused[-1] - refused[0] + 1
    tilt, heading = errors(track, true)
    if "field" in flt.handles:  # a body at rest has not turned, whatever its field does
        assert heading[3000:].max() < heading[2500:3000].max() + 1.0
        return
    assert len(refused) / RATE == pytest.approx(lh.Guard().mag_time, abs=0.05)
    assert heading[3000 : refused[-1]].max() < heading[2500:3000].max() + 1.0, "as long as it is refused"
    settled = refused[-1] + int(RATE * flt.settles.heading)
    assert np.abs(heading[settled:] - 30.0).max() < 2.0
    assert tilt[3000:].max() < TILTED_BY_FIELD.get(flt.name, 2.0)


@EVERY_GUARDED
def test_twenty_dropouts_of_52_ms_hardly_matter(flt, clean):
    """Rows missing, not marked: one interval of 60 ms each. Programs that count samples lose a turn of 3° at each."""
    true, *readings = body()
    keep = np.ones(len(readings[0]), bool)
    for start in np.linspace(1050, 1950, 20).astype(int):
        keep[start : start + 5] = False
    keep[START:END][np.diff(keep[START:END].astype(int), prepend=1) > 0] = True
    # a rate is the mean over the interval that it ends, as a gyroscope with an integrating low-pass gives it
    track = lh.fuse(lh.Recording(*(values[keep] for values in readings)), flt.params())
    sound(track)
    assert no_fault(track.health)
    with_all, with_less = errors(clean[flt.name], true)[0][keep], errors(track, true[keep])[0]
    moving = slice(START, END - 100)
    assert np.sqrt(np.mean(with_less[moving] ** 2)) < 1.5 * np.sqrt(np.mean(with_all[moving] ** 2)) + 0.5


@pytest.mark.full
@pytest.mark.parametrize("params", [lh.Complementary(), lh.EKF()], ids=repr)
def test_every_engine_says_the_same_of_faults(params):
    """Everything at once: plain Python, compiled code and lanes give the same bits."""
    _, *readings = body(n=2400, fastest=12.0)
    _, gyr, acc, mag = readings
    gyr[:] = np.clip(gyr, -5.0, 5.0)
    gyr[1100:1130], acc[1200:1260], mag[1300:1900] = np.nan, np.nan, np.nan
    acc[1400:1600, 1], gyr[1600:1800, 2] = acc[1400, 1], gyr[1600, 2]
    acc[1900:1910] *= 100.0
    mag[2000:2100] *= 2.0
    readings[0][1500:] += 3.0
    recording = lh.Recording(*readings)
    expected = lh.fuse(recording, params, engine="python")
    bits = (health.GYR_SATURATED, health.GYR_STUCK, health.ACC_STUCK, health.MAG_REJECTED, health.GAP, health.AT_REST)
    assert all((expected.health & bit).any() for bit in bits)
    assert_same(expected, lh.fuse(recording, params, engine="compiled"))
    for track in fuse_parameter_sets(recording, [params] * 9, engine="compiled"):
        assert_same(expected, track)
