"""Euler angles in degrees for pictures: the one that moves most, σ, references from single sensors."""

import numpy as np

from levelhead.engine import fuse
from levelhead.recording import Array, Recording
from levelhead.track import Track

NAMES = ("roll", "pitch", "yaw")


def euler_of(t: Array, quat: Array) -> Array:
    """(n, 3) roll, pitch, yaw in degrees of quaternions (n, 4); NaN where they are."""
    return Track(t, quat).euler()


def most_active_axis(euler: Array) -> int:
    """0, 1 or 2: the Euler angle that moves most, by the standard deviation of its unwrapped course."""
    good = euler[np.isfinite(euler).all(axis=1)]
    if not len(good):
        return 0
    return int(np.argmax(np.unwrap(good, period=360.0, axis=0).std(axis=0)))


def wrap_degrees(degrees: Array) -> Array:
    """Angles brought to −180° … 180°."""
    return (degrees + 180.0) % 360.0 - 180.0


def euler_sigma(track: Track) -> Array | None:
    """(n, 3) 1σ of roll, pitch and yaw in degrees, at most 180°.

    A small rotation e in the earth frame changes the angles (ψ yaw, θ pitch) by

        droll  = (cos ψ e_x + sin ψ e_y) / cos θ
        dpitch = −sin ψ e_x + cos ψ e_y
        dyaw   = e_z + tan θ (cos ψ e_x + sin ψ e_y)

    and the track's σ are those of e_x, e_y and e_z, taken as independent. None if the track has no σ.
    """
    if track.sigma is None:
        return None
    _, pitch, yaw = track.euler(degrees=False).T
    x, y, z = track.sigma.T
    forward = np.hypot(np.cos(yaw) * x, np.sin(yaw) * y)
    cosine = np.maximum(np.cos(pitch), 1e-6)
    sigma = [
        forward / cosine,
        np.hypot(np.sin(yaw) * x, np.cos(yaw) * y),
        np.hypot(z, np.sin(pitch) / cosine * forward),
    ]
    capped: Array = np.minimum(np.degrees(np.stack(sigma, axis=1)), 180.0)
    return capped


def accelerometer_only(acc: Array) -> Array:
    """(n, 3) roll and pitch in degrees from each sample of (n, 3) alone; NaN where it is missing, and for yaw."""
    ax, ay, az = acc.T
    pitch = np.arctan2(-ax, np.hypot(ay, az))
    euler: Array = np.degrees(np.stack([np.arctan2(ay, az), pitch, np.full(len(pitch), np.nan)], axis=1))
    return euler


def gyroscope_only(recording: Recording) -> Array:
    """(n, 3) Euler angles in degrees from integrating the gyroscope alone."""
    return fuse(recording, "GyroIntegration").euler()


def unwrap(degrees: Array, longest: float = 720.0) -> Array:
    """An angle without its wraps, so that a drift is one line; left wrapped when that would take several turns."""
    straight = np.unwrap(degrees, period=360.0)
    return straight if np.ptp(straight) <= longest else degrees
