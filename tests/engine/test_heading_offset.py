"""A heading that is set while a stream runs: every output turns, σ starts with that given, bytes keep it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh


def halves(live, rec, mag=True, heading=None, sigma=2.0):
    """Orientations and 1σ of the heading over a recording; the heading is set after the first half."""
    quat, up = [], []
    for i in range(len(rec)):
        if heading is not None and i == len(rec) // 2:
            live.set_heading(heading, sigma)
        field = rec.mag[i] if mag else None
        quat.append(live.update(rec.gyr[i], rec.acc[i], field, t=rec.t[i]))
        up.append(live.sigma.z)
    return np.array(quat), np.array(up)


@pytest.fixture(scope="module")
def rec():
    return lh.simulate.recording("MPU-6050", "hand", duration=6.0, seed=2, mag="HMC5883L")


@pytest.mark.parametrize("mag", [False, True])
def test_all_outputs_turn_and_sigma_begins_anew(rec, mag):
    plain, before = halves(lh.Stream(), rec, mag)
    live = lh.Stream()
    turned, after = halves(live, rec, mag, heading=-120.0)
    half = len(rec) // 2
    np.testing.assert_array_equal(turned[:half], plain[:half])
    yaw = lh.Track(rec.t, plain).euler()[half - 1, 2]
    expected = (
        Rotation.from_euler("z", -120.0 - yaw, degrees=True) * Rotation.from_quat(plain, scalar_first=True)[half:]
    )
    np.testing.assert_allclose(Rotation.from_quat(turned, scalar_first=True)[half:].as_matrix(), expected.as_matrix())
    np.testing.assert_array_equal(live.numbers[:4], turned[-1])
    np.testing.assert_array_equal(live.quat, turned[-1])
    grown = before[half:] ** 2 + (before[half - 1] ** 2 if mag else -(before[half - 1] ** 2))
    np.testing.assert_allclose(after[half:], np.sqrt(np.maximum(grown + np.radians(2.0) ** 2, 0.0)))


def test_rows_saved_bytes_and_reset(rec):
    live = lh.Stream("Mahony")
    live.update_rows(rec.gyr[:100], rec.acc[:100], t=rec.t[:100])
    live.set_heading(1.0, degrees=False)
    again = lh.Stream.restore(live.save())
    rows = live.update_rows(rec.gyr[100:200], rec.acc[100:200], t=rec.t[100:200])
    one_by_one = [again.update(rec.gyr[i], rec.acc[i], t=rec.t[i]) for i in range(100, 200)]
    np.testing.assert_allclose(rows, one_by_one, atol=1e-15)
    live.reset()
    fresh = lh.Stream("Mahony")
    assert live.update(rec.gyr[0], rec.acc[0], dt=0.01) == fresh.update(rec.gyr[0], rec.acc[0], dt=0.01)


@pytest.mark.parametrize(
    "given, said",
    [(("north",), "expected two numbers"), ((np.nan,), "finite numbers"), ((0.0, -1.0), "σ not negative")],
)
def test_no_heading(rec, given, said):
    live = lh.Stream("Mahony")
    live.update(rec.gyr[0], rec.acc[0], dt=0.01)
    with pytest.raises(lh.LevelheadError, match=said):
        live.set_heading(*given)


def test_a_vertical_nose_has_no_heading():
    live = lh.Stream("Mahony")
    live.update((0.0, 0.0, 0.0), (9.81, 0.0, 0.0), dt=0.01)
    with pytest.raises(lh.LevelheadError, match="x axis is vertical"):
        live.set_heading(0.0)
