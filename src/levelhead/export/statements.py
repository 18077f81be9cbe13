"""Statements of the kernel language as C, line by line, with the kernel's comments where they stood."""

import ast
import functools
import re
from collections.abc import Callable, Sequence

from levelhead.export.expressions import Expressions, Names
from levelhead.export.inference import Inference
from levelhead.export.kinds import FLOAT, INT, VOID, Array, Kind, Struct, is_empty, is_struct, variable
from levelhead.export.layout import STEP, add_comment, comment, wrap_line
from levelhead.export.pointers import Pointers
from levelhead.export.scopes import Scopes, loaded_in, stored_in
from levelhead.export.source import Source
from levelhead.export.type_table import declarator


class Body:
    """The body of one kernel."""

    def __init__(self, source: Source, inference: Inference, names: Names, addresses: set[str]) -> None:
        self._source, self._known, self._names = source, inference, names
        self._write = Expressions(inference, names, source.function, addresses)
        self._addresses = addresses
        self._parameters = {argument.arg for argument in source.tree.args.args}
        body = [statement for statement in source.tree.body if not _is_docstring(statement)]
        self._scopes = Scopes(body)
        for node in self._scopes.stray:
            raise source.refuse(node, f"{node.id} counts a loop; outside of the loop another name has to be used")
        self._comments = {line: words for line, words in source.comments.items() if line > _head(source.tree)}
        self._pointers = Pointers(self._parameters, self._scopes, inference, names)
        addresses |= self._pointers.names
        self._slots = self._pointers.slots
        self._taken = {slot: 1 for slots in self._slots.values() for slot in slots.values()}
        self._open: list[tuple[str, str]] = []  # (type, "name = value") to be declared in one line
        self.lines: list[str] = []
        self._block(body, STEP)
        self.flush()
        self.lines = self._discard_unread() + self.lines

    def _discard_unread(self) -> list[str]:
        """Parameters that C would warn about."""
        code = re.sub(r"/\*.*?\*/", "", "\n".join(self.lines), flags=re.DOTALL)
        unread = []
        for argument in self._source.tree.args.args:
            name = variable(argument.arg)
            if not is_empty(self._known.variables[argument.arg]) and not re.search(rf"\b{name}\b", code):
                unread.append(f"(void){name};")
        return [STEP + " ".join(unread)] if unread else []

    # Blocks, comments, declarations

    def _block(self, body: Sequence[ast.stmt], indent: str) -> None:
        for statement in body:
            self._write_comments_above(statement.lineno, indent)
            stored = stored_in(statement)
            late = [n for n in self._scopes.declared_before(statement) if self._declares_early(n, stored, statement)]
            for name in late:
                self.flush(indent)
                pointer = ("const ", "*") if name in self._pointers.names else ("", "")
                kind = self._names.types.name(self._known.variables[name])
                self.lines.append(f"{indent}{pointer[0]}{kind} {pointer[1]}{self._pointer(name)};")
            self._declare_slots(statement, indent)
            getattr(self, f"_on_{type(statement).__name__}")(statement, indent)

    def _declare_slots(self, statement: ast.stmt, indent: str) -> None:
        """The place of what a variable that is an address gets in inner blocks, before the variable begins."""
        for name in self._scopes.declared_before(statement):
            inner = {
                slot for at, slot in self._slots.get(name, {}).items() if not self._pointers.in_own_block(name, at)
            }
            if inner:
                self._emit(f"{self._names.types.name(self._known.variables[name])} {inner.pop()};", indent)

    def _declares_early(self, name: str, stored: set[str], statement: ast.stmt) -> bool:
        """Whether a variable is declared before its first statement instead of by it."""
        if name in self._parameters or name not in self._known.variables or self._idle(name):
            return False
        return name not in stored

    def _idle(self, name: str) -> bool:
        """Whether nobody ever reads the variable, or there is nothing in it."""
        return not self._scopes.variables[name].loads or is_empty(self._known.variables.get(name))

    def _write_comments_above(self, line: int, indent: str) -> None:
        for at in sorted(self._comments):
            if at < line:
                self.flush(indent)
                self.lines += comment(self._comments.pop(at), indent)

    def _comment_beside(self, node: ast.stmt, last: int | None = None) -> str:
        end = last or node.end_lineno or node.lineno
        found = [self._comments.pop(at) for at in sorted(self._comments) if node.lineno <= at <= end]
        return "; ".join(found)

    def _emit(self, code: str, indent: str, words: str = "") -> None:
        self.flush(indent)
        self.lines += add_comment(wrap_line(code, indent), words)

    def flush(self, indent: str = STEP) -> None:
        """Writes out the declarations that wait to share a line."""
        waiting, self._open = self._open, []
        if waiting:
            kind = waiting[0][0]
            self.lines += wrap_line(f"{kind} {', '.join(text for _, text in waiting)};", indent)

    def _declares(self, name: str, statement: ast.stmt) -> bool:
        """Whether this statement is where a variable begins."""
        return name not in self._parameters and name in self._scopes.declared_before(statement)

    def _pointer(self, name: str) -> str:
        return declarator(self._known.variables[name], variable(name))

    def _store(
        self, name: str, value: str, statement: ast.stmt, indent: str, words: str = "", lasting: bool = False
    ) -> None:
        """Gives a variable a value, and declares it if it begins here; ``lasting``: the value stays where it is."""
        if name == "_" or self._idle(name):
            return
        kind = self._known.variables[name]
        slot = self._slots.get(name, {}).get(statement)
        if slot is not None:
            head = f"const {self._names.types.name(kind)} " if self._pointers.in_own_block(name, statement) else ""
            self._emit(f"{head}{slot} = {value};", indent, words)
            value, words = slot, ""
        if name in self._pointers.names:
            written = f"const {self._names.types.name(kind)} *" if self._declares(name, statement) else ""
            self._emit(f"{written}{variable(name)} = {_address(value)};", indent, words)
            return
        if not self._declares(name, statement):
            self._emit(f"{variable(name)} = {value};", indent, words)
            return
        constant = self._scopes.variables[name].stores == 1
        if constant and lasting and self._names.by_address(kind):  # it is where it is; no need to copy it
            self._addresses.add(name)
            self._emit(f"const {self._names.types.name(kind)} *{variable(name)} = {_address(value)};", indent, words)
            return
        written = ("const " if constant and not isinstance(kind, Array) else "") + self._names.types.name(kind)
        alone = not (isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Tuple))
        if words or alone or isinstance(kind, Array):
            self._emit(f"{written} {self._pointer(name)} = {value};", indent, words)
            return
        if self._open and self._open[0][0] != written:
            self.flush(indent)
        self._open.append((written, f"{self._pointer(name)} = {value}"))

    # Statements

    def _on_Expr(self, node: ast.Expr, indent: str) -> None:
        if isinstance(node.value, ast.Call):
            words = self._comment_beside(node)
            unused = "" if self._known.kinds[node.value] is VOID else "(void)"
            self._emit(f"{unused}{self._write.text(node.value)};", indent, words)

    def _on_Pass(self, node: ast.Pass, indent: str) -> None:
        pass

    def _on_Return(self, node: ast.Return, indent: str) -> None:
        words = self._comment_beside(node)
        if node.value is None:
            self._emit("return;", indent, words)
            return
        value = self._write.value(node.value, self._known.returns)
        if self._names.writes_in_place(self._source.function):
            self._emit(f"*result = {value};", indent, words)
            if node is not self._source.tree.body[-1]:
                self._emit("return;", indent)
            return
        back = self._names.returned_parameter(self._source.function) is not None
        self._emit(f"return {_address(value) if back else value};", indent, words)

    def _on_If(self, node: ast.If, indent: str) -> None:
        words = self._comment_beside(node, node.body[0].lineno - 1)
        head = f"if ({self._write.condition(node.test)}) {{"
        self._emit(head, indent, words)
        self._branches(node, indent)

    def _branches(self, node: ast.If, indent: str) -> None:
        self._block(node.body, indent + STEP)
        self.flush(indent + STEP)
        if not node.orelse:
            self.lines.append(f"{indent}}}")
            return
        first = node.orelse[0]
        if len(node.orelse) == 1 and isinstance(first, ast.If) and not self._needs_block(first):
            words = self._comment_beside(first, first.body[0].lineno - 1)
            self.lines += add_comment(wrap_line(f"}} else if ({self._write.condition(first.test)}) {{", indent), words)
            self._branches(first, indent)
            return
        self.lines.append(f"{indent}}} else {{")
        self._block(node.orelse, indent + STEP)
        self.flush(indent + STEP)
        self.lines.append(f"{indent}}}")

    def _needs_block(self, node: ast.If) -> bool:
        """Whether something is declared just before it."""
        return any(name not in self._parameters and not self._idle(name)
                   for name in self._scopes.declared_before(node))  # fmt: skip

    def _on_For(self, node: ast.For, indent: str) -> None:
        assert isinstance(node.target, ast.Name) and isinstance(node.iter, ast.Call)
        words = self._comment_beside(node, node.body[0].lineno - 1)
        bounds = [self._write.text(part) for part in node.iter.args]
        first, end = ("0", bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = bounds[2] if len(bounds) > 2 else "1"
        i = variable(node.target.id)
        begin = f"int32_t {i} = {first}"
        forth, less = (f"{i}++", "<") if step == "1" else (f"{i} += {step}", "<")
        if step.startswith("-"):
            forth, less = f"{i} -= {step[1:]}", ">"
        self._emit(f"for ({begin}; {i} {less} {end}; {forth}) {{", indent, words)
        self._block(node.body, indent + STEP)
        self.flush(indent + STEP)
        self.lines.append(f"{indent}}}")

    def _on_AugAssign(self, node: ast.AugAssign, indent: str) -> None:
        words = self._comment_beside(node)
        binary = ast.BinOp(node.target, node.op, node.value)
        self._known.kinds[binary] = kind = self._known.kinds[node.target]
        sign = {ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*=", ast.Div: "/=", ast.BitOr: "|=", ast.BitAnd: "&="}
        code = f"{self._write.text(node.target)} {sign[type(node.op)]} {self._write.value(node.value, kind)};"
        self._emit(code, indent, words)

    def _on_AnnAssign(self, node: ast.AnnAssign, indent: str) -> None:
        assert isinstance(node.target, ast.Name) and node.value is not None
        words = self._comment_beside(node)
        self._one(node.target.id, node.value, node, indent, words)

    def _one(self, name: str, value: ast.expr, statement: ast.stmt, indent: str, words: str) -> None:
        if name == "_" or self._idle(name):
            return
        kind = self._known.variables[name]
        if (
            self._declares(name, statement)
            and isinstance(value, ast.Call)
            and is_struct(self._known.resolve(value.func))
        ):
            self._store(name, self._write.braces(value), statement, indent, words)
        else:
            lasting = isinstance(value, ast.Attribute) and self._pointers.is_constant(value)
            self._store(name, self._write.value(value, kind), statement, indent, words, lasting)

    def _on_Assign(self, node: ast.Assign, indent: str) -> None:
        words = self._comment_beside(node)
        for target in node.targets:
            if isinstance(target, ast.Tuple):
                self._unpack(target, node.value, node, indent, words)
                self.flush(indent)
            elif isinstance(target, ast.Subscript):
                value = self._write.value(node.value, FLOAT)
                self._emit(f"{self._write.text(target)} = {value};", indent, words)
            else:
                assert isinstance(target, ast.Name)
                self._one(target.id, node.value, node, indent, words)

    def _unpack(self, target: ast.Tuple, value: ast.expr, statement: ast.Assign, indent: str, words: str) -> None:
        if words:
            self._emit("", indent)
            self.lines.pop()
            self.lines += comment(words, indent)
        stored = stored_in(statement)
        if isinstance(value, ast.Tuple):
            self._pairwise(target, value, statement, indent)
            return
        kind = self._known.kinds[value]
        assert isinstance(kind, Struct)
        simple = isinstance(value, ast.Name | ast.Attribute) and not (loaded_in(value) & stored)
        if simple:
            lasting = self._pointers.is_constant(value)
            self._fields(target, lambda name: self._write.member(value, name), kind, statement, indent, lasting)
            return
        held = self._fresh(kind)
        self._emit(f"const {self._names.types.struct_name(kind)} {held} = {self._write.text(value)};", indent)
        self._fields(target, lambda name: f"{held}.{variable(name)}", kind, statement, indent, True)

    def _fields(
        self,
        target: ast.Tuple,
        member: Callable[[str], str],
        kind: Struct,
        statement: ast.Assign,
        indent: str,
        lasting: bool,
    ) -> None:
        for part, (name, inner) in zip(target.elts, kind.fields.items(), strict=True):
            text = member(name)
            if isinstance(part, ast.Tuple):
                assert isinstance(inner, Struct)
                deeper = functools.partial(_member, text)
                self._fields(part, deeper, inner, statement, indent, lasting)
            elif isinstance(part, ast.Subscript):
                self._emit(f"{self._write.text(part)} = {text};", indent)
            else:
                assert isinstance(part, ast.Name)
                if part.id != "_" and not self._idle(part.id):
                    if inner is INT and self._known.variables[part.id] is FLOAT:
                        text = f"({self._names.types.real}){text}"
                    self._store(part.id, text, statement, indent, lasting=lasting)

    def _pairwise(self, target: ast.Tuple, value: ast.Tuple, statement: ast.Assign, indent: str) -> None:
        """a, b = c, d: one by one, through helpers where a name stands on both sides."""
        mixed = any(stored_in(statement) & loaded_in(part) for part in value.elts)
        texts = []
        for part in value.elts:
            kind = self._known.kinds[part]
            text = self._write.value(part, None)
            if mixed:
                held = self._fresh(kind)
                self._emit(f"const {self._names.types.name(kind)} {held} = {text};", indent)
                text = held
            texts.append(text)
        for part, text, one in zip(target.elts, texts, value.elts, strict=True):
            if isinstance(part, ast.Name):
                wanted = self._known.variables.get(part.id)
                literal = text if mixed or wanted is None else self._write.value(one, wanted)
                self._store(part.id, literal, statement, indent)
            elif isinstance(part, ast.Tuple) and not mixed:
                self._unpack(part, one, statement, indent, "")
            elif isinstance(part, ast.Tuple):
                inner = self._known.kinds[one]
                assert isinstance(inner, Struct)
                self._fields(part, functools.partial(_member, text), inner, statement, indent, True)
            else:
                self._emit(f"{self._write.text(part)} = {text};", indent)

    def _fresh(self, kind: Kind) -> str:
        """A name for a value that has none in Python."""
        name = kind.name.lower() if isinstance(kind, Struct) else "held"
        while name in self._known.variables or name in self._taken:
            self._taken[name] = self._taken.get(name, 1) + 1
            name = f"{name.rstrip('_0123456789')}_{self._taken[name]}"
        self._taken[name] = 1
        return name


def _address(value: str) -> str:
    return value[1:] if value.startswith("*") else f"&{value}"


def _member(owner: str, name: str) -> str:
    return f"{owner}.{variable(name)}"


def _is_docstring(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _head(tree: ast.FunctionDef) -> int:
    """The last line of a kernel's head, so that remarks on the decorator or the arguments are no comments inside."""
    return tree.body[0].lineno - 1
