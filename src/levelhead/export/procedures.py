"""Kernels as procedures over places: those that stay calls, the reads and writes of each, and the fields that never
change.

A field that has one value at the start, and to which nothing else is ever given, is that constant (``steady``): without
the guard, no reading is ever clipped. That is assumed of every field first, and dropped where a store contradicts it.
"""

import ast
import functools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from levelhead.compiler.mark import KernelFunction, is_kernel
from levelhead.export.constants import UniqueNames
from levelhead.export.fusing import fuse
from levelhead.export.graph import (
    ARRAY,
    FLOAT,
    Call,
    Loop,
    Operand,
    Place,
    Put,
    Record,
    RecordField,
    Store,
    Value,
    items_within,
    leaves,
    placed_leaves,
)
from levelhead.export.graph_builder import KINDS, GraphBuilder, Steady
from levelhead.export.layout import snake
from levelhead.export.names import allocation, resolve_name
from levelhead.export.source import read_source
from levelhead.export.tracing import BY_PLACE, Tracer
from levelhead.export.type_table import annotations
from levelhead.open_types import Untyped

Homes = Mapping[type, Place | None]
WORTH = 40  # operations from which a kernel of several places is called
RARE = 8  # and one that is marked as rare


class Part(NamedTuple):
    """An argument or a part of it: its number, the way down, and its name."""

    at: int
    path: tuple[int, ...]
    name: str

    def of(self, given: Sequence[Value]) -> Value:
        """This part of arguments."""
        value = given[self.at]
        for i in self.path:
            assert isinstance(value, Record)
            value = value.values[i]
        return value


@dataclass(eq=False)
class Procedure:
    """One kernel with the kernels that it calls.

    Attributes:
        parts: of its arguments, each with a value like those that it takes.
        by_place: the parameters that are records at a place.
        graph: its items.
        least: numbers from which a record is passed by its place.
        answer: its result: a number of ``returned``, the parameter at whose place it lies, or (class, answers).
        returned: the numbers that it returns.
        outputs: the records at a place that it makes, among ``by_place``.
        reads, writes: the places of its parameters whose number before it may matter; that it writes, with the kind of
            number.
        used: numbers that something takes.
        puts: the arrays, its own ones and those of its caller, into which it puts something.
    """

    function: KernelFunction
    name: str
    graph: GraphBuilder
    least: int = BY_PLACE
    parts: list[tuple[Part, Value]] = field(default_factory=list)
    by_place: dict[str, type] = field(default_factory=dict)
    arguments: list[Operand] = field(default_factory=list)
    answer: Untyped = None
    returned: list[Operand] = field(default_factory=list)
    used: set[Operand] = field(default_factory=set)
    outputs: dict[str, Record] = field(default_factory=dict)
    reads: set[Place] = field(default_factory=set)
    writes: dict[Place, str] = field(default_factory=dict)
    puts: set[Operand] = field(default_factory=set)

    def outside(self, array: Operand, call: Call, caller: GraphBuilder) -> Operand:
        """The caller's array of an array of this procedure."""
        if array.op == "row":
            given = (self.outside(array.base, call, caller), *array.arguments[1:])
            return Operand("row", given, ARRAY, shape=array.shape)
        if array.op == "argument":
            return call.arguments[self.arguments.index(array)]
        return caller.memory(outer_place(call, array.content), array.shape)

    def stores(self) -> Iterator[Store]:
        """All stores."""
        return (item for _, item in items_within(self.graph.body) if isinstance(item, Store))

    def calls(self) -> Iterator[Call]:
        """All calls."""
        return (item for _, item in items_within(self.graph.body) if isinstance(item, Call))


class Procedures:
    """All procedures of a program.

    Args:
        roots: the kernels that the program calls.
        steady: field -> its value, for fields that are assumed never to change.
        inlined: kernels that are not calls, whatever their size.
        frozen: classes of parameters that are constants of the program.
        by_hand: kernels that are calls in any case.
    """

    def __init__(
        self,
        roots: Sequence[KernelFunction],
        steady: Steady,
        inlined: set[KernelFunction],
        frozen: tuple[type, ...] = (),
        by_hand: Iterable[KernelFunction] = (),
    ) -> None:
        self.steady, self.frozen = steady, frozen
        self.all: dict[KernelFunction, Procedure] = {}
        self.inlines = False
        self._names = UniqueNames()
        self._called = called_kernels(roots) - inlined | set(by_hand)
        self._loops = {one for one in self._called if hasattr(one, "__noinline__") and _has_loops(one)}

    def is_called(self, function: KernelFunction) -> bool:
        """Whether a kernel stays a call; where all is to be inlined, a rare one with loops, which no constants fold."""
        return function in (self._loops if self.inlines else self._called)

    def procedure(self, function: KernelFunction, given: Sequence[Value], homes: Homes) -> Procedure:
        """The procedure of a kernel for arguments like these; ``homes``: where records lie for the first caller."""
        if function not in self.all:
            name = self._names.choose(function, function.__module__, f"_{function.__name__}")
            made = make_procedure(self, function, name, given, homes=homes)
            self.all[function] = made
        return self.all[function]

    def find_contradictions(self, procedures: Iterable[Procedure]) -> set[tuple[RecordField, ...]]:
        """Fields that do change."""
        found = set()
        for procedure in procedures:
            for store in procedure.stores():
                member = store.place.field
                if member in self.steady:
                    same = store.value.op == "const" and repr(store.value.content) == repr(self.steady[member])
                    found |= set() if same else {member}
        return found


def make_procedure(
    callees: Procedures,
    function: KernelFunction,
    name: str,
    given: Sequence[Value],
    pick: str | None = None,
    fixed: Mapping[str, object] | None = None,
    homes: Homes | None = None,
    least: int = BY_PLACE,
    own: Homes | None = None,
) -> Procedure:
    """Runs a kernel for arguments like these.

    ``pick``: the name of the part of its result that is wanted; ``fixed``: arguments that are known; ``homes``: as
    ``Procedures``; ``least``: numbers from which a record is passed by its place; ``own``: the places of records of its
    result.
    """
    read_only: frozenset[str] = frozenset()
    while True:
        made, answered = _trace_procedure(callees, function, name, given, pick, fixed, homes, least, own, read_only)
        changed = {place.root for place in made.writes} - answered - made.outputs.keys()
        if not changed:
            return made
        read_only |= changed


def _trace_procedure(
    callees: Procedures,
    function: KernelFunction,
    name: str,
    given: Sequence[Value],
    pick: str | None,
    fixed: Mapping[str, object] | None,
    homes: Homes | None,
    least: int,
    own: Homes | None,
    read_only: frozenset[str],
) -> tuple[Procedure, set[str]]:
    """The same once, and the parameters at whose place something is returned."""
    tracer = Tracer(callees, read_only)
    tracer.graph.homes |= own or {}
    hints = annotations(function)
    made = Procedure(function, name, tracer.graph, least)
    values = []
    for i, (argument, value) in enumerate(zip(read_source(function).tree.args.args, given, strict=True)):
        named = argument.arg
        if fixed and named in fixed:
            values.append(tracer.graph.literal(fixed[named]))
            made.arguments += leaves(_as_arguments(value, named, None))
            continue
        hint = hints.get(named)
        wanted = KINDS.get(hint) if isinstance(hint, type) else None
        values.append(_take(made, value, Part(i, (), named), homes or {}, wanted))
    result = tracer.inline(function, values)
    answered: set[str] = set()
    if result is not None:
        if pick:
            assert isinstance(result, Record)
            result = result.get(pick)
        made.answer = _answer(made, result, answered)
    fuse(made.graph.body, made.graph.loads)
    _note_effects(made)
    return made, answered


def _take(made: Procedure, value: Value, part: Part, homes: Homes, wanted: str | None) -> Value:
    """The value of an argument or a part of it: a record at a place, or numbers."""
    large = isinstance(value, Record) and len(list(leaves(value))) >= made.least
    if isinstance(value, Record) and made.graph.is_frozen(value):
        return made.graph.copy(value)
    if isinstance(value, Record) and large and (value.place or homes.get(value.cls) or not _has_home(value, homes)):
        made.parts.append((part, value))
        made.by_place[part.name] = value.cls
        return made.graph.record_at(value, Place(part.name, ()))
    if isinstance(value, Record) and large:
        names: Sequence[str] = value.cls._fields  # type: ignore[attr-defined]
        inner = (Part(part.at, (*part.path, i), f"{part.name}_{name}") for i, name in enumerate(names))
        return Record(
            value.cls, tuple(_take(made, v, p, homes, None) for v, p in zip(value.values, inner, strict=True))
        )
    taken = _as_arguments(value, part.name, wanted)
    made.parts.append((part, taken))
    made.arguments += leaves(taken)
    return taken


def _has_home(value: Value, homes: Homes) -> bool:
    """Whether a part of a record lies somewhere."""
    return isinstance(value, Record) and any(
        isinstance(part, Record)
        and ((len(list(leaves(part))) >= BY_PLACE and (part.place or homes.get(part.cls))) or _has_home(part, homes))
        for part in value.values
    )


def _as_arguments(value: Value, name: str, wanted: str | None) -> Value:
    if isinstance(value, Operand):
        return Operand("argument", (), wanted or value.kind, name, hint=name, shape=value.shape)
    fields: Sequence[str] = getattr(value.cls, "_fields", ()) or [f"part_{i}" for i in range(len(value.values))]
    parts = zip(fields, value.values, strict=True)
    return Record(value.cls, tuple(_as_arguments(part, f"{name}_{inner}", None) for inner, part in parts))


def _answer(made: Procedure, value: Value, taken: set[str]) -> Untyped:
    if isinstance(value, Operand):
        if value.kind == ARRAY:
            return value
        made.returned.append(value)
        return len(made.returned) - 1
    for name, cls in made.by_place.items():
        if cls is value.cls and name not in taken:
            taken.add(name)
            _put(made, value, name)
            return name
    inside = any(isinstance(part, Record) and _is_placed(made, part, taken) for part in value.values)
    if len(list(leaves(value))) >= made.least and value.cls is not tuple and not inside:
        name = snake(value.cls.__name__)
        while name in read_source(made.function).function.__code__.co_varnames or name in made.by_place:
            name = f"{name}_new"
        made.by_place[name], made.outputs[name] = value.cls, value
        _put(made, value, name)
        return name
    return value.cls, [_answer(made, part, taken) for part in value.values]


def _is_placed(made: Procedure, value: Record, taken: set[str]) -> bool:
    """Whether a record, or a part of it, is returned at the place of a parameter."""
    if any(cls is value.cls and name not in taken for name, cls in made.by_place.items()):
        return True
    return any(isinstance(part, Record) and _is_placed(made, part, taken) for part in value.values)


def _put(made: Procedure, value: Value, name: str) -> None:
    for place, node in placed_leaves(value, Place(name, ())):
        if node.kind == ARRAY:
            made.graph.claim(node, place)
        elif made.graph.contents.get(place) is not node:
            made.graph.body.items.append(Store(place, node, True))


def _note_effects(made: Procedure) -> None:
    """Fills in a procedure's reads and writes at the places of its parameters, and its arrays."""
    partly: set[Place] = set()
    for block, item in items_within(made.graph.body):
        written: dict[Place, str] = {}
        if isinstance(item, Store):
            written = {item.place: item.value.kind}
        elif isinstance(item, Put):
            made.puts.add(item.array)
        elif isinstance(item, Call):
            written = {outer_place(item, inner): kind for inner, kind in item.procedure.writes.items()}
            _note_call(made, item)
        made.writes |= {place: kind for place, kind in written.items() if place.root in made.by_place}
        partly |= written.keys() if block is not made.graph.body else set()
    used = _used(made)
    made.reads |= {load.content[0] for load in made.graph.loads if load.op == "load" and load in used}
    made.reads = {
        place for place in (made.reads | partly) if place.root in made.by_place and place.root not in made.outputs
    }
    made.writes = {place: kind for place, kind in made.writes.items() if place.field not in made.graph.steady}


def _note_call(made: Procedure, call: Call) -> None:
    """The arrays into which a call puts something, and the places that it reads as they were before the procedure."""
    for array in call.procedure.puts:
        made.puts.add(call.procedure.outside(array, call, made.graph).base)
    found = (node for node in call.reads.values() if node.op == "load" and not isinstance(node.after, Call))
    made.reads |= {node.content[0] for node in found}


def _used(made: Procedure) -> set[Operand]:
    """Nodes that an item or the caller takes."""
    if not made.used:
        made.used = {node for _, item in items_within(made.graph.body) for node in list_operands(item)} | set(
            made.returned
        )
    return {node for node in made.used if not isinstance(node.after, Call)}


def outer_place(call: Call, inner: Place) -> Place:
    """Where a place inside a procedure lies for its caller."""
    place = call.places[inner.root]
    return Place(place.root, place.members + inner.members)


def list_operands(item: Untyped) -> Iterator[Operand]:
    """The numbers that an item takes."""
    if isinstance(item, Operand):
        yield from item.arguments
    elif isinstance(item, Store):
        yield item.value
    elif isinstance(item, Put):
        yield from (item.array, *item.indices, item.value)
    elif isinstance(item, Call):
        yield from item.arguments
    elif isinstance(item, Loop):
        yield from (*item.bounds, *(part for phi in item.carried for part in phi.arguments))
    else:
        yield item.condition
        for phi in item.phis.values():
            yield from phi.arguments


def called_kernels(roots: Sequence[KernelFunction]) -> set[KernelFunction]:
    """The kernels that stay calls: rare ones, and large ones that stand in several places."""
    order: list[KernelFunction] = []
    callees: dict[KernelFunction, tuple[KernelFunction, ...]] = {}
    weights: dict[KernelFunction, int] = {}

    def is_rare(function: KernelFunction) -> bool:
        return hasattr(function, "__noinline__") and weights.get(function, 0) >= RARE

    def visit(function: KernelFunction) -> None:
        if function in callees:
            return
        own, callees[function] = _operations(function)
        for callee in dict.fromkeys(callees[function]):
            visit(callee)
        weights[function] = own + sum(1 if is_rare(callee) else weights.get(callee, 0) for callee in callees[function])
        order.append(function)

    for root in roots:
        visit(root)
    makers = {one for one in order if _allocates(one)}
    while grown := {one for one in order if one not in makers and makers & set(callees[one])}:
        makers |= grown
    places = dict.fromkeys(order, 0) | dict.fromkeys(roots, 1)
    often = {root for root in roots if not hasattr(root, "__noinline__")}
    called = set()
    for function in reversed(order):
        again = (places[function] - 1) * weights[function]
        if function in makers:
            pass  # its arrays belong to its caller
        elif (
            is_rare(function)
            or (weights[function] >= WORTH if function in often else weights[function] >= RARE) * again >= WORTH
        ):
            called.add(function)
        for callee in callees[function]:
            places[callee] += 1 if function in called else places[function]
            if function in often and not hasattr(function, "__noinline__"):
                often.add(callee)
    return called - set(roots)


@functools.cache
def _has_loops(function: KernelFunction) -> bool:
    """Whether there is a loop in a kernel or in its calls."""
    return any(isinstance(node, ast.For) for node in ast.walk(read_source(function).tree)) or any(
        map(_has_loops, _operations(function)[1])
    )


@functools.cache
def _allocates(function: KernelFunction) -> bool:
    tree, local = read_source(function).tree, function.__code__.co_varnames
    return any(allocation(function, node, local) is not None for node in ast.walk(tree))


@functools.cache
def _operations(function: KernelFunction) -> tuple[int, tuple[KernelFunction, ...]]:
    """The number of operations and constants of records of a kernel itself, and its calls, once for each place."""
    own, called = 0, []
    for node in ast.walk(read_source(function).tree):
        own += isinstance(node, ast.BinOp | ast.Compare | ast.IfExp)
        if isinstance(node, ast.Call):
            own += sum(isinstance(argument, ast.Constant) for argument in node.args)
            callee = resolve_name(function, node.func, function.__code__.co_varnames)
            if is_kernel(callee):
                called.append(callee)
    return own, tuple(called)


def steady_members(value: Untyped) -> Steady:
    """The fields that have one value wherever they occur in a state before its first sample."""
    found: Steady = {}
    different: set[tuple[RecordField, ...]] = set()

    def visit(record: Untyped, place: Place) -> None:
        for name, part in zip(getattr(record, "_fields", ()), record, strict=True):
            at = place.member(type(record), name)
            if isinstance(part, tuple):
                visit(part, at)
            elif not isinstance(part, list | np.ndarray):
                hint = annotations(type(record)).get(name)
                number = float(part) if hint is float else part
                if at.field in found and repr(found[at.field]) != repr(number):
                    different.add(at.field)
                found[at.field] = number

    visit(value, Place("", ()))
    return {member: number for member, number in found.items() if member not in different}


def like(value: Untyped) -> Value:
    """A value of the kinds of a Python value."""
    if isinstance(value, tuple):
        hints = annotations(type(value))
        parts = []
        for name, part in zip(getattr(value, "_fields", ()), value, strict=True):
            hint = hints.get(name)
            parts.append(Operand("const", (), FLOAT, 0.0) if hint is float else like(part))
        return Record(type(value), tuple(parts))
    if isinstance(value, list | np.ndarray):
        return Operand("const", (), ARRAY, shape=np.shape(value))
    return Operand("const", (), KINDS[type(value)], value)
