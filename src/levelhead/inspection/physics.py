"""Findings on the sensors beside each other: scale at rest, bias, the field."""

from collections.abc import Iterator

import numpy as np

from levelhead.inspection.findings import Finding
from levelhead.recording import Recording, median
from levelhead.signals.gravity_turn import excerpt, quiet_turn
from levelhead.signals.mean_force import mean_forces
from levelhead.signals.rest import rest_rows
from levelhead.units import GRAVITY

SCALE = 0.025  # of gravity
MIN_SIGMAS = 3.0  # σ by which a scale found in motion must be beyond SCALE
STRIDES = 2.0  # s, over which the accelerations of a motion cancel
MAX_HELD = 0.09  # rad/s, and rad: 5 deg/s and 5 deg
MAX_ROWS = 1_000_000  # rows that show a distribution as well as all
MIN_GRAVITY = 0.35  # g, below which there is no gravity in the force
MIN_WINDOWS = 8  # windows of STRIDES
BIAS = np.radians(0.45)  # rad/s
MAX_REVERSED_CORRELATION = -0.55  # correlation from which gravity turns against the gyroscope
MIN_CORRELATION = 0.5  # correlation from which it turns as the gyroscope has it
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


def examine_rest(recording: Recording) -> Iterator[Finding]:
    """Findings about rest: how much there is, scale of the accelerometer, bias of the gyroscope."""
    still = rest_rows(recording)
    share = float(still.mean())
    acc, gyr = recording.acc[still], recording.gyr[still]
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
    if still.sum() > 20:
        off, sigma = median(np.linalg.norm(acc, axis=1)) / GRAVITY - 1.0, 0.0
        evidence = f"median length, {100 * share:.0f} % at rest"
    else:
        off, sigma = scale_in_motion(recording)
        evidence = f"mean over {STRIDES:g} s, turned back by the gyroscope, ±{100 * sigma:.1f} %"
    if abs(off) > SCALE + MIN_SIGMAS * sigma:
        yield Finding(
            "acc_scale",
            "warning",
            f"the accelerometer feels {GRAVITY * (1 + off):.3f} m/s² "
            f"{'in motion' if sigma else 'at rest'}, {100 * off:+.1f} %",
            evidence,
            "Calibrate it: six positions, or ESKF with a prior.",
            value=1.0 + off,
            interval=(1.0 + off - 2.0 * sigma, 1.0 + off + 2.0 * sigma),
        )
    if still.sum() > 20:
        bias = np.array([median(axis) for axis in gyr.T])
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


def scale_in_motion(recording: Recording) -> tuple[float, float]:
    """(excess over gravity, its 1σ) as shares of gravity, from a motion without rest; (0, 0) if that shows nothing.

    A gyroscope against which gravity turns cannot turn the force back. A wrong one makes the mean shorter, so a force
    that is too small counts only where gravity turns as the gyroscope has it.
    """
    rows = excerpt(len(recording))
    t, gyr, acc = recording.t[rows], recording.gyr[rows], recording.acc[rows]
    quiet = quiet_turn(t, gyr, acc)
    if quiet is not None and quiet.correlation < MAX_REVERSED_CORRELATION:
        return 0.0, 0.0
    lengths = mean_forces(t, gyr, acc, STRIDES).length
    lengths = lengths[np.isfinite(lengths)]
    if len(lengths) < MIN_WINDOWS:
        return 0.0, 0.0
    off = float(lengths.mean() / GRAVITY - 1.0)
    if off < 0.0 and (quiet is None or quiet.correlation < MIN_CORRELATION):
        return 0.0, 0.0
    return off, float(lengths.std() / GRAVITY / np.sqrt(len(lengths)))


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
