"""Compiled twins that are written by hand, because Numba would not use vector instructions for them.

LLVM proves for no two stretches of one array that they lie apart, and leaves such loops scalar: four times slower.
Every number is rounded as in the kernel, a product and a sum each, whatever the width; so that bits are the same.
"""

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from levelhead.compiler.borders import Builder, CodeContext, Intrinsic, LlvmValue, NumbaType, TypingContext

WIDTH = 4  # numbers in one vector: what AVX holds; narrower processors take two steps

INDEX = ir.IntType(64)
NUMBER = ir.DoubleType()
VECTOR = ir.VectorType(NUMBER, WIDTH)


@numba.njit
def zeros(count: int) -> NDArray[np.float64]:
    """``arrays.zeros``."""
    return np.zeros(count)


def _broadcast(builder: Builder, number: LlvmValue) -> LlvmValue:
    """A vector of one number."""
    undefined = ir.Constant(VECTOR, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))


def _add(builder: Builder, data: LlvmValue, to: LlvmValue, weight: LlvmValue, at: LlvmValue, kind: LlvmValue) -> None:
    """data[to] += weight data[at], of a number or a vector."""
    there, here = (builder.bitcast(builder.gep(data, [i]), kind.as_pointer()) for i in (to, at))
    product = builder.fmul(weight, builder.load(here, align=8))
    builder.store(builder.fadd(builder.load(there, align=8), product), there, align=8)


@intrinsic
def copy(typing: TypingContext, m: NumbaType, to: NumbaType, at: NumbaType, count: NumbaType) -> Intrinsic:
    """``arrays.copy``."""

    def generate(context: CodeContext, builder: Builder, signature: NumbaType, values: LlvmValue) -> LlvmValue:
        memory, to, at, count = values
        data = context.make_array(signature.args[0])(context, builder, memory).data
        cgutils.raw_memcpy(builder, builder.gep(data, [to]), builder.gep(data, [at]), count, 8)  # type: ignore[no-untyped-call]
        return context.get_dummy_value()

    return types.void(m, types.int64, types.int64, types.int64), generate


@intrinsic
def add_scaled(
    typing: TypingContext, m: NumbaType, to: NumbaType, weight: NumbaType, at: NumbaType, count: NumbaType
) -> Intrinsic:
    """``arrays.add_scaled``: vectors as far as they go, then the rest one by one."""

    def generate(context: CodeContext, builder: Builder, signature: NumbaType, values: LlvmValue) -> LlvmValue:
        memory, to, weight, at, count = values
        data = context.make_array(signature.args[0])(context, builder, memory).data
        vectors = builder.and_(count, ir.Constant(INDEX, -WIDTH))
        spread = _broadcast(builder, weight)
        steps = (ir.Constant(INDEX, 0), vectors, WIDTH, spread, VECTOR), (vectors, count, 1, weight, NUMBER)
        for start, stop, step, factor, kind in steps:
            with cgutils.for_range_slice(builder, start, stop, ir.Constant(INDEX, step), intp=INDEX) as (j, _):
                _add(builder, data, builder.add(to, j), factor, builder.add(at, j), kind)
        return context.get_dummy_value()

    return types.void(m, types.int64, types.float64, types.int64, types.int64), generate


@intrinsic(prefer_literal=True)
def subtract_rows(
    typing: TypingContext,
    m: NumbaType,
    to: NumbaType,
    weight: NumbaType,
    step: NumbaType,
    row: NumbaType,
    stride: NumbaType,
    count: NumbaType,
    width: NumbaType,
) -> Intrinsic:
    """``arrays.subtract_rows``: the row stays in registers while all others pass."""

    def generate(context: CodeContext, builder: Builder, signature: NumbaType, values: LlvmValue) -> LlvmValue:
        memory, to, weight, step, row, stride, count, _ = values
        data = context.make_array(signature.args[0])(context, builder, memory).data

        def vector(at: LlvmValue, i: int) -> LlvmValue:
            there = builder.gep(data, [builder.add(at, ir.Constant(INDEX, WIDTH * i))])
            return builder.bitcast(there, VECTOR.as_pointer())

        sums = []
        for i in range(width.literal_value // WIDTH):
            first = builder.load(vector(to, i), align=8)
            sums.append(cgutils.alloca_once_value(builder, first))  # type: ignore[no-untyped-call]
        with cgutils.for_range(builder, count, intp=INDEX) as loop:
            here = builder.add(weight, builder.mul(loop.index, step))
            factor = _broadcast(builder, builder.load(builder.gep(data, [here])))
            at = builder.add(row, builder.mul(loop.index, stride))
            for i, total in enumerate(sums):
                product = builder.fmul(factor, builder.load(vector(at, i), align=8))
                builder.store(builder.fsub(builder.load(total), product), total)
        for i, total in enumerate(sums):
            builder.store(builder.load(total), vector(to, i), align=8)
        return context.get_dummy_value()

    if not isinstance(width, types.IntegerLiteral) or width.literal_value % WIDTH:
        return None  # Numba: no such function. Registers hold a constant number of whole vectors
    return types.void(m, *[types.int64] * 6, width), generate
