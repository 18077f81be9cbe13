"""A kernel as it was written: its syntax tree, each line's number, and the comments, which a parser throws away."""

import ast
import functools
import inspect
import io
import sys
import textwrap
import tokenize
import types
from collections.abc import Iterator
from dataclasses import dataclass

from levelhead.compiler.mark import KernelFunction
from levelhead.errors import LevelheadError

REMARKS = ("fmt:", "noqa", "type:", "ruff:")  # comments for tools, not for readers
PYTHON = "plain Python"  # its comments are of no use in C


def comments(text: str) -> dict[int, str]:
    """Line number -> the comment on it."""
    found = {}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        words = token.string.lstrip("# ").rstrip()
        if token.type == tokenize.COMMENT and not words.startswith(REMARKS) and PYTHON not in words:
            found[token.start[0]] = words.split("  # ")[0]
    return found


@dataclass(frozen=True, eq=False)
class Source:
    """One kernel's source.

    Attributes:
        function: the kernel.
        tree: its definition, with statements that can never run left out.
        comments: line of the tree -> comment.
        first: number in the file of the tree's first line.
    """

    function: KernelFunction
    tree: ast.FunctionDef
    comments: dict[int, str]
    first: int
    text: str

    def refuse(self, node: ast.AST, what: str) -> LevelheadError:
        """The error for code outside of the language, with file and line."""
        line = self.first + getattr(node, "lineno", 1) - 1
        return LevelheadError(f"{self.function.__code__.co_filename}:{line}: {what}")


@functools.cache
def read_source(function: KernelFunction) -> Source:
    """The source of a kernel.

    Raises:
        LevelheadError: there is none, as for code typed into a Python prompt.
    """
    try:
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError):
        raise LevelheadError(
            f"the source of the kernel {function.__qualname__} is not there to be translated"
        ) from None
    text = textwrap.dedent("".join(lines))
    tree = ast.parse(text).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise LevelheadError(f"{function.__code__.co_filename}:{first}: a kernel is a function")
    return Source(function, _BranchPruner(function).visit(tree), comments(text), first, text)


def constant(function: KernelFunction, test: ast.expr) -> bool | None:
    """The value of a condition that is decided before the kernel runs, as by ``hooks.OWN_SIGMA``; None if it is not."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        inner = constant(function, test.operand)
        return None if inner is None else not inner
    if isinstance(test, ast.Name) and test.id not in function.__code__.co_varnames:
        value = function.__globals__.get(test.id)
        return value if isinstance(value, bool) else None
    if isinstance(test, ast.Attribute) and isinstance(test.value, ast.Name):
        owner = function.__globals__.get(test.value.id)
        value = vars(owner).get(test.attr) if isinstance(owner, types.ModuleType) else None
        return value if isinstance(value, bool) else None
    return None


class _BranchPruner(ast.NodeTransformer):
    """Leaves out the code that a constant condition excludes."""

    def __init__(self, function: KernelFunction) -> None:
        self._function = function

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """The value that is taken, where that is known."""
        self.generic_visit(node)
        taken = constant(self._function, node.test)
        if taken is None:
            return node
        return node.body if taken else node.orelse

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        """The branch that is taken, where that is known."""
        self.generic_visit(node)
        taken = constant(self._function, node.test)
        if taken is None:
            return node
        return node.body if taken else node.orelse


@functools.cache
def _module(name: str) -> tuple[ast.Module, dict[int, str]]:
    text = inspect.getsource(sys.modules[name])
    return ast.parse(text), comments(text)


@functools.cache
def home(module: str, name: str) -> tuple[str, str]:
    """Where a module's global is defined: module and name there."""
    if not module.startswith("levelhead") and module not in sys.modules:
        return module, name
    try:
        tree, _ = _module(module)
    except (OSError, TypeError):  # built in, such as math
        return module, name
    for statement in tree.body:
        if isinstance(statement, ast.ImportFrom) and statement.module:
            for alias in statement.names:
                if (alias.asname or alias.name) == name:
                    return home(statement.module, alias.name)
    return module, name


def _assignments(module: str, name: str) -> Iterator[ast.Assign]:
    try:
        tree, _ = _module(module)
    except (OSError, TypeError):  # built in
        return
    for statement in tree.body:
        if isinstance(statement, ast.Assign):
            inside = [node for target in statement.targets for node in ast.walk(target)]
            if any(isinstance(node, ast.Name) and node.id == name for node in inside):
                yield statement


def place(module: str, name: str) -> int:
    """The line at which a module's constant is defined."""
    return next((statement.lineno for statement in _assignments(module, name)), 0)


@functools.cache
def remark(module: str, name: str) -> str:
    """The origin of a module's constant: its expression, if that shows more than the number, and its comment."""
    for statement in _assignments(module, name):
        said = _module(module)[1].get(statement.end_lineno or statement.lineno, "")
        if isinstance(statement.value, ast.Constant | ast.UnaryOp | ast.Call | ast.Tuple):
            return said
        segment = ast.get_source_segment(inspect.getsource(sys.modules[module]), statement.value)
        return (segment or "") + (said and f": {said}")
    return ""


def position(function: KernelFunction) -> int:
    """The line of a kernel in its file."""
    return function.__code__.co_firstlineno


def field_remarks(cls: type) -> dict[str, str]:
    """Field -> the comment behind or, if there is none behind, above it in the class."""
    try:
        text = textwrap.dedent(inspect.getsource(cls))
    except (OSError, TypeError):
        return {}
    words = comments(text)
    definition = ast.parse(text).body[0]
    fields = [node for node in ast.walk(definition) if isinstance(node, ast.AnnAssign)]
    return {
        node.target.id: words[node.end_lineno or node.lineno]
        for node in fields
        if isinstance(node.target, ast.Name) and (node.end_lineno or node.lineno) in words
    }
