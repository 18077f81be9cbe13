"""What kind of value every variable and expression of a kernel is.

Python writes it down for arguments and fields only; the rest follows. What a driver that serves every filter leaves
open is said by the first call.
"""

import ast
import builtins
import types
from collections.abc import Container, Sequence
from typing import Any, Protocol

from levelhead.compiler.mark import KernelFunction, is_kernel
from levelhead.errors import LevelheadError
from levelhead.export.kinds import BOOL, FLOAT, INT, VOID, Array, Kind, Scalar, Struct, describe, is_struct
from levelhead.export.source import Source
from levelhead.export.type_table import TypeTable

PythonObject = Any  # what a global of a kernel is: a number, a class, a module, a function
MISSING = object()
ARITHMETIC = (ast.Add, ast.Sub, ast.Mult, ast.Div)
BITS = (ast.BitOr, ast.BitAnd, ast.BitXor)
FUNCTIONS = {"min", "max", "abs", "float", "sqrt", "floor", "range"}
ALLOCATIONS = {"empty", "zeros"}  # of NumPy; ``arrays.zeros`` is marked


class Callee(Protocol):
    """What inference has to know of another kernel."""

    @property
    def returns(self) -> Kind:
        """The kind of what it returns."""


class Program(Protocol):
    """What inference has to know of the whole."""

    types: TypeTable

    def kernel(self, function: KernelFunction, arguments: Sequence[Kind]) -> Callee:
        """Another kernel, called with values of these kinds."""


def resolve_name(function: KernelFunction, node: ast.AST, local: Container[str] = ()) -> PythonObject:
    """The Python object that a name or ``module.name`` stands for; ``MISSING`` where it is a value of the kernel."""
    found: object = MISSING
    if isinstance(node, ast.Name) and node.id not in local:
        found = function.__globals__.get(node.id, getattr(builtins, node.id, MISSING))
    elif isinstance(node, ast.Attribute):
        owner = resolve_name(function, node.value, local)
        if isinstance(owner, types.ModuleType):
            found = getattr(owner, node.attr, MISSING)
    return getattr(found, "__meaning__", found)


def allocation(function: KernelFunction, node: ast.AST, local: Container[str] = ()) -> ast.expr | None:
    """The shape in ``zeros(count)``, ``np.zeros(shape)`` or ``np.empty(shape)``; None for anything else."""
    if not isinstance(node, ast.Call) or len(node.args) != 1:
        return None
    called = resolve_name(function, node.func, local)
    if hasattr(called, "__memory__"):
        return node.args[0]
    of_numpy = str(getattr(called, "__module__", "")).partition(".")[0] == "numpy"
    return node.args[0] if of_numpy and getattr(called, "__name__", "") in ALLOCATIONS else None


class Inference:
    """Walks through one kernel once; afterwards ``variables``, ``kinds`` (by expression) and ``returns`` are known."""

    def __init__(self, source: Source, parameters: dict[str, Kind], program: Program) -> None:
        self.source, self._program = source, program
        self.variables: dict[str, Kind] = dict(parameters)
        self.kinds: dict[ast.AST, Kind] = {}
        self.calls: list[Callee] = []
        self.arrays: dict[ast.AST, str] = {}  # where arrays are made -> what they are called
        self._returns: Kind | None = None
        self._block(source.tree.body)

    @property
    def returns(self) -> Kind:
        """The kind of what the kernel returns."""
        return VOID if self._returns is None else self._returns

    def resolve(self, node: ast.AST) -> PythonObject:
        """The Python object that stands behind a name, or ``MISSING``."""
        return resolve_name(self.source.function, node, self.variables)

    def _refuse(self, node: ast.AST, what: str) -> LevelheadError:
        return self.source.refuse(node, what)

    # Statements

    def _block(self, body: Sequence[ast.stmt]) -> None:
        for statement in body:
            handler = getattr(self, f"_on_{type(statement).__name__}", None)
            if handler is None:
                raise self._refuse(statement, f"{type(statement).__name__} is outside of the kernel language")
            handler(statement)

    def _on_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call) and is_kernel(self.resolve(node.value.func)):
            self.of(node.value)  # for what it writes into memory
        elif not (isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)):
            raise self._refuse(node, "an expression whose value is not used")

    def _on_Pass(self, node: ast.Pass) -> None:
        pass

    def _on_Return(self, node: ast.Return) -> None:
        kind = VOID if node.value is None else self.of(node.value)
        if self._returns in (INT, FLOAT) and kind in (INT, FLOAT) and self._returns is not kind:
            kind = self._returns = FLOAT
        if self._returns not in (None, kind):
            raise self._refuse(node, f"returns {describe(kind)} here and {describe(self._returns)} before")
        self._returns = kind

    def _on_If(self, node: ast.If) -> None:
        self.of(node.test)
        self._block(node.body)
        self._block(node.orelse)

    def _on_For(self, node: ast.For) -> None:
        bounds = node.iter
        if not isinstance(bounds, ast.Call) or self.resolve(bounds.func) is not range or node.orelse:
            raise self._refuse(node, "a loop over something else than range")
        if not isinstance(node.target, ast.Name):
            raise self._refuse(node, "a loop counts one variable")
        for bound in bounds.args:
            self._want(bound, INT, "a bound of range")
        self._set(node.target, INT)
        self._block(node.body)

    def _on_Assign(self, node: ast.Assign) -> None:
        for target in node.targets:
            if isinstance(target, ast.Name) and allocation(self.source.function, node.value, self.variables):
                self.arrays[node.value] = target.id
        if len(node.targets) == 1 and isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple):
            self._pairwise(node.targets[0], node.value)
            return
        kind = self._value_kind(node.value)
        for target in node.targets:
            self._set(target, kind)

    def _pairwise(self, target: ast.Tuple, value: ast.Tuple) -> None:
        if len(target.elts) != len(value.elts):
            raise self._refuse(target, f"{len(target.elts)} names for {len(value.elts)} values")
        kinds = [self.of(part) for part in value.elts]
        for part, kind in zip(target.elts, kinds, strict=True):
            self._set(part, kind)

    def _on_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is None:
            raise self._refuse(node, "a declaration without a value")
        self._set(node.target, self.of(node.value))

    def _on_AugAssign(self, node: ast.AugAssign) -> None:
        kind = self._arithmetic(node, node.op, self.of(node.target), self.of(node.value))
        self._set(node.target, kind)

    def _set(self, target: ast.expr, kind: Kind) -> None:
        if isinstance(target, ast.Tuple):
            if not isinstance(kind, Struct) or len(kind.fields) != len(target.elts):
                raise self._refuse(target, f"{len(target.elts)} names for {describe(kind)}")
            for part, (name, inner) in zip(target.elts, kind.fields.items(), strict=True):
                if inner is None:
                    raise self._refuse(target, f"no annotation gives the type of {kind.name}.{name} is")
                if not (isinstance(part, ast.Name) and part.id == "_"):
                    kind.known.add(name)
                self._set(part, inner)
            return
        if isinstance(target, ast.Subscript):
            if self.of(target) is not FLOAT or kind not in (INT, FLOAT):
                raise self._refuse(target, "only a number can be put into an array")
            return
        if not isinstance(target, ast.Name):
            raise self._refuse(target, "a value can be given to a variable or an element of an array only")
        before = self.variables.get(target.id, kind) if target.id != "_" else kind
        if before is FLOAT and kind is INT:
            kind = FLOAT
        if before is not kind and before != kind:
            raise self._refuse(target, f"{target.id} is {describe(before)} before and {describe(kind)} here")
        if target.id != "_":
            self.variables[target.id] = kind
        self.kinds[target] = kind

    # Expressions

    def of(self, node: ast.expr) -> Kind:
        """The kind of an expression."""
        handler = getattr(self, f"_of_{type(node).__name__}", None)
        if handler is None:
            raise self._refuse(node, f"{type(node).__name__} is outside of the kernel language")
        kind: Kind = handler(node)
        self.kinds[node] = kind
        return kind

    def _value_kind(self, node: ast.expr) -> Kind:
        """The kind of a value that somebody takes."""
        kind = self.of(node)
        if kind is VOID:
            raise self._refuse(node, f"{ast.unparse(node)} returns nothing")
        return kind

    def _want(self, node: ast.expr, wanted: Kind, what: str) -> None:
        kind = self.of(node)
        if kind != wanted and not (wanted is FLOAT and kind is INT):
            raise self._refuse(node, f"{what} is {describe(kind)}; it must be {describe(wanted)}")

    def _of_Constant(self, node: ast.Constant) -> Kind:
        kind = {bool: BOOL, int: INT, float: FLOAT}.get(type(node.value))
        if kind is None:
            raise self._refuse(node, f"{node.value!r} is no number")
        return kind

    def _of_Name(self, node: ast.Name) -> Kind:
        if node.id in self.variables:
            return self.variables[node.id]
        return self._constant(node)

    def _constant(self, node: ast.expr) -> Kind:
        value = self.resolve(node)
        kind = None if value is MISSING else self._program.types.kind_of(value)
        if kind is None:
            raise self._refuse(node, f"{ast.unparse(node)} is neither a number nor a kernel's value")
        return kind

    def _of_Attribute(self, node: ast.Attribute) -> Kind:
        if self.resolve(node) is not MISSING:
            return self._constant(node)
        owner = self.of(node.value)
        if not isinstance(owner, Struct) or owner.fields.get(node.attr) is None:
            raise self._refuse(node, f"{describe(owner)} has no {node.attr} that a kernel could read")
        owner.known.add(node.attr)
        kind = owner.fields[node.attr]
        assert kind is not None
        return kind

    def _of_Subscript(self, node: ast.Subscript) -> Kind:
        owner = self.of(node.value)
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(owner, Struct):
            at = places[0].value if isinstance(places[0], ast.Constant) and len(places) == 1 else None
            if not isinstance(at, int) or not -1 < at < len(owner.fields):
                raise self._refuse(node, f"{owner.name} is indexed by a whole number from 0 to {len(owner.fields) - 1}")
            owner.known.add(list(owner.fields)[at])
            kind = list(owner.fields.values())[at]
            assert kind is not None
            return kind
        if not isinstance(owner, Array) or len(places) > len(owner.shape):
            raise self._refuse(node, f"{describe(owner)} has no {len(places)} indices")
        for place in places:
            self._want(place, INT, "an index")
        rest = owner.shape[len(places) :]
        return Array(rest) if rest else FLOAT

    def _of_Tuple(self, node: ast.Tuple) -> Kind:
        return self._program.types.bundle([self.of(part) for part in node.elts])

    def _of_UnaryOp(self, node: ast.UnaryOp) -> Kind:
        kind = self.of(node.operand)
        if isinstance(node.op, ast.Not):
            return BOOL
        if not isinstance(node.op, ast.USub) or kind not in (INT, FLOAT):
            raise self._refuse(node, f"{type(node.op).__name__} of {describe(kind)}")
        return kind

    def _of_BinOp(self, node: ast.BinOp) -> Kind:
        return self._arithmetic(node, node.op, self.of(node.left), self.of(node.right))

    def _arithmetic(self, node: ast.AST, op: ast.operator, left: Kind, right: Kind) -> Kind:
        known = left in (INT, FLOAT) and right in (INT, FLOAT)
        if isinstance(op, BITS) and left is INT and right is INT:
            return INT
        if isinstance(op, ARITHMETIC) and known:
            if left is INT and right is INT and not isinstance(op, ast.Div):
                return INT
            return FLOAT
        name = type(op).__name__
        raise self._refuse(node, f"{name} of {describe(left)} and {describe(right)} is outside of the kernel language")

    def _of_BoolOp(self, node: ast.BoolOp) -> Kind:
        for part in node.values:
            self.of(part)
        return BOOL

    def _of_Compare(self, node: ast.Compare) -> Kind:
        for part in (node.left, *node.comparators):
            if not isinstance(self.of(part), Scalar):
                raise self._refuse(part, f"{describe(self.kinds[part])} is compared")
        for middle in node.comparators[:-1]:
            if not isinstance(middle, ast.Name | ast.Constant | ast.Attribute):
                raise self._refuse(middle, "the middle of a < b < c is computed twice in C; give it a name")
        return BOOL

    def _of_IfExp(self, node: ast.IfExp) -> Kind:
        self.of(node.test)
        body, orelse = self.of(node.body), self.of(node.orelse)
        if {body, orelse} == {INT, FLOAT}:
            return FLOAT
        if body != orelse:
            raise self._refuse(node, f"{describe(body)} if …, else {describe(orelse)}")
        return body

    def _of_Call(self, node: ast.Call) -> Kind:
        shape = allocation(self.source.function, node, self.variables)
        if shape is not None:
            return self._made(node, shape)
        called = self.resolve(node.func)
        if is_struct(called):
            return self._construct(node, self._program.types.struct(called))
        if is_kernel(called):
            callee = self._program.kernel(called, [self.of(part) for part in arguments(node, called)])
            self.calls.append(callee)
            return callee.returns
        name = getattr(called, "__name__", ast.unparse(node.func))
        if called is MISSING or name not in FUNCTIONS or node.keywords:
            raise self._refuse(node, f"{ast.unparse(node.func)} is not a kernel")
        kinds = [self.of(part) for part in node.args]
        if not kinds or not all(kind in (INT, FLOAT) for kind in kinds):
            raise self._refuse(node, f"{name} of {', '.join(map(describe, kinds)) or 'nothing'}")
        return INT if name in ("min", "max", "abs") and all(kind is INT for kind in kinds) else FLOAT

    def _construct(self, node: ast.Call, struct: Struct) -> Kind:
        values = by_field(node, list(struct.fields))
        if values is None:
            raise self._refuse(node, f"{struct.name} has {len(struct.fields)} fields, each to be given once")
        for name, value in values.items():
            kind, wanted = self.of(value), struct.fields[name]
            if allocation(self.source.function, value, self.variables) is not None:
                self.arrays[value] = name
            if wanted is None:
                struct.fields[name] = kind
            elif kind != wanted and not (wanted is FLOAT and kind is INT):
                raise self._refuse(value, f"{struct.name}.{name} is {describe(wanted)}, not {describe(kind)}")
        return struct

    def _made(self, node: ast.Call, shape: ast.expr) -> Kind:
        sizes = shape.elts if isinstance(shape, ast.Tuple) else [shape]
        numbers = []
        for size in sizes:
            number: object = size.value if isinstance(size, ast.Constant) else self.resolve(size)
            if type(number) is not int or number < 1:
                raise self._refuse(node, f"the shape {ast.unparse(shape)} is not made of constants")
            numbers.append(number)
        return Array(tuple(numbers))


def arguments(node: ast.Call, function: KernelFunction) -> list[ast.expr]:
    """The arguments of a call in the order of the parameters."""
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    return list((by_field(node, list(names)) or {}).values())


def by_field(node: ast.Call, names: list[str]) -> dict[str, ast.expr] | None:
    """Name -> value of a call's arguments, in order; None unless each is given once."""
    given = dict(zip(names, node.args, strict=False))
    for keyword in node.keywords:
        if keyword.arg is None or keyword.arg in given:
            return None
        given[keyword.arg] = keyword.value
    if len(node.args) > len(names) or set(given) != set(names):
        return None
    return {name: given[name] for name in names}
