"""The one driver: what happens to a sample before and around a filter's step, for batch and stream alike.

These are kernels: plain Python runs them as they stand, Numba compiles the same source. ``init``, ``step`` and
``output`` are the filter's own; ``binding.bind`` binds them. Arrays are flat (row after row), so that Python lists and
NumPy arrays are indexed by the same line.
"""

from typing import Any, NamedTuple

from levelhead.filters.contract import Output
from levelhead.filters.health import ACC_MISSING, GAP, GYR_MISSING, MAG_MISSING
from levelhead.kernels.jit import kernel
from levelhead.kernels.tilt import GAP_SECONDS, present
from levelhead.kernels.vec3 import ZERO, Vec3

NO_READING = 1e9  # rad/s, m/s², µT: no sensor says that; NaN and infinity fail the comparison as well


class Carry(NamedTuple):
    """What goes from one sample to the next: the filter's state, the last good rate, whether it has started, health."""

    state: Any
    gyr: Vec3
    started: bool
    health: int


def unbound(*_: Any) -> Any:
    """Stands where a filter's kernel will be bound."""
    raise RuntimeError("bind the driver to a filter first")


init = step = output = unbound


@kernel
def missing(v: Vec3) -> bool:
    """Whether a reading is NaN, infinite or absurd in any component."""
    x = -NO_READING < v.x < NO_READING
    y = -NO_READING < v.y < NO_READING
    z = -NO_READING < v.z < NO_READING
    return not (x and y and z)


@kernel
def begin(params: Any) -> Carry:
    """Before the first sample: level, not started."""
    return Carry(init(params, ZERO, ZERO, ZERO), ZERO, False, 0)


@kernel
def advance(params: Any, carry: Carry, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Carry:
    """One sample through the filter; NaN marks a missing reading, the zero vector a sensor that does not exist.

    The filter starts at the first sample with an accelerometer reading. A missing rate is replaced by the last one,
    any other missing reading corrects nothing, and ``health`` says so.
    """
    health = 0
    if missing(gyr):
        gyr = carry.gyr
        health |= GYR_MISSING
    if missing(acc):
        acc = ZERO
        health |= ACC_MISSING
    if missing(mag):
        mag = ZERO
        health |= MAG_MISSING
    if not carry.started:
        return Carry(init(params, gyr, acc, mag), gyr, present(acc), health)
    rate = gyr
    if dt > GAP_SECONDS:
        health |= GAP
        rate = output(params, carry.state).bias  # reads as "did not turn"
    return Carry(step(params, carry.state, rate, acc, mag, dt), gyr, True, health)


@kernel
def result(params: Any, carry: Carry) -> Output:
    """The filter's output, with the driver's health bits added."""
    said: Output = output(params, carry.state)
    if carry.health == 0:
        return said
    return Output(said.quat, said.bias, said.sigma, said.health | carry.health)


@kernel
def run(
    params: Any, carry: Carry, last: float, t: Any, gyr: Any, acc: Any, mag: Any,
    quat: Any, bias: Any, sigma: Any, health: Any,
) -> Carry:  # fmt: skip
    """A stretch of samples: reads t (n), gyr, acc (3n), mag (3n or 0); fills quat (4n), bias, sigma (3n), health (n).

    ``last`` is the time of the sample before; the returned carry continues exactly where this stretch ends.
    """
    field = ZERO
    for i in range(len(t)):
        j = 3 * i
        if len(mag) > 0:
            field = Vec3(mag[j], mag[j + 1], mag[j + 2])
        carry = advance(
            params,
            carry,
            Vec3(gyr[j], gyr[j + 1], gyr[j + 2]),
            Vec3(acc[j], acc[j + 1], acc[j + 2]),
            field,
            t[i] - last,
        )
        last = t[i]
        said = result(params, carry)
        quat[4 * i] = said.quat.w
        quat[4 * i + 1] = said.quat.x
        quat[4 * i + 2] = said.quat.y
        quat[4 * i + 3] = said.quat.z
        bias[j] = said.bias.x
        bias[j + 1] = said.bias.y
        bias[j + 2] = said.bias.z
        sigma[j] = said.sigma.x
        sigma[j + 1] = said.sigma.y
        sigma[j + 2] = said.sigma.z
        health[i] = said.health
    return carry
