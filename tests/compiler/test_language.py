"""Kernels stay inside the language that can be translated to C; what is outside is named with file and line."""

import ast
import importlib
import inspect
import textwrap
from pathlib import Path

import pytest

import levelhead
from levelhead import filters
from levelhead.compiler import mark
from levelhead.compiler.hooks import Namespace
from levelhead.engine import conditioning, lane_kernels, smoother_kernels, stepper
from levelhead.engine.binding import bind, bind_axis

STATEMENTS = "FunctionDef arguments arg Return Assign AugAssign AnnAssign If For Expr"
EXPRESSIONS = "Call Attribute Name Constant BinOp UnaryOp BoolOp Compare IfExp Subscript Tuple keyword Load Store"
OPERATORS = "Add Sub Mult Div BitOr BitAnd USub Not And Or Eq NotEq Lt LtE Gt GtE"
LANGUAGE = {"Module", *STATEMENTS.split(), *EXPRESSIONS.split(), *OPERATORS.split()}
MATH = {"sqrt", "floor"}  # what IEEE 754 rounds, or what is exact: no libm


def offences(function):
    """Constructs outside of the kernel language, as "file:line: what"."""
    if hasattr(function, "__memory__"):
        return  # a word of the language itself, written once for each of its engines
    function = getattr(function, "__meaning__", function)
    lines, first = inspect.getsourcelines(function)
    tree = ast.parse(textwrap.dedent("".join(lines)))
    where = function.__code__.co_filename
    definition = tree.body[0]
    definition.decorator_list, definition.returns = [], None
    if ast.get_docstring(definition) is not None:
        definition.body = definition.body[1:]
    for argument in definition.args.args:
        argument.annotation = None
    for node in ast.walk(tree):
        line = f"{where}:{first + getattr(node, 'lineno', 1) - 1}"
        if type(node).__name__ not in LANGUAGE:
            yield f"{line}: {type(node).__name__}"
        if isinstance(node, ast.For) and not (isinstance(node.iter, ast.Call) and node.iter.func.id == "range"):
            yield f"{line}: a loop over something else than range"
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield f"{line}: a string"
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Tuple):
            yield f"{line}: an index of two numbers"
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            value = function.__globals__.get(node.func.id, getattr(__import__("builtins"), node.func.id, None))
            if getattr(value, "__module__", None) == "math" and node.func.id not in MATH:
                yield f"{line}: math.{node.func.id}"


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
def test_filters_and_everything_they_call(flt):
    functions = mark.list_reachable(bind(flt).run)
    assert len(functions) > 5 and conditioning.missing_bits in functions
    assert [line for function in functions for line in offences(function)] == []
    if flt.axis:
        assert [line for function in mark.list_reachable(bind_axis(flt).run) for line in offences(function)] == []


PACKAGE = Path(levelhead.__file__).parent
MARKED = [  # modules with kernels
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted(PACKAGE.rglob("*.py"))
    if "levelhead.compiler.mark import" in path.read_text(encoding="utf-8") and path.parent.name != "compiler"
]
ADDRESSES = {  # hooks that take the address of memory, which the kernel language has no word for
    lane_kernels.LaneHooks,
    lane_kernels.OutputHooks,
    lane_kernels.ObserverHooks,
    lane_kernels.SinkHooks,
    stepper.MemoryHooks,
}


def defined(module):
    """Functions that a module defines, those of its classes too."""
    for value in vars(module).values():
        members = vars(value).values() if isinstance(value, type) and value.__module__ == module.__name__ else [value]
        for member in members:
            function = getattr(member, "__func__", member)
            if inspect.isfunction(function) and function.__module__ == module.__name__:
                yield function


def compiled_only(value):
    return mark.is_compilable(value) and not mark.is_kernel(value)


def reasons(function):
    """Why a function cannot be a kernel."""
    yield from offences(function)
    for name in mark.global_names(function):
        value = function.__globals__.get(name)
        if isinstance(value, Namespace) and value._record in ADDRESSES:
            yield f"{name} takes addresses"
    yield from (f"calls {name}" for name, value in mark.list_mentions(function) if compiled_only(value))


@pytest.mark.parametrize("name", MARKED)
def test_every_kernel_of_the_package_obeys_the_language(name):
    kernels = [function for function in defined(importlib.import_module(name)) if mark.is_kernel(function)]
    assert [line for function in kernels for line in offences(function)] == []
    called = [(kernel.__qualname__, *mentioned) for kernel in kernels for mentioned in mark.list_mentions(kernel)]
    assert [(kernel, other) for kernel, other, value in called if compiled_only(value)] == []


@pytest.mark.parametrize("name", MARKED)
def test_what_is_compiled_only_could_not_be_a_kernel(name):
    functions = [function for function in defined(importlib.import_module(name)) if compiled_only(function)]
    assert [function.__qualname__ for function in functions if not list(reasons(function))] == []


def test_the_walk_finds_kernels_and_what_is_compiled_only():
    assert len(MARKED) > 30
    assert {"levelhead.kernels.quat", "levelhead.filters.eskf.rts", "levelhead.tune.lane_score"} <= set(MARKED)
    assert sum(map(compiled_only, defined(lane_kernels))) > 10
    assert any("While" in reason for reason in reasons(smoother_kernels.forward_stretch))
    assert any("While" in reason for reason in reasons(smoother_kernels.spread_blocks))
    assert list(reasons(stepper.report)) == ["memory takes addresses"]


def test_offences_are_found():
    @mark.kernel
    def bad(x):
        return [y**2 for y in range(x)]

    @mark.kernel
    def worded(x):
        """A docstring is no offence."""
        return x if "true" else 0.0

    @mark.compiled_only
    def plain(x):
        return x + 1.0

    assert list(reasons(plain)) == []
    found = list(offences(bad))
    assert any("ListComp" in line for line in found) and any("Pow" in line for line in found)
    (line,) = offences(worded)
    assert line.endswith(": a string")
