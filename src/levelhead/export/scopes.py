"""Where in C a variable is declared: in the innermost block around all its uses, with its first value if it can be.

Python knows one scope, the function; a C reader expects a name where it begins to mean something, and ``const`` where
it never changes.
"""

import ast
import functools
from collections.abc import Sequence
from dataclasses import dataclass, field

Place = tuple[tuple[int, int], ...]  # (block, statement) from the outermost block inwards


@dataclass
class Variable:
    """What happens to one name.

    Attributes:
        places: of all its occurrences, in order.
        stores: how often it gets a value.
        loads: how often it is read.
    """

    places: list[Place] = field(default_factory=list)
    stores: int = 0
    loads: int = 0

    @property
    def block(self) -> Place:
        """Where it is declared: (block, first statement) at the end."""
        shared: list[tuple[int, int]] = []
        for level in zip(*self.places, strict=False):
            if len({block for block, _ in level}) > 1:
                break
            shared.append(level[0])
            if len({at for _, at in level}) > 1:
                break
        return tuple(shared)


class Scopes(ast.NodeVisitor):
    """All variables of a function body, and before which statement each is declared."""

    def __init__(self, body: Sequence[ast.stmt]) -> None:
        self.variables: dict[str, Variable] = {}
        self.stray: list[ast.Name] = []  # a loop's counter read or changed outside of its loop
        self._counters = {node.target.id for statement in body for node in ast.walk(statement)
                          if isinstance(node, ast.For) and isinstance(node.target, ast.Name)}  # fmt: skip
        self._counting: list[str] = []
        self.at: dict[ast.stmt, tuple[int, int]] = {}
        self._blocks = 0
        self._place: Place = ()
        self._block(body)
        self._declared: dict[tuple[int, int], list[str]] = {}  # statement -> the names declared before it
        for name, variable in self.variables.items():
            if variable.block:
                self._declared.setdefault(variable.block[-1], []).append(name)

    def _block(self, body: Sequence[ast.stmt]) -> None:
        self._blocks += 1
        number, outside = self._blocks, self._place
        for i, statement in enumerate(body):
            self.at[statement] = (number, i)
            self._place = (*outside, (number, i))
            self.visit(statement)
        self._place = outside

    def visit_If(self, node: ast.If) -> None:
        """Two blocks."""
        self.visit(node.test)
        self._block(node.body)
        self._block(node.orelse)

    def visit_For(self, node: ast.For) -> None:
        """A block; the counter is declared in the loop's head."""
        self.visit(node.iter)
        self._counting.append(node.target.id if isinstance(node.target, ast.Name) else "")
        self._block(node.body)
        self._counting.pop()

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        """Read and written."""
        self.visit(node.value)
        self.visit(node.target)
        if isinstance(node.target, ast.Name):
            self.variables[node.target.id].stores += 1
            self.variables[node.target.id].loads += 1

    def visit_Assign(self, node: ast.Assign) -> None:
        """The value comes first."""
        self.visit(node.value)
        for target in node.targets:
            self.visit(target)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        """Without the annotation."""
        if node.value is not None:
            self.visit(node.value)
        self.visit(node.target)

    def visit_Name(self, node: ast.Name) -> None:
        """One occurrence."""
        if node.id == "_":
            return
        if node.id in self._counters:
            if node.id not in self._counting or isinstance(node.ctx, ast.Store):
                self.stray.append(node)
            return
        variable = self.variables.setdefault(node.id, Variable())
        variable.places.append(self._place)
        variable.stores += isinstance(node.ctx, ast.Store)
        variable.loads += isinstance(node.ctx, ast.Load)

    def declared_before(self, statement: ast.stmt) -> Sequence[str]:
        """The names whose innermost common block has this as its first statement about them."""
        return self._declared.get(self.at[statement], ())


def stored_in(statement: ast.stmt) -> set[str]:
    """Names to which a plain assignment itself gives a value."""
    if isinstance(statement, ast.Assign):
        targets = statement.targets
    elif isinstance(statement, ast.AnnAssign):
        targets = [statement.target]
    else:
        return set()
    return {node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)
            and isinstance(node.ctx, ast.Store)}  # fmt: skip


def loaded_in(node: ast.AST) -> set[str]:
    """Names that are read somewhere inside."""
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Load)}


@functools.cache
def stored_names(function: ast.FunctionDef) -> frozenset[str]:
    """The variables that a function writes to, but for those that count a loop."""
    return frozenset(name for name, variable in Scopes(function.body).variables.items() if variable.stores)
