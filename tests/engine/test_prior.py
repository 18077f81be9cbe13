"""What an earlier run has learned: a start that is better from its first sample on, the same on every engine."""

import numpy as np
import pytest
from tests.reference.engines import EVERY_ENGINE
from tests.reference.hard import assert_same

import levelhead as lh
from levelhead.filters import ESKF
from levelhead.filters.eskf.calibration import Estimate

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recording():
    return lh.simulate.recording("LSM6DSO32", "hand", duration=90.0, seed=5, mag="HMC5883L")


@pytest.fixture(scope="module")
def prior(recording):
    return lh.fuse(recording, ESKF()).calibration


def feed(live, recording, rows):
    return [live.update(recording.gyr[i], recording.acc[i], recording.mag[i], t=float(recording.t[i])) for i in rows]


@pytest.mark.full
def test_every_engine_gives_the_same_bits(recording, prior):
    part = recording[:1500]
    plain = lh.fuse(part, ESKF(), prior=prior, engine="python")
    compiled = lh.fuse(part, ESKF(), prior=prior, engine="compiled", progress=lambda done: None)
    assert_same(plain, compiled)
    assert plain.calibration.to_dict() == compiled.calibration.to_dict()
    assert (plain.quat != lh.fuse(part, ESKF(), engine="python").quat).any()


@pytest.mark.full
@EVERY_ENGINE
def test_a_stream_is_the_batch_also_when_saved_restored_and_reset(engine, recording, prior):
    part = recording[:700]
    expected = lh.fuse(part, ESKF(), prior=prior, engine="python")
    live = lh.Stream(ESKF(), prior=prior, engine=engine)
    live = lh.Stream.restore(live.save(), engine=engine)  # the prior travels with what is saved before any sample
    first = feed(live, part, range(300))
    live = lh.Stream.restore(live.save(), engine="python" if engine == "compiled" else "compiled")
    assert [*first, *feed(live, part, range(300, 700))] == [tuple(row) for row in expected.quat.tolist()]
    assert live.calibration.to_dict() == expected.calibration.to_dict()
    live.reset()
    assert feed(live, part, range(100)) == first[:100]


def test_a_magnetometer_that_comes_late_has_its_prior():
    """Before the first field the offset has no unit that the filter knows. A large one is handed on."""
    iron = (6.0, -4.0, 5.0)
    recording = lh.simulate.recording(
        "LSM6DSO32", "hand", duration=90.0, seed=5, mag="HMC5883L", iron=lh.simulate.Iron(iron)
    )
    params = ESKF(mag_offset=0.3)
    prior = lh.fuse(recording, params).calibration
    mag = recording.mag.copy()
    mag[:400] = np.nan
    late = lh.Recording(recording.t, recording.gyr, recording.acc, mag)[:450]
    plain = lh.fuse(late, params).calibration
    primed = lh.fuse(late, params, prior=prior).calibration
    assert np.linalg.norm(primed.mag_offset.value - iron) < 0.4 * np.linalg.norm(plain.mag_offset.value - iron)
    assert (primed.mag_offset.sigma < plain.mag_offset.sigma).all()
    assert primed.mag_delay.sigma[0] <= prior.mag_delay.sigma[0] < plain.mag_delay.sigma[0]


def test_the_start_is_better_and_surer(recording, prior):
    """The first 10 s of another recording of the same specimen."""
    other = lh.simulate.observe(
        lh.simulate.motion(77, 10.0, 100.0, style="hand"), lh.simulate.imu("LSM6DSO32", mag="HMC5883L"), seed=5
    )
    new, known = (lh.fuse(other, ESKF(), prior=one) for one in (None, prior))
    matrix = np.eye(3) - np.linalg.inv(other.meta["true_errors"]["gyr"]["matrix"])
    bias = other.truth.bias[-1]

    def off(track, what, true):
        return np.sqrt(np.mean((getattr(track.calibration, what).value - true) ** 2))

    assert off(known, "gyr_matrix", matrix) < 0.6 * off(new, "gyr_matrix", matrix)
    assert off(known, "gyr_bias", bias) < np.radians(0.1)
    early = slice(60, 300)
    assert (known.sigma_tilt[early] < new.sigma_tilt[early]).all()
    assert (known.sigma_heading[early] < new.sigma_heading[early]).all()


def test_a_bias_may_have_changed_since(prior):
    told = prior.prior()
    assert min(told["gyr_bias"].sigma) >= np.radians(0.3) and min(told["acc_bias"].sigma) >= 0.02
    np.testing.assert_allclose(told["gyr_matrix"].sigma, prior.gyr_matrix.sigma.reshape(-1), rtol=0.01)


def test_what_hardly_walks_is_handed_on(prior):
    """Of the offset's σ at the start little is a random walk, so its value is a constant of the sensor."""
    offset, told = prior.mag_offset, prior.prior()["mag_offset"]
    np.testing.assert_allclose(told.value, offset.value, rtol=0.01)
    assert (np.array(told.sigma) < 0.2 * offset.start).all()
    assert "field" not in prior.prior() and "north" not in prior.prior()


def test_a_wild_prior_is_outlived(recording, prior):
    """A bias that is 1 °/s off after switching on again, three times its widened σ, is learned all the same."""
    wrong = prior.prior()
    off = Estimate(tuple(b + np.radians(1.0) for b in wrong["gyr_bias"].value), *wrong["gyr_bias"][1:])
    told = lh.Calibration.from_estimates(wrong | {"gyr_bias": off})
    found = lh.fuse(recording, ESKF(), prior=told).calibration
    np.testing.assert_allclose(found.gyr_bias.value, prior.gyr_bias.value, atol=np.radians(0.1))


def test_what_takes_no_prior_says_so(recording, prior):
    for run in (lambda: lh.fuse(recording, lh.Kalman(), prior=prior), lambda: lh.Stream(lh.Kalman(), prior=prior)):
        with pytest.raises(lh.LevelheadError, match="Kalman learns no calibration, so it has no prior; ESKF does"):
            run()
    with pytest.raises(lh.LevelheadError, match="prior is str; expected a Calibration"):
        lh.fuse(recording, ESKF(), prior="sensor.json")
    assert lh.fuse(recording[:10], lh.Kalman()).calibration is None
    assert lh.Stream(lh.Kalman(), engine="python").calibration is None
