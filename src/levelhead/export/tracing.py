"""From a kernel's syntax tree to a graph: records fall apart into numbers, and calls become what they compute.

A kernel that stands in many places, or that few samples reach, stays a call (``procedures`` decides). Its records are
passed by their place, and those that it returns are written there; a value of before that is read later is loaded in
time. ``graph_builder`` makes the nodes.
"""

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from levelhead.compiler.mark import KernelFunction, is_kernel
from levelhead.export.graph import (
    BOOL,
    FLOAT,
    Branch,
    Call,
    Items,
    Operand,
    Place,
    Record,
    RecordField,
    Store,
    Value,
    leaves,
    placed_leaves,
)
from levelhead.export.graph_builder import FUNCTIONS, KINDS, GraphBuilder
from levelhead.export.inference import MISSING, arguments, by_field, resolve_name
from levelhead.export.kinds import is_struct
from levelhead.export.scopes import loaded_in
from levelhead.export.source import Source, home, read_source
from levelhead.export.type_table import annotations
from levelhead.open_types import Untyped

BY_PLACE = 5  # numbers from which a record is passed by its place
MANY = 12  # numbers of a record that had better stay where they are than in variables


class Callees(Protocol):
    """What a tracer asks of the whole."""

    steady: dict[RecordField, Untyped]
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
    pending: list[frozenset[str]] = field(default_factory=list)  # what is read behind the branches around

    @property
    def function(self) -> KernelFunction:
        """The kernel."""
        return self.source.function

    def resolve(self, node: ast.AST) -> Untyped:
        """The Python object behind a name; ``MISSING`` for a value of the kernel."""
        return resolve_name(self.function, node, self.function.__code__.co_varnames)


class Tracer:
    """Runs one procedure's kernel.

    Attributes:
        graph: what it makes.
    """

    def __init__(self, callees: Callees) -> None:
        self._callees = callees
        self.graph = GraphBuilder(callees.steady, callees.frozen)
        self._temporaries = 0

    # Calls

    def call(self, function: KernelFunction, given: Sequence[Value]) -> Value | None:
        """What a kernel returns."""
        if self._callees.is_called(function):
            return self._call_procedure(function, given)
        return self.inline(function, given)

    def inline(self, function: KernelFunction, given: Sequence[Value]) -> Value | None:
        """The same, computed here."""
        source = read_source(function)
        hints = annotations(function)
        variables = {}
        for argument, value in zip(source.tree.args.args, given, strict=True):
            hint = hints.get(argument.arg)
            variables[argument.arg] = self.graph.convert(value, KINDS.get(hint) if isinstance(hint, type) else None)
        return self._run(source.tree.body, KernelFrame(source, variables))

    def _call_procedure(self, function: KernelFunction, given: Sequence[Value]) -> Value | None:
        procedure = self._callees.procedure(function, given, self.graph.homes)
        call = Call(procedure, {}, [])
        records: dict[str, Value] = {}
        for part, shape in procedure.parts:
            value, name = part.of(given), part.name
            if name not in procedure.by_place:
                call.arguments += [
                    self.graph.number(got, wanted.kind)
                    for wanted, got in zip(leaves(shape), leaves(value), strict=True)
                ]
                continue
            assert isinstance(value, Record)
            place = self._place_of(value.cls, value.place, call, name)
            for at, leaf in placed_leaves(value, place):
                inner = Place(name, at.members[len(place.members) :])
                if inner not in procedure.reads:
                    continue
                if self.graph.contents.get(at) is not leaf:
                    self._store(at, leaf)
                elif leaf.op == "load":
                    call.reads[inner] = leaf
            call.places[name], records[name] = place, value
        for name, shape in procedure.outputs.items():
            call.places[name] = self._place_of(shape.cls, None, call, name)
        self.graph.block.items.append(call)
        for inner, kind in procedure.writes.items():
            self.graph.load(Place(call.places[inner.root].root, call.places[inner.root].members + inner.members), kind)
        call.results = [
            Operand("result", (), node.kind, (call, i), self.graph.block, node.hint)
            for i, node in enumerate(procedure.returned)
        ]
        return self._result(procedure.answer, call, records)

    def _place_of(self, cls: type, place: Place | None, call: Call, name: str) -> Place:
        """Where a record lies for a call: where it came from, its class's one place, or in a struct of its own."""
        place = place or self.graph.homes.get(cls)
        if place is None or any(_overlap(place, other) for other in call.places.values()):
            self._temporaries += 1
            place = Place(f"{name}_{self._temporaries}", ())
            call.temporaries[place.root] = cls
        return place

    def _store(self, place: Place, value: Operand) -> None:
        if place.members and place.members[-1] in self.graph.steady:
            self.graph.block.items.append(Store(place, value))  # to be compared
            return
        self.graph.block.items.append(Store(place, value))
        self.graph.contents[place] = value

    def _result(self, answer: Untyped, call: Call, given: dict[str, Value]) -> Value | None:
        """The value of a call: numbers that it returns, and records that lie where it has written them."""
        if answer is None:
            return None
        if isinstance(answer, int):
            return call.results[answer]
        if isinstance(answer, str):
            place = call.places[answer]
            if answer in call.procedure.outputs:
                return self._placed(call.procedure.outputs[answer], place)
            return self._written(given[answer], place, call, Place(answer, ()))
        cls, parts = answer
        return Record(cls, tuple(self._result(part, call, given) for part in parts))  # type: ignore[misc]

    def _placed(self, shape: Value, place: Place) -> Value:
        """A record that a call has put at a place."""
        if isinstance(shape, Operand):
            member = place.members[-1]
            if member in self.graph.steady:
                return self.graph.constant(self.graph.steady[member])
            return self.graph.contents[place]
        names: Sequence[str] = shape.cls._fields  # type: ignore[attr-defined]
        parts = zip(names, shape.values, strict=True)
        return Record(
            shape.cls, tuple(self._placed(part, place.member(shape.cls, name)) for name, part in parts), place
        )

    def _written(self, before: Value, place: Place, call: Call, inner: Place) -> Value:
        if isinstance(before, Operand):
            procedure = call.procedure
            if place.members and place.members[-1] in self.graph.steady:
                return before
            return self.graph.contents[place] if inner in procedure.writes else before
        names: Sequence[str] = before.cls._fields  # type: ignore[attr-defined]
        values = []
        for name, part in zip(names, before.values, strict=True):
            values.append(self._written(part, place.member(before.cls, name), call, inner.member(before.cls, name)))
        return Record(before.cls, tuple(values), place)

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
                    return self._branch(condition, *arms, frame, True)
                frame.pending.append(frozenset().union(*map(loaded_in, rest)))
                self._branch(condition, statement.body, statement.orelse, frame, False)
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
            return None if one is None or other is None else self._merge(branch, one, other)
        needed = frozenset().union(*frame.pending)
        shared = [name for name in ones if name in others and name in needed]
        frame.variables = {name: self._merge(branch, ones[name], others[name]) for name in shared}
        return None

    def _merge(self, branch: Branch, one: Value, other: Value, place: Place | None = None, many: bool = False) -> Value:
        """The value of either arm, which lies or would lie at a place; ``many``: together with many others."""
        if one is other:
            return one
        if isinstance(one, Record) and isinstance(other, Record):
            home = one.place or other.place or self.graph.homes.get(one.cls) or place
            many = sum(isinstance(part, Operand) for part in one.values) >= MANY
            names: Sequence[str] = getattr(one.cls, "_fields", ()) or [""] * len(one.values)
            values = tuple(
                self._merge(branch, a, b, home and home.member(one.cls, name), many)
                for name, a, b in zip(names, one.values, other.values, strict=True)
            )
            return Record(one.cls, values, home)
        assert isinstance(one, Operand) and isinstance(other, Operand)
        if one.kind != other.kind:
            return self._merge(branch, self.graph.convert(one, FLOAT), self.graph.convert(other, FLOAT))
        if place is not None:
            self._home(branch, one, other, place, many)
        for lies, node in branch.contents[0].items():
            if node is one and branch.contents[1].get(lies) is other:
                held = self.graph.contents.get(lies)
                return held if held is not None else self.graph.load(lies, one.kind)
        if (one, other) not in branch.phis:
            hint = one.hint or other.hint
            branch.phis[one, other] = Operand("phi", (one, other), one.kind, branch, branch.block, hint)
        return branch.phis[one, other]

    def _home(self, branch: Branch, one: Operand, other: Operand, place: Place, many: bool) -> None:
        """Stores the number of an arm where the number of the other lies already, or one of many where it belongs."""
        if place in branch.homed or place.members[-1] in self.graph.steady:
            return
        lies = [contents.get(place) is node for contents, node in zip(branch.contents, (one, other), strict=True)]
        if not any(lies) and not (many and all(place in contents for contents in branch.contents)):
            return
        branch.homed.add(place)
        self.graph.contents.pop(place, None)
        for arm, contents, node, there in zip(branch.arms, branch.contents, (one, other), lies, strict=True):
            if not there:
                arm.items.append(Store(place, node))
                contents[place] = node

    def _on_Pass(self, node: ast.Pass, frame: KernelFrame) -> None:
        pass

    def _on_Expr(self, node: ast.Expr, frame: KernelFrame) -> None:
        if not isinstance(node.value, ast.Constant):
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
        self._assign(node.target, self.graph.arithmetic(node.op, left, right, frame.function), frame)

    def _assign(self, target: ast.expr, value: Value, frame: KernelFrame) -> None:
        if isinstance(target, ast.Tuple):
            assert isinstance(value, Record)
            for part, inner in zip(target.elts, value.values, strict=True):
                self._assign(part, inner, frame)
        elif isinstance(target, ast.Name):
            if isinstance(value, Operand) and not value.hint and value.op not in ("const", "named"):
                value.hint = target.id
            frame.variables[target.id] = value
        else:
            raise frame.source.refuse(target, "a value can be given to a variable only")

    # Expressions

    def _value(self, node: ast.expr, frame: KernelFrame) -> Value:
        handler = getattr(self, f"_of_{type(node).__name__}", None)
        if handler is None:
            raise frame.source.refuse(node, f"{type(node).__name__} is outside of the kernel language")
        value: Value = handler(node, frame)
        return value

    def _number(self, node: ast.expr, frame: KernelFrame) -> Operand:
        value = self._value(node, frame)
        if not isinstance(value, Operand):
            raise frame.source.refuse(node, f"{ast.unparse(node)} is no number")
        return value

    def _of_Constant(self, node: ast.Constant, frame: KernelFrame) -> Value:
        return self.graph.constant(node.value)  # type: ignore[arg-type]

    def _of_Name(self, node: ast.Name, frame: KernelFrame) -> Value:
        if node.id in frame.variables:
            return frame.variables[node.id]
        return self._global(node, frame)

    def _of_Attribute(self, node: ast.Attribute, frame: KernelFrame) -> Value:
        if frame.resolve(node) is not MISSING:
            return self._global(node, frame)
        owner = self._value(node.value, frame)
        if not isinstance(owner, Record):
            raise frame.source.refuse(node, f"{ast.unparse(node.value)} has no {node.attr}")
        return owner.get(node.attr)

    def _global(self, node: ast.Name | ast.Attribute, frame: KernelFrame) -> Value:
        value = frame.resolve(node)
        if isinstance(value, float):
            if isinstance(node, ast.Attribute):
                module, name = home(frame.resolve(node.value).__name__, node.attr)
            else:
                module, name = home(frame.function.__module__, node.id)
            return self.graph.named_constant(module, name, value)
        if value is MISSING:
            raise frame.source.refuse(node, f"{ast.unparse(node)} is neither a number nor a kernel's value")
        return self.graph.literal(value)

    def _of_Subscript(self, node: ast.Subscript, frame: KernelFrame) -> Value:
        owner = self._value(node.value, frame)
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
        left, right = self._number(node.left, frame), self._number(node.right, frame)
        return self.graph.arithmetic(node.op, left, right, frame.function)

    def _of_Compare(self, node: ast.Compare, frame: KernelFrame) -> Value:
        numbers = [self._number(part, frame) for part in (node.left, *node.comparators)]
        found = [
            self.graph.compare(op, a, b, frame.function)
            for a, op, b in zip(numbers, node.ops, numbers[1:], strict=False)
        ]
        return self.graph.combine("and", found)

    def _of_BoolOp(self, node: ast.BoolOp, frame: KernelFrame) -> Value:
        return self.graph.combine(
            "and" if isinstance(node.op, ast.And) else "or", [self._condition(part, frame) for part in node.values]
        )

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
        value = self._branch(condition, *arms, frame, True)
        assert value is not None
        return value

    def _of_Call(self, node: ast.Call, frame: KernelFrame) -> Value:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
            owner = self._value(node.func.value, frame)
            assert isinstance(owner, Record)
            new = {str(word.arg): self._value(word.value, frame) for word in node.keywords}
            names: Sequence[str] = owner.cls._fields  # type: ignore[attr-defined]
            parts = [new.get(name, part) for name, part in zip(names, owner.values, strict=True)]
            return self.graph.record(owner.cls, parts, owner.place)
        called = frame.resolve(node.func)
        if is_struct(called):
            fields = by_field(node, list(called._fields)) or {}  # type: ignore[attr-defined]
            return self.graph.record(called, [self._value(part, frame) for part in fields.values()])
        if is_kernel(called):
            found = self.call(called, [self._value(part, frame) for part in arguments(node, called)])
            if found is None:
                raise frame.source.refuse(node, f"{ast.unparse(node)} returns nothing")
            return found
        name = getattr(called, "__name__", ast.unparse(node.func))
        if called is MISSING or name not in FUNCTIONS or node.keywords:
            raise frame.source.refuse(node, f"{ast.unparse(node.func)} is not a kernel")
        return self.graph.call_builtin(name, [self._number(part, frame) for part in node.args], frame.function)


def _overlap(one: Place, other: Place) -> bool:
    shared = min(len(one.members), len(other.members))
    return one.root == other.root and one.members[:shared] == other.members[:shared]


def _returns(statement: ast.stmt) -> bool:
    return any(isinstance(node, ast.Return) for node in ast.walk(statement))
