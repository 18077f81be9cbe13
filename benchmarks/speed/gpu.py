"""A GPU beside two processor cores: 10,000 parameter sets over a one-minute recording, and 10,000 such recordings.

Wall time of whole calls in turn, compilation left out: ``fuse_parameter_sets`` scores are ``tune.score_sets`` (no
tracks), as sweeps and tuning run them. The processor takes the same work with its fastest engine on two threads, by a
share of the runs, which is said. Where there is no GPU one sentence says so, and nothing is timed.
"""

import sys
import time
from collections.abc import Callable

import numpy as np

import levelhead as lh
from levelhead import filters
from levelhead.compiler.gpu import require_gpu
from levelhead.engine.parallel import fuse_recordings
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import param_table
from levelhead.guard import Guard
from levelhead.tune.score_sets import score_sets

RUNS = 10_000
SHARE = 50  # of the runs, one in so many is timed on the processor
SECONDS = 60.0
FILTERS = ("EKF", "Mahony", "ESKF")
REPEATS = 3
CORES = 2


def spread(name: str, count: int) -> list[object]:
    """Parameter sets over the usual range of a filter's first parameter that has one."""
    default = filters.find(name).params()
    for key, param in param_table(type(default)).items():
        if param.sweep is not None and not isinstance(getattr(default, key), bool):
            return [default._replace(**{key: float(value)}) for value in np.geomspace(*param.sweep, count)]
    raise ValueError(name)


def seconds(work: Callable[[], object]) -> float:
    """The shortest of some calls, after one that compiles."""
    work()
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


def main() -> None:
    """The table; or the sentence why there is none."""
    try:
        require_gpu()
    except LevelheadError as error:
        print(f"no time was taken: {error}")
        return
    recording = lh.simulate.recording("MPU-6050", "hand", duration=SECONDS)
    recordings = [recording] * RUNS
    print(f"{'work':34}{'engine':14}{'GPU, s':>10}{'2 cores, s':>12}{'ratio':>8}")
    for engine in ("cuda", "cuda-single"):
        for name in FILTERS:
            sets = spread(name, RUNS)
            gpu = seconds(lambda sets=sets, engine=engine: score_sets([recording], sets, Guard(), engine))
            few = sets[::SHARE]
            cpu = SHARE * seconds(lambda few=few: score_sets([recording], few, Guard()))
            print(f"{name + ', parameter sets':34}{engine:14}{gpu:10.3g}{cpu:12.3g}{cpu / gpu:8.3g}")
        for name in FILTERS:
            gpu = seconds(
                lambda name=name, engine=engine: sum(1 for _ in fuse_recordings(recordings, name, engine=engine))
            )
            few = recordings[::SHARE]
            cpu = SHARE * seconds(lambda name=name, few=few: sum(1 for _ in fuse_recordings(few, name, workers=CORES)))
            print(f"{name + ', recordings':34}{engine:14}{gpu:10.3g}{cpu:12.3g}{cpu / gpu:8.3g}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
