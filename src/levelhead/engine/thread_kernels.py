"""The driver as a GPU runs it: each thread takes one run through a chunk of samples. ``cuda`` binds and starts them."""

from typing import Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.mark import compiled_only
from levelhead.compiler.tree import Tree
from levelhead.engine.driver import Carry, Settings, advance, result
from levelhead.filters.contract import Output
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.recording import Array


class ThreadHooks(Protocol):
    """What a GPU program is compiled for, and where each thread's values lie."""

    HAS_MAG: bool  # without a magnetometer its part of the filter is not compiled

    @staticmethod
    def load_settings(floats: Array, wholes: Array, thread: int) -> Settings:
        """A thread's settings."""
        ...

    @staticmethod
    def load_carry(floats: Array, wholes: Array, thread: int) -> Carry:
        """What its run carries from chunk to chunk."""
        ...

    @staticmethod
    def store_carry(floats: Array, wholes: Array, thread: int, carry: Carry) -> None:
        """Writes it."""
        ...


class ScoreHooks(Protocol):
    """What is accumulated of each run against the truth: members of a ``lanes.Observer``."""

    @staticmethod
    def observe(sums: Tree, quat: Quat, truth: Quat) -> Tree:
        """What has been observed, with one more sample."""
        ...

    @staticmethod
    def load(floats: Array, wholes: Array, thread: int) -> Tree:
        """A thread's observed values."""
        ...

    @staticmethod
    def store(floats: Array, wholes: Array, thread: int, sums: Tree) -> None:
        """Writes them."""
        ...


hooks: ThreadHooks = declare(ThreadHooks)
score: ScoreHooks = declare(ScoreHooks)


@compiled_only
def thread_number() -> int:
    """The number of the thread that asks: stands where ``compiler.gpu_words`` has what a GPU runs."""
    raise RuntimeError("only a GPU's threads have numbers")


@compiled_only
def next_carry(settings: Settings, carry: Carry, inputs: Array, i: int, column: int) -> Carry:
    """Sample i through the filter; rows of inputs: dt, gyr (3), acc (3) and mag (3)."""
    field = ZERO
    if hooks.HAS_MAG:
        field = Vec3(inputs[7, i, column], inputs[8, i, column], inputs[9, i, column])
    rate = Vec3(inputs[1, i, column], inputs[2, i, column], inputs[3, i, column])
    force = Vec3(inputs[4, i, column], inputs[5, i, column], inputs[6, i, column])
    return advance(settings, carry, rate, force, field, inputs[0, i, column])


@compiled_only
def write_outputs(outputs: Array, health: Array, i: int, thread: int, said: Output) -> None:
    """Sample i of a thread: quaternion, bias and σ."""
    (outputs[0, i, thread], outputs[1, i, thread], outputs[2, i, thread], outputs[3, i, thread]) = said.quat
    (outputs[4, i, thread], outputs[5, i, thread], outputs[6, i, thread]) = said.bias
    (outputs[7, i, thread], outputs[8, i, thread], outputs[9, i, thread]) = said.sigma
    health[i, thread] = said.health


@compiled_only
def run_tracks(
    floats: Array, wholes: Array, lengths: Array, inputs: Array, outputs: Array, health: Array
) -> None:  # fmt: skip
    """A chunk of samples.

    Args:
        floats: (rows, threads) settings and carry, as ``compiler.thread_rows`` lays them out.
        wholes: the same of ints and bools.
        lengths: (threads,) samples of each run in this chunk.
        inputs: (10, samples, threads), or (10, samples, 1) where all runs are of one recording.
        outputs: (10, samples, threads) to be filled.
        health: (samples, threads) to be filled.
    """
    thread = thread_number()
    if thread < len(lengths):
        column = thread if inputs.shape[2] > 1 else 0
        settings = hooks.load_settings(floats, wholes, thread)
        carry = hooks.load_carry(floats, wholes, thread)
        for i in range(lengths[thread]):
            carry = next_carry(settings, carry, inputs, i, column)
            write_outputs(outputs, health, i, thread, result(settings, carry.run))
        hooks.store_carry(floats, wholes, thread, carry)


@compiled_only
def run_scores(floats: Array, wholes: Array, lengths: Array, inputs: Array, truth: Array) -> None:
    """The same, and instead of outputs an observer's values; truth: (4, samples) quaternions, NaN where unknown."""
    thread = thread_number()
    if thread < len(lengths):
        settings = hooks.load_settings(floats, wholes, thread)
        carry = hooks.load_carry(floats, wholes, thread)
        sums = score.load(floats, wholes, thread)
        for i in range(lengths[thread]):
            carry = next_carry(settings, carry, inputs, i, 0)
            if truth[0, i] == truth[0, i]:
                said = result(settings, carry.run)
                sums = score.observe(sums, said.quat, Quat(truth[0, i], truth[1, i], truth[2, i], truth[3, i]))
        hooks.store_carry(floats, wholes, thread, carry)
        score.store(floats, wholes, thread, sums)
