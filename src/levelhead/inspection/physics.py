"""Findings on the sensors beside each other: scale at rest, bias, the field."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.inspection.findings import Finding, Measurement
from levelhead.inspection.values import find_clipping
from levelhead.recording import Recording, median
from levelhead.signals.gravity_turn import excerpt
from levelhead.signals.mean_force import mean_forces
from levelhead.signals.rest import rest_rows
from levelhead.units import GRAVITY

SCALE = 0.025  # of gravity
MIN_SIGMAS = 3.0  # σ by which a scale found in motion must be beyond SCALE
STRIDES = 2.0  # s, over which the accelerations of a motion cancel
MAX_HELD = 0.09  # rad/s, and rad: 5 deg/s and 5 deg
MAX_ROWS = 1_000_000  # rows that show a distribution as well as all
MIN_GRAVITY = 0.35  # g, below which there is no gravity in the force
MIN_STILL = 20  # rows at rest that show a scale and a bias
MIN_WINDOWS = 8  # windows of STRIDES
BIAS = np.radians(0.45)  # rad/s
MAX_SHRINKAGE = 0.1  # of a force that is too small, by which a window twice as long may make it smaller
MAX_FIELD, MIN_FIELD = 67.0, 22.0  # µT, of the earth's field (World Magnetic Model 2020, at the ground)


def examine_gravity(recording: Recording) -> Iterator[Finding]:
    """Whether gravity is there at all: turned back by the gyroscope, the mean force over seconds is 1 g."""
    rows = excerpt(len(recording))
    t, gyr, acc = recording.t[rows], recording.gyr[rows], recording.acc[rows]
    lengths = mean_forces(t, gyr, acc, STRIDES).length
    usual = np.linalg.norm(acc, axis=1)
    usual = usual[np.isfinite(usual)]
    if len(lengths) < 3 or len(usual) == 0:
        return
    share, length = median(lengths) / GRAVITY, median(usual) / GRAVITY
    if share < MIN_GRAVITY and length < 2.0 * MIN_GRAVITY:
        yield Finding(
            "gravity_removed",
            "broken",
            "the acceleration lacks gravity: the logger removed it",
            f"its mean over {STRIDES:g} s, turned back by the gyroscope, is {share:.2f} g, its length {length:.2f} g",
            "Record the acceleration with gravity; give its columns: --map acc=X,Y,Z.",
        )


def examine_rest(recording: Recording) -> Iterator[Finding | Measurement]:
    """About rest: how much there is, scale of the accelerometer, bias of the gyroscope."""
    still = rest_rows(recording)
    share = float(still.mean())
    if share > 0.95 or _hardly_turns(recording):
        yield Finding(
            "always_still",
            "note",
            f"the sensor {'rests' if share > 0.95 else 'hardly turns'}: scale, axes and units cannot be checked",
            f"{100 * share:.0f} % at rest",
            "Turn it about all three axes for 20 s.",
        )
    elif share < 0.2:
        yield Finding(
            "never_still",
            "note",
            "the sensor hardly rests: its bias must be learned in motion",
            f"{100 * share:.0f} % at rest",
        )
    found = find_scale(recording, still)
    if found is not None:
        yield Measurement("acc_scale", "force over gravity", found.ratio, found.interval, 1.0)
    if found is not None and found.is_wrong:
        in_motion = f"mean over {STRIDES:g} s, turned back by the gyroscope, ±{100 * found.sigma:.1f} %"
        yield Finding(
            "acc_scale",
            "warning",
            f"the accelerometer feels {GRAVITY * found.ratio:.3f} m/s² "
            f"{'at rest' if found.at_rest else 'in motion'}, {100 * (found.ratio - 1.0):+.1f} %",
            f"median length, {100 * share:.0f} % at rest" if found.at_rest else in_motion,
            "Calibrate it: six positions, or ESKF with a prior.",
            value=found.ratio,
            interval=found.interval,
        )
    if still.sum() > MIN_STILL:
        bias = np.array([median(axis) for axis in recording.gyr[still].T])
        if float(np.abs(bias).max()) > BIAS:
            listed = ", ".join(f"{value:.2f}" for value in np.degrees(bias))
            yield Finding(
                "gyro_bias",
                "note",
                f"the gyroscope reads {listed} deg/s at rest",
                f"{int(still.sum())} rows at rest",
                "The filters read it off at rest.",
                value=float(np.degrees(np.abs(bias).max())),
                unit="deg/s",
            )


def _hardly_turns(recording: Recording) -> bool:
    """Whether the rate stays small and gravity on one side: held in a hand, perhaps, but too still."""
    some = slice(None, None, 1 + len(recording) // MAX_ROWS)
    rate = np.linalg.norm(recording.gyr[some], axis=1)
    up = recording.acc[some] / np.linalg.norm(recording.acc[some], axis=1)[:, None]
    known = up[np.isfinite(up).all(axis=1)]
    if len(known) == 0:
        return False
    away = np.linalg.norm(up - [median(axis) for axis in known.T], axis=1)
    return float(np.nanquantile(rate, 0.99)) < MAX_HELD and float(np.nanquantile(away, 0.99)) < MAX_HELD


class ForceScale(NamedTuple):
    """The length of the specific force over gravity.

    Attributes:
        ratio: 1 for a right accelerometer.
        sigma: 1σ of it, by the scatter of means over ``STRIDES``.
        at_rest: whether the sensor rested, or gravity is the mean force of a motion.
    """

    ratio: float
    sigma: float
    at_rest: bool

    @property
    def interval(self) -> tuple[float, float]:
        """Where the ratio lies with 95 %."""
        return self.ratio - 2.0 * self.sigma, self.ratio + 2.0 * self.sigma

    @property
    def is_wrong(self) -> bool:
        """Whether it is worth a warning."""
        return abs(self.ratio - 1.0) > SCALE + (0.0 if self.at_rest else MIN_SIGMAS * self.sigma)


def find_scale(recording: Recording, still: NDArray[np.bool_]) -> ForceScale | None:
    """At rest in the rows ``still`` (n,), or in motion; None: the motion does not show it."""
    if still.sum() <= MIN_STILL:
        return scale_in_motion(recording)
    lengths = np.linalg.norm(recording.acc[still], axis=1) / GRAVITY
    blocks = np.array_split(lengths, max(1, round(len(lengths) / (STRIDES * recording.rate))))
    means = np.array([one.mean() for one in blocks]) if len(blocks) > 1 else lengths
    return ForceScale(median(lengths), float(means.std() / np.sqrt(len(blocks))), True)


def scale_to_gravity(recording: Recording) -> Recording:
    """With the accelerometer's scale mended, where ``examine_rest`` reports one.

    A filter takes a force that is too long for acceleration.
    """
    found = find_scale(recording, rest_rows(recording))
    return recording if found is None or not found.is_wrong else replace(recording, acc=recording.acc / found.ratio)


def scale_in_motion(recording: Recording) -> ForceScale | None:
    """From a motion without rest; None if that shows nothing.

    A wrong gyroscope makes the mean shorter, the more so the longer the window; a scale makes all windows alike.
    """
    rows = excerpt(len(recording))
    t, gyr, acc = recording.t[rows], recording.gyr[rows], np.array(recording.acc[rows])
    if (clipping := find_clipping("acc", acc)) is not None:
        acc[clipping.rows] = np.nan
    short, long = (mean_forces(t, gyr, acc, window).length / GRAVITY for window in (0.5 * STRIDES, STRIDES))
    if len(long) < MIN_WINDOWS:
        return None
    ratio = float(long.mean())
    if ratio < 1.0 and float(short.mean()) - ratio > MAX_SHRINKAGE * (1.0 - ratio):
        return None
    return ForceScale(ratio, float(long.std() / np.sqrt(len(long))), False)


def examine_field(recording: Recording) -> Iterator[Finding]:
    """Findings about the magnetometer."""
    if recording.mag is None:
        return
    length = np.linalg.norm(recording.mag, axis=1)
    length = length[np.isfinite(length)]
    if len(length) < 20:
        return
    low, middle, high = (float(one) for one in np.quantile(length, [0.05, 0.5, 0.95]))
    known = "mag_unit" not in recording.meta
    if (high - low) > 0.45 * middle:
        yield Finding(
            "mag_disturbed",
            "warning",
            f"the field's length varies from {low:.3g} to {high:.3g}{' µT' if known else ''}",
            "5th to 95th percentile; the earth's is constant",
            "Keep away from iron, or calibrate.",
        )
    if known and (middle > MAX_FIELD or middle < MIN_FIELD):
        yield Finding(
            "mag_strength",
            "warning",
            f"{middle:.0f} µT is not a field of the earth ({MIN_FIELD:g} to {MAX_FIELD:g} µT)",
            "median length",
            "Iron or a magnet is near, or the unit is wrong.",
        )
    up = np.einsum("ij,ij->i", recording.acc, recording.mag) / (
        np.linalg.norm(recording.acc, axis=1) * np.linalg.norm(recording.mag, axis=1)
    )
    up = up[np.isfinite(up)]
    dip = float(np.degrees(np.arcsin(np.clip(-median(up), -1.0, 1.0)))) if len(up) else 0.0
    if dip < -20.0:
        yield Finding(
            "field_points_up",
            "note",
            f"the field points up by {-dip:.0f} deg",
            "angle between specific force and field",
            "South of the magnetic equator it does; else the accelerometer points down.",
        )
