"""The driver over all lanes of a block, as kernels; ``lanes`` binds and compiles them for their use."""

from collections.abc import Callable
from math import nan
from typing import Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.lane_slots import LANES
from levelhead.compiler.mark import compiled_only, kernel, with_globals
from levelhead.compiler.tree import Tree
from levelhead.engine import driver
from levelhead.engine.conditioning import ConditionedSample, condition, sigma_due
from levelhead.engine.driver import FilterRun, Settings
from levelhead.filters.contract import Output
from levelhead.guard import Guard
from levelhead.kernels import quat, vector_error
from levelhead.kernels.arrays import Floats
from levelhead.kernels.quat import Quat
from levelhead.kernels.trig import SinCos
from levelhead.kernels.vec3 import ZERO, Vec3


class LaneHooks(Protocol):
    """The observer that lanes are compiled for, and their block of memory; ``at`` is its address."""

    HAS_MAG: bool  # without a magnetometer its part of the filter is not compiled
    OWN_SIGMA: bool  # as ``driver.Hooks``
    CORRECTS: bool  # the filter has a part that does not run at every sample

    @staticmethod
    def each(body: Callable[..., None], at: int, guard: Guard, argument: Tree) -> None:
        """Calls ``body(at, lane, guard, argument)`` for every lane, in a loop that becomes SIMD."""
        ...

    @staticmethod
    def load(at: int, lane: int) -> FilterRun:
        """A lane's run."""
        ...

    @staticmethod
    def store(at: int, lane: int, run: FilterRun) -> None:
        """Writes a lane's run."""
        ...

    @staticmethod
    def load_params(at: int, lane: int) -> Settings:
        """A lane's filter parameters."""
        ...


class OutputHooks(Protocol):
    """Where the outputs of a chunk of samples go."""

    BYTES: int  # of one sample's outputs, all lanes

    @staticmethod
    def store(tile: int, lane: int, output: Output) -> None:
        """Writes a lane's output to the rows at the address ``tile``."""
        ...


class ObserverHooks(Protocol):
    """An observer's kernel, and where in the block its values lie."""

    @staticmethod
    def observe(sums: Tree, quat: Quat, truth: Quat) -> Tree:
        """The observation with one more sample."""
        ...

    @staticmethod
    def load(at: int, lane: int) -> Tree:
        """A lane's observed values."""
        ...

    @staticmethod
    def store(at: int, lane: int, sums: Tree) -> None:
        """Writes them."""
        ...


class SinkHooks(Protocol):
    """The use of a sample's results."""

    @staticmethod
    def take(at: int, guard: Guard, i: int, more: Tree) -> None:
        """Takes the results of sample i of a chunk: ``take_outputs`` or ``take_errors``."""
        ...


hooks: LaneHooks = declare(LaneHooks)
outputs: OutputHooks = declare(OutputHooks)
observer: ObserverHooks = declare(ObserverHooks)
sink: SinkHooks = declare(SinkHooks)


@kernel
def not_a_number(excess: float) -> float:
    """In place of a scale that is hardly ever needed."""
    return nan


@kernel
def no_sine(angle: float) -> SinCos:
    """In place of a sine and a cosine that are hardly ever needed."""
    return SinCos(nan, nan)


@kernel
def no_direction(expected: Vec3, x: float, y: float, z: float) -> Vec3:
    """In place of the error of a direction that is beyond a right angle."""
    return Vec3(nan, nan, nan)


RARE = (
    (quat.half_angle_far, with_globals(quat.half_angle_far, "short", sincos=no_sine)),
    (vector_error.unit_scale, not_a_number),
    (vector_error.obtuse_error, no_direction),
)


@compiled_only
def start(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """``driver.start`` of one lane."""
    hooks.store(at, lane, driver.start(Settings(hooks.load_params(at, lane), guard), sample, hooks.load(at, lane)))


@compiled_only
def update_rest(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """``driver.update_rest`` of one lane."""
    settings = Settings(hooks.load_params(at, lane), guard)
    hooks.store(at, lane, driver.update_rest(settings, sample, hooks.load(at, lane)))


@compiled_only
def inflate(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """``driver.inflate`` of one lane."""
    hooks.store(at, lane, driver.inflate(Settings(hooks.load_params(at, lane), guard), sample, hooks.load(at, lane)))


@compiled_only
def step_accelerated(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """``driver.gate_acceleration`` and ``driver.step`` of one lane."""
    settings = Settings(hooks.load_params(at, lane), guard)
    run = driver.gate_acceleration(settings, sample, hooks.load(at, lane))
    hooks.store(at, lane, driver.step(settings, sample, run))


@compiled_only
def step_plain(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """``driver.accept_force`` and ``driver.step`` of one lane."""
    settings = Settings(hooks.load_params(at, lane), guard)
    hooks.store(at, lane, driver.step(settings, sample, driver.accept_force(sample, hooks.load(at, lane))))


@compiled_only
def apply_correction(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """``driver.apply_correction`` of one lane."""
    settings = Settings(hooks.load_params(at, lane), guard)
    hooks.store(at, lane, driver.apply_correction(settings, sample, hooks.load(at, lane)))


@compiled_only
def update_sigma(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """``driver.update_sigma`` of one lane."""
    settings = Settings(hooks.load_params(at, lane), guard)
    hooks.store(at, lane, driver.update_sigma(settings, sample, hooks.load(at, lane)))


@compiled_only
def run_lanes(
    at: int,
    guard: Guard,
    sample: ConditionedSample,
    last: float,
    t: Floats,
    gyr: Floats,
    acc: Floats,
    mag: Floats,
    more: Tree,
) -> ConditionedSample:
    """A chunk of samples, as ``driver.run``, through all lanes of the block at an address.

    The phases are those of ``driver.advance``, each over all lanes. A sample is conditioned once for all lanes, and
    whether a phase has work to do is decided once for all. ``sink.take`` takes each sample's results, with ``more``.
    The sample returned is where the next chunk begins.
    """
    field = ZERO
    for i in range(len(t)):
        j = 3 * i
        if hooks.HAS_MAG:
            field = Vec3(mag[j], mag[j + 1], mag[j + 2])
        running = sample.started
        rate = Vec3(gyr[j], gyr[j + 1], gyr[j + 2])
        sample = condition(guard, sample, rate, Vec3(acc[j], acc[j + 1], acc[j + 2]), field, t[i] - last)
        last = t[i]
        if not running:
            hooks.each(start, at, guard, sample)
        else:
            if sample.detected.sums.complete:
                hooks.each(update_rest, at, guard, sample)
            if sample.unmeasured > 0.0:
                hooks.each(inflate, at, guard, sample)
            if sample.detected.far_from_g or sample.detected.was_far:
                hooks.each(step_accelerated, at, guard, sample)
            else:
                hooks.each(step_plain, at, guard, sample)
            if hooks.CORRECTS:
                due = 0
                for lane in range(LANES):
                    settings = Settings(hooks.load_params(at, lane), guard)
                    due += 1 if driver.correction_due(settings, sample, hooks.load(at, lane)) else 0
                if due > 0:
                    hooks.each(apply_correction, at, guard, sample)
            if not hooks.OWN_SIGMA and sigma_due(sample):
                hooks.each(update_sigma, at, guard, sample)
        sink.take(at, guard, i, more)
    return sample


@compiled_only
def store_output(at: int, lane: int, guard: Guard, tile: int) -> None:
    """Writes the output of one lane."""
    outputs.store(tile, lane, driver.result(Settings(hooks.load_params(at, lane), guard), hooks.load(at, lane)))


@compiled_only
def take_outputs(at: int, guard: Guard, i: int, tile: int) -> None:
    """Writes the output of each lane: the sample's rows of a tile of ``CHUNK`` samples at the address ``tile``."""
    hooks.each(store_output, at, guard, tile + i * outputs.BYTES)


@compiled_only
def observe_lane(at: int, lane: int, guard: Guard, real: Quat) -> None:
    """Shows an observer the orientation of one lane and the truth."""
    estimate = driver.result(Settings(hooks.load_params(at, lane), guard), hooks.load(at, lane))
    observer.store(at, lane, observer.observe(observer.load(at, lane), estimate.quat, real))


@compiled_only
def take_errors(at: int, guard: Guard, i: int, truth: Floats) -> None:
    """Shows an observer the orientation of each lane and the truth (4n, flat), where that is known."""
    j = 4 * i
    if truth[j] == truth[j]:
        hooks.each(observe_lane, at, guard, Quat(truth[j], truth[j + 1], truth[j + 2], truth[j + 3]))
