"""Kernels stay inside the language that can be translated to C; what is outside is named with file and line."""

import ast
import inspect
import textwrap

import pytest

from levelhead import filters
from levelhead.compiler import mark
from levelhead.engine import conditioning
from levelhead.engine.binding import bind, bind_axis
from levelhead.kernels import mat2, mat3, quat, tilt, triad

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
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            value = function.__globals__.get(node.func.id, getattr(__import__("builtins"), node.func.id, None))
            if getattr(value, "__module__", None) == "math" and node.func.id not in MATH:
                yield f"{line}: math.{node.func.id}"


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
def test_filters_and_everything_they_call(flt):
    functions = mark.reached(bind(flt).run)
    assert len(functions) > 5 and conditioning.missing in functions
    assert [line for function in functions for line in offences(function)] == []
    if flt.axis:
        assert [line for function in mark.reached(bind_axis(flt).run) for line in offences(function)] == []


@pytest.mark.parametrize("module", [mat2, mat3, quat, tilt, triad], ids=lambda m: m.__name__)
def test_kernels(module):
    kernels = [value for value in vars(module).values() if mark.is_kernel(value)]
    assert len(kernels) > 5
    assert [line for function in kernels for line in offences(function)] == []


def test_offences_are_found():
    @mark.kernel
    def bad(x):
        return [y**2 for y in range(x)]

    @mark.kernel
    def worded(x):
        """A docstring is no offence."""
        return x if "true" else 0.0

    found = list(offences(bad))
    assert any("ListComp" in line for line in found) and any("Pow" in line for line in found)
    (line,) = offences(worded)
    assert line.endswith(": a string")
