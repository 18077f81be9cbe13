"""Seconds that the noise of a day at rest takes, 200 Hz and six axes; and what a noise file does to filters.

    python -m benchmarks.accuracy.noise [HOURS]
    python -m benchmarks.accuracy.noise --filters

With ``--filters``: total errors on RepoIMU's T-stick with the defaults and with the noise of its still recording. Needs
$LEVELHEAD_DATA.
"""

import sys
from time import perf_counter, process_time

import numpy as np
from benchmarks.measure import DATA

import levelhead as lh
from levelhead.evaluate import evaluate
from levelhead.noise import measure_noise
from levelhead.recording import Recording
from levelhead.units import GRAVITY

RATE = 200.0  # Hz


def still(hours: float) -> Recording:
    """White noise and random walk of six axes."""
    random, n = np.random.default_rng(1), int(hours * 3600.0 * RATE)
    gyr, acc = np.empty((n, 3)), np.empty((n, 3))
    for values, density, walk in ((gyr, 1e-4, 1e-7), (acc, 1e-3, 1e-6)):
        for axis in range(3):
            values[:, axis] = np.cumsum(random.standard_normal(n) * (walk / RATE**0.5))
            values[:, axis] += random.standard_normal(n) * (density * RATE**0.5)
    acc[:, 2] += GRAVITY
    return Recording(np.arange(n) / RATE, gyr, acc)


def filters() -> None:
    """Prints for each filter the mean total errors and their ratio."""
    folder = DATA / "repoimu"
    model = measure_noise(lh.read(folder / "TStick_Test01_Static.csv"))
    motions = [lh.read(folder / f"TStick_Test{number:02d}_Trial2.csv") for number in (2, 3, 4, 6, 8, 9, 10)]
    for params in (lh.ESKF(), lh.EKF(), lh.Kalman()):
        both = (params, model.parameters(params))
        errors = np.array([[evaluate(one, lh.fuse(one, chosen)).total for chosen in both] for one in motions])
        ratio = np.exp(np.log(errors[:, 1] / errors[:, 0]).mean())
        before, after = errors.mean(axis=0)
        print(
            f"{type(params).__name__}: {before:.2f}° with the defaults, {after:.2f}° with the noise: ratio {ratio:.2f}"
        )


def main() -> None:
    """Prints samples, seconds and what was found."""
    if sys.argv[1:] == ["--filters"]:
        filters()
        return
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else 24.0
    recording = still(hours)
    began, work = perf_counter(), process_time()
    model = measure_noise(recording)
    seconds, work = perf_counter() - began, process_time() - work
    print(
        f"{len(recording):,} samples, {hours:g} h at {RATE:g} Hz, six axes: {seconds:.1f} s, {work:.1f} s of one core"
    )
    print(f"N of the gyroscope {model.gyr.density:.4g} rad/s/√Hz, put in: 0.0001")


if __name__ == "__main__":
    main()
