"""A set of kernels and all that they reach as one piece of C: types, constants, functions, in the order of use."""

import ast
import graphlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from levelhead.errors import LevelheadError
from levelhead.export.constants import Constants, UniqueNames
from levelhead.export.inference import Inference
from levelhead.export.kinds import FLOAT, NUMBERS, Array, Kind, Struct, by_address, describe, is_empty, variable, within
from levelhead.export.layout import STEP, comment, docstring, template, wrap_line
from levelhead.export.scopes import stored_names
from levelhead.export.source import Source, position, read_source
from levelhead.export.statements import Body
from levelhead.export.type_table import TypeTable, annotations, declarator
from levelhead.kernels.arrays import subtract_each_row


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


class Program:
    """Everything that some kernels need, translated.

    Args:
        prefix: of the types that other files see.
        real: "double" or "float".
        inline: whether kernels are to be inlined, and take structs by value.

    Attributes:
        arrays: member of the storage -> its shape.
        in_place: kernels that write what they return to an address: ones that no other kernel calls.
    """

    def __init__(self, prefix: str, real: str, inline: bool = False) -> None:
        self.types = TypeTable(prefix, real)
        self.constants = Constants(self.types)
        self.inline = inline
        self.arrays: dict[str, Array] = {}
        self.in_place: set[Callable[..., object]] = set()
        self._names = UniqueNames()
        self._kernels: dict[object, Kernel] = {}
        self._running: list[Callable[..., object]] = []
        self._array_makers: dict[object, bool] = {}
        self._members: dict[tuple[object, str], str] = {}

    # Kernels

    def kernel(self, function: Callable[..., object], arguments: Sequence[Kind]) -> Kernel:
        """A kernel for arguments of these kinds; the same kinds at every call.

        Raises:
            LevelheadError: the kernel is outside of the language; the sentence begins with file and line.
        """
        if function in self._running:
            raise read_source(function).refuse(ast.Pass(), f"{function.__name__} calls itself")
        if function not in self._kernels:
            source = read_source(function)
            parameters = self._parameters(source, arguments)
            self._running.append(function)
            inference = Inference(source, parameters, self)
            name = self._names.choose(function, function.__module__, f"_{function.__name__}")
            self._kernels[function] = Kernel(source, parameters, inference, name)
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
        hints = annotations(source.function)
        found = {}
        for name, kind in zip(names, given, strict=True):
            wanted = known[name] if known else self.types.annotated_kind(hints.get(name)) or kind
            if kind != wanted and not (wanted is FLOAT and kind == NUMBERS[int]):
                what = f"{name} of {source.tree.name} is {describe(wanted)}, and {describe(kind)} was given"
                raise source.refuse(source.tree, what)
            found[name] = wanted
        return found

    # How kernels are called

    def call(self, kernel: Kernel, values: list[str], to: str = "") -> str:
        """A call of a kernel from outside of the language; ``to``: where one that writes in place does so."""
        function = kernel.source.function
        given = [to] if to else []
        given += ["&filter->arrays"] if self.makes_arrays(function) else []
        for value, (kind, addressed) in zip(values, self.passed_parameters(function), strict=True):
            if not is_empty(kind):
                given.append(f"&{value}" if addressed else value)
        star = "*" if self.returned_parameter(function) is not None else ""
        return f"{star}{kernel.name}({', '.join(given)})"

    def function(self, function: object) -> str:
        """A kernel's name."""
        return self._kernels[function].name

    def passed_parameters(self, function: object) -> list[tuple[Kind, bool]]:
        """Kinds of a kernel's parameters, and which are passed by their address: large ones that it does not change."""
        kernel = self._kernels[function]
        addresses = self._addresses(kernel)
        return [(kind, name in addresses) for name, kind in kernel.parameters.items()]

    def writes_in_place(self, function: object) -> bool:
        """Whether a kernel writes what it returns to an address."""
        return function in self.in_place

    def returned_parameter(self, function: object) -> int | None:
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
        stored = stored_names(kernel.source.tree)
        return {name for name, kind in kernel.parameters.items() if self.by_address(kind) and name not in stored}

    # Arrays

    def makes_arrays(self, function: object) -> bool:
        """Whether a kernel makes arrays, itself or through others."""
        if function not in self._array_makers:
            kernel = self._kernels[function]
            inner = [callee.source.function for callee in kernel.inference.calls if isinstance(callee, Kernel)]
            self._array_makers[function] = bool(kernel.inference.arrays) or any(map(self.makes_arrays, inner))
        return self._array_makers[function]

    def storage(self, function: object, name: str, array: Array) -> str:
        """The place of an array that a kernel makes; each place in a kernel has its own."""
        key = (function, name)
        if key not in self._members:
            member = name if name not in self.arrays else f"{self._kernels[function].name}_{name}"
            self._members[key] = member
            self.arrays[member] = array
        return f"arrays->{variable(self._members[key])}"

    @property
    def arrays_type(self) -> str:
        """The type of the storage for arrays."""
        return f"{self.types.prefix}_arrays"

    def arrays_definition(self) -> list[str]:
        """The storage of all arrays as C; nothing where there are none."""
        if not self.arrays:
            return []
        lines = ["/* Where the arrays of the state lie. */", "typedef struct {"]
        for name, array in self.arrays.items():
            sizes = "".join(f"[{size}]" for size in array.shape)
            lines.append(f"{STEP}{self.types.real} {variable(name)}{sizes};")
        return [*lines, f"}} {self.arrays_type};", ""]

    # Text

    def sections(self) -> Iterator[tuple[str, list[str]]]:
        """Module by module, callees first: its name, and its kernels as lines of C."""
        kernels = self.call_order()
        for module in dict.fromkeys(kernel.module for kernel in kernels):
            yield module, [line for kernel in kernels if kernel.module == module for line in self._text(kernel)]

    def call_order(self) -> list[Kernel]:
        """All kernels, callees first, module by module; in a module as they stand there, as far as that allows it."""
        kernels = sorted(self._kernels.values(), key=lambda kernel: position(kernel.source.function))
        found: list[Kernel] = []

        def visit(kernel: Kernel) -> None:
            if kernel not in found:
                for callee in kernel.inference.calls:
                    assert isinstance(callee, Kernel)
                    if callee.module == kernel.module:
                        visit(callee)
                found.append(kernel)

        for module in self._module_order():
            for kernel in kernels:
                if kernel.module == module:
                    visit(kernel)
        return found

    def _module_order(self) -> list[str]:
        """The modules of kernels, those that are called first; the same in every process, so no sets of names."""
        called: dict[str, dict[str, None]] = {}
        for kernel in self._kernels.values():
            modules = [callee.module for callee in kernel.inference.calls if isinstance(callee, Kernel)]
            others = called.setdefault(kernel.module, {})
            others.update(dict.fromkeys(name for name in modules if name != kernel.module))
        try:
            return list(graphlib.TopologicalSorter(called).static_order())
        except graphlib.CycleError as error:
            raise LevelheadError(f"kernels of these modules call each other in a circle: {error.args[1]}") from None

    def modules(self) -> set[str]:
        """Where all of this is written down: the modules of kernels, of types and of constants."""
        kernels = {kernel.module for kernel in self._kernels.values()}
        return kernels | self.types.modules() | {module for module, _ in self.constants.values}

    def private_types(self) -> list[Struct]:
        """Types that only this file knows, inner ones first."""
        found: list[Struct] = []
        for kernel in self.call_order():
            for kind in (*kernel.parameters.values(), kernel.returns, *kernel.inference.variables.values()):
                for struct in within(kind):
                    if struct not in found and struct not in self.types.public and not is_empty(struct):
                        found.append(struct)
        return found

    def _text(self, kernel: Kernel) -> list[str]:
        """A kernel as C, with its docstring above."""
        if self.inline and kernel.source.function is subtract_each_row:
            by_hand = template("native.subtract_each_row.c").substitute(name=kernel.name)
            return [*by_hand.splitlines(), ""]
        body = Body(kernel.source, kernel.inference, self, self._addresses(kernel))
        words = docstring(ast.get_docstring(kernel.source.tree))
        return [*(comment(words) if words else []), *wrap_line(self._head(kernel), ""), "{", *body.lines, "}", ""]

    def _head(self, kernel: Kernel) -> str:
        addresses, function = self._addresses(kernel), kernel.source.function
        in_place, returned = self.writes_in_place(function), self.types.name(kernel.returns)
        parameters = [f"{returned} *result"] if in_place else []
        parameters += [f"{self.arrays_type} *arrays"] if self.makes_arrays(function) else []
        for name, kind in kernel.parameters.items():
            if is_empty(kind):
                continue
            star = "const " if name in addresses else ""
            shown = f"*{variable(name)}" if name in addresses else declarator(kind, variable(name))
            parameters.append(f"{star}{self.types.name(kind)} {shown}")
        static = "LH_INLINE" if self.inline and not hasattr(function, "__noinline__") else "static"
        if in_place:
            return f"{static} void {kernel.name}({', '.join(parameters)})"
        if self.returned_parameter(function) is not None:
            return f"{static} const {returned} *{kernel.name}({', '.join(parameters)})"
        if isinstance(kernel.returns, Array):
            raise kernel.source.refuse(kernel.source.tree, "an array is returned; put it into a NamedTuple")
        return f"{static} {returned} {kernel.name}({', '.join(parameters) or 'void'})"
