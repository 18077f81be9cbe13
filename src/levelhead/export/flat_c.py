"""Procedures as C: numbers in variables, records at their places, the kernels' docstrings above their code."""

import ast
import re
from collections.abc import Sequence
from itertools import combinations

from levelhead.compiler.mark import KernelFunction
from levelhead.export.constants import Constants
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
    Store,
    are_exclusive,
)
from levelhead.export.kinds import RESERVED, count_numbers, variable
from levelhead.export.layout import STEP, comment, docstring, wrap_line
from levelhead.export.liveness import Liveness
from levelhead.export.plan import ATOMS, StatementPlan
from levelhead.export.procedures import Procedure
from levelhead.export.source import read_source
from levelhead.export.type_table import TypeTable

TERNARY, OR, AND, BIT_OR, BIT_XOR, BIT_AND, EQUAL, LESS, SUM, PRODUCT, UNARY, PRIMARY = range(12)
LEVELS = {
    "+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT, "|": BIT_OR, "^": BIT_XOR, "&": BIT_AND,
    "<": LESS, "<=": LESS, ">": LESS, ">=": LESS, "==": EQUAL, "!=": EQUAL,
}  # fmt: skip
LEAST_CLEARED = 8  # zeros, from which a loop that clears is shorter than their stores
OF_LIBRARY = {"sqrt": "sqrt", "floor": "floor", "abs": "fabs"}


class Writer:
    """Writes the procedures of one program.

    Args:
        types: the types; their structs hold the needed fields.
        constants: the constants, which fill up.
        live: the needed operations.
        taken: names that no variable may have.
        outer: procedures that the program calls; all others are to stay calls,
        alone: and so are these of them, which stand in two places.
        inline: whether all code but that of few samples is inlined nevertheless.
    """

    def __init__(
        self,
        types: TypeTable,
        constants: Constants,
        live: Liveness,
        taken: set[str],
        outer: set[Procedure],
        alone: set[Procedure],
        inline: bool,
    ) -> None:
        self.types, self.constants, self.live, self.taken = types, constants, live, taken
        self.outer, self.alone, self.inline = outer, alone, inline

    def reads(self, procedure: Procedure, name: str) -> bool:
        """Whether a procedure needs the record at a place."""
        if self.loads(procedure, name):
            return True
        if self._memories(procedure, name) or self.writes(procedure, name):
            return True
        return any(
            place.root == name and self.reads(call.procedure, inner)
            for call in procedure.calls()
            if call in self.live.calls
            for inner, place in call.places.items()
        )

    def loads(self, procedure: Procedure, name: str) -> bool:
        """Whether a procedure itself reads a record at a place."""
        return any(load.op == "load" and load.content[0].root == name for load in self._loads(procedure))

    def _loads(self, procedure: Procedure) -> list[Operand]:
        return [load for load in procedure.graph.loads if load in self.live.nodes]

    def _memories(self, procedure: Procedure, name: str) -> list[Operand]:
        """The arrays of a record at a place."""
        found = [*procedure.graph.memories.values(), *procedure.graph.locals]
        return [one for one in found if one.op == "memory" and one in self.live.nodes and one.content.root == name]

    def writes(self, procedure: Procedure, name: str) -> bool:
        """Whether it writes to a record."""
        if any(store.place.root == name and self.live.stores(store, procedure) for store in procedure.stores()):
            return True
        if procedure.puts & set(self._memories(procedure, name)):
            return True
        return any(
            place.root == name and self.writes(call.procedure, inner)
            for call in procedure.calls()
            if call in self.live.calls
            for inner, place in call.places.items()
        )

    def kind(self, kind: str) -> str:
        """A number's type."""
        return {FLOAT: self.types.real, INT: "int32_t", BOOL: "bool"}[kind]

    def results(self, procedure: Procedure) -> list[Operand]:
        """The numbers that a procedure returns and somebody takes."""
        return [procedure.returned[i] for i in sorted(self.live.results[procedure])]

    def record_type(self, procedure: Procedure) -> type | None:
        """The class of a whole record that is returned as it is; None: a number, nothing, or some numbers of it."""
        answer = procedure.answer
        whole = len(self.results(procedure)) == len(procedure.returned)
        if (
            isinstance(answer, tuple)
            and answer[0] is not tuple
            and whole
            and len(self.types.struct(answer[0]).fields) == len(procedure.returned)
            and all(isinstance(p, int) for p in answer[1])
        ):
            return answer[0]  # type: ignore[no-any-return]
        return None

    def result_type(self, procedure: Procedure) -> str:
        """The type of a procedure's result."""
        found = self.results(procedure)
        if len(found) < 2:
            return self.kind(found[0].kind) if found else "void"
        cls = self.record_type(procedure)
        return self.types.struct_name(self.types.struct(cls)) if cls else f"{procedure.name}_result"

    def result_members(self, procedure: Procedure) -> dict[int, str]:
        """Number of a result -> its member in the type of the result."""
        cls = self.record_type(procedure)
        if cls is not None:
            return dict(enumerate(variable(name) for name in cls._fields))  # type: ignore[attr-defined]
        found: dict[int, str] = {}
        for i in sorted(self.live.results[procedure]):
            stem = variable(procedure.returned[i].hint or "part")
            name, count = stem, 2
            while name in found.values():
                name, count = f"{stem}_{count}", count + 1
            found[i] = name
        return found

    def result_definition(self, procedure: Procedure) -> list[str]:
        """The type of the result, where it is this procedure's own."""
        if len(self.results(procedure)) < 2 or self.record_type(procedure):
            return []
        members = self.result_members(procedure)
        lines = [f"{STEP}{self.kind(procedure.returned[i].kind)} {name};" for i, name in members.items()]
        return ["typedef struct {", *lines, f"}} {procedure.name}_result;", ""]

    def head(self, procedure: Procedure) -> str:
        """A procedure's declaration."""
        given = []
        for name, cls in procedure.by_place.items():
            if self.reads(procedure, name):
                constant = "" if self.writes(procedure, name) else "const "
                given.append(f"{constant}{self.types.struct_name(self.types.struct(cls))} *{variable(name)}")
        for node in procedure.arguments:
            if node in self.live.nodes and node.kind == ARRAY:
                constant = "" if node in procedure.puts or len(node.shape) > 1 else "const "
                given.append(f"{constant}{self.types.real} {address(node.shape, variable(node.content))}")
            elif node in self.live.nodes:
                given.append(f"{self.kind(node.kind)} {variable(node.content)}")
        rare = hasattr(procedure.function, "__noinline__") or procedure in self.alone
        static = "static" if procedure in self.outer - self.alone else f"static {'LH_RARE' if rare else 'LH_CALLED'}"
        if self.inline and procedure not in self.outer and not hasattr(procedure.function, "__noinline__"):
            static = "LH_INLINE"
        return f"{static} {self.result_type(procedure)} {procedure.name}({', '.join(given) or 'void'})"

    def text(self, procedure: Procedure) -> list[str]:
        """A procedure as lines of C."""
        words = docstring(ast.get_docstring(read_source(procedure.function).tree))
        body = Body(self, procedure).lines
        words_of = set(re.findall(r"\w+", "\n".join(body)))
        given = [name for name in procedure.by_place if self.reads(procedure, name) and variable(name) not in words_of]
        body = [*(f"{STEP}(void){variable(name)};" for name in given), *body]  # only a callee might have read them
        head = wrap_line(self.head(procedure), "")
        return [*self.result_definition(procedure), *(comment(words) if words else []), *head, "{", *body, "}", ""]


class Body:
    """The body of one procedure."""

    def __init__(self, writer: Writer, procedure: Procedure) -> None:
        self._writer, self._procedure = writer, procedure
        self._plan = StatementPlan(procedure, writer.live)
        self._names: dict[Operand, str] = {}
        self._taken = set(writer.taken) | set(RESERVED) | {variable(name) for name in procedure.by_place}
        for node in procedure.arguments:
            self._names[node] = variable(node.content)
            self._taken.add(variable(node.content))
        self._origin: KernelFunction | None = procedure.function
        self.lines: list[str] = []
        self._roots = {place.root for call in procedure.calls() for place in call.places.values()}
        for call in procedure.calls():
            if call in writer.live.calls:
                for root, cls in call.temporaries.items():
                    kind = writer.types.struct_name(writer.types.struct(cls))
                    self.lines.append(f"{STEP}{kind} {root};")
                    self._taken.add(root)
        for array in procedure.graph.locals:
            if array.op == "local" and array in writer.live.nodes:
                name = self._name(array)
                self.lines.append(f"{STEP}{writer.types.real} {name}{''.join(f'[{size}]' for size in array.shape)};")
        self._counters: list[str] = []  # names of loops that have ended
        self._cleared = self._clear()
        self._block(procedure.graph.body, STEP)
        self._save(None, STEP)
        self._return(STEP)

    def _clear(self) -> str:
        """The record that only gets numbers, most of them 0: its bytes are cleared, and only the others are stored."""
        items = list(self._plan.walk(self._procedure.graph.body))
        blocks: dict[Place, list[Items]] = {}
        for block, item in items:
            if isinstance(item, Store):
                blocks.setdefault(item.place, []).append(block)
        stores = [item for _, item in items if isinstance(item, Store)]
        roots = {place.root for place in blocks} & self._procedure.by_place.keys()
        zeros = sum(map(_is_zero, stores))
        if (
            any(isinstance(item, Call | Loop | Put) for _, item in items)
            or len(roots) != 1
            or 2 * zeros < len(stores)
            or zeros < LEAST_CLEARED
            or self._writer.loads(self._procedure, *roots)
            or not all(are_exclusive(*two) for some in blocks.values() for two in combinations(some, 2))
        ):
            return ""
        (root,) = roots
        whole = count_numbers(self._writer.types.struct(self._procedure.by_place[root]))
        if root not in self._procedure.outputs and len(blocks) != whole:
            return ""  # something of it stays as it is
        name = variable(root)
        self._emit(f"unsigned char *const bytes = (unsigned char *){name};", STEP)
        self._emit(f"for (unsigned i = 0; i < sizeof *{name}; i++) {{", STEP)
        self.lines += [f"{STEP * 2}bytes[i] = 0;", f"{STEP}}}"]
        return root

    # Names

    def _name(self, node: Operand) -> str:
        if node not in self._names:
            stem = variable(node.hint) if node.hint else "at" if node.kind == INT else "number"
            name, count = stem, 2
            while name in self._taken:
                name, count = f"{stem}_{count}", count + 1
            self._taken.add(name)
            self._names[node] = name
        return self._names[node]

    def place(self, place: Place) -> str:
        """A place as C."""
        arrow = "->" if place.root in self._procedure.by_place else "."
        path = ".".join(variable(member.name) for member in place.members)
        return f"{variable(place.root)}{arrow}{path}" if path else variable(place.root)

    def _address(self, place: Place) -> str:
        if not place.members and place.root in self._procedure.by_place:
            return variable(place.root)
        return f"&{self.place(place)}"

    # Statements

    def _emit(self, code: str, indent: str) -> None:
        self.lines += wrap_line(code, indent)

    def _block(self, block: Items, indent: str) -> None:
        for item in self._plan.items[block]:
            if isinstance(item, Operand) and item not in self._plan.held:
                self._save(item, indent)
                continue
            self._save(item, indent)
            if isinstance(item, Operand):
                self._remark(item, indent)
                self._emit(f"const {self._kind(item)} {self._name(item)} = {self._operation(item)[0]};", indent)
            elif isinstance(item, Store):
                if item.place.root == self._cleared and _is_zero(item):
                    continue
                self._emit(f"{self.place(item.place)} = {self._text(item.value)};", indent)
            elif isinstance(item, Put):
                self._emit(f"{self._element(item.array, item.indices)} = {self._text(item.value)};", indent)
            elif isinstance(item, Call):
                self._call(item, indent)
            elif isinstance(item, Loop):
                self._loop(item, indent)
            else:
                self._branch(item, indent)

    def _kind(self, node: Operand) -> str:
        return self._writer.kind(node.kind)

    def _remark(self, node: Operand, indent: str) -> None:
        """Says of which kernel the following is."""
        if node.origin is None or node.origin is self._origin:
            return
        self._origin = node.origin
        if node.origin is self._procedure.function:
            return
        words = docstring(ast.get_docstring(read_source(node.origin).tree)).split("\n\n")[0].replace("\n", " ")
        module = node.origin.__module__.rpartition(".")[2]
        self.lines += comment(f"{module}.{node.origin.__name__}: {words}" if words else node.origin.__name__, indent)

    def _save(self, before: Item | None, indent: str) -> None:
        for load in self._plan.saved.get(before, []):
            self._emit(f"const {self._kind(load)} {self._name(load)} = {self.place(load.content[0])};", indent)

    def _branch(self, branch: Branch, indent: str) -> None:
        phis = self._plan.phis(branch)
        for phi in phis:
            self.lines.append(f"{indent}{self._kind(phi)} {self._name(phi)};")
        first, second = branch.arms
        test = self._text(branch.condition)
        if self._is_idle(first, phis, branch):
            test, first, second = self._invert(branch.condition), second, first
        self._emit(f"if ({test}) {{", indent)
        self._arm(branch, first, phis, indent + STEP)
        if not self._is_idle(second, phis, branch):
            self.lines.append(f"{indent}}} else {{")
            self._arm(branch, second, phis, indent + STEP)
        self.lines.append(f"{indent}}}")

    def _is_idle(self, arm: Items, phis: Sequence[Operand], branch: Branch) -> bool:
        held = [item for item in self._plan.items[arm] if not isinstance(item, Operand) or item in self._plan.held]
        return not held and not phis and (branch, arm) not in self._plan.saved

    def _arm(self, branch: Branch, arm: Items, phis: Sequence[Operand], indent: str) -> None:
        origin = self._origin
        self._block(arm, indent)
        for load in self._plan.saved.get((branch, arm), []):
            self._emit(f"const {self._kind(load)} {self._name(load)} = {self.place(load.content[0])};", indent)
        for phi in phis:
            self._emit(f"{self._name(phi)} = {self._text(phi.arguments[branch.arms.index(arm)])};", indent)
        self._origin = origin

    def _loop(self, loop: Loop, indent: str) -> None:
        phis, origin = self._plan.carried(loop), self._origin
        for phi in phis:
            self._emit(f"{self._kind(phi)} {self._name(phi)} = {self._text(phi.arguments[0])};", indent)
        if self._counters:
            self._names[loop.counter] = self._counters.pop()
        i, (first, last, step) = self._name(loop.counter), loop.bounds
        by = int(step.content)
        forth = f"{i}++" if by == 1 else f"{i} += {by}" if by > 0 else f"{i} -= {-by}"
        less = "<" if by > 0 else ">"
        self._emit(f"for (int32_t {i} = {self._text(first)}; {i} {less} {self._text(last)}; {forth}) {{", indent)
        (body,) = loop.arms
        self._block(body, indent + STEP)
        self._save((loop, body), indent + STEP)  # type: ignore[arg-type]
        changed = [phi for phi in phis if phi.arguments[1] is not phi]
        texts = {phi: self._text(phi.arguments[1]) for phi in changed}
        for k, phi in enumerate(changed[:-1]):  # all change at once
            if any(self._mentions(other.arguments[1], phi) for other in changed[k + 1 :]):
                held = self._name(Operand("held", (), phi.kind, hint=f"{self._name(phi)}_next"))
                self._emit(f"const {self._kind(phi)} {held} = {texts[phi]};", indent + STEP)
                texts[phi] = held
        late = [phi for phi in changed if texts[phi].endswith("_next")]
        for phi in [*(one for one in changed if one not in late), *late]:
            self._emit(f"{self._name(phi)} = {texts[phi]};", indent + STEP)
        self.lines.append(f"{indent}}}")
        self._counters.append(i)
        self._origin = origin

    def _mentions(self, node: Operand, phi: Operand) -> bool:
        """Whether the text of a number has a carried one in it."""
        if node is phi or node in self._plan.held or node.op in ATOMS:
            return node is phi
        return any(self._mentions(part, phi) for part in node.arguments)

    def _element(self, array: Operand, indices: Sequence[Operand]) -> str:
        return self._text(array, PRIMARY) + "".join(f"[{self._text(index)}]" for index in indices)

    def _call(self, call: Call, indent: str) -> None:
        procedure, writer = call.procedure, self._writer
        given = [self._address(call.places[name]) for name in procedure.by_place if writer.reads(procedure, name)]
        given += [self._text(node) for node in self._plan.arguments(call)]
        code = f"{procedure.name}({', '.join(given)})"
        wanted = {i: call.results[i] for i in sorted(writer.live.results[procedure])}
        if not any(node in writer.live.nodes for node in wanted.values()):
            self._emit(f"{code};" if not wanted else f"(void){code};", indent)
        elif len(wanted) == 1:
            ((_, node),) = wanted.items()
            self._emit(f"const {self._kind(node)} {self._name(node)} = {code};", indent)
        else:
            held = Operand("held", (), FLOAT, hint=procedure.function.__name__)
            self._emit(f"const {writer.result_type(procedure)} {self._name(held)} = {code};", indent)
            for i, member in writer.result_members(procedure).items():
                self._names[call.results[i]] = f"{self._name(held)}.{member}"

    def _return(self, indent: str) -> None:
        found = self._plan.returned
        if len(found) == 1:
            self._emit(f"return {self._text(found[0])};", indent)
        elif found:
            values = ", ".join(self._text(node) for node in found)
            held = self._name(Operand("held", (), FLOAT, hint="found"))
            self._emit(f"const {self._writer.result_type(self._procedure)} {held} = {{{values}}};", indent)
            self._emit(f"return {held};", indent)

    # Expressions

    def _text(self, node: Operand, least: int = TERNARY) -> str:
        text, level = self._atom(node)
        return f"({text})" if level < least else text

    def _atom(self, node: Operand) -> tuple[str, int]:
        if node.op == "const":
            return self._constant(node)
        if node.op == "named":
            return self._writer.constants.place(*node.content), PRIMARY
        if node.op == "memory":
            return self.place(node.content), PRIMARY
        if node in self._names or node.op in ("phi", "carried", "result") or node in self._plan.held:
            return self._name(node), PRIMARY
        return (self.place(node.content[0]), PRIMARY) if node.op == "load" else self._operation(node)

    def _constant(self, node: Operand) -> tuple[str, int]:
        if node.kind == BOOL:
            return str(bool(node.content)).lower(), PRIMARY
        try:
            text = self._writer.types.number(node.content) if node.kind == FLOAT else str(node.content)
        except OverflowError as error:
            source = read_source(node.origin or self._procedure.function)
            constants = (one for one in ast.walk(source.tree) if isinstance(one, ast.Constant))
            at = next((one for one in constants if one.value == node.content), source.tree)
            raise source.refuse(at, f"{node.content!r} cannot be a constant: {error}") from None
        return text, UNARY if text.startswith("-") else PRIMARY

    def _operation(self, node: Operand) -> tuple[str, int]:
        op, given = node.op, node.arguments
        if op in ("element", "row"):
            return self._element(given[0], given[1:]), PRIMARY
        if op in LEVELS:
            return self._binary(op, given)
        if op in ("and", "or"):
            least = {"and": EQUAL, "or": BIT_OR}[op]
            parts = [self._text(part, least if part.op not in ("and", "or") else PRIMARY) for part in given]
            return (" && " if op == "and" else " || ").join(parts), AND if op == "and" else OR
        if op in ("not", "neg", "float"):
            sign = {"not": "!", "neg": "-", "float": f"({self._writer.types.real})"}[op]
            inner = self._text(given[0], UNARY)
            return (f"-({inner})" if op == "neg" and inner.startswith("-") else f"{sign}{inner}"), UNARY
        if op == "select":
            test, one, other = given
            return f"{self._text(test, OR)} ? {self._text(one, OR)} : {self._text(other, OR)}", TERNARY
        return self._function(node), PRIMARY

    def _function(self, node: Operand) -> str:
        """A call of the C library, or of the replacement of a word of Python."""
        op, texts = node.op, [self._text(part) for part in node.arguments]
        if op == "abs" and node.kind == INT:
            return f"lh_max_int({texts[0]}, -({texts[0]}))"
        single = "f" if self._writer.types.real == "float" else ""
        name = f"{OF_LIBRARY[op]}{single}" if op in OF_LIBRARY else f"lh_{op}{'' if node.kind == FLOAT else '_int'}"
        return f"{name}({', '.join(texts)})"

    def _binary(self, op: str, given: Sequence[Operand]) -> tuple[str, int]:
        level = LEVELS[op]
        if level < EQUAL:
            same = given[0].op == op
            return f"{self._text(given[0], level if same else UNARY)} {op} {self._text(given[1], UNARY)}", level
        if level in (EQUAL, LESS):
            return f"{self._text(given[0], LESS + 1)} {op} {self._text(given[1], LESS + 1)}", level
        return f"{self._text(given[0], level)} {op} {self._text(given[1], level + 1)}", level

    def _invert(self, condition: Operand) -> str:
        return f"!{self._text(condition, UNARY)}"


def address(shape: tuple[int, ...], name: str) -> str:
    """The declarator of a parameter that is an array."""
    rows = "".join(f"[{size}]" for size in shape[1:])
    return f"(*{name}){rows}" if rows else f"*{name}"


def _is_zero(store: Store) -> bool:
    """Whether all stored bits are 0."""
    value = store.value
    return value.op == "const" and repr(value.content) in ("0.0", "0", "False")
