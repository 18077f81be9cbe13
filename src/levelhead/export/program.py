"""A set of kernels and all that they reach as one piece of C: types, constants, functions, in the order of use."""

import ast
import graphlib
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, get_args, get_origin, get_type_hints

from levelhead.errors import LevelheadError
from levelhead.export.expressions import variable
from levelhead.export.inference import Inference
from levelhead.export.kinds import (
    FLOAT,
    NUMBERS,
    Array,
    Kind,
    Scalar,
    Struct,
    by_address,
    described,
    is_empty,
    within,
)
from levelhead.export.layout import STEP, beside, comment, docstring, wrapped
from levelhead.export.scopes import Scopes
from levelhead.export.single import REMARKS, meant, shortest
from levelhead.export.source import Source, field_remarks, home, place, position, read, remark
from levelhead.export.statements import Body
from levelhead.filters.parameters import description


@dataclass(eq=False)
class Kernel:
    """One kernel, its kinds known."""

    source: Source
    parameters: dict[str, Kind]
    inference: Inference
    name: str

    @property
    def returns(self) -> Kind:
        """The kind of what it returns."""
        return self.inference.returns

    @property
    def module(self) -> str:
        """The module in which it stands."""
        return self.source.function.__module__


def snake(name: str) -> str:
    """RollPitchKalman -> roll_pitch_kalman, EKF -> ekf.

    >>> snake("BiasRateKalman"), snake("EKF")
    ('bias_rate_kalman', 'ekf')
    """
    words = ""
    for i, letter in enumerate(name):
        begins = letter.isupper() and i > 0 and (name[i - 1].islower() or name[i + 1 : i + 2].islower())
        words += ("_" if begins else "") + letter.lower()
    return words


class Program:
    """Everything that some kernels need, translated.

    Args:
        prefix: of the types that other files see.
        real: "double" or "float".
    """

    def __init__(self, prefix: str, real: str, inline: bool = False) -> None:
        self.prefix, self.real, self.inline = prefix, real, inline
        self.public: list[Struct] = []  # types that other files see, inner ones first
        self.arrays: dict[str, Array] = {}  # member of the storage -> its shape
        self._structs: dict[Any, Struct] = {}
        self._kernels: dict[Callable[..., Any], Kernel] = {}
        self._running: list[Callable[..., Any]] = []
        self._constants: dict[tuple[str, str], Any] = {}
        self._makers: dict[Callable[..., Any], bool] = {}
        self._places: dict[tuple[Any, str], str] = {}
        self._taken: dict[tuple[str, str], Any] = {}  # names in C -> what has them
        self.written: set[Callable[..., Any]] = set()  # kernels that write what they return to an address
        self.called: dict[Struct, str] = {}  # types that other files see by another name than their own

    # Kinds

    def struct(self, cls: type) -> Struct:
        """The kind of a NamedTuple, by its annotations; a field that they leave open is said by its first value."""
        if cls not in self._structs:
            struct = self._structs[cls] = Struct(cls.__name__, {}, cls)
            hints = _hints(cls)
            for name in cls._fields:  # type: ignore[attr-defined]
                struct.fields[name] = self._annotated(hints.get(name))
        return self._structs[cls]

    def _annotated(self, hint: Any) -> Kind | None:
        if get_origin(hint) is not None and hasattr(hint, "__metadata__"):
            hint = get_args(hint)[0]
        if hint in NUMBERS:
            return NUMBERS[hint]
        if isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields"):
            return self.struct(hint)
        return None

    def bundle(self, kinds: Sequence[Kind]) -> Struct:
        """The kind of a plain tuple."""
        key = tuple(kind if isinstance(kind, Scalar | Array) else id(kind) for kind in kinds)
        if key not in self._structs:
            name = f"Tuple{len([known for known in self._structs if isinstance(known, tuple)]) + 1}"
            self._structs[key] = Struct(name, {f"part_{i}": kind for i, kind in enumerate(kinds)})
        return self._structs[key]

    def kind_of(self, value: Any) -> Kind | None:
        """The kind of a constant: a number or a NamedTuple of numbers."""
        if type(value) in NUMBERS:
            return NUMBERS[type(value)]
        return self.struct(type(value)) if hasattr(type(value), "_fields") else None

    # Kernels

    def kernel(self, function: Callable[..., Any], arguments: Sequence[Kind]) -> Kernel:
        """A kernel for arguments of these kinds; the same kinds at every call.

        Raises:
            LevelheadError: the kernel is outside of the language; the sentence begins with file and line.
        """
        if function in self._running:
            raise read(function).refuse(ast.Pass(), f"{function.__name__} calls itself")
        if function not in self._kernels:
            source = read(function)
            parameters = self._parameters(source, arguments)
            self._running.append(function)
            self._kernels[function] = Kernel(
                source, parameters, Inference(source, parameters, self), self._name(function)
            )
            self._running.pop()
        known = self._kernels[function]
        self._parameters(known.source, arguments, known.parameters)
        return known

    def _parameters(
        self, source: Source, given: Sequence[Kind], known: dict[str, Kind] | None = None
    ) -> dict[str, Kind]:
        names = [argument.arg for argument in source.tree.args.args]
        if len(names) != len(given):
            raise source.refuse(source.tree, f"{source.tree.name} takes {', '.join(names)}, each to be given once")
        hints = _hints(source.function)
        found = {}
        for name, kind in zip(names, given, strict=True):
            wanted = known[name] if known else self._annotated(hints.get(name)) or kind
            if kind != wanted and not (wanted is FLOAT and kind == NUMBERS[int]):
                what = f"{name} of {source.tree.name} is {described(wanted)}, and {described(kind)} was given"
                raise source.refuse(source.tree, what)
            found[name] = wanted
        return found

    def _name(self, function: Callable[..., Any]) -> str:
        return self._named("kernel", function, function.__module__, f"_{function.__name__}")

    # Names in C

    def function(self, function: Any) -> str:
        """A kernel's name."""
        return self._kernels[function].name

    def passing(self, function: Any) -> list[tuple[Kind, bool]]:
        """Kinds of a kernel's parameters, and which are passed by their address: large ones that it does not change."""
        kernel = self._kernels[function]
        addresses = self._addresses(kernel)
        return [(kind, name in addresses) for name, kind in kernel.parameters.items()]

    def in_place(self, function: Any) -> bool:
        """Whether a kernel writes what it returns to an address: one that no other kernel calls."""
        return function in self.written

    def handed_back(self, function: Any) -> int | None:
        """Which parameter a kernel does nothing but return, if it is a large one; the place of it is returned then."""
        kernel = self._kernels[function]
        *_, last = kernel.source.tree.body
        names = list(kernel.parameters)
        if not isinstance(last, ast.Return) or not isinstance(last.value, ast.Name) or last.value.id not in names:
            return None
        alone = len(kernel.source.tree.body) == 1 + (ast.get_docstring(kernel.source.tree) is not None)
        return names.index(last.value.id) if alone and last.value.id in self._addresses(kernel) else None

    def by_address(self, kind: Kind) -> bool:
        """Whether a parameter of that kind is passed by its address."""
        return by_address(kind) and not self.inline

    def _addresses(self, kernel: Kernel) -> set[str]:
        if self.inline:
            return set()
        stored = Scopes(kernel.source.tree.body).variables
        return {name for name, kind in kernel.parameters.items()
                if self.by_address(kind) and not (name in stored and stored[name].stores)}  # fmt: skip

    def makes(self, function: Any) -> bool:
        """Whether a kernel makes arrays, itself or through others."""
        if function not in self._makers:
            kernel = self._kernels[function]
            inner = [callee.source.function for callee in kernel.inference.calls if isinstance(callee, Kernel)]
            self._makers[function] = bool(kernel.inference.arrays) or any(map(self.makes, inner))
        return self._makers[function]

    def storage(self, function: Any, name: str, array: Array) -> str:
        """The place of an array that a kernel makes; each place in a kernel has its own."""
        key = (function, name)
        if key not in self._places:
            member = name if name not in self.arrays else f"{self._kernels[function].name}_{name}"
            self._places[key] = member
            self.arrays[member] = array
        return f"arrays->{variable(self._places[key])}"

    def struct_name(self, struct: Struct) -> str:
        """A type's name in this file."""
        twins = [other for other in self._structs.values() if other.name == struct.name]
        if len(twins) == 1 or struct.origin is None:
            return struct.name
        return "".join(word.title() for word in struct.origin.__module__.rpartition(".")[2].split("_")) + struct.name

    def public_name(self, struct: Struct) -> str:
        """A type's name in all files."""
        return f"{self.prefix}_{self.called.get(struct) or snake(self.struct_name(struct))}"

    def kind(self, kind: Kind, public: bool = False) -> str:
        """A type."""
        if isinstance(kind, Struct):
            return self.public_name(kind) if public else self.struct_name(kind)
        if isinstance(kind, Array):
            return self.real
        return {"float": self.real, "int": "int32_t", "bool": "bool", "void": "void"}[kind.name]

    def declarator(self, kind: Kind, name: str) -> str:
        """A name as it is declared: an array is an address, of a row where it has several dimensions."""
        if not isinstance(kind, Array):
            return name
        rows = "".join(f"[{size}]" for size in kind.shape[1:])
        return f"(*{name}){rows}" if rows else f"*{name}"

    def number(self, value: float) -> str:
        """A float as a literal.

        Raises:
            OverflowError: it is not finite, or out of the range of single precision.
        """
        if not math.isfinite(value):
            raise OverflowError(f"{value} is no number that C99 could write")
        return plain(value) if self.real == "double" else f"{plain(shortest(meant(value)))}f"

    def constant(self, inference: Inference, node: ast.expr) -> str:
        """A module's constant, by the name that it has where it is defined."""
        value = inference.resolve(node)
        function = inference.source.function
        if isinstance(node, ast.Attribute):
            module, name = home(inference.resolve(node.value).__name__, node.attr)
        else:
            assert isinstance(node, ast.Name)
            module, name = home(function.__module__, node.id)
        self._constants[module, name] = value
        return self._constant_name(module, name)

    def _constant_name(self, module: str, name: str) -> str:
        return self._named("constant", (module, name), module, f"_{name}").upper()

    def _named(self, what: str, key: Any, module: str, rest: str) -> str:
        """The last part of a module's name and the rest; more parts, if something else is called that already."""
        parts = module.split(".")
        for count in range(1, len(parts) + 1):
            name = "_".join(parts[-count:]) + rest
            if self._taken.setdefault((what, name), key) == key:
                return name
        raise LevelheadError(f"there are two of the name {module}{rest}")

    # Text

    def literal(self, value: Any, kind: Kind) -> str:
        """A constant as an initialiser."""
        if isinstance(kind, Struct):
            parts = zip(value, kind.fields.values(), strict=True)
            return "{" + ", ".join(self.literal(part, inner or FLOAT) for part, inner in parts) + "}"
        if isinstance(value, bool):
            return str(value).lower()
        return self.number(float(value)) if kind is FLOAT else str(value)

    def head(self, kernel: Kernel) -> str:
        """A kernel's head."""
        addresses = self._addresses(kernel)
        in_place, returned = self.in_place(kernel.source.function), self.kind(kernel.returns)
        parameters = [f"{returned} *result"] if in_place else []
        parameters += [f"{self.arrays_type} *arrays"] if self.makes(kernel.source.function) else []
        for name, kind in kernel.parameters.items():
            if is_empty(kind):
                continue
            star = "const " if name in addresses else ""
            shown = f"*{variable(name)}" if name in addresses else self.declarator(kind, variable(name))
            parameters.append(f"{star}{self.kind(kind)} {shown}")
        static = "LH_INLINE" if self.inline and not hasattr(kernel.source.function, "__noinline__") else "static"
        if in_place:
            return f"{static} void {kernel.name}({', '.join(parameters)})"
        if self.handed_back(kernel.source.function) is not None:
            return f"{static} const {returned} *{kernel.name}({', '.join(parameters)})"
        if isinstance(kernel.returns, Array):
            raise kernel.source.refuse(kernel.source.tree, "an array is returned; put it into a NamedTuple")
        return f"{static} {returned} {kernel.name}({', '.join(parameters) or 'void'})"

    @property
    def arrays_type(self) -> str:
        """The type of the storage for arrays."""
        return f"{self.prefix}_arrays"

    def text(self, kernel: Kernel) -> list[str]:
        """A kernel as C, with its docstring above."""
        body = Body(kernel.source, kernel.inference, self, self._addresses(kernel))
        words = docstring(ast.get_docstring(kernel.source.tree))
        return [*(comment(words) if words else []), *wrapped(self.head(kernel), ""), "{", *body.lines, "}", ""]

    def ordered(self) -> list[Kernel]:
        """All kernels, callees first, module by module."""
        found: list[Kernel] = []

        def visit(kernel: Kernel) -> None:
            if kernel not in found:
                for callee in kernel.inference.calls:
                    assert isinstance(callee, Kernel)
                    visit(callee)
                found.append(kernel)

        for kernel in sorted(self._kernels.values(), key=lambda one: position(one.source.function)):
            visit(kernel)
        modules: dict[str, set[str]] = {}
        for kernel in found:
            used = {callee.module for callee in kernel.inference.calls if isinstance(callee, Kernel)}
            modules.setdefault(kernel.module, set()).update(used - {kernel.module})
        try:
            order = list(graphlib.TopologicalSorter(modules).static_order())
        except graphlib.CycleError as error:
            raise LevelheadError(f"kernels of these modules call each other in a circle: {error.args[1]}") from None
        return sorted(found, key=lambda kernel: order.index(kernel.module))

    def modules(self) -> set[str]:
        """Where all of this is written down: the modules of kernels, of types and of constants."""
        types = {struct.origin.__module__ for struct in self._structs.values() if struct.origin is not None}
        return {kernel.module for kernel in self._kernels.values()} | types | {module for module, _ in self._constants}

    def sections(self) -> Iterator[tuple[str, list[str]]]:
        """Module by module, callees first: its name, and its kernels as lines of C."""
        kernels = self.ordered()
        for module in dict.fromkeys(kernel.module for kernel in kernels):
            yield module, [line for kernel in kernels if kernel.module == module for line in self.text(kernel)]

    def constants(self) -> list[str]:
        """The constants that the sections use; to be asked for behind them."""
        lines: list[str] = []
        for module in dict.fromkeys(module for module, _ in self._constants):
            names = [name for where, name in self._constants if where == module]
            for name in sorted(names, key=lambda name: place(module, name)):
                lines += self._constant(module, name, self._constants[module, name])
            lines.append("")
        return lines

    def _constant(self, module: str, name: str, value: Any) -> list[str]:
        kind = self.kind_of(value)
        assert kind is not None
        try:
            number = self.literal(value, kind)
        except OverflowError as error:
            raise LevelheadError(f"the constant {name} of {module}: {error}") from None
        code = f"static const {self.kind(kind)} {self._constant_name(module, name)} = {number};"
        said = REMARKS.get(value, "") if kind is FLOAT and self.real == "float" else ""
        return beside(wrapped(code, ""), said or remark(module, name))

    def private(self) -> list[Struct]:
        """Types that only this file knows, inner ones first."""
        found: list[Struct] = []
        for kernel in self.ordered():
            for kind in (*kernel.parameters.values(), kernel.returns, *kernel.inference.variables.values()):
                for struct in within(kind):
                    if struct not in found and struct not in self.public and not is_empty(struct):
                        found.append(struct)
        return found

    def arrays_definition(self) -> list[str]:
        """The storage of all arrays as C; nothing where there are none."""
        if not self.arrays:
            return []
        lines = ["/* Where the arrays of the state lie. */", "typedef struct {"]
        for name, array in self.arrays.items():
            sizes = "".join(f"[{size}]" for size in array.shape)
            lines.append(f"{STEP}{self.real} {variable(name)}{sizes};")
        return [*lines, f"}} {self.arrays_type};", ""]

    def publish(self, kind: Kind) -> None:
        """Makes a type and those inside it known to other files."""
        for struct in within(kind):
            if struct not in self.public and not is_empty(struct):
                self.public.append(struct)

    def definition(self, struct: Struct, remarks: dict[str, str] | None = None) -> list[str]:
        """A type as C."""
        public = struct in self.public
        lines = (
            comment(docstring(description(struct.origin) or struct.origin.__doc__))
            if struct.origin is not None and struct.origin.__doc__
            else []
        )
        said = remarks if remarks is not None else field_remarks(struct.origin) if struct.origin else {}
        lines.append("typedef struct {")
        for name, kind in struct.fields.items():
            if kind is None:
                raise LevelheadError(f"nobody said what {struct.name}.{name} is")
            if not is_empty(kind):
                code = f"{STEP}{self.kind(kind, public)} {self.declarator(kind, variable(name))};"
                lines += beside([code], said.get(name, ""))
        return [*lines, f"}} {self.public_name(struct) if public else self.struct_name(struct)};", ""]


def plain(value: float) -> str:
    """A float as people write it: 1e9, not 1000000000.0.

    >>> plain(1e9), plain(0.1), plain(12582912.0)
    ('1e9', '0.1', '12582912.0')
    """
    short = f"{value:g}".replace("e+0", "e").replace("e+", "e")
    return short if abs(value) >= 1e6 and float(short) == value else repr(value)


def module_words(module: str) -> str:
    """A module's docstring."""
    return docstring(sys.modules[module].__doc__) if module in sys.modules and module.startswith("levelhead") else ""


def _hints(thing: Any) -> dict[str, Any]:
    """Annotations, each for itself: one that cannot be read leaves the others as they are."""
    try:
        return get_type_hints(thing, include_extras=True)
    except NameError:
        return {name: hint for name, hint in getattr(thing, "__annotations__", {}).items() if not isinstance(hint, str)}
