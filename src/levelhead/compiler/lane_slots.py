"""Keeps values of many lanes side by side, number by number, so that a loop over the lanes becomes SIMD.

A block of memory is a table of 64-bit words: a row for each number of a value (floats as they are, ints and bools
widened, so that all columns are equally wide), a column for each lane. A compiled load from one lane is a
nested NamedTuple again; neighbouring lanes are neighbours in memory, and all rows lie at constant distances from one
address, which proves to the loop vectoriser that they do not overlap.
"""

import hashlib
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.compiler.borders import Builder, CodeContext, Intrinsic, LlvmModule, LlvmValue, NumbaType, TypingContext
from levelhead.compiler.cache import code_hash
from levelhead.compiler.tree import Tree

LANES = 64  # columns; enough to pay for the work of each sample, few enough for the first-level cache
LINE = 8  # words of a cache line
INTERLEAVED = 2  # vectors of lanes in turn


class Rows(NamedTuple):
    """The rows that hold one value of each lane."""

    load: Intrinsic  # load(address, lane) -> value
    store: Intrinsic  # store(address, lane, value)
    first: int
    end: int
    floats: tuple[bool, ...]  # row by row: a float, or an int or bool
    layout: str  # of the type and place, for the names of compiled functions


def lane_rows(example: Tree, first: int, known: Mapping[str, bool] | None = None) -> Rows:
    """Rows from ``first`` on for values of the type of ``example`` (floats, ints, bools, NamedTuples of these).

    ``known`` are bool fields, wherever in the value, that loading replaces by a constant: operations that depend on
    them are not compiled.
    """
    import numba
    from numba.core import types
    from numba.extending import intrinsic

    kind: NumbaType = numba.typeof(example)  # type: ignore[no-untyped-call]
    fixed = dict(known or {})

    @intrinsic
    def load(typing_context: TypingContext, address: NumbaType, lane: NumbaType) -> Intrinsic:
        def code(context: CodeContext, builder: Builder, signature: NumbaType, args: LlvmValue) -> LlvmValue:
            return _load(context, builder, kind, first, args, fixed)

        return kind(types.intp, types.intp), code

    @intrinsic
    def store(typing_context: TypingContext, address: NumbaType, lane: NumbaType, value: NumbaType) -> Intrinsic:
        def code(context: CodeContext, builder: Builder, signature: NumbaType, args: LlvmValue) -> LlvmValue:
            _store(builder, kind, first, args[:2], args[2])
            return context.get_dummy_value()

        return types.void(types.intp, types.intp, kind), code

    floats = _floats(kind)
    text = f"{kind} {first} {LANES} {sorted(fixed.items())} {code_hash(_load)} {code_hash(_store)} {code_hash(_place)}"
    return Rows(load, store, first, first + len(floats), floats, hashlib.sha256(text.encode()).hexdigest()[:16])


def over_lanes() -> Intrinsic:
    """``each(body, address, a, b)``: the kernel ``body(address, lane, a, b)`` for all lanes, a loop that becomes SIMD.

    The loop is written here because of its request to LLVM: to do two vectors of lanes in turn, instruction by
    instruction. A filter's operations wait for each other, and no processor looks far enough ahead to begin the next
    vector meanwhile.
    """
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic

    @intrinsic
    def each(
        typing_context: TypingContext, body: NumbaType, address: NumbaType, a: NumbaType, b: NumbaType
    ) -> Intrinsic:
        inner = body.get_call_type(typing_context, (address, types.intp, a, b), {})

        def code(context: CodeContext, builder: Builder, signature: NumbaType, args: LlvmValue) -> LlvmValue:
            call = context.get_function(body, inner)
            word = ir.IntType(64)
            before = builder.block
            loop, after = (builder.append_basic_block(name) for name in ("lanes", "after_lanes"))
            builder.branch(loop)
            builder.position_at_end(loop)
            lane = builder.phi(word)
            call(builder, [args[1], lane, args[2], args[3]])
            following = builder.add(lane, ir.Constant(word, 1))
            lane.add_incoming(ir.Constant(word, 0), before)
            lane.add_incoming(following, builder.block)
            again = builder.cbranch(builder.icmp_signed("<", following, ir.Constant(word, LANES)), loop, after)
            again.set_metadata("llvm.loop", _loop_hints(builder.module))
            builder.position_at_end(after)
            return context.get_dummy_value()

        return types.void(body, address, a, b), code

    return each


def _loop_hints(module: LlvmModule) -> LlvmValue:
    """The loop metadata; its first operand has to be itself."""
    from llvmlite import ir

    def hint(name: str, value: LlvmValue) -> LlvmValue:
        return module.add_metadata([ir.MetaDataString(module, f"llvm.loop.{name}"), value])

    wishes = module.add_metadata([
        hint("vectorize.enable", ir.Constant(ir.IntType(1), 1)),
        hint("interleave.count", ir.Constant(ir.IntType(32), INTERLEAVED)),
    ])  # fmt: skip
    wishes.operands = (wishes, *wishes.operands)
    return wishes


def _members(kind: NumbaType) -> list[NumbaType] | None:
    """The types of a tuple's members (a filter without parameters has none); None: it is a number."""
    from numba.core import types

    return list(kind) if isinstance(kind, types.BaseTuple) else None  # type: ignore[call-overload]


def _floats(kind: NumbaType) -> tuple[bool, ...]:
    from numba.core import types

    kinds = _members(kind)
    if kinds is None:
        return (isinstance(kind, types.Float),)
    return tuple(leaf for member in kinds for leaf in _floats(member))


def _place(builder: Builder, is_float: bool, row: int, args: LlvmValue) -> LlvmValue:
    """The pointer to one number of one lane: a constant row behind the address, so that distances are constants."""
    from llvmlite import ir

    word = ir.IntType(64)
    start = builder.inttoptr(args[0], (ir.DoubleType() if is_float else word).as_pointer())
    return builder.gep(builder.gep(start, [ir.Constant(word, row * LANES)]), [args[1]])


def _load(
    context: CodeContext, builder: Builder, kind: NumbaType, row: int, args: LlvmValue, fixed: Mapping[str, bool]
) -> LlvmValue:
    from llvmlite import ir
    from numba.core import types

    kinds = _members(kind)
    if kinds is not None:
        members = []
        for name, member in zip(getattr(kind, "fields", [""] * len(kinds)), kinds, strict=True):
            if name in fixed:
                members.append(context.get_constant(member, fixed[name]))
            else:
                members.append(_load(context, builder, member, row, args, fixed))
            row += len(_floats(member))
        return context.make_tuple(builder, kind, members)
    value = builder.load(_place(builder, isinstance(kind, types.Float), row, args))
    return builder.icmp_unsigned("!=", value, ir.Constant(value.type, 0)) if kind == types.boolean else value


def _store(builder: Builder, kind: NumbaType, row: int, args: LlvmValue, value: LlvmValue) -> None:
    from llvmlite import ir
    from numba.core import types

    kinds = _members(kind)
    if kinds is not None:
        for i, member in enumerate(kinds):
            _store(builder, member, row, args, builder.extract_value(value, i))
            row += len(_floats(member))
        return
    if kind == types.boolean:
        value = builder.zext(value, ir.IntType(64))
    builder.store(value, _place(builder, isinstance(kind, types.Float), row, args))


def allocate(count: int) -> tuple[NDArray[np.float64], int]:
    """Zeroed memory of ``count`` rows, (count, LANES) words, and its address, which begins a cache line: SIMD loads
    across two lines take twice as long."""
    memory = np.zeros(count * LANES + LINE)
    skip = -(memory.ctypes.data // 8) % LINE
    table = memory[skip : skip + count * LANES].reshape(count, LANES)
    return table, int(table.ctypes.data)


def flat(value: Tree) -> list[float]:
    """The numbers of a nested NamedTuple, in the order of its rows."""
    if isinstance(value, tuple):
        return [number for member in value for number in flat(member)]
    return [value]


def put(table: NDArray[np.float64], place: Rows, values: NDArray[np.float64]) -> None:
    """Write (count, rows of ``place``) numbers into the lanes; lanes beyond count repeat the last one."""
    lanes = np.minimum(np.arange(LANES), len(values) - 1)
    for row, is_float, numbers in zip(range(place.first, place.end), place.floats, values.T[:, lanes], strict=True):
        table[row] = numbers if is_float else numbers.astype(np.int64).view(np.float64)


def get(table: NDArray[np.float64], place: Rows, count: int) -> NDArray[np.float64]:
    """(count, rows of ``place``) numbers of the first lanes."""
    found = np.empty((count, place.end - place.first))
    for column, row in enumerate(range(place.first, place.end)):
        numbers = table[row] if place.floats[column] else table[row].view(np.int64)
        found[:, column] = numbers[:count]
    return found
