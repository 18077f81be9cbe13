"""The smoother's way there and back as compiled code runs it; ``smoothing`` binds it to a filter."""

from typing import NamedTuple, Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.mark import compiled_only, kernel
from levelhead.engine.driver import Carry, Settings, advance, aiding, result, update_aiding
from levelhead.filters.contract import FilterState, NavState
from levelhead.kernels import quat
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS
from levelhead.kernels.vec3 import Vec3
from levelhead.recording import Array

SHORTEST = 1e-9  # s, a block


class Hooks(Protocol):
    """What the smoother calls of a filter: members of its ``contract.Smoothing``."""

    WIDTH: int  # numbers of a block

    @staticmethod
    def is_block_end(state: FilterState) -> bool:
        """Whether a block ended with the last sample."""
        ...

    @staticmethod
    def keep(state: FilterState, kept: Array, first: int) -> None:
        """Keeps the block that has just ended, as numbers from ``first`` on."""
        ...

    @staticmethod
    def back(kept: Array, first: int, memory: Array) -> None:
        """One step back, to the block that is kept from ``first`` on."""
        ...

    @staticmethod
    def read(kept: Array, first: int, memory: Array) -> tuple[Vec3, Vec3, Vec3]:
        """Rotation vector, bias and σ of the block that the step back has reached."""
        ...

    @staticmethod
    def rotation(kept: Array, first: int) -> Quat:
        """The rotation by the correction at the end of a block, earth frame."""
        ...

    @staticmethod
    def is_restart(kept: Array, first: int) -> bool:
        """Whether the attitude of a block is independent of that before it."""
        ...


class NavHooks(Protocol):
    """What it calls besides where there is aiding: members of ``contract.AidedSmoothing``."""

    @staticmethod
    def read_nav(kept: Array, first: int, memory: Array) -> NavState:
        """Corrections of position and velocity of the block that the step back has reached, 1σ of both."""
        ...

    @staticmethod
    def nav_change(kept: Array, first: int) -> NavState:
        """By which the end of a block changed position and velocity."""
        ...

    @staticmethod
    def is_set(kept: Array, first: int, i: int) -> bool:
        """Whether number i of position and velocity has no past before the block."""
        ...


hooks: Hooks = declare(Hooks)
nav_hooks: NavHooks = declare(NavHooks)


class BlockRows(NamedTuple):
    """The blocks of a stretch, one after the other; the first one is the last of the stretch before."""

    numbers: Array  # WIDTH of each
    end: Array  # last sample of each


class FlatTrack(NamedTuple):
    """What comes out, flat."""

    quat: Array  # 4 a sample
    bias: Array  # 3
    sigma: Array  # 3


class Readings(NamedTuple):
    """Of aiding: ``aiding_inputs.AidingInputs``."""

    first: Array
    row: Array
    value: Array
    sigma: Array
    age: Array


class Corrections(NamedTuple):
    """Of the blocks kept, three numbers each, flat."""

    turn: Array  # rotation vectors of the corrections at their ends
    before: Array  # and just before their ends
    bias: Array
    sigma: Array


@compiled_only
def forward_stretch(
    settings: Settings, carry: Carry, last: float, start: int, t: Array, gyr: Array, acc: Array, mag: Array,
    attitude: Array, health: Array, kept: BlockRows,
) -> tuple[Carry, int, int]:  # fmt: skip
    """Samples from ``start`` on until there is no room for another block, or no sample.

    Returns the carry, how many blocks were kept, and the sample after the last one. The native engine has this loop in
    ``native.forward.c``.
    """
    field = Vec3(0.0, 0.0, 0.0)
    count = 1
    i = start
    while i < len(t) and count < len(kept.end):
        j = 3 * i
        if len(mag) > 0:
            field = Vec3(mag[j], mag[j + 1], mag[j + 2])
        turned = Vec3(gyr[j], gyr[j + 1], gyr[j + 2])
        carry = advance(settings, carry, turned, Vec3(acc[j], acc[j + 1], acc[j + 2]), field, t[i] - last)
        last = t[i]
        said = result(settings, carry.run)
        k = 4 * i
        attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3] = said.quat
        health[i] = said.health
        if hooks.is_block_end(carry.run.state):
            hooks.keep(carry.run.state, kept.numbers, hooks.WIDTH * count)
            kept.end[count] = float(i)
            count += 1
        i += 1
    return carry, count, i


@kernel
def backward(kept: Array, count: int, m: Array, turn: Array, bias: Array, sigma: Array) -> None:
    """Rotation vectors of the corrections, bias and σ of all blocks kept, from the last one on, which m holds."""
    for steps in range(count):
        k = count - 1 - steps
        if steps > 0:
            hooks.back(kept, hooks.WIDTH * k, m)
        vector, offset, deviation = hooks.read(kept, hooks.WIDTH * k, m)
        j = 3 * k
        turn[j], turn[j + 1], turn[j + 2] = vector
        bias[j], bias[j + 1], bias[j + 2] = offset
        sigma[j], sigma[j + 1], sigma[j + 2] = deviation


@kernel
def compose_ends(kept: Array, count: int, turn: Array, before: Array) -> None:
    """Rotation vectors of attitudes just before the ends of blocks: by the blocks' own corrections, then ``turn``."""
    for k in range(count):
        j = 3 * k
        asked = quat.exp(Vec3(turn[j], turn[j + 1], turn[j + 2]))
        before[j], before[j + 1], before[j + 2] = quat.log(quat.multiply(asked, hooks.rotation(kept, hooks.WIDTH * k)))


@kernel
def last_gap(t: Array, first: int, last: int) -> int:
    """The last sample of these that comes after a gap; ``first`` if none does."""
    found = first
    for i in range(first + 1, last + 1):
        if t[i] - t[i - 1] > GAP_SECONDS:
            found = i
    return found


@kernel
def turn_by(attitude: Array, i: int, x: float, y: float, z: float) -> None:
    """Turns the attitude of sample i by a rotation vector, earth frame."""
    k = 4 * i
    q = Quat(attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3])
    turned = quat.compose(quat.exp(Vec3(x, y, z)), q)
    attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3] = turned


@kernel
def spread_block(
    t: Array, kept: Array, k: int, count: int, first: int, last: int,
    turn: Array, before: Array, bias: Array, sigma: Array, attitude: Array, biases: Array, sigmas: Array,
) -> None:  # fmt: skip
    """From the ends of block k − 1 and k to each sample between: linear, but not across a new start.

    ``first`` and ``last`` are these samples. Block ``count`` has no end: it is what follows the last one.
    """
    here = min(k, count - 1)
    one = 3 * (k - 1)
    other = 3 * here
    left = t[max(first - 1, 0)]
    span = max(t[last] - left, SHORTEST)
    new_start = hooks.is_restart(kept, hooks.WIDTH * here)
    joined = last_gap(t, max(first - 1, 0), last) if new_start else 0
    for i in range(first, last + 1):
        line = min((t[i] - left) / span, 1.0) if k < count else 1.0
        share = line
        if new_start:
            share = 1.0 if i >= joined else 0.0
        if k == count or i == last:
            turn_by(attitude, i, turn[other], turn[other + 1], turn[other + 2])
        else:
            kept_share = 1.0 - share
            turn_by(
                attitude,
                i,
                kept_share * turn[one] + share * before[other],
                kept_share * turn[one + 1] + share * before[other + 1],
                kept_share * turn[one + 2] + share * before[other + 2],
            )
        for j in range(3):
            biases[3 * i + j] = bias[one + j] + line * (bias[other + j] - bias[one + j])
            sigmas[3 * i + j] = sigma[one + j] + line * (sigma[other + j] - sigma[one + j])


@compiled_only
def correct_stretch(
    t: Array, kept: BlockRows, count: int, stop: int, memory: Array, corrections: Corrections, track: FlatTrack
) -> None:
    """Backwards through the blocks that were kept, then to every sample between them and up to ``stop``.

    The native engine has this loop in ``native.smoother.c``.
    """
    turn, before, bias, sigma = corrections
    backward(kept.numbers, count, memory, turn, bias, sigma)
    compose_ends(kept.numbers, count, turn, before)
    k = 1
    while k <= count:
        first = int(kept.end[k - 1]) + 1
        last = int(kept.end[k]) if k < count else stop - 1
        spread_block(
            t, kept.numbers, k, count, first, last, turn, before, bias, sigma, track.quat, track.bias, track.sigma
        )
        k += 1


@compiled_only
def forward_stretch_with_aiding(
    settings: Settings, carry: Carry, last: float, start: int, t: Array, gyr: Array, acc: Array, mag: Array,
    attitude: Array, health: Array, kept: BlockRows, readings: Readings, nav: Array,
) -> tuple[Carry, int, int]:  # fmt: skip
    """``forward_stretch`` with position, velocity and height; fills ``nav``, 6 a sample: position and velocity."""
    field = Vec3(0.0, 0.0, 0.0)
    count = 1
    i = start
    while i < len(t) and count < len(kept.end):
        j = 3 * i
        if len(mag) > 0:
            field = Vec3(mag[j], mag[j + 1], mag[j + 2])
        turned = Vec3(gyr[j], gyr[j + 1], gyr[j + 2])
        carry = advance(settings, carry, turned, Vec3(acc[j], acc[j + 1], acc[j + 2]), field, t[i] - last)
        last = t[i]
        if hooks.is_block_end(carry.run.state):
            hooks.keep(carry.run.state, kept.numbers, hooks.WIDTH * count)
            kept.end[count] = float(i)
            count += 1
        for r in range(readings.first[i], readings.first[i + 1]):
            carry = update_aiding(
                settings, carry, readings.row[r], readings.value[r], readings.sigma[r], readings.age[r]
            )
        said = result(settings, carry.run)
        k = 4 * i
        attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3] = said.quat
        health[i] = said.health
        seen = aiding.nav_state(settings.filter, carry.run.state)
        k = 6 * i
        nav[k], nav[k + 1], nav[k + 2] = seen.position
        nav[k + 3], nav[k + 4], nav[k + 5] = seen.velocity
        i += 1
    return carry, count, i


class NavCorrections(NamedTuple):
    """Of the blocks kept, flat."""

    end: Array  # 12 each: corrections of position and velocity at their ends, 1σ of both
    before: Array  # 6 each: corrections just before their ends


@kernel
def write_nav(values: Array, k: int, nav: NavState) -> None:
    """Position and velocity as six numbers from k on."""
    values[k], values[k + 1], values[k + 2] = nav.position
    values[k + 3], values[k + 4], values[k + 5] = nav.velocity


@kernel
def backward_with_nav(
    kept: Array, count: int, m: Array, turn: Array, bias: Array, sigma: Array, found: NavCorrections
) -> None:
    """``backward`` that reads position and velocity of each block too."""
    for steps in range(count):
        k = count - 1 - steps
        if steps > 0:
            hooks.back(kept, hooks.WIDTH * k, m)
        vector, offset, deviation = hooks.read(kept, hooks.WIDTH * k, m)
        j = 3 * k
        turn[j], turn[j + 1], turn[j + 2] = vector
        bias[j], bias[j + 1], bias[j + 2] = offset
        sigma[j], sigma[j + 1], sigma[j + 2] = deviation
        nav = nav_hooks.read_nav(kept, hooks.WIDTH * k, m)
        j = 12 * k
        write_nav(found.end, j, nav)
        found.end[j + 6], found.end[j + 7], found.end[j + 8] = nav.sigma_position
        found.end[j + 9], found.end[j + 10], found.end[j + 11] = nav.sigma_velocity
        write_nav(found.before, 6 * k, nav_hooks.nav_change(kept, hooks.WIDTH * k))
        for i in range(6):
            found.before[6 * k + i] += found.end[j + i]


@kernel
def spread_nav(
    t: Array, kept: Array, k: int, count: int, first: int, last: int, found: NavCorrections, nav: Array, sigmas: Array
) -> None:
    """``spread_block`` of position and velocity, and of their 1σ (``sigmas``, 6 a sample)."""
    here = min(k, count - 1)
    left = t[max(first - 1, 0)]
    span = max(t[last] - left, SHORTEST)
    new_start = hooks.is_restart(kept, hooks.WIDTH * here)
    joined = last_gap(t, max(first - 1, 0), last) if new_start else 0
    for i in range(first, last + 1):
        line = min((t[i] - left) / span, 1.0) if k < count else 1.0
        share = line
        if new_start:
            share = 1.0 if i >= joined else 0.0
        for j in range(6):
            part = share
            if k < count and not new_start and nav_hooks.is_set(kept, hooks.WIDTH * k, j):
                part = 1.0
            one, other = found.end[12 * (k - 1) + j], found.end[12 * here + j]
            if k < count and i < last:
                nav[6 * i + j] += (1.0 - part) * one + part * found.before[6 * here + j]
            else:
                nav[6 * i + j] += other
            deviation = found.end[12 * (k - 1) + 6 + j]
            sigmas[6 * i + j] = deviation + part * (found.end[12 * here + 6 + j] - deviation)


@compiled_only
def correct_stretch_with_nav(
    t: Array, kept: BlockRows, count: int, stop: int, memory: Array, corrections: Corrections, track: FlatTrack,
    found: NavCorrections, nav: Array, sigmas: Array,
) -> None:  # fmt: skip
    """``correct_stretch`` with position and velocity."""
    turn, before, bias, sigma = corrections
    backward_with_nav(kept.numbers, count, memory, turn, bias, sigma, found)
    compose_ends(kept.numbers, count, turn, before)
    k = 1
    while k <= count:
        first = int(kept.end[k - 1]) + 1
        last = int(kept.end[k]) if k < count else stop - 1
        spread_block(
            t, kept.numbers, k, count, first, last, turn, before, bias, sigma, track.quat, track.bias, track.sigma
        )
        spread_nav(t, kept.numbers, k, count, first, last, found, nav, sigmas)
        k += 1
