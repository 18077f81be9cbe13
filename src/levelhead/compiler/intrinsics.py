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

WIDTH = 4  # numbers in one vector of AVX; narrower processors take two steps

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
    """``arrays.subtract_rows``: the row stays in registers while all others pass, a part of it if ``width`` varies."""
    constant = width.literal_value if isinstance(width, types.IntegerLiteral) else WIDTH
    columns = max(constant // WIDTH, 1)

    def generate(context: CodeContext, builder: Builder, signature: NumbaType, values: LlvmValue) -> LlvmValue:
        memory, to, weight, step, row, stride, count, wide = values
        data = context.make_array(signature.args[0])(context, builder, memory).data
        if isinstance(width, types.IntegerLiteral):
            wide = ir.Constant(INDEX, constant)

        def subtract(start: LlvmValue, stop: LlvmValue, columns: int, size: int, kind: LlvmValue) -> None:
            def part(at: LlvmValue, i: int) -> LlvmValue:
                there = builder.gep(data, [builder.add(at, ir.Constant(INDEX, size * i))])
                return builder.bitcast(there, kind.as_pointer())

            sums = [cgutils.alloca_once(builder, kind) for _ in range(columns)]  # type: ignore[no-untyped-call]
            each = ir.Constant(INDEX, size * columns)
            with cgutils.for_range_slice(builder, start, stop, each, intp=INDEX) as (j, _):
                here = builder.add(to, j)
                for i, total in enumerate(sums):
                    builder.store(builder.load(part(here, i), align=8), total)
                with cgutils.for_range(builder, count, intp=INDEX) as loop:
                    factor = builder.load(builder.gep(data, [builder.add(weight, builder.mul(loop.index, step))]))
                    factor = factor if kind is NUMBER else _broadcast(builder, factor)
                    at = builder.add(builder.add(row, j), builder.mul(loop.index, stride))
                    for i, total in enumerate(sums):
                        product = builder.fmul(factor, builder.load(part(at, i), align=8))
                        builder.store(builder.fsub(builder.load(total), product), total)
                for i, total in enumerate(sums):
                    builder.store(builder.load(total), part(here, i), align=8)

        whole = builder.and_(wide, ir.Constant(INDEX, -WIDTH))
        subtract(ir.Constant(INDEX, 0), whole, columns, WIDTH, VECTOR)
        subtract(whole, wide, 1, 1, NUMBER)
        return context.get_dummy_value()

    return types.void(m, *[types.int64] * 6, width), generate
