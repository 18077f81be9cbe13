"""From a kernel's syntax tree to a graph: records fall apart into numbers, and calls become their operations.

A kernel that many places call, or that few samples reach, stays a call (``procedures`` decides). Its records are
passed by their place, and those that it returns are written there; a value of before that is read later is loaded in
time. ``graph_builder`` makes the nodes.
"""

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from levelhead.compiler.mark import KernelFunction, is_kernel
from levelhead.export.calling import ProcedureCalls
from levelhead.export.graph import (
    ARRAY,
    BOOL,
    FLOAT,
    INT,
    Branch,
    Call,
    Item,
    Items,
    Loop,
    Operand,
    Place,
    Put,
    Record,
    Store,
    Value,
    items_within,
    leaves,
)
from levelhead.export.graph_builder import FUNCTIONS, KINDS, OPERATORS, GraphBuilder, Steady
from levelhead.export.kinds import is_struct
from levelhead.export.merging import ArmMerger
from levelhead.export.names import MISSING, allocation, arguments, by_field, loaded_in, resolve_name, stored_in
from levelhead.export.source import Source, home, read_source
from levelhead.export.type_table import annotations
from levelhead.open_types import Untyped

BY_PLACE = 5  # numbers from which a record is passed by its place


class Callees(Protocol):
    """The parts of the whole that a tracer uses."""

    steady: Steady
    frozen: tuple[type, ...]

    def is_called(self, function: KernelFunction) -> bool:
        """Whether a kernel stays a call."""

    def procedure(self, function: KernelFunction, given: Sequence[Value], homes: dict[type, Place | None]) -> Untyped:
        """The procedure of a kernel, for arguments like these."""


@dataclass
class KernelFrame:
    """One kernel that is being run: its source and its variables."""

    source: Source
    variables: dict[str, Value]
    pending: list[frozenset[str]] = field(default_factory=list)  # names that are read behind the branches around

    @property
    def function(self) -> KernelFunction:
        """The kernel."""
        return self.source.function

    def resolve(self, node: ast.AST) -> Untyped:
        """The Python object behind a name; ``MISSING`` for a value of the kernel."""
        return resolve_name(self.function, node, self.function.__code__.co_varnames)


class Tracer:
    """Runs one procedure's kernel.

    Args:
        callees: its callees.
        read_only: the parameters at places without stores, because they are not the result.

    Attributes:
        graph: its result.
    """

    def __init__(self, callees: Callees, read_only: frozenset[str] = frozenset()) -> None:
        self._callees = callees
        self.graph = GraphBuilder(callees.steady, callees.frozen)
        self._calls, self._arms = ProcedureCalls(self.graph, read_only), ArmMerger(self.graph, read_only)
        self._running: list[KernelFunction] = []

    # Calls

    def call(self, function: KernelFunction, given: Sequence[Value]) -> Value | None:
        """The result of a kernel."""
        if self._callees.is_called(function):
            procedure = self._callees.procedure(function, given, self.graph.homes)
            return self._calls.call(procedure, given)
        return self.inline(function, given)

    def inline(self, function: KernelFunction, given: Sequence[Value]) -> Value | None:
        """The same, computed here."""
        source = read_source(function)
        if function in self._running:
            raise source.refuse(ast.Pass(), f"{function.__name__} calls itself")
        hints = annotations(function)
        variables = {}
        for argument, value in zip(source.tree.args.args, given, strict=True):
            hint = hints.get(argument.arg)
            variables[argument.arg] = self.graph.convert(value, KINDS.get(hint) if isinstance(hint, type) else None)
        self._running.append(function)
        found = self._run(source.tree.body, KernelFrame(source, variables))
        self._running.pop()
        return found

    # Statements

    def _run(self, body: Sequence[ast.stmt], frame: KernelFrame) -> Value | None:
        for i, statement in enumerate(body):
            if isinstance(statement, ast.Return):
                return None if statement.value is None else self._value(statement.value, frame)
            if isinstance(statement, ast.If):
                rest = body[i + 1 :]
                condition = self._condition(statement.test, frame)
                known = self.graph.decide(condition)
                if known is not None:
                    return self._run([*(statement.body if known else statement.orelse), *rest], frame)
                if _returns(statement):
                    arms = [*statement.body, *rest], [*statement.orelse, *rest]
                    return self._branch(condition, *arms, frame, True, statement)
                frame.pending.append(frozenset().union(*map(loaded_in, rest)))
                self._branch(condition, statement.body, statement.orelse, frame, False, statement)
                frame.pending.pop()
                continue
            if isinstance(statement, ast.For):
                frame.pending.append(frozenset().union(*map(loaded_in, [*body[i + 1 :], statement])))
                self._loop(statement, frame)
                frame.pending.pop()
                continue
            handler: Callable[..., None] | None = getattr(self, f"_on_{type(statement).__name__}", None)
            if handler is None:
                raise frame.source.refuse(statement, f"{type(statement).__name__} is outside of the kernel language")
            handler(statement, frame)
        return None

    def _branch(
        self,
        condition: Operand,
        body: Sequence[ast.stmt],
        orelse: Sequence[ast.stmt],
        frame: KernelFrame,
        returns: bool,
        at: ast.AST,
    ) -> Value | None:
        before, outside = dict(self.graph.contents), self.graph.block
        variables = dict(frame.variables)
        branch = Branch(condition, outside)
        branch.arms = Items(branch), Items(branch)
        outside.items.append(branch)
        ends = []
        for arm, statements, truth in ((branch.arms[0], body, True), (branch.arms[1], orelse, False)):
            self.graph.block, self.graph.contents, frame.variables = arm, dict(before), dict(variables)
            self.graph.assume(condition, truth)
            ends.append((self._run(statements, frame), frame.variables, self.graph.contents))
        self.graph.block = outside
        (one, ones, contents), (other, others, other_contents) = ends
        branch.contents = contents, other_contents
        self.graph.contents = {}
        for place in contents.keys() | other_contents.keys():
            if contents.get(place) is other_contents.get(place):
                self.graph.contents[place] = contents[place]
        if returns:
            frame.variables = variables
            if one is None or other is None:
                return None
            self._require_alike(one, other, frame.function.__name__, at, frame)
            return self._arms.merge(branch, one, other)
        needed = frozenset().union(*frame.pending)
        shared = [name for name in ones if name in others and name in needed]
        for name in shared:
            self._require_alike(ones[name], others[name], name, at, frame)
        frame.variables = {name: self._arms.merge(branch, ones[name], others[name]) for name in shared}
        return None

    # Loops

    def _loop(self, node: ast.For, frame: KernelFrame) -> None:
        bounds = self._bounds(node, frame)
        name = node.target.id  # type: ignore[attr-defined]
        if any(name in stored_in(part) for part in node.body):
            raise frame.source.refuse(node, f"{name} counts a loop; it cannot be changed there")
        needed = frozenset().union(*frame.pending)
        stored = sorted({one for part in node.body for one in stored_in(part)} & needed)
        before = dict(frame.variables)
        wide: set[int] = set()  # which numbers are whole before the loop and floats in it
        while not self._turn(node, frame, bounds, {one: before[one] for one in stored if one in before}, wide):
            frame.variables = dict(before)
        frame.variables = before | {one: frame.variables[one] for one in stored if one in frame.variables}

    def _bounds(self, node: ast.For, frame: KernelFrame) -> tuple[Operand, ...]:
        call = node.iter
        if not isinstance(call, ast.Call) or frame.resolve(call.func) is not range or node.orelse:
            raise frame.source.refuse(node, "a loop over something else than range")
        if not isinstance(node.target, ast.Name):
            raise frame.source.refuse(node, "a loop counts one variable")
        if any(isinstance(inner, ast.Return) for inner in ast.walk(node)):
            raise frame.source.refuse(node, "a loop that returns; keep its result in a variable")
        given = [self._number(part, frame) for part in call.args]
        if any(bound.kind != INT for bound in given):
            raise frame.source.refuse(node, "a bound of range must be int")
        zero, one = self.graph.constant(0), self.graph.constant(1)
        first, last, step = ([zero, *given] if len(given) == 1 else given) + [one] * (3 - max(len(given), 2))
        if step.op != "const":
            raise frame.source.refuse(node, "the step of range must be a constant")
        return first, last, step

    def _turn(
        self,
        node: ast.For,
        frame: KernelFrame,
        bounds: tuple[Operand, ...],
        carried: dict[str, Value],
        wide: set[int],
    ) -> bool:
        """The body once; False: a number turned out to be a float in it, and it has to be done again."""
        graph, outside, loads = self.graph, self.graph.block, len(self.graph.loads)
        counter = Operand("counter", (), INT, hint=node.target.id)  # type: ignore[attr-defined]
        loop = Loop(bounds, outside, counter)
        counter.content, body = loop, Items(loop)
        loop.arms = (body,)
        pairs: list[tuple[Operand, Operand]] = []  # a carried number, and its value before

        def carry(value: Value, name: str) -> Value:
            if isinstance(value, Record):
                return Record(value.cls, tuple(carry(part, name) for part in value.values))
            if value.kind == ARRAY:
                return value
            first = graph.number(value, FLOAT) if len(pairs) in wide else value
            phi = Operand("carried", (), first.kind, loop, body, value.hint or name)
            pairs.append((phi, first))
            return phi

        before = dict(frame.variables)
        items, nodes, contents = len(outside.items), dict(outside.nodes), dict(graph.contents)
        frame.variables |= {name: carry(value, name) for name, value in carried.items()}
        entry = {name: frame.variables[name] for name in carried}
        outside.items.append(loop)
        graph.block = body
        frame.variables[node.target.id] = counter  # type: ignore[attr-defined]
        self._run(node.body, frame)
        graph.block = body
        last = []
        for name, value in entry.items():
            after = frame.variables[name]
            self._require_alike(value, after, name, node, frame)
            last += [leaf for leaf in leaves(after) if leaf.kind != ARRAY]
        grown = {
            i for i, ((phi, _), end) in enumerate(zip(pairs, last, strict=True)) if (phi.kind, end.kind) == (INT, FLOAT)
        }
        if grown:
            wide |= grown
            del outside.items[items:], graph.loads[loads:]
            graph.contents, graph.block, outside.nodes = contents, outside, nodes
            return False
        for (phi, first), end in zip(pairs, last, strict=True):
            phi.arguments = first, graph.number(end, phi.kind)
            loop.carried.append(phi)
        for name in sorted(frame.variables.keys() - before.keys() - {node.target.id}):  # type: ignore[attr-defined]
            entry[name] = self._last(frame.variables[name], loop)
        graph.block = outside
        graph.contents = self._contents_behind(loop, contents, node, frame)
        frame.variables |= entry
        return True

    def _last(self, value: Value, loop: Loop) -> Value:
        """The value behind a loop of a variable that begins in it."""
        if isinstance(value, Record):
            return Record(value.cls, tuple(self._last(part, loop) for part in value.values))
        if value.kind == ARRAY:
            return value
        zero = self.graph.constant({FLOAT: 0.0, INT: 0, BOOL: False}[value.kind])
        phi = Operand("carried", (zero, value), value.kind, loop, loop.arms[0], value.hint)
        loop.carried.append(phi)
        return phi

    def _contents_behind(
        self, loop: Loop, before: dict[Place, Operand], node: ast.For, frame: KernelFrame
    ) -> dict[Place, Operand]:
        """The values at places after a loop: it may only write records of its own."""
        inside = [item for _, item in items_within(loop.arms[0])]
        calls = [item for item in inside if isinstance(item, Call)]
        own = {root for call in calls for root in call.temporaries}
        written = [item.place for item in inside if isinstance(item, Store)]
        written += [call.places[place.root] for call in calls for place in call.procedure.writes]
        if any(place.root not in own for place in written):
            raise frame.source.refuse(node, "a loop that changes a record of the state; keep it in a variable")
        return {place: operand for place, operand in before.items() if place.root not in own}

    def _require_alike(self, one: Value, other: Value, name: str, node: ast.AST, frame: KernelFrame) -> None:
        """Refuses a variable that is one thing here and another there."""
        if isinstance(one, Record) and isinstance(other, Record) and len(one.values) == len(other.values):
            if one.cls is other.cls:
                for part, twin in zip(one.values, other.values, strict=True):
                    self._require_alike(part, twin, name, node, frame)
                return
        elif isinstance(one, Operand) and isinstance(other, Operand):
            if ARRAY not in (one.kind, other.kind) or one is other:
                return
            if "memory" in (one.op, other.op) and one.shape == other.shape:
                place = one.content if one.op == "memory" else other.content
                self.graph.claim(one, place)
                self.graph.claim(other, place)
                return
        raise frame.source.refuse(node, f"{name} is {describe(one)} before and {describe(other)} here")

    def _on_Pass(self, node: ast.Pass, frame: KernelFrame) -> None:
        pass

    def _on_Expr(self, node: ast.Expr, frame: KernelFrame) -> None:
        if isinstance(node.value, ast.Call) and is_kernel(frame.resolve(node.value.func)):
            self._call_kernel(node.value, frame)  # for its writes into memory
        elif not isinstance(node.value, ast.Constant):
            raise frame.source.refuse(node, "an expression whose value is not used")

    def _on_Assign(self, node: ast.Assign, frame: KernelFrame) -> None:
        value = self._value(node.value, frame)
        for target in node.targets:
            self._assign(target, value, frame)

    def _on_AnnAssign(self, node: ast.AnnAssign, frame: KernelFrame) -> None:
        assert node.value is not None
        self._assign(node.target, self._value(node.value, frame), frame)

    def _on_AugAssign(self, node: ast.AugAssign, frame: KernelFrame) -> None:
        left, right = self._number(node.target, frame), self._number(node.value, frame)
        self._assign(node.target, self._arithmetic(node, left, right, frame), frame)

    def _assign(self, target: ast.expr, value: Value, frame: KernelFrame) -> None:
        if isinstance(target, ast.Tuple):
            assert isinstance(value, Record)
            for part, inner in zip(target.elts, value.values, strict=True):
                self._assign(part, inner, frame)
        elif isinstance(target, ast.Name):
            if isinstance(value, Operand) and not value.hint and value.op not in ("const", "named"):
                value.hint = target.id
            before = frame.variables.get(target.id, value)
            if target.id != "_" and type(before) is not type(value):
                raise frame.source.refuse(
                    target, f"{target.id} is {describe(before)} before and {describe(value)} here"
                )
            frame.variables[target.id] = value
        elif isinstance(target, ast.Subscript):
            array, indices = self._array(target.value, frame), self._indices(target, frame)
            if not isinstance(value, Operand) or value.kind not in (FLOAT, INT) or len(indices) != len(array.shape):
                raise frame.source.refuse(target, "only a number can be put into an array")
            number = self.graph.number(value, FLOAT)
            self.graph.block.items.append(Put(array.base, (*array.arguments[1:], *indices), number))
        else:
            raise frame.source.refuse(target, "a value can be given to a variable or an element of an array only")

    def _array(self, node: ast.expr, frame: KernelFrame) -> Operand:
        value = self._value(node, frame)
        if not isinstance(value, Operand) or value.kind != ARRAY:
            raise frame.source.refuse(node, f"{ast.unparse(node)} is {describe(value)}, not an array")
        return value

    def _indices(self, node: ast.Subscript, frame: KernelFrame) -> list[Operand]:
        found = [
            self._number(part, frame)
            for part in (node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice])
        ]
        if any(index.kind != INT for index in found):
            raise frame.source.refuse(node, "an index must be int")
        return found

    def _made(self, node: ast.Call, shape: ast.expr, frame: KernelFrame) -> Operand:
        """A new array, in the procedure until a record takes it."""
        sizes = []
        for size in shape.elts if isinstance(shape, ast.Tuple) else [shape]:
            number: object = size.value if isinstance(size, ast.Constant) else frame.resolve(size)
            if type(number) is not int or number < 1:
                raise frame.source.refuse(node, f"the shape {ast.unparse(shape)} is not made of constants")
            sizes.append(number)
        array = Operand("local", (), ARRAY, block=self.graph.block, shape=tuple(sizes))
        self.graph.locals.append(array)
        if frame.resolve(node.func).__name__ == "zeros":
            self._clear(array, ())
        return array

    def _clear(self, array: Operand, indices: tuple[Operand, ...]) -> None:
        """Zeros, from some indices on."""
        graph = self.graph
        if len(indices) == len(array.shape):
            graph.block.items.append(Put(array, indices, graph.constant(0.0)))
            return
        bounds = graph.constant(0), graph.constant(array.shape[len(indices)]), graph.constant(1)
        counter = Operand("counter", (), INT, hint="ijk"[len(indices)])
        loop = Loop(bounds, graph.block, counter)
        counter.content, loop.arms = loop, (Items(loop),)
        graph.block.items.append(loop)
        graph.block = loop.arms[0]
        self._clear(array, (*indices, counter))
        graph.block = loop.block

    # Expressions

    def _value(self, node: ast.expr, frame: KernelFrame) -> Value:
        handler = getattr(self, f"_of_{type(node).__name__}", None)
        if handler is None:
            raise frame.source.refuse(node, f"{type(node).__name__} is outside of the kernel language")
        value: Value = handler(node, frame)
        return value

    def _number(self, node: ast.expr, frame: KernelFrame) -> Operand:
        value = self._value(node, frame)
        if not isinstance(value, Operand) or value.kind == ARRAY:
            raise frame.source.refuse(node, f"{ast.unparse(node)} is not a number")
        return value

    def _of_Constant(self, node: ast.Constant, frame: KernelFrame) -> Value:
        if not isinstance(node.value, int | float):
            raise frame.source.refuse(node, f"{node.value!r} is not a number")
        number = self.graph.constant(node.value)
        number.origin = number.origin or frame.function
        return number

    def _of_Name(self, node: ast.Name, frame: KernelFrame) -> Value:
        if node.id in frame.variables:
            return frame.variables[node.id]
        return self._global(node, frame)

    def _of_Attribute(self, node: ast.Attribute, frame: KernelFrame) -> Value:
        if frame.resolve(node) is not MISSING:
            return self._global(node, frame)
        owner = self._value(node.value, frame)
        if not isinstance(owner, Record) or node.attr not in getattr(owner.cls, "_fields", ()):
            raise frame.source.refuse(node, f"{describe(owner)} has no {node.attr}")
        return owner.get(node.attr)

    def _global(self, node: ast.Name | ast.Attribute, frame: KernelFrame) -> Value:
        value = frame.resolve(node)
        if isinstance(value, float):
            if isinstance(node, ast.Attribute):
                module, name = home(frame.resolve(node.value).__name__, node.attr)
            else:
                module, name = home(frame.function.__module__, node.id)
            return self.graph.named_constant(module, name, value)
        if value is MISSING and isinstance(node, ast.Name) and node.id in frame.function.__code__.co_varnames:
            raise frame.source.refuse(node, f"{node.id} has no value here")
        if value is MISSING:
            raise frame.source.refuse(node, f"{ast.unparse(node)} is neither a number nor a kernel's value")
        return self.graph.literal(value)

    def _of_Subscript(self, node: ast.Subscript, frame: KernelFrame) -> Value:
        owner = self._value(node.value, frame)
        if isinstance(owner, Operand) and owner.kind == ARRAY:
            return self.graph.element(owner, self._indices(node, frame))
        at = node.slice.value if isinstance(node.slice, ast.Constant) else None
        if not isinstance(owner, Record) or not isinstance(at, int):
            raise frame.source.refuse(node, "a record is indexed by a constant")
        return owner.values[at]

    def _of_Tuple(self, node: ast.Tuple, frame: KernelFrame) -> Value:
        return Record(tuple, tuple(self._value(part, frame) for part in node.elts))

    def _of_UnaryOp(self, node: ast.UnaryOp, frame: KernelFrame) -> Value:
        if isinstance(node.op, ast.Not):
            return self.graph.negate(self._condition(node.operand, frame))
        inner = self._number(node.operand, frame)
        return self.graph.operate("neg", inner.kind, inner, origin=frame.function)

    def _of_BinOp(self, node: ast.BinOp, frame: KernelFrame) -> Value:
        return self._arithmetic(node, self._number(node.left, frame), self._number(node.right, frame), frame)

    def _arithmetic(
        self, node: ast.BinOp | ast.AugAssign, left: Operand, right: Operand, frame: KernelFrame
    ) -> Operand:
        if type(node.op) not in OPERATORS:
            raise frame.source.refuse(node, f"{type(node.op).__name__} is outside of the kernel language")
        return self.graph.arithmetic(node.op, left, right, frame.function)

    def _of_Compare(self, node: ast.Compare, frame: KernelFrame) -> Value:
        numbers = [self._number(part, frame) for part in (node.left, *node.comparators)]
        found = [
            self.graph.compare(op, a, b, frame.function)
            for a, op, b in zip(numbers, node.ops, numbers[1:], strict=False)
        ]
        return self.graph.combine("and", found)

    def _of_BoolOp(self, node: ast.BoolOp, frame: KernelFrame) -> Value:
        graph, parts = self.graph, list[Operand]()
        op = "and" if isinstance(node.op, ast.And) else "or"
        for i, part in enumerate(node.values):
            block = graph.block
            items, nodes, loads, contents = len(block.items), dict(block.nodes), len(graph.loads), dict(graph.contents)
            found = self._condition(part, frame)
            if i > 0 and any(map(_reads_array, block.items[items:])):  # an operand before may exclude it
                del block.items[items:], graph.loads[loads:]
                block.nodes, graph.contents = nodes, contents
                rest = ast.copy_location(ast.Return(ast.BoolOp(node.op, node.values[i:])), node)
                known = ast.copy_location(ast.Return(ast.Constant(op == "or")), node)
                arms = ([rest], [known]) if op == "and" else ([known], [rest])
                test = graph.combine(op, parts)
                if graph.decide(test) is not None:
                    return self._run(arms[0] if graph.decide(test) else arms[1], frame) or test
                return self._branch(test, *arms, frame, True, node) or test
            parts.append(found)
        return graph.combine(op, parts)

    def _condition(self, node: ast.expr, frame: KernelFrame) -> Operand:
        value = self._number(node, frame)
        return value if value.kind == BOOL else self.graph.operate("!=", BOOL, value, self.graph.constant(0))

    def _of_IfExp(self, node: ast.IfExp, frame: KernelFrame) -> Value:
        condition = self._condition(node.test, frame)
        known = self.graph.decide(condition)
        if known is not None:
            return self._value(node.body if known else node.orelse, frame)
        arms = (
            [ast.copy_location(ast.Return(value=node.body), node)],
            [ast.copy_location(ast.Return(value=node.orelse), node)],
        )
        value = self._branch(condition, *arms, frame, True, node)
        assert value is not None
        return value

    def _call_kernel(self, node: ast.Call, frame: KernelFrame) -> Value | None:
        called = frame.resolve(node.func)
        return self.call(called, [self._value(part, frame) for part in arguments(node, called)])

    def _of_Call(self, node: ast.Call, frame: KernelFrame) -> Value:
        shape = allocation(frame.function, node, frame.variables)
        if shape is not None:
            return self._made(node, shape, frame)
        if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
            owner = self._value(node.func.value, frame)
            assert isinstance(owner, Record)
            new = {str(word.arg): self._value(word.value, frame) for word in node.keywords}
            fields_of: Sequence[str] = owner.cls._fields  # type: ignore[attr-defined]
            parts = [new.get(name, part) for name, part in zip(fields_of, owner.values, strict=True)]
            return self.graph.record(owner.cls, parts, owner.place)
        called = frame.resolve(node.func)
        if is_struct(called):
            names: Sequence[str] = called._fields  # type: ignore[attr-defined]
            fields = by_field(node, list(names))
            if fields is None:
                raise frame.source.refuse(node, f"{called.__name__} has {len(names)} fields, each to be given once")
            return self.graph.record(called, [self._value(part, frame) for part in fields.values()])
        if is_kernel(called):
            found = self._call_kernel(node, frame)
            if found is None:
                raise frame.source.refuse(node, f"{ast.unparse(node)} returns nothing")
            return found
        name = getattr(called, "__name__", ast.unparse(node.func))
        if called is MISSING or name not in FUNCTIONS or node.keywords:
            raise frame.source.refuse(node, f"{ast.unparse(node.func)} is not a kernel")
        return self.graph.call_builtin(name, [self._number(part, frame) for part in node.args], frame.function)


def describe(value: Value | None) -> str:
    """For error messages."""
    if value is None:
        return "nothing"
    if isinstance(value, Record):
        return value.cls.__name__
    return value.kind if value.kind != ARRAY else f"an array of {' × '.join(map(str, value.shape))} numbers"


def _reads_array(item: Item) -> bool:
    """Whether an item reads elements, by itself or in its calls."""
    if isinstance(item, Call):
        return any(node.kind == ARRAY for node in item.arguments)
    if isinstance(item, Branch | Loop):
        return any(_reads_array(inner) for arm in item.arms for inner in arm.items)
    return isinstance(item, Operand) and item.op == "element"


def _returns(statement: ast.stmt) -> bool:
    return any(isinstance(node, ast.Return) for node in ast.walk(statement))
