"""The graph of one procedure while it is made: every operation once, and facts about numbers and conditions.

Equal operations on equal numbers are one node, whose bits are those of each.
"""

import ast
from collections.abc import Sequence

from levelhead.compiler.mark import KernelFunction
from levelhead.errors import LevelheadError
from levelhead.export.folding import fold
from levelhead.export.graph import (
    ARRAY,
    BOOL,
    FLOAT,
    INT,
    Items,
    Operand,
    Place,
    Put,
    Record,
    RecordField,
    Value,
    are_exclusive,
    items_within,
)
from levelhead.export.type_table import annotations
from levelhead.open_types import Untyped

OPERATORS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitOr: "|", ast.BitAnd: "&", ast.BitXor: "^",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
FUNCTIONS = {"sqrt", "floor", "min", "max", "abs", "float"}
KINDS = {float: FLOAT, int: INT, bool: BOOL}


Steady = dict[tuple[RecordField, ...], Untyped]  # ``Place.field`` -> value


class GraphBuilder:
    """Makes the nodes of one procedure.

    Args:
        steady: field -> its value, for fields that are assumed never to change.
        frozen: classes of parameters that are constants of the program.

    Attributes:
        body: its items.
        block: the items that get the next node: the body, or an arm within it.
        contents: the present content of each place.
        loads: all loads.
        homes: class -> the one place of a record of it; None where there are several.
        memories: field -> the array that every record has there: it is made once and written in place.
        claims: array that an argument is -> the place of the record in which it is returned.
        locals: the arrays that it makes.
    """

    def __init__(self, steady: Steady, frozen: tuple[type, ...]) -> None:
        self.steady, self.frozen = steady, frozen
        self.body = self.block = Items()
        self.contents: dict[Place, Operand] = {}
        self.loads: list[Operand] = []
        self.homes: dict[type, Place | None] = {}
        self.memories: dict[RecordField, Operand] = {}
        self.claims: dict[Operand, Place] = {}
        self.locals: list[Operand] = []
        self._versions = 0
        self._constants: dict[object, Operand] = {}

    # Numbers and records

    def constant(self, value: float | int | bool) -> Operand:
        """A number that is written where it is used."""
        key = (type(value), repr(value))
        if key not in self._constants:
            self._constants[key] = Operand("const", (), KINDS[type(value)], value)
        return self._constants[key]

    def named_constant(self, module: str, name: str, value: float) -> Operand:
        """A constant of a module."""
        content = module, name, value
        return self._constants.setdefault((module, name, repr(value)), Operand("named", (), FLOAT, content))

    def load(self, place: Place, kind: str) -> Operand:
        """Sets the value at a place from now on."""
        member = place.members[-1] if place.members else None
        if place.field in self.steady:
            return self.constant(self.steady[place.field])
        self._versions += 1
        hint = place.members[-2].name if len(place.members) > 1 and len(str(member.name)) < 2 else ""  # type: ignore[union-attr]
        node = Operand("load", (), kind, (place, self._versions), self.block, f"{hint}_{member.name}".strip("_"))  # type: ignore[union-attr]
        node.after = self.block.items[-1] if self.block.items else None
        self.loads.append(node)
        self.contents[place] = node
        return node

    def memory(self, place: Place, shape: tuple[int, ...]) -> Operand:
        """The array of the field at a place."""
        return self.memories.setdefault(place.members[-1], Operand("memory", (), ARRAY, place, shape=shape))

    def claim(self, array: Operand, place: Place) -> None:
        """An array goes into a record: the one that every record has in that field, or the first that is made for it.

        Raises:
            LevelheadError: it is another one.
        """
        member = place.members[-1]
        array_is: RecordField | None
        if array.op == "argument":
            array_is = self.claims.setdefault(array, place).members[-1]
        elif array.op == "local" and not self._is_used(self.memories.get(member), array):
            before = self.memories.setdefault(member, array)
            array.op, array.content, array_is = "memory", before.content or place, member
        else:
            array_is = array.content.members[-1] if array.op == "memory" else None
        if array_is != member:
            owner = member.owner.__name__
            raise LevelheadError(f"the array {owner}.{member.name} is made once, by init, and written in place")

    def _is_used(self, array: Operand | None, beside: Operand) -> bool:
        """Whether an array is used beside another one that is made in this procedure."""
        if array is None:
            return False
        assert beside.block is not None
        for block, item in items_within(self.body):
            given = (item.array,) if isinstance(item, Put) else getattr(item, "arguments", ())
            if array in given and not are_exclusive(block, beside.block):
                return True
        return False

    def element(self, array: Operand, indices: Sequence[Operand]) -> Operand:
        """An element of an array as it is now, or a row of it."""
        rest = array.shape[len(indices) :]
        given = (array.base, *array.arguments[1:], *indices)
        node = Operand("row" if rest else "element", given, ARRAY if rest else FLOAT, block=self.block, shape=rest)
        self.block.items.append(node)
        return node

    def record_at(self, shape: Value, place: Place) -> Value:
        """A value like ``shape`` that lies at a place."""
        if isinstance(shape, Operand):
            return self.memory(place, shape.shape) if shape.kind == ARRAY else self.load(place, shape.kind)
        self.homes[shape.cls] = None if shape.cls in self.homes else place
        names: Sequence[str] = shape.cls._fields  # type: ignore[attr-defined]
        values = (
            self.record_at(part, place.member(shape.cls, name)) for name, part in zip(names, shape.values, strict=True)
        )
        return Record(shape.cls, tuple(values), place)

    def is_frozen(self, value: Record) -> bool:
        """Whether a record is of parameters that are constants of the program."""
        return issubclass(value.cls, self.frozen)

    def copy(self, value: Value) -> Value:
        """The constants of another procedure."""
        if isinstance(value, Operand):
            return self.constant(value.content)
        return Record(value.cls, tuple(map(self.copy, value.values)))

    def literal(self, value: Untyped) -> Value:
        """A number or a record of numbers that is known before the program runs."""
        if isinstance(value, tuple):
            return self.record(type(value), [self.literal(part) for part in value])
        return self.constant(value)

    def record(self, cls: type, parts: Sequence[Value], place: Place | None = None) -> Record:
        """A record of values, each in the kind of its field."""
        hints = annotations(cls)
        names: Sequence[str] = cls._fields  # type: ignore[attr-defined]
        values = tuple(
            self.convert(part, KINDS.get(hints.get(name)))  # type: ignore[call-overload]
            for name, part in zip(names, parts, strict=True)
        )
        return Record(cls, values, place)

    def convert(self, value: Value, kind: str | None) -> Value:
        """A whole number as a float where one is wanted."""
        if kind != FLOAT or not isinstance(value, Operand) or value.kind == FLOAT:
            return value
        if value.op == "const":
            return self.constant(float(value.content))
        return self.operate("float", FLOAT, value)

    def number(self, value: Value, kind: str | None) -> Operand:
        """The same of a value that is a number."""
        node = self.convert(value, kind)
        assert isinstance(node, Operand)
        return node

    def operate(self, op: str, kind: str, *given: Operand, origin: KernelFunction | None = None) -> Operand:
        """One operation, unless it was done already, or is done before the program runs."""
        folded = fold(op, given, self.constant)
        if folded is not None:
            return folded
        keys = [(op, *map(id, given))] + ([(op, *map(id, given[::-1]))] if op in ("+", "*") else [])
        for block in self.block.ancestors():
            for key in keys:
                if key in block.nodes:
                    return block.nodes[key]
        node = Operand(op, given, kind, block=self.block, origin=origin)
        self.block.nodes[keys[0]] = node
        self.block.items.append(node)
        return node

    def arithmetic(self, op: ast.operator, left: Operand, right: Operand, origin: KernelFunction) -> Operand:
        """A sum, a difference, a product, a quotient, or an operation on bits."""
        sign = OPERATORS[type(op)]
        if FLOAT in (left.kind, right.kind) or sign == "/":
            return self.operate(sign, FLOAT, self.number(left, FLOAT), self.number(right, FLOAT), origin=origin)
        return self.operate(sign, INT, left, right, origin=origin)

    def compare(self, op: ast.cmpop, left: Operand, right: Operand, origin: KernelFunction) -> Operand:
        """A comparison."""
        if FLOAT in (left.kind, right.kind):
            left, right = self.number(left, FLOAT), self.number(right, FLOAT)
        return self.operate(OPERATORS[type(op)], BOOL, left, right, origin=origin)

    def call_builtin(self, name: str, given: Sequence[Operand], origin: KernelFunction) -> Operand:
        """The result of one of ``FUNCTIONS``."""
        if name == "float":
            return self.number(given[0], FLOAT)
        if name in ("sqrt", "floor"):
            return self.operate(name, FLOAT, self.number(given[0], FLOAT), origin=origin)
        kind = FLOAT if any(node.kind == FLOAT for node in given) else INT
        found, *others = (self.number(node, kind) for node in given)
        if name == "abs":
            return self.operate("abs", kind, found, origin=origin)
        for other in others:
            found = self.operate(name, kind, found, other, origin=origin)
        return found

    # Conditions

    def negate(self, condition: Operand) -> Operand:
        """The opposite of a condition."""
        known = self.decide(condition)
        if known is not None:
            return self.constant(not known)
        return condition.arguments[0] if condition.op == "not" else self.operate("not", BOOL, condition)

    def combine(self, op: str, parts: Sequence[Operand]) -> Operand:
        """The conjunction or disjunction of conditions, without those that are decided."""
        left = []
        for part in parts:
            known = self.decide(part)
            if known is None:
                left += [part] if part not in left else []
            elif known == (op == "or"):
                return self.constant(known)
        if not left:
            return self.constant(op == "and")
        return left[0] if len(left) == 1 else self.operate(op, BOOL, *left)

    def decide(self, condition: Operand) -> bool | None:
        """The value of a condition that follows from the branch that was taken."""
        if condition.op == "const":
            return bool(condition.content)
        for block in self.block.ancestors():
            if condition in block.known:
                return block.known[condition]
        if condition.op == "not":
            inner = self.decide(condition.arguments[0])
            return None if inner is None else not inner
        return None

    def assume(self, condition: Operand, truth: bool) -> None:
        """Notes the value of a condition in the arm that begins."""
        self.block.known[condition] = truth
        if condition.op == "not":
            self.assume(condition.arguments[0], not truth)
        if (condition.op == "and" and truth) or (condition.op == "or" and not truth):
            for part in condition.arguments:
                self.assume(part, truth)
