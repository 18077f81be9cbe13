"""Guided calibration: a hand that does what it is told, a source that is silent, stuck, or a replay."""

import math
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import levelhead as lh
from levelhead import LevelheadError, simulate
from levelhead.calibrate.coverage import lay_down, side_up
from levelhead.calibrate.live_session import record_poses
from levelhead.calibrate.next_pose import Guide
from levelhead.calibrate.poses import find_poses
from levelhead.publish.dashboard.guide_view import side_attitude
from levelhead.sample import Sample
from levelhead.sources.devices.replay import Replay

Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
RATE = 100.0
GYR = np.array([[0.02, 0.004, -0.003], [0.002, -0.015, 0.005], [-0.006, 0.001, 0.01]])  # what is put in
ACC = np.array([[0.012, -0.006, 0.004], [0.0, -0.008, 0.009], [0.0, 0.0, 0.015]])
GYR_BIAS, ACC_BIAS = np.array([0.02, -0.01, 0.015]), np.array([0.15, -0.2, 0.1])


class ObedientHand:
    """A sensor with known errors; the hand takes a second and a half for a turn and lets go."""

    def __init__(self, seed):
        self.random, self.attitude, self.t = np.random.default_rng(seed), Rotation.identity(), 0.0

    def sample(self, rate):
        """The readings while it turns at (3,) rad/s: true = r − M r − b."""
        up = self.attitude.inv().apply([0.0, 0.0, 9.80665])
        gyr = np.linalg.solve(np.eye(3) - GYR, rate + GYR_BIAS) + 1e-3 * self.random.standard_normal(3)
        acc = np.linalg.solve(np.eye(3) - ACC, up + ACC_BIAS) + 0.02 * self.random.standard_normal(3)
        self.t += 1.0 / RATE
        return Sample(self.t, tuple(gyr), tuple(acc))

    def rest(self):
        return [self.sample(np.zeros(3)) for _ in range(round(0.5 * RATE))]

    def turn(self, side):
        """The shortest way until a side is up, about 5° off, and 70° about the vertical besides."""
        steps = round(1.5 * RATE)
        about_up = Rotation.from_rotvec([0.0, 0.0, self.random.uniform(-1.2, 1.2)])
        wanted = about_up * Rotation.from_quat(side_attitude(side), scalar_first=True)
        whole = (self.attitude.inv() * wanted).as_rotvec() + 0.05 * self.random.standard_normal(3)
        samples = []
        for k in range(steps):
            share = np.sin(np.pi * (k + 0.5) / steps) ** 2 * 2.0 / steps
            samples.append(self.sample(whole * share * RATE))
            self.attitude = self.attitude * Rotation.from_rotvec(whole * share)
        return samples


class TremblingHand(ObedientHand):
    """One that never puts the sensor down: it trembles by 0.15° RMS between 0.7 and 6 Hz."""

    TREMOR = np.radians(0.15) * np.sqrt(2.0 / 3.0) * np.eye(3)
    RATES = 2.0 * np.pi * np.array([0.7, 2.3, 6.0])

    def rest(self):
        samples = []
        for _ in range(round(0.5 * RATE)):
            phase = self.RATES * self.t + np.array([[0.0], [1.0], [2.0]])
            rate = self.TREMOR @ (self.RATES * np.cos(phase)).sum(axis=1)
            samples.append(self.sample(rate))
            self.attitude = self.attitude * Rotation.from_rotvec(rate / RATE)
        return samples


def follow(hand, guide, most=60):
    """Does what the guide says until it is done; the sentences on the way."""
    said = []
    for _ in range(most * 8):
        now = guide.instruction(wait=True)
        said.append(now)
        if now.done:
            return said
        guide.add(hand.turn(now.side) if now.side is not None and now.poses else hand.rest())
        while guide.instruction(wait=True).hold > 0.0 or guide.instruction(wait=True).poses == now.poses:
            said.append(guide.instruction(wait=True))
            guide.add(hand.rest())
            assert len(said) < 1000
    raise AssertionError(said[-1].words)


@pytest.fixture(scope="module")
def guided():
    with ThreadPoolExecutor(1) as executor:
        guide = Guide(executor)
        said = follow(ObedientHand(3), guide)
        return said, guide.recording()


@pytest.mark.slow
def test_a_hand_that_obeys_is_led_through_all_sides(guided):
    said, recording = guided
    assert said[-1].sides == ["+x", "+y", "+z", "−z", "−y", "−x"]
    assert said[-1].unknown == []
    assert said[-1].poses == 12
    assert len(find_poses([recording])[0]) == 12
    first = next(one for one in said if one.poses == 1)
    assert "accelerometer scale x" in first.unknown
    assert first.unobservable_words().startswith("accelerometer bias x, ")
    assert said[0].unobservable_words() == first.unobservable_words()  # before the first pose nothing is told
    words = [one.words for one in said]
    assert any("put it down on its left side (−y up)" in one for one in words)
    assert any("leaned against something" in one for one in words)  # what sides alone do not tell
    assert any(one.startswith("hold still: ") for one in words)
    assert "hold still: 0.0 s more" not in words
    fractions = [one.fraction for one in said]
    assert fractions[-1] == 1.0
    assert fractions == sorted(fractions)


@pytest.mark.slow
def test_what_was_put_in_is_found(guided):
    found = lh.calibrate_sensor(guided[1]).calibration
    for part, value in {"acc_matrix": ACC, "acc_bias": ACC_BIAS, "gyr_matrix": GYR, "gyr_bias": GYR_BIAS}.items():
        one = getattr(found, part)
        asked = one.sigma > 0.0
        assert (np.abs(one.value - value)[asked] < 4.0 * one.sigma[asked]).all(), part
        assert one.known[asked].all(), part


@pytest.mark.slow
def test_a_hand_that_holds_the_sensor_is_led_too():
    with ThreadPoolExecutor(1) as executor:
        guide = Guide(executor)
        said = follow(TremblingHand(5), guide)
    assert any(one.words.startswith("hold still: ") for one in said)
    assert len(find_poses([guide.recording()])[0]) >= 12
    found = lh.calibrate_sensor(guide.recording()).calibration
    np.testing.assert_allclose(found.acc_bias.value, ACC_BIAS, atol=0.02)


class Source:
    """A live source that gives one and the same sample, or none."""

    name, rate, gyr_range, acc_range, ended = "a wire", RATE, 0.0, 0.0, False

    def __init__(self, sample=None):
        self.sample, self.count, self.closed = sample, 0, False

    def start(self):
        pass

    def poll(self):
        if self.sample is None:
            return []
        self.count += 1
        return [self.sample._replace(t=self.count / RATE)]

    def close(self):
        self.closed = True


@pytest.mark.parametrize(
    ("sample", "sentence"),
    [
        (None, "a wire gave no reading for 0.2 s"),
        (Sample(0.0, (math.nan,) * 3, (0.0, 0.0, 9.8)), "a wire gave no reading for 0.2 s"),
        (Sample(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8)), "the same reading for 2 s"),
    ],
)
def test_a_source_that_says_nothing_is_refused(sample, sentence):
    source = Source(sample)
    with pytest.raises(LevelheadError, match=sentence):
        record_poses(source, lambda now: None, give_up=0.2)
    assert source.closed


@pytest.mark.slow
def test_a_replay_gives_what_the_log_gives():
    recording = simulate.observe(simulate.poses(8, 5, rate=25.0), simulate.imu("MPU-6050", mag="HMC5883L"), 5)
    shown = []
    read = record_poses(Replay(recording, math.inf), shown.append)
    for name in ("gyr", "acc", "mag"):  # a calibration of equal readings is equal
        np.testing.assert_array_equal(getattr(read, name), getattr(recording, name))
    np.testing.assert_allclose(read.t - read.t[0], recording.t - recording.t[0], rtol=0.0, atol=1e-9)
    assert shown[-1].fraction < 1.0  # the replay ended before 12 poses


@pytest.mark.slow
def test_reading_goes_on_while_poses_are_assessed():
    """A fit that takes long does not hold up the sensor."""

    class Slow(ThreadPoolExecutor):
        def submit(self, work, *arguments):
            return super().submit(lambda: time.sleep(0.3) or work(*arguments))

    hand = ObedientHand(1)
    with Slow(1) as executor:
        guide = Guide(executor)
        for _ in range(6):
            guide.add(hand.rest())
            guide.instruction()
        assert guide.instruction().words == "good; leave it there for a moment"
        assert guide.instruction(wait=True).side is not None


def test_too_few_poses_are_refused():
    with ThreadPoolExecutor(1) as executor, pytest.raises(LevelheadError, match="expected 6 or more"):
        Guide(executor, poses=3)


@pytest.mark.parametrize("side", [(0, 0, 1), (0, 0, -1), (0, 1, 0), (-1, 0, 0), (1, -1, 0), (1, 1, -1)])
def test_words_and_attitude_of_a_side_agree(side):
    """The specific force at rest in that attitude points to the side that the words name."""
    lying = Rotation.from_quat(side_attitude(np.array(side, dtype=float)), scalar_first=True)
    up = lying.inv().apply([0.0, 0.0, 9.8])
    np.testing.assert_allclose(up / 9.8, np.array(side) / np.linalg.norm(side), atol=1e-12)
    named = side_up(up[None])
    assert all(part in lay_down(np.array(side)) for part in named.split())
