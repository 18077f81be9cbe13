"""From a kernel's syntax tree to a graph: records fall apart into numbers, and calls become what they compute.

A kernel that stands in many places, or that few samples reach, stays a call (``procedures`` decides). Its records are
passed by their place, and those that it returns are written there; a value of before that is read later is loaded in
time. Equal operations on equal numbers are one node, whose bits are those of each.
"""

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from levelhead.compiler.mark import KernelFunction, is_kernel
from levelhead.export.folding import fold, negated
from levelhead.export.graph import (
    BOOL,
    FLOAT,
    INT,
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
from levelhead.export.inference import MISSING, arguments, by_field, resolve_name
from levelhead.export.kinds import is_struct
from levelhead.export.scopes import loaded_in
from levelhead.export.source import Source, home, read_source
from levelhead.export.type_table import annotations
from levelhead.open_types import Handle

BY_PLACE = 5  # numbers from which a record is passed by its place
MANY = 12  # numbers of a record that had better stay where they are than in variables
OPERATORS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitOr: "|", ast.BitAnd: "&", ast.BitXor: "^",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
KINDS = {float: FLOAT, int: INT, bool: BOOL}
FUNCTIONS = {"sqrt", "floor", "min", "max", "abs", "float"}


class Callees(Protocol):
    """What a tracer asks of the whole."""

    steady: dict[RecordField, Handle]
    frozen: tuple[type, ...]

    def is_called(self, function: KernelFunction) -> bool:
        """Whether a kernel stays a call."""

    def procedure(self, function: KernelFunction, given: Sequence[Value], homes: dict[type, Place | None]) -> Handle:
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

    def resolve(self, node: ast.AST) -> Handle:
        """The Python object behind a name; ``MISSING`` for a value of the kernel."""
        return resolve_name(self.function, node, self.function.__code__.co_varnames)


class Tracer:
    """Runs one procedure's kernel.

    Attributes:
        body: its items.
        contents: what lies at each place now.
        loads: all loads.
    """

    def __init__(self, callees: Callees) -> None:
        self._callees = callees
        self.steady = callees.steady
        self.body = self._block = Items()
        self.contents: dict[Place, Operand] = {}
        self.loads: list[Operand] = []
        self.homes: dict[type, Place | None] = {}  # class -> the one place of a record of it
        self._versions = 0
        self._temporaries = 0
        self._constants: dict[object, Operand] = {}

    # Nodes

    def constant(self, value: float | int | bool) -> Operand:
        """A number that is written where it is used."""
        key = (type(value), repr(value))
        if key not in self._constants:
            self._constants[key] = Operand("const", (), KINDS[type(value)], value)
        return self._constants[key]

    def load(self, place: Place, kind: str) -> Operand:
        """What lies at a place from now on."""
        member = place.members[-1] if place.members else None
        if member in self._callees.steady:
            return self.constant(self._callees.steady[member])
        self._versions += 1
        hint = place.members[-2].name if len(place.members) > 1 and len(str(member.name)) < 2 else ""  # type: ignore[union-attr]
        node = Operand("load", (), kind, (place, self._versions), self._block, f"{hint}_{member.name}".strip("_"))  # type: ignore[union-attr]
        node.after = self._block.items[-1] if self._block.items else None
        self.loads.append(node)
        self.contents[place] = node
        return node

    def record_at(self, shape: Value, place: Place) -> Value:
        """A value like ``shape`` that lies at a place."""
        if isinstance(shape, Operand):
            return self.load(place, shape.kind)
        self.homes[shape.cls] = None if shape.cls in self.homes else place
        names: Sequence[str] = shape.cls._fields  # type: ignore[attr-defined]
        values = (
            self.record_at(part, place.member(shape.cls, name)) for name, part in zip(names, shape.values, strict=True)
        )
        return Record(shape.cls, tuple(values), place)

    def is_frozen(self, value: Record) -> bool:
        """Whether a record is of parameters that are constants of the program."""
        return issubclass(value.cls, self._callees.frozen)

    def copy(self, value: Value) -> Value:
        """The constants of another procedure."""
        if isinstance(value, Operand):
            return self.constant(value.content)
        return Record(value.cls, tuple(map(self.copy, value.values)))

    def operate(self, op: str, kind: str, *given: Operand, origin: KernelFunction | None = None) -> Operand:
        """One operation, unless it was done already, or is done before the program runs."""
        folded = fold(op, given, self.constant)
        if folded is not None:
            return folded
        keys = [(op, *map(id, given))] + ([(op, *map(id, given[::-1]))] if op in ("+", "*") else [])
        for block in self._block.ancestors():
            for key in keys:
                if key in block.nodes:
                    return block.nodes[key]
        node = Operand(op, given, kind, block=self._block, origin=origin)
        self._block.nodes[keys[0]] = node
        self._block.items.append(node)
        return node

    def convert(self, value: Value, kind: str | None) -> Value:
        """A whole number as a float where one is wanted."""
        if kind != FLOAT or not isinstance(value, Operand) or value.kind == FLOAT:
            return value
        if value.op == "const":
            return self.constant(float(value.content))
        return self.operate("float", FLOAT, value)

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
            variables[argument.arg] = self.convert(value, KINDS.get(hint) if isinstance(hint, type) else None)
        return self._run(source.tree.body, KernelFrame(source, variables))

    def _call_procedure(self, function: KernelFunction, given: Sequence[Value]) -> Value | None:
        procedure = self._callees.procedure(function, given, self.homes)
        call = Call(procedure, {}, [])
        records: dict[str, Value] = {}
        for part, shape in procedure.parts:
            value, name = part.of(given), part.name
            if name not in procedure.by_place:
                call.arguments += [
                    self._argument(wanted, got) for wanted, got in zip(leaves(shape), leaves(value), strict=True)
                ]
                continue
            assert isinstance(value, Record)
            place = self._place_of(value.cls, value.place, call, name)
            for at, leaf in placed_leaves(value, place):
                inner = Place(name, at.members[len(place.members) :])
                if inner not in procedure.reads:
                    continue
                if self.contents.get(at) is not leaf:
                    self._store(at, leaf)
                elif leaf.op == "load":
                    call.reads[inner] = leaf
            call.places[name], records[name] = place, value
        for name, shape in procedure.outputs.items():
            call.places[name] = self._place_of(shape.cls, None, call, name)
        self._block.items.append(call)
        for inner, kind in procedure.writes.items():
            self.load(Place(call.places[inner.root].root, call.places[inner.root].members + inner.members), kind)
        call.results = [
            Operand("result", (), node.kind, (call, i), self._block, node.hint)
            for i, node in enumerate(procedure.returned)
        ]
        return self._result(procedure.answer, call, records)

    def _argument(self, wanted: Operand, got: Operand) -> Operand:
        node = self.convert(got, wanted.kind)
        assert isinstance(node, Operand)
        return node

    def _place_of(self, cls: type, place: Place | None, call: Call, name: str) -> Place:
        """Where a record lies for a call: where it came from, its class's one place, or in a struct of its own."""
        place = place or self.homes.get(cls)
        if place is None or any(_overlap(place, other) for other in call.places.values()):
            self._temporaries += 1
            place = Place(f"{name}_{self._temporaries}", ())
            call.temporaries[place.root] = cls
        return place

    def _store(self, place: Place, value: Operand) -> None:
        if place.members and place.members[-1] in self._callees.steady:
            self._block.items.append(Store(place, value))  # to be compared
            return
        self._block.items.append(Store(place, value))
        self.contents[place] = value

    def _result(self, answer: Handle, call: Call, given: dict[str, Value]) -> Value | None:
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
            if member in self._callees.steady:
                return self.constant(self._callees.steady[member])
            return self.contents[place]
        names: Sequence[str] = shape.cls._fields  # type: ignore[attr-defined]
        parts = zip(names, shape.values, strict=True)
        return Record(
            shape.cls, tuple(self._placed(part, place.member(shape.cls, name)) for name, part in parts), place
        )

    def _written(self, before: Value, place: Place, call: Call, inner: Place) -> Value:
        if isinstance(before, Operand):
            procedure = call.procedure
            if place.members and place.members[-1] in self._callees.steady:
                return before
            return self.contents[place] if inner in procedure.writes else before
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
                known = self._decided(condition)
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
        before, outside = dict(self.contents), self._block
        variables = dict(frame.variables)
        branch = Branch(condition, outside)
        branch.arms = Items(branch), Items(branch)
        outside.items.append(branch)
        ends = []
        for arm, statements, truth in ((branch.arms[0], body, True), (branch.arms[1], orelse, False)):
            self._block, self.contents, frame.variables = arm, dict(before), dict(variables)
            self._assume(condition, truth)
            ends.append((self._run(statements, frame), frame.variables, self.contents))
        self._block = outside
        (one, ones, contents), (other, others, other_contents) = ends
        branch.contents = contents, other_contents
        self.contents = {}
        for place in contents.keys() | other_contents.keys():
            if contents.get(place) is other_contents.get(place):
                self.contents[place] = contents[place]
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
            home = one.place or other.place or self.homes.get(one.cls) or place
            many = sum(isinstance(part, Operand) for part in one.values) >= MANY
            names: Sequence[str] = getattr(one.cls, "_fields", ()) or [""] * len(one.values)
            values = tuple(
                self._merge(branch, a, b, home and home.member(one.cls, name), many)
                for name, a, b in zip(names, one.values, other.values, strict=True)
            )
            return Record(one.cls, values, home)
        assert isinstance(one, Operand) and isinstance(other, Operand)
        if one.kind != other.kind:
            return self._merge(branch, self.convert(one, FLOAT), self.convert(other, FLOAT))
        if place is not None:
            self._home(branch, one, other, place, many)
        for lies, node in branch.contents[0].items():
            if node is one and branch.contents[1].get(lies) is other:
                held = self.contents.get(lies)
                return held if held is not None else self.load(lies, one.kind)
        if (one, other) not in branch.phis:
            hint = one.hint or other.hint
            branch.phis[one, other] = Operand("phi", (one, other), one.kind, branch, branch.block, hint)
        return branch.phis[one, other]

    def _home(self, branch: Branch, one: Operand, other: Operand, place: Place, many: bool) -> None:
        """Stores the number of an arm where the number of the other lies already, or one of many where it belongs."""
        if place in branch.homed or place.members[-1] in self._callees.steady:
            return
        lies = [contents.get(place) is node for contents, node in zip(branch.contents, (one, other), strict=True)]
        if not any(lies) and not (many and all(place in contents for contents in branch.contents)):
            return
        branch.homed.add(place)
        self.contents.pop(place, None)
        for arm, contents, node, there in zip(branch.arms, branch.contents, (one, other), lies, strict=True):
            if not there:
                arm.items.append(Store(place, node))
                contents[place] = node

    def _on_Pass(self, node: ast.Pass, frame: KernelFrame) -> None:
        pass

    def _on_Expr(self, node: ast.Expr, frame: KernelFrame) -> None:
        if not isinstance(node.value, ast.Constant):
            raise frame.source.refuse(node, "an expression whose value nobody takes")

    def _on_Assign(self, node: ast.Assign, frame: KernelFrame) -> None:
        value = self._value(node.value, frame)
        for target in node.targets:
            self._assign(target, value, frame)

    def _on_AnnAssign(self, node: ast.AnnAssign, frame: KernelFrame) -> None:
        assert node.value is not None
        self._assign(node.target, self._value(node.value, frame), frame)

    def _on_AugAssign(self, node: ast.AugAssign, frame: KernelFrame) -> None:
        left, right = self._number(node.target, frame), self._number(node.value, frame)
        self._assign(node.target, self._arithmetic(node.op, left, right, frame), frame)

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
        return self.constant(node.value)  # type: ignore[arg-type]

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
            key = (module, name, repr(value))
            return self._constants.setdefault(key, Operand("named", (), FLOAT, (module, name, value)))
        if value is MISSING:
            raise frame.source.refuse(node, f"{ast.unparse(node)} is neither a number nor a kernel's value")
        return self.literal(value)

    def literal(self, value: Handle) -> Value:
        """A number or a record of numbers that is known before the program runs."""
        if isinstance(value, tuple):
            hints = annotations(type(value))
            names: Sequence[str] = value._fields  # type: ignore[attr-defined]
            parts = (
                self.convert(self.literal(part), KINDS.get(hints.get(name)))  # type: ignore[call-overload]
                for name, part in zip(names, value, strict=True)
            )
            return Record(type(value), tuple(parts))
        return self.constant(value)

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
            return self._not(self._condition(node.operand, frame))
        inner = self._number(node.operand, frame)
        return self.operate("neg", inner.kind, inner, origin=frame.function)

    def _not(self, condition: Operand) -> Operand:
        known = self._decided(condition)
        if known is not None:
            return self.constant(not known)
        return condition.arguments[0] if condition.op == "not" else self.operate("not", BOOL, condition)

    def _of_BinOp(self, node: ast.BinOp, frame: KernelFrame) -> Value:
        left, right = self._number(node.left, frame), self._number(node.right, frame)
        return self._arithmetic(node.op, left, right, frame)

    def _arithmetic(self, op: ast.operator, left: Operand, right: Operand, frame: KernelFrame) -> Operand:
        sign = OPERATORS[type(op)]
        if FLOAT in (left.kind, right.kind) or sign == "/":
            a, b = self.convert(left, FLOAT), self.convert(right, FLOAT)
            assert isinstance(a, Operand) and isinstance(b, Operand)
            return self.operate(sign, FLOAT, a, b, origin=frame.function)
        return self.operate(sign, INT, left, right, origin=frame.function)

    def _of_Compare(self, node: ast.Compare, frame: KernelFrame) -> Value:
        numbers = [self._number(part, frame) for part in (node.left, *node.comparators)]
        found = []
        for a, op, b in zip(numbers, node.ops, numbers[1:], strict=False):
            if FLOAT in (a.kind, b.kind):
                a, b = self.convert(a, FLOAT), self.convert(b, FLOAT)  # type: ignore[assignment]  # noqa: PLW2901
            found.append(self.operate(OPERATORS[type(op)], BOOL, a, b, origin=frame.function))
        return self._all("and", found)

    def _of_BoolOp(self, node: ast.BoolOp, frame: KernelFrame) -> Value:
        return self._all(
            "and" if isinstance(node.op, ast.And) else "or", [self._condition(part, frame) for part in node.values]
        )

    def _all(self, op: str, parts: Sequence[Operand]) -> Operand:
        """The conjunction or disjunction of conditions, without those that are decided."""
        left = []
        for part in parts:
            known = self._decided(part)
            if known is None:
                left += [part] if part not in left else []
            elif known == (op == "or"):
                return self.constant(known)
        if not left:
            return self.constant(op == "and")
        return left[0] if len(left) == 1 else self.operate(op, BOOL, *left)

    def _condition(self, node: ast.expr, frame: KernelFrame) -> Operand:
        value = self._number(node, frame)
        return value if value.kind == BOOL else self.operate("!=", BOOL, value, self.constant(0))

    def _decided(self, condition: Operand) -> bool | None:
        """What a condition is, where that follows from the branch that was taken."""
        if condition.op == "const":
            return bool(condition.content)
        for block in self._block.ancestors():
            if condition in block.known:
                return block.known[condition]
        if condition.op == "not":
            inner = self._decided(condition.arguments[0])
            return None if inner is None else not inner
        opposite = negated(condition, self._block)
        if opposite is not None:
            for block in self._block.ancestors():
                if opposite in block.known:
                    return not block.known[opposite]
        return None

    def _assume(self, condition: Operand, truth: bool) -> None:
        """Notes what a condition is in the arm that begins."""
        self._block.known[condition] = truth
        if condition.op == "not":
            self._assume(condition.arguments[0], not truth)
        if (condition.op == "and" and truth) or (condition.op == "or" and not truth):
            for part in condition.arguments:
                self._assume(part, truth)

    def _of_IfExp(self, node: ast.IfExp, frame: KernelFrame) -> Value:
        condition = self._condition(node.test, frame)
        known = self._decided(condition)
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
            return self._record(owner.cls, parts, owner.place)
        called = frame.resolve(node.func)
        if is_struct(called):
            fields = by_field(node, list(called._fields)) or {}  # type: ignore[attr-defined]
            return self._record(called, [self._value(part, frame) for part in fields.values()])
        if is_kernel(called):
            found = self.call(called, [self._value(part, frame) for part in arguments(node, called)])
            if found is None:
                raise frame.source.refuse(node, f"{ast.unparse(node)} returns nothing")
            return found
        name = getattr(called, "__name__", ast.unparse(node.func))
        if called is MISSING or name not in FUNCTIONS or node.keywords:
            raise frame.source.refuse(node, f"{ast.unparse(node.func)} is no kernel")
        return self._builtin(name, [self._number(part, frame) for part in node.args], frame)

    def _record(self, cls: type, parts: Sequence[Value], place: Place | None = None) -> Record:
        hints = annotations(cls)
        names: Sequence[str] = cls._fields  # type: ignore[attr-defined]
        values = tuple(
            self.convert(part, KINDS.get(hints.get(name)))  # type: ignore[call-overload]
            for name, part in zip(names, parts, strict=True)
        )
        return Record(cls, values, place)

    def _builtin(self, name: str, given: list[Operand], frame: KernelFrame) -> Operand:
        if name == "float":
            value = self.convert(given[0], FLOAT)
            assert isinstance(value, Operand)
            return value
        if name in ("sqrt", "floor"):
            value = self.convert(given[0], FLOAT)
            assert isinstance(value, Operand)
            return self.operate(name, FLOAT, value, origin=frame.function)
        kind = FLOAT if any(node.kind == FLOAT for node in given) else INT
        parts = [self.convert(node, kind) for node in given]
        found = parts[0]
        assert isinstance(found, Operand)
        if name == "abs":
            return self.operate("abs", kind, found, origin=frame.function)
        for other in parts[1:]:
            assert isinstance(found, Operand) and isinstance(other, Operand)
            found = self.operate(name, kind, found, other, origin=frame.function)
        assert isinstance(found, Operand)
        return found


def _overlap(one: Place, other: Place) -> bool:
    shared = min(len(one.members), len(other.members))
    return one.root == other.root and one.members[:shared] == other.members[:shared]


def _returns(statement: ast.stmt) -> bool:
    return any(isinstance(node, ast.Return) for node in ast.walk(statement))
