"""A buoy that follows a random sea of deep water: heave, orbit and slope of the surface in closed form."""

import math

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.simulate.disturbance import require_number
from levelhead.simulate.motion import Motion, attitude
from levelhead.simulate.noise import generator
from levelhead.units import GRAVITY

COMPONENTS = 60  # waves of other frequencies and directions
BAND = (0.6, 4.0)  # of the peak's frequency
SPREAD = math.radians(20.0)  # 1σ of the waves' directions
PEAKEDNESS, WIDTH = 3.3, (0.07, 0.09)  # γ, and σ below and above the peak (JONSWAP's means)


def buoy(
    duration: float = 300.0, rate: float = 50.0, *, height: float = 1.0, period: float = 6.0, seed: int = 0
) -> Motion:
    """The motion of a buoy that is as steep as the water is, from the first sample on.

    The spectrum is that of JONSWAP (K. Hasselmann et al., Deutsche Hydrographische Zeitschrift A8(12), 1973). Particles
    of deep water move in circles, and the wavenumber is ω²/g (linear theory).

    Args:
        duration: s.
        rate: samples a second.
        height: m, significant: four times the standard deviation of heave.
        period: s, of the spectrum's peak.
        seed: zero or more.

    Raises:
        LevelheadError: a number out of range, or waves so steep that they would break.
    """
    for name, value, unit in (("duration", duration, "s"), ("rate", rate, "Hz"), ("height", height, "m"),
                              ("period", period, "s")):  # fmt: skip
        require_number(name, value, unit, positive=True)
    peak = 2.0 * math.pi / period
    if height * peak * peak > 0.4 * GRAVITY:
        raise LevelheadError(f"waves of {height:g} m and {period:g} s would break; give a lower height")
    random = generator(seed, 0, 3)
    t = np.arange(round(duration * rate)) / rate
    edges = peak * np.geomspace(*BAND, COMPONENTS + 1)
    omega = random.uniform(edges[:-1], edges[1:])
    energy = _spectrum(omega / peak) * np.diff(edges)
    amplitude = np.sqrt(2.0 * energy / energy.sum()) * height / 4.0
    phase, angle = random.uniform(0.0, 2.0 * math.pi, COMPONENTS), random.normal(0.0, SPREAD, COMPONENTS)
    position, velocity, acceleration, slope, slope_rate = (np.zeros((len(t), 3)) for _ in range(5))
    for a, w, p, d in zip(amplitude, omega, phase, angle, strict=True):
        sine, cosine = np.sin(w * t + p)[:, None], np.cos(w * t + p)[:, None]
        along, up = np.array([math.cos(d), math.sin(d), 0.0]), np.array([0.0, 0.0, 1.0])
        position += a * (cosine * up + sine * along)
        velocity += a * w * (cosine * along - sine * up)
        acceleration -= a * w * w * (cosine * up + sine * along)
        tilt = a * w * w / GRAVITY * np.array([math.sin(d), -math.cos(d), 0.0])  # roll, pitch of a surface that rises
        slope += sine * tilt
        slope_rate += w * cosine * tilt
    return Motion(t, *attitude(slope, slope_rate), position, velocity, acceleration)


def _spectrum(ratio: Array) -> Array:
    """JONSWAP's density of heave at multiples of the peak's frequency, in any unit."""
    width = np.where(ratio <= 1.0, *WIDTH)
    peaked = PEAKEDNESS ** np.exp(-0.5 * ((ratio - 1.0) / width) ** 2)
    density: Array = ratio**-5 * np.exp(-1.25 * ratio**-4) * peaked
    return density
