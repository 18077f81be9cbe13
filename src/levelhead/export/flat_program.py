"""The procedures of a filter on an IMU: update, start, and queries; unneeded operations are left out."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from levelhead.compiler.mark import KernelFunction
from levelhead.export.constants import Constants, UniqueNames
from levelhead.export.flat_c import Writer
from levelhead.export.graph import ARRAY, Operand, Place, Record, RecordField, Value, leaves
from levelhead.export.graph_builder import Steady
from levelhead.export.homing import home_phis
from levelhead.export.kinds import BOOL, FLOAT, INT, Array, Kind, Struct, is_empty, variable, within
from levelhead.export.layout import template
from levelhead.export.liveness import Liveness
from levelhead.export.plan import ATOMS
from levelhead.export.procedures import Procedure, Procedures, like, make_procedure, steady_members
from levelhead.export.tracing import BY_PLACE
from levelhead.export.type_table import TypeTable
from levelhead.kernels.quat import Euler, Quat
from levelhead.kernels.vec3 import Vec3
from levelhead.open_types import Untyped

NUMBERS = {"float": FLOAT, "int": INT, "bool": BOOL}
WHOLE = (Vec3, Quat, Euler)  # records that are never cut


class Root:
    """A kernel that the program calls.

    Attributes:
        name: by which it is asked for.
        kernel: the kernel.
        given: values like its arguments.
        pick: the name of the part of its result that is wanted.
        alone: whether it calls nothing: all is inlined.
        fixed: arguments that are known.
        least: numbers from which a record is passed by its place.
        homes: the places of records of its result, by class.
    """

    def __init__(
        self,
        name: str,
        kernel: KernelFunction,
        given: Sequence[Value],
        pick: str | None = None,
        alone: bool = False,
        fixed: Mapping[str, object] | None = None,
        least: int = BY_PLACE,
        homes: Mapping[type, Place | None] = MappingProxyType({}),
    ) -> None:
        self.name, self.kernel, self.given, self.pick, self.alone = name, kernel, given, pick, alone
        self.least, self.homes = least, homes
        self.fixed = fixed or {}


class FlatProgram:
    """Everything that some kernels need, as procedures.

    Args:
        prefix: of the types that other files see.
        real: "double" or "float".
        roots: the kernels that the program calls.
        kept: classes of which all fields are kept.
        frozen: classes of parameters that are constants of the program.
        by_hand: kernel -> the template that has it in C; with any, speed is worth more than size: calls are inlined.
        prefixes: argument of a root that lies in the state -> the way there.
        state: the state before the first sample, as Python has it; (): nothing.

    Attributes:
        procedures: name of a root -> its procedure.
    """

    def __init__(
        self,
        prefix: str,
        real: str,
        roots: Sequence[Root],
        state: Untyped = (),
        kept: Sequence[type] = (),
        frozen: tuple[type, ...] = (),
        prefixes: Mapping[str, tuple[RecordField, ...]] = MappingProxyType({}),
        by_hand: Mapping[KernelFunction, str] = MappingProxyType({}),
    ) -> None:
        self._prefixes, self._by_hand = prefixes, by_hand
        self.types = TypeTable(prefix, real)
        self.constants = Constants(self.types)
        self._shape = like(state)
        assert isinstance(self._shape, Record)
        self._sections: list[tuple[str, list[str]]] = []
        self._alone: set[KernelFunction] = set()
        self._frozen = frozen
        self._alone_roots = {root.name for root in roots if root.alone}
        steady, again = steady_members(state), True
        while again:
            self._trace(roots, steady)
            wrong = self._all.find_contradictions(self._every())
            alone = set() if wrong else self._called_once(kept)
            steady = {member: value for member, value in steady.items() if member not in wrong}
            self._alone |= alone
            again = bool(wrong or alone)
        self._cut_types()

    def _trace(self, roots: Sequence[Root], steady: Steady) -> None:
        self._all = Procedures(
            [root.kernel for root in roots if not root.alone], steady, self._alone, self._frozen, self._by_hand
        )
        names = UniqueNames()
        self.procedures: dict[str, Procedure] = {}
        for root in roots:
            stem = root.kernel.__name__ if root.pick is None else root.name
            name = names.choose(root.name, root.kernel.__module__, f"_{stem}")
            self._all.inlines = root.alone
            self.procedures[root.name] = make_procedure(
                self._all, root.kernel, name, root.given, root.pick, root.fixed, None, root.least, root.homes
            )

    def _called_once(self, kept: Sequence[type]) -> set[KernelFunction]:
        """Kernels that are called in one place only, and by no means rarely: they had better be inlined."""
        for procedure in self._every():
            home_phis(procedure)
        members = {RecordField(cls, name) for cls in (*WHOLE, *kept) for name in cls._fields}  # type: ignore[attr-defined]
        self.live = Liveness(self._every(), self.procedures.values(), members, self._prefixes)
        calls = [call.procedure.function for one in self._every() for call in one.calls() if call in self.live.calls]
        return {
            one for one in calls if calls.count(one) == 1 and not hasattr(one, "__noinline__")
        } - self._by_hand.keys()

    def _every(self) -> list[Procedure]:
        return [*self._all.all.values(), *self.procedures.values()]

    def _cut_types(self) -> None:
        """Leaves out of the types the fields without a reader."""
        first = [self._shape] if list(leaves(self._shape)) else []
        for value in [*first, *(value for one in self._every() for _, value in one.parts)]:
            self._complete(value)
        for struct in list(self.types.structs()):
            if struct.origin is not None and struct.origin not in WHOLE:
                kept = {n: k for n, k in struct.fields.items() if RecordField(struct.origin, n) in self.live.members}
                struct.fields = kept

    def _complete(self, value: Value) -> Kind:
        """The kind of a value; fields whose annotation leaves it open get theirs."""
        if not isinstance(value, Record):
            return Array(value.shape) if value.kind == ARRAY else NUMBERS[value.kind]
        struct = self.types.struct(value.cls)
        for name, part in zip(value.cls._fields, value.values, strict=True):  # type: ignore[attr-defined]
            kind = self._complete(part)
            if isinstance(kind, Struct) or struct.fields[name] is None:
                struct.fields[name] = kind
        return struct

    def counts(self) -> tuple[int, int]:
        """How many operations are needed, and how many numbers are moved: stored, or taken from either arm."""
        operations = sum(node.op not in ATOMS for node in self.live.nodes)
        stores = sum(self.live.stores(store, one) for one in self.order() for store in one.stores())
        return operations, stores + sum(node.op == "phi" for node in self.live.nodes)

    # Calls

    def call(self, name: str, places: Mapping[str, str], values: Mapping[str, str] = MappingProxyType({})) -> str:
        """A call of a root: the content of each place, and its other arguments."""
        procedure = self.procedures[name]
        given = [f"&{places[one]}" for one in procedure.by_place if self.writer.reads(procedure, one)]
        given += [values[str(node.content)] for node in self.arguments(name)]
        return f"{procedure.name}({', '.join(given)})"

    def arguments(self, name: str) -> list[Operand]:
        """The numbers and arrays that a root takes."""
        return [node for node in self.procedures[name].arguments if node in self.live.nodes]

    # Text

    def order(self) -> list[Procedure]:
        """The procedures that are needed, callees first."""
        found: list[Procedure] = []

        def visit(procedure: Procedure) -> None:
            if procedure in found:
                return
            for call in procedure.calls():
                if call in self.live.calls:
                    visit(call.procedure)
            found.append(procedure)

        for procedure in self.procedures.values():
            visit(procedure)
        return found

    def sections(self) -> list[tuple[str, list[str]]]:
        """Runs of procedures of one module: its name, and C."""
        if not self._sections:  # planning changes the graph
            self._sections = list(self._written())
        return self._sections

    def _written(self) -> Iterator[tuple[str, list[str]]]:
        taken = {procedure.name for procedure in self.order()}
        outer, alone = set(self.procedures.values()), {self.procedures[name] for name in self._alone_roots}
        self.writer = Writer(self.types, self.constants, self.live, taken, outer, alone, bool(self._by_hand))
        module = ""
        lines: list[str] = []
        for procedure in self.order():
            if procedure.function.__module__ != module:
                if lines:
                    yield module, lines
                module, lines = procedure.function.__module__, []
            by_hand = self._by_hand.get(procedure.function)
            if by_hand is None:
                lines += self.writer.text(procedure)
            else:
                lines += [*template(by_hand).substitute(name=procedure.name).splitlines(), ""]
        yield module, lines

    def private_types(self) -> list[Struct]:
        """Types of this file alone, inner ones first."""
        found: list[Struct] = []
        for procedure in self.order():
            classes = [*procedure.by_place.values(), self.writer.record_type(procedure)]
            classes += [cls for call in procedure.calls() for cls in call.temporaries.values()]
            for cls in classes:
                for struct in within(self.types.struct(cls)) if cls else ():
                    if struct not in found and struct not in self.types.public and not is_empty(struct):
                        found.append(struct)
        return found

    def modules(self) -> set[str]:
        """Where all of this is written down."""
        return {procedure.function.__module__ for procedure in self._every()} | self.types.modules()


def classes(value: Value) -> Iterator[type]:
    """The classes of a record and those in it."""
    if isinstance(value, Record):
        yield value.cls
        for part in value.values:
            yield from classes(part)


def number_paths(value: Value, name: str, path: str = "") -> Iterator[tuple[str, str]]:
    """The numbers of a record as a root takes them, by name, and their members in C."""
    if isinstance(value, Record):
        for inner, part in zip(value.cls._fields, value.values, strict=True):  # type: ignore[attr-defined]
            yield from number_paths(part, f"{name}_{inner}", f"{path}.{variable(inner)}" if path else variable(inner))
    else:
        yield name, path
