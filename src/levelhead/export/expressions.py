"""Expressions of the kernel language as C, with no more brackets than the same order of operations asks for.

Sums and products of floats are not associative: what Python groups stays grouped.
"""

import ast
from collections.abc import Sequence
from typing import Protocol

from levelhead.compiler.mark import is_kernel
from levelhead.export.constants import Constants
from levelhead.export.inference import Inference, allocation, arguments, by_field
from levelhead.export.kinds import FLOAT, INT, Array, Kind, Struct, is_empty, is_struct, variable
from levelhead.export.type_table import TypeTable

# C's precedences
TERNARY, OR, AND, BIT_OR, BIT_XOR, BIT_AND, EQUAL, LESS, SUM, PRODUCT, UNARY, PRIMARY = range(12)
OPERATORS: dict[type, tuple[str, int]] = {
    ast.Add: ("+", SUM), ast.Sub: ("-", SUM), ast.Mult: ("*", PRODUCT), ast.Div: ("/", PRODUCT),
    ast.BitOr: ("|", BIT_OR), ast.BitAnd: ("&", BIT_AND), ast.BitXor: ("^", BIT_XOR),
    ast.Lt: ("<", LESS), ast.LtE: ("<=", LESS), ast.Gt: (">", LESS), ast.GtE: (">=", LESS),
    ast.Eq: ("==", EQUAL), ast.NotEq: ("!=", EQUAL),
}  # fmt: skip


class Names(Protocol):
    """How things are called in C, and how numbers are written."""

    types: TypeTable
    constants: Constants

    def function(self, function: object) -> str:
        """A kernel."""

    def passed_parameters(self, function: object) -> Sequence[tuple[Kind, bool]]:
        """A kernel's parameters: what they are, and whether they are passed by address."""

    def returned_parameter(self, function: object) -> int | None:
        """Which parameter a kernel returns as it is, as an address; None for a kernel that returns a value."""

    def by_address(self, kind: Kind) -> bool:
        """Whether a parameter of that kind is passed by its address."""

    def writes_in_place(self, function: object) -> bool:
        """Whether a kernel writes what it returns to where its caller wants it."""

    def makes_arrays(self, function: object) -> bool:
        """Whether a kernel makes arrays, itself or through others."""

    def storage(self, function: object, name: str, array: Array) -> str:
        """The member of the storage that an array made in a kernel is."""


class Expressions:
    """Writes the expressions of one kernel."""

    def __init__(self, inference: Inference, names: Names, function: object, addresses: set[str]) -> None:
        self._known, self._names, self._function = inference, names, function
        self._addresses = addresses  # parameters that are addresses

    def text(self, node: ast.expr, least: int = TERNARY) -> str:
        """An expression, in brackets if it binds less than ``least``."""
        text, level = getattr(self, f"_{type(node).__name__}")(node)
        return f"({text})" if level < least else str(text)

    def value(self, node: ast.expr, wanted: Kind | None) -> str:
        """An expression where a value of a kind is wanted: a whole number for a float is converted in sight."""
        if wanted is FLOAT and self._known.kinds[node] is INT:
            if isinstance(node, ast.Constant):
                return self._literal(node)
            return f"({self._names.types.real}){self.text(node, UNARY)}"
        return self.text(node)

    def condition(self, node: ast.expr) -> str:
        """What an ``if`` asks; a whole number is true unless it is 0."""
        return self.text(node)

    def _Constant(self, node: ast.Constant) -> tuple[str, int]:
        if isinstance(node.value, bool):
            return str(node.value).lower(), PRIMARY
        if isinstance(node.value, int):
            return str(node.value), PRIMARY
        return self._literal(node), PRIMARY

    def _literal(self, node: ast.Constant) -> str:
        assert isinstance(node.value, int | float)
        try:
            return self._names.types.number(float(node.value))
        except OverflowError as error:
            raise self._known.source.refuse(node, f"{node.value!r} cannot be a constant: {error}") from None

    def _Name(self, node: ast.Name) -> tuple[str, int]:
        if node.id not in self._known.variables:
            return self._names.constants.name(self._known, node), PRIMARY
        if node.id in self._addresses:
            return f"*{variable(node.id)}", UNARY
        return variable(node.id), PRIMARY

    def _Attribute(self, node: ast.Attribute) -> tuple[str, int]:
        if self._is_constant(node):
            return self._names.constants.name(self._known, node), PRIMARY
        return self.member(node.value, node.attr), PRIMARY

    def _is_constant(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Name | ast.Attribute) and node in self._known.kinds and (
            (isinstance(node, ast.Name) and node.id not in self._known.variables)
            or (isinstance(node, ast.Attribute) and node.value not in self._known.kinds)
        )  # fmt: skip

    def member(self, owner: ast.expr, name: str) -> str:
        """A field of a struct."""
        if isinstance(owner, ast.Name) and owner.id in self._addresses:
            return f"{variable(owner.id)}->{variable(name)}"
        return f"{self.text(owner, PRIMARY)}.{variable(name)}"

    def _Subscript(self, node: ast.Subscript) -> tuple[str, int]:
        owner = self._known.kinds[node.value]
        if isinstance(owner, Struct):
            at = node.slice.value if isinstance(node.slice, ast.Constant) else None
            assert isinstance(at, int)
            return self.member(node.value, list(owner.fields)[at]), PRIMARY
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        return self.text(node.value, PRIMARY) + "".join(f"[{self.text(place)}]" for place in places), PRIMARY

    def _UnaryOp(self, node: ast.UnaryOp) -> tuple[str, int]:
        if isinstance(node.op, ast.Not):
            return f"!{self.text(node.operand, UNARY)}", UNARY
        inner = self.text(node.operand, UNARY)
        return f"-({inner})" if inner.startswith("-") else f"-{inner}", UNARY

    def _operand(self, node: ast.expr, kind: Kind, least: int) -> str:
        if kind is FLOAT and self._known.kinds[node] is INT:
            return self.value(node, FLOAT)
        return self.text(node, least)

    def _BinOp(self, node: ast.BinOp) -> tuple[str, int]:
        sign, level = OPERATORS[type(node.op)]
        kind = self._known.kinds[node]
        if level < EQUAL:  # compilers ask for brackets around what people misread
            left = self.text(node.left, level if self._same(node.left, node.op) else UNARY)
            return f"{left} {sign} {self.text(node.right, UNARY)}", level
        kept = isinstance(node.left, ast.BinOp) and self._known.source.has_brackets(node.left)
        left = self._operand(node.left, kind, PRIMARY if kept else level)  # some brackets are there for the reader
        return f"{left} {sign} {self._operand(node.right, kind, level + 1)}", level

    @staticmethod
    def _same(node: ast.expr, op: ast.operator) -> bool:
        return isinstance(node, ast.BinOp) and type(node.op) is type(op)

    def _BoolOp(self, node: ast.BoolOp) -> tuple[str, int]:
        conjunction = isinstance(node.op, ast.And)
        least = EQUAL if conjunction else BIT_OR + 1
        inner = [self.text(part, least if not isinstance(part, ast.BoolOp) else PRIMARY) for part in node.values]
        return (" && " if conjunction else " || ").join(inner), AND if conjunction else OR

    def _Compare(self, node: ast.Compare) -> tuple[str, int]:
        parts = [node.left, *node.comparators]
        pairs = []
        for left, op, right in zip(parts, node.ops, parts[1:], strict=False):
            sign, level = OPERATORS[type(op)]
            floats = FLOAT in (self._known.kinds[left], self._known.kinds[right])
            a, b = (self._operand(side, FLOAT if floats else INT, LESS + 1) for side in (left, right))
            pairs.append(f"{a} {sign} {b}")
        return (pairs[0], level) if len(pairs) == 1 else (" && ".join(pairs), AND)

    def _IfExp(self, node: ast.IfExp) -> tuple[str, int]:
        kind = self._known.kinds[node]
        test = self.text(node.test, LESS if isinstance(node.test, ast.BinOp) else OR)
        return f"{test} ? {self._operand(node.body, kind, OR)} : {self._operand(node.orelse, kind, TERNARY)}", TERNARY

    def _Call(self, node: ast.Call) -> tuple[str, int]:
        function = self._known.resolve(node.func)
        if allocation(self._known.source.function, node, self._known.variables) is not None:
            array = self._known.kinds[node]
            assert isinstance(array, Array)
            place = self._names.storage(self._function, self._known.arrays[node], array)
            return (f"memset({place}, 0, sizeof {place})" if function.__name__ == "zeros" else place), PRIMARY
        if is_struct(function):
            struct = self._known.kinds[node]
            assert isinstance(struct, Struct)
            return f"({self._names.types.struct_name(struct)}){self.braces(node)}", PRIMARY
        if is_kernel(function):
            text = f"{self._names.function(function)}({', '.join(self._pass_arguments(node, function))})"
            return (text, PRIMARY) if self._names.returned_parameter(function) is None else (f"*{text}", UNARY)
        return self._builtin(node, str(function.__name__)), PRIMARY

    def _builtin(self, node: ast.Call, name: str) -> str:
        kind = self._known.kinds[node]
        suffix = "f" if self._names.types.real == "float" else ""
        inner = [self.value(part, FLOAT if kind is FLOAT else None) for part in node.args]
        if name == "float":
            return inner[0] if self._known.kinds[node.args[0]] is FLOAT else f"({inner[0]})"
        if name in ("sqrt", "floor"):
            return f"{name}{suffix}({inner[0]})"
        if name == "abs":
            return f"fabs{suffix}({inner[0]})" if kind is FLOAT else f"lh_max_int({inner[0]}, -({inner[0]}))"
        call = {"min": "lh_min", "max": "lh_max"}[name] + ("" if kind is FLOAT else "_int")
        text = inner[0]
        for other in inner[1:]:
            text = f"{call}({text}, {other})"
        return text

    def braces(self, node: ast.expr) -> str:
        """A struct's values in braces, as an initialiser."""
        struct = self._known.kinds[node]
        assert isinstance(node, ast.Call) and isinstance(struct, Struct)
        values = by_field(node, list(struct.fields)) or {}
        inner = []
        for name, value in values.items():
            wanted = struct.fields[name]
            if not is_empty(wanted):
                inner.append(self.initializer(value, wanted))
        return "{" + ", ".join(inner) + "}"

    def initializer(self, node: ast.expr, wanted: Kind | None = None) -> str:
        """An expression as the first value of a variable or field: braces for a struct that is made here."""
        if isinstance(node, ast.Call) and is_struct(self._known.resolve(node.func)):
            return self.braces(node)
        if isinstance(node, ast.Tuple):
            return "{" + ", ".join(self.initializer(part) for part in node.elts) + "}"
        return self.value(node, wanted)

    def _Tuple(self, node: ast.Tuple) -> tuple[str, int]:
        struct = self._known.kinds[node]
        assert isinstance(struct, Struct)
        return f"({self._names.types.struct_name(struct)}){self.initializer(node)}", PRIMARY

    def _pass_arguments(self, node: ast.Call, function: object) -> list[str]:
        given = arguments(node, function)  # type: ignore[arg-type]
        passed = ["arrays"] if self._names.makes_arrays(function) else []
        for part, (kind, addressed) in zip(given, self._names.passed_parameters(function), strict=True):
            if not is_empty(kind):
                passed.append(self._address(part) if addressed else self.value(part, kind))
        return passed

    def _address(self, node: ast.expr) -> str:
        if isinstance(node, ast.Name) and node.id in self._addresses:
            return variable(node.id)
        if isinstance(node, ast.Name | ast.Attribute):
            return f"&{self.text(node, UNARY)}"
        struct = self._known.kinds[node]
        assert isinstance(struct, Struct)
        if isinstance(node, ast.Call) and is_struct(self._known.resolve(node.func)):
            return f"&{self.text(node)}"
        return f"(const {self._names.types.struct_name(struct)}[]){{{self.text(node)}}}"
