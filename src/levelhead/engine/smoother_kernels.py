"""The smoother's way there and back as compiled code runs it; ``smoothing`` binds it to a filter."""

from typing import NamedTuple, Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.mark import compiled_only, kernel
from levelhead.engine.driver import Carry, Settings, process_row, result, update_aiding, write_nav
from levelhead.filters.contract import FilterState, NavState
from levelhead.kernels import quat
from levelhead.kernels.arrays import Floats
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS
from levelhead.kernels.vec3 import Vec3, add, scale
from levelhead.recording import Array

SHORTEST = 1e-9  # s, a block


class Hooks(Protocol):
    """The functions of a filter that the smoother calls: members of its ``contract.Smoothing``."""

    WIDTH: int  # numbers of a block

    @staticmethod
    def is_block_end(state: FilterState) -> bool:
        """Whether a block ended with the last sample."""
        ...

    @staticmethod
    def keep_start(state: FilterState, kept: Array) -> None:
        """Keeps the block before a stretch, as the first of its blocks."""
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
    """Its further functions with aiding: members of ``contract.AidedSmoothing``."""

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
    """The results, flat."""

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


@kernel
def keep_block(state: FilterState, i: int, kept: BlockRows, count: int) -> int:
    """How many blocks are kept after sample i: one more if a block ended with it."""
    if not hooks.is_block_end(state):
        return count
    hooks.keep(state, kept.numbers, hooks.WIDTH * count)
    kept.end[count] = float(i)
    return count + 1


@kernel
def write_attitude(settings: Settings, carry: Carry, i: int, attitude: Array, health: Array) -> None:
    """Attitude and health of sample i; its bias and σ come on the way back."""
    said = result(settings, carry.run)
    k = 4 * i
    attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3] = said.quat
    health[i] = said.health


@compiled_only
def forward_stretch(
    settings: Settings, carry: Carry, last: float, start: int, t: Floats, gyr: Floats, acc: Floats, mag: Floats,
    attitude: Array, health: Array, kept: BlockRows,
) -> tuple[Carry, int, int]:  # fmt: skip
    """Samples from ``start`` on until there is no room for another block, or no sample.

    Returns the carry, how many blocks were kept, and the sample after the last one. The native engine has this loop,
    with aiding and without, in ``native.forward.c``.
    """
    hooks.keep_start(carry.run.state, kept.numbers)
    count = 1
    i = start
    while i < len(t) and count < len(kept.end):
        carry = process_row(settings, carry, i, gyr, acc, mag, t[i] - last)
        last = t[i]
        count = keep_block(carry.run.state, i, kept, count)
        write_attitude(settings, carry, i, attitude, health)
        i += 1
    return carry, count, i


@kernel
def go_back(kept: Array, k: int, count: int, m: Array, turn: Array, bias: Array, sigma: Array) -> None:
    """To block k from the one behind it: the rotation vector of its correction, its bias and σ."""
    if k < count - 1:
        hooks.back(kept, hooks.WIDTH * k, m)
    vector, offset, deviation = hooks.read(kept, hooks.WIDTH * k, m)
    j = 3 * k
    turn[j], turn[j + 1], turn[j + 2] = vector
    bias[j], bias[j + 1], bias[j + 2] = offset
    sigma[j], sigma[j + 1], sigma[j + 2] = deviation


@kernel
def backward(kept: Array, count: int, m: Array, turn: Array, bias: Array, sigma: Array) -> None:
    """Rotation vectors of the corrections, bias and σ of all blocks kept, from the last one on, which m holds."""
    for steps in range(count):
        go_back(kept, count - 1 - steps, count, m, turn, bias, sigma)


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
def turn_by(attitude: Array, i: int, vector: Vec3) -> None:
    """Turns the attitude of sample i by a rotation vector, earth frame."""
    k = 4 * i
    q = Quat(attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3])
    attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3] = quat.compose(quat.exp(vector), q)


class Interval(NamedTuple):
    """From the end of a block to that of the next one."""

    left: float  # s, the end of the first
    span: float  # s
    has_end: bool  # False: the time after the last block
    new_start: bool  # the attitude of the second is independent of that of the first,
    joined: int  # and samples from this one on belong to the second


@kernel
def block_interval(t: Array, kept: Array, k: int, count: int, first: int, last: int) -> Interval:
    """From the end of block k − 1, with the samples from ``first`` to ``last``."""
    before, has_end = max(first - 1, 0), k < count
    new_start = has_end and hooks.is_restart(kept, hooks.WIDTH * k)
    joined = last_gap(t, before, last) if new_start else 0
    return Interval(
        left=t[before], span=max(t[last] - t[before], SHORTEST), has_end=has_end, new_start=new_start, joined=joined
    )


@kernel
def shares_at(interval: Interval, i: int, time: float) -> tuple[float, float]:
    """The second block's in sample i, linear in time; and that in states that do not continue over a new start."""
    line = min((time - interval.left) / interval.span, 1.0) if interval.has_end else 1.0
    if interval.new_start:
        return line, 1.0 if i >= interval.joined else 0.0
    return line, line


@kernel
def spread_block(
    t: Array, kept: Array, k: int, count: int, first: int, last: int,
    turn: Array, before: Array, bias: Array, sigma: Array, attitude: Array, biases: Array, sigmas: Array,
) -> None:  # fmt: skip
    """From the ends of block k − 1 and k to each sample between: linear, but not across a new start.

    ``first`` and ``last`` are these samples. Block ``count`` has no end: the state after the last one.
    """
    one = 3 * (k - 1)
    other = 3 * min(k, count - 1)
    interval = block_interval(t, kept, k, count, first, last)
    for i in range(first, last + 1):
        line, share = shares_at(interval, i, t[i])
        vector = Vec3(turn[other], turn[other + 1], turn[other + 2])
        if interval.has_end and i < last:
            one_vector = Vec3(turn[one], turn[one + 1], turn[one + 2])
            other_vector = Vec3(before[other], before[other + 1], before[other + 2])
            vector = add(scale(one_vector, 1.0 - share), scale(other_vector, share))
        turn_by(attitude, i, vector)
        for j in range(3):
            biases[3 * i + j] = bias[one + j] + line * (bias[other + j] - bias[one + j])
            sigmas[3 * i + j] = sigma[one + j] + line * (sigma[other + j] - sigma[one + j])


@kernel
def block_rows(end: Array, k: int, count: int, stop: int) -> tuple[int, int]:
    """The first and the last sample of block k; block ``count`` ends before ``stop``."""
    return int(end[k - 1]) + 1, int(end[k]) if k < count else stop - 1


@compiled_only
def spread_blocks(t: Array, kept: BlockRows, count: int, stop: int, corrections: Corrections, track: FlatTrack) -> None:
    """From the blocks that were kept to every sample between them and up to ``stop``."""
    turn, before = corrections.turn, corrections.before
    attitude, biases, sigmas = track
    compose_ends(kept.numbers, count, turn, before)
    k = 1
    while k <= count:
        first, last = block_rows(kept.end, k, count, stop)
        spread_block(
            t, kept.numbers, k, count, first, last, turn, before, corrections.bias, corrections.sigma, attitude, biases,
            sigmas,
        )  # fmt: skip
        k += 1


@compiled_only
def correct_stretch(
    t: Array, kept: BlockRows, count: int, stop: int, memory: Array, corrections: Corrections, track: FlatTrack
) -> None:
    """Backwards through the blocks that were kept, then to every sample.

    The native engine has this, with position and velocity and without, in ``native.smoother.c``.
    """
    backward(kept.numbers, count, memory, corrections.turn, corrections.bias, corrections.sigma)
    spread_blocks(t, kept, count, stop, corrections, track)


@compiled_only
def forward_stretch_with_aiding(
    settings: Settings, carry: Carry, last: float, start: int, t: Floats, gyr: Floats, acc: Floats, mag: Floats,
    attitude: Array, health: Array, kept: BlockRows, readings: Readings, nav: Floats,
) -> tuple[Carry, int, int]:  # fmt: skip
    """``forward_stretch`` with position, velocity and height; fills ``nav`` as ``run_with_aiding`` does."""
    hooks.keep_start(carry.run.state, kept.numbers)
    count = 1
    i = start
    while i < len(t) and count < len(kept.end):
        carry = process_row(settings, carry, i, gyr, acc, mag, t[i] - last)
        last = t[i]
        count = keep_block(carry.run.state, i, kept, count)
        for r in range(readings.first[i], readings.first[i + 1]):
            carry = update_aiding(
                settings, carry, readings.row[r], readings.value[r], readings.sigma[r], readings.age[r]
            )
        write_attitude(settings, carry, i, attitude, health)
        write_nav(settings, carry, i, nav)
        i += 1
    return carry, count, i


class NavCorrections(NamedTuple):
    """Of the blocks kept, flat."""

    end: Array  # 12 each: corrections of position and velocity at their ends, 1σ of both
    before: Array  # 6 each: corrections just before their ends


@kernel
def write_pair(values: Array, k: int, one: Vec3, other: Vec3) -> None:
    """Two vectors as six numbers from k on."""
    values[k], values[k + 1], values[k + 2] = one
    values[k + 3], values[k + 4], values[k + 5] = other


@kernel
def backward_with_nav(
    kept: Array, count: int, m: Array, turn: Array, bias: Array, sigma: Array, end: Array, before: Array
) -> None:
    """``backward`` that reads position and velocity of each block too."""
    for steps in range(count):
        k = count - 1 - steps
        go_back(kept, k, count, m, turn, bias, sigma)
        nav, change = nav_hooks.read_nav(kept, hooks.WIDTH * k, m), nav_hooks.nav_change(kept, hooks.WIDTH * k)
        j = 12 * k
        write_pair(end, j, nav.position, nav.velocity)
        write_pair(end, j + 6, nav.sigma_position, nav.sigma_velocity)
        write_pair(before, 6 * k, change.position, change.velocity)
        for i in range(6):
            before[6 * k + i] += end[j + i]


@kernel
def spread_nav(
    t: Array, kept: Array, k: int, count: int, first: int, last: int, end: Array, before: Array, nav: Array
) -> None:
    """``spread_block`` of position and velocity, which are in ``nav`` as yet without corrections, and of their 1σ."""
    one, other = 12 * (k - 1), 12 * min(k, count - 1)
    interval = block_interval(t, kept, k, count, first, last)
    for i in range(first, last + 1):
        _, share = shares_at(interval, i, t[i])
        for j in range(6):
            is_set = interval.has_end and not interval.new_start and nav_hooks.is_set(kept, hooks.WIDTH * k, j)
            part = 1.0 if is_set else share
            if interval.has_end and i < last:
                nav[12 * i + j] += (1.0 - part) * end[one + j] + part * before[6 * k + j]
            else:
                nav[12 * i + j] += end[other + j]
            deviation = end[one + 6 + j]
            nav[12 * i + 6 + j] = deviation + part * (end[other + 6 + j] - deviation)


@compiled_only
def correct_stretch_with_nav(
    t: Array, kept: BlockRows, count: int, stop: int, memory: Array, corrections: Corrections, track: FlatTrack,
    found: NavCorrections, nav: Array,
) -> None:  # fmt: skip
    """``correct_stretch`` with position and velocity."""
    backward_with_nav(
        kept.numbers, count, memory, corrections.turn, corrections.bias, corrections.sigma, found.end, found.before
    )
    spread_blocks(t, kept, count, stop, corrections, track)
    k = 1
    while k <= count:
        first, last = block_rows(kept.end, k, count, stop)
        spread_nav(t, kept.numbers, k, count, first, last, found.end, found.before, nav)
        k += 1
