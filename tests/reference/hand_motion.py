"""A hand that puts a sensor down, or holds it, in given attitudes: the truth of simulated calibrations."""

from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from levelhead import simulate

RATE = 100.0


def sides(seed, edges=0, askew=2.0):
    """Attitudes with each of the six sides up, and so many edges, some degrees askew, in any order."""
    random = np.random.default_rng(seed + 77)
    ups = [np.array(up, dtype=float) for up in product((1, 0, -1), repeat=3)]
    faces = [up for up in ups if np.abs(up).sum() == 1]
    slanted = [up for up in ups if np.abs(up).sum() == 2]
    chosen = [faces[i] for i in random.permutation(6)] + [slanted[i] for i in random.permutation(12)[:edges]]
    attitudes = []
    for up in chosen:
        side = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up / np.linalg.norm(up)])[0]
        about_up = Rotation.from_rotvec([0.0, 0.0, random.uniform(0.0, 6.28)])
        attitudes.append(about_up * side * Rotation.from_rotvec(np.radians(askew) * random.standard_normal(3)))
    return attitudes


def move(attitudes, turns, seed=0, tremor=0.0, rest=2.0):
    """A Motion from attitude to attitude, 2 s in each.

    Args:
        attitudes: Rotations.
        turns: (k − 1) s of each turn; a Rotation vector in its place: s and the way that is not the shortest.
        seed: of the tremor.
        tremor: degrees RMS of the attitude, between 0.3 and 8 Hz, with 0.05 m/s² of acceleration.
        rest: s in each attitude.
    """
    parts = []
    for i, attitude in enumerate(attitudes):
        parts.append(Rotation.concatenate([attitude] * round(rest * RATE)))
        if i + 1 < len(attitudes):
            seconds, way = turns[i] if isinstance(turns[i], tuple) else (turns[i], None)
            way = (attitude.inv() * attitudes[i + 1]).as_rotvec() if way is None else way
            u = np.arange(1, round(seconds * RATE) + 1) / round(seconds * RATE)
            parts.append(attitude * Rotation.from_rotvec(np.outer(u**3 * (10.0 - 15.0 * u + 6.0 * u * u), way)))
    whole = Rotation.concatenate(parts)
    push = np.zeros((len(whole), 3))
    if tremor:
        random = np.random.default_rng(seed + 1000)
        whole = whole * Rotation.from_rotvec(np.radians(tremor) * _band(random, len(whole)))
        push = 0.05 * _band(random, len(whole))
    steps = (whole[:-1].inv() * whole[1:]).as_rotvec() * RATE
    rate = np.concatenate([steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:]])
    zero = np.zeros_like(push)
    return simulate.Motion(
        np.arange(len(whole)) / RATE, whole.as_quat(scalar_first=True), rate, push, zero, zero
    )  # fmt: skip


def frame(drawn):
    """(3, 3) from the sensor to the frame of the accelerometer, in which its matrix is upper triangular."""
    acc = np.linalg.inv(drawn["acc"]["matrix"])
    return np.linalg.cholesky(acc.T @ acc).T @ np.linalg.inv(acc)


def inertial_truth(recording):
    """What poses ought to find of accelerometer and gyroscope."""
    drawn = recording.meta["true_errors"]
    turned = frame(drawn)
    upper = turned @ np.linalg.inv(drawn["acc"]["matrix"])
    gyr = turned @ np.linalg.inv(drawn["gyr"]["matrix"])
    return {
        "acc_matrix": np.eye(3) - upper,
        "acc_bias": upper @ drawn["acc"]["turn_on_bias"],
        "gyr_matrix": np.eye(3) - gyr,
        "gyr_bias": gyr @ recording.truth.bias.mean(axis=0),
    }


def _band(random, count):
    """(count, 3) noise of 1σ between 0.3 and 8 Hz."""
    frequency = np.fft.rfftfreq(count, 1.0 / RATE)
    spectrum = np.fft.rfft(random.standard_normal((count, 3)), axis=0)
    spectrum[(frequency < 0.3) | (frequency > 8.0)] = 0.0
    noise = np.fft.irfft(spectrum, count, axis=0)
    return noise / noise.std()
