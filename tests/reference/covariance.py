"""Pieces of recordings with everything that is hard, and the covariance of the self-calibrating filter on them."""

import ctypes
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tests.reference.c_library import STRICT, build

import levelhead as lh
from levelhead.engine.binding import bind
from levelhead.engine.driver import Settings
from levelhead.engine.native import FilterMemory
from levelhead.export import ExportConfig, write
from levelhead.filters.eskf import FILTER, state

PIECE = 50_000  # samples
CHUNK = 1000  # samples between two looks at P
ROW = state.ROW  # numbers from one row of P to the next
CHIPS = ("MPU-6050", "LSM6DSO32", "BMI160")
MOTIONS = ("hand", "still", "walking", "drone", "robot")
RATES = (100.0, 25.0, 1000.0, 200.0)
LOOP = """#include <stddef.h>
#include "{name}.c"
void run(const void *begun, ptrdiff_t n, const double *dt, const double *gyr, const double *acc, const double *mag,
         double *sigma, double *p)
{{
    static {name} filter;
    if (!begun) {name}_init(&filter);
    for (ptrdiff_t i = 0; i < n; i++) {{
        {real} g[3], a[3], m[3];
        for (int k = 0; k < 3; k++) {{
            g[k] = ({real})gyr[3 * i + k];
            a[k] = ({real})acc[3 * i + k];
            m[k] = ({real})mag[3 * i + k];
        }}
        {name}_update(&filter, g, a, m, ({real})dt[i]);
        const {name}_vec3 s = {name}_sigma(&filter);
        sigma[3 * i] = s.x, sigma[3 * i + 1] = s.y, sigma[3 * i + 2] = s.z;
    }}
    for (int i = 0; i < {row} * {row}; i++) p[i] = filter.carry.run.state.memory[{first} + i];
}}
"""


class Readings(NamedTuple):
    """What a filter is fed with."""

    dt: Any  # (n,) s
    gyr: Any  # (n, 3) rad/s
    acc: Any  # (n, 3) m/s²
    mag: Any  # (n, 3) µT


class Found(NamedTuple):
    """What a run's covariance was like."""

    looks: int
    crooked: float  # largest difference of P and its transpose
    least: float  # smallest eigenvalue of P scaled to a diagonal of ones
    zero: int  # samples whose σ of attitude was not positive, or no number
    smallest: float  # rad, σ of attitude
    largest: float


def burst(random: np.random.Generator, n: int, longest: float) -> slice:
    """Some samples in a row, more often few than many."""
    length = int(10.0 ** random.uniform(0.0, np.log10(longest)))
    start = int(random.integers(0, n))
    return slice(start, start + length)


def piece(k: int, n: int = PIECE) -> Readings:
    """The k-th piece: its motion and chip go round, what befalls it is drawn."""
    random = np.random.default_rng(k)
    rate = RATES[k % len(RATES)]
    clips = k % 10 == 0  # at 250 °/s
    motion = lh.simulate.motion(k, n / rate, rate, style=MOTIONS[k % len(MOTIONS)], rotation=150.0 if clips else None)
    chip = lh.simulate.imu(CHIPS[k % len(CHIPS)], mag="HMC5883L", gyr_range=250.0 if clips else None)
    recording = lh.simulate.observe(motion, chip, seed=k)
    dt = np.full(n, 1.0 / rate)
    dt[0] = 1.0  # another place, another attitude
    gyr, acc, mag = (np.array(one) for one in (recording.gyr, recording.acc, recording.mag))
    if random.random() < 0.3:  # nothing happens, so that P shrinks for as long as it can
        return Readings(dt, gyr, acc, mag)
    for _ in range(8):
        mag[burst(random, n, 5000)] += random.normal(0.0, 100.0, 3)
        acc[burst(random, n, 5)] += random.normal(0.0, 100.0 * 9.8 / np.sqrt(3.0), 3)
        for values in (gyr, acc, mag):
            values[burst(random, n, 2000)] = np.nan
        dt[random.integers(0, n)] = 10.0 ** random.uniform(-0.3, 3.5)
    dt *= random.uniform(0.5, 1.5, n) if k % 3 == 1 else 1.0
    held = burst(random, n, 20_000)
    for values in (gyr, acc, mag):
        values[held] = values[held.start]
    if k % 6 == 4:
        mag[:] = np.nan
    if k % 11 == 9:
        acc[n // 2 :] = np.nan
    return Readings(dt, gyr, acc, mag)


class Native:
    """The native engine, in double."""

    def __init__(self, params: lh.ESKF) -> None:
        settings = Settings(params, lh.Guard())
        self._memory = FilterMemory(FILTER, True, settings, bind(FILTER).begin(settings))

    def feed(self, part: Readings) -> tuple[Any, Any]:
        """Takes samples; returns P and σ of attitude after each."""
        n = len(part.dt)
        quat, bias, sigma, health = np.empty(4 * n), np.empty(3 * n), np.empty(3 * n), np.empty(n, np.uint32)
        flat = [np.ascontiguousarray(values).reshape(-1) for values in part[1:]]
        self._memory.filter.run(0.0, np.cumsum(part.dt), *flat, quat, bias, sigma, health)
        m = self._memory.state.run.state.memory
        return np.array(m[state.P : state.P + ROW**2]).reshape(ROW, ROW), sigma.reshape(n, 3)


class Exported:
    """The exported C, in double or float."""

    def __init__(self, params: lh.ESKF, real: str = "float") -> None:
        config = ExportConfig(params, real=real)
        with tempfile.TemporaryDirectory() as folder:
            write(config, Path(folder))
            words = {"name": config.name, "real": real, "row": ROW, "first": state.P}
            (Path(folder) / "run.c").write_text(LOOP.format(**words), encoding="utf-8")
            self._run = build("run.c", STRICT, Path(folder))
        self._run.argtypes = [ctypes.c_void_p, ctypes.c_ssize_t, *[ctypes.c_void_p] * 6]
        self._begun = False

    def feed(self, part: Readings) -> tuple[Any, Any]:
        """As of ``Native``."""
        n = len(part.dt)
        p, sigma = np.empty((ROW, ROW)), np.empty((n, 3))
        arrays = [np.ascontiguousarray(values) for values in part] + [sigma, p]
        self._run(arrays[0].ctypes.data if self._begun else None, n, *(values.ctypes.data for values in arrays))
        self._begun = True
        return p, sigma


def least_eigenvalue(p: Any) -> float:
    """Of P scaled to a diagonal of ones, without the states that do not exist; −∞ where P is no covariance at all."""
    there = np.diag(p) != 0.0
    p = p[np.ix_(there, there)]
    if not np.isfinite(p).all() or (np.diag(p) < 0.0).any():
        return -np.inf
    one = 1.0 / np.sqrt(np.diag(p))
    return float(np.linalg.eigvalsh(one[:, None] * p * one).min())


def parts(pieces: Iterator[Readings]) -> Iterator[Readings]:
    """A few samples at a time."""
    for one in pieces:
        for start in range(0, len(one.dt), CHUNK):
            yield Readings(*(values[start : start + CHUNK] for values in one))


def watch(filter_: Native | Exported, pieces: Iterator[Readings]) -> Found:
    """All pieces through a filter."""
    looks, crooked, least, zero, smallest, largest = 0, 0.0, np.inf, 0, np.inf, 0.0
    for part in parts(pieces):
        p, sigma = filter_.feed(part)
        looks += 1
        crooked = max(crooked, float(np.abs(p - p.T).max()))
        least = min(least, least_eigenvalue(p))
        zero += int(np.sum(~(sigma > 0.0).all(axis=1)))
        smallest, largest = min(smallest, float(sigma.min())), max(largest, float(sigma.max()))
    return Found(looks, crooked, least, zero, smallest, largest)
