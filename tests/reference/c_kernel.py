"""A few kernels of a test's own as C, to be called with numbers."""

import ctypes
import subprocess
import tempfile
from pathlib import Path

from tests.reference.c_engine import KEPT, WARNINGS

from levelhead.export.flat_program import FlatProgram, Root
from levelhead.export.graph import FLOAT, INT, Operand, Record
from levelhead.export.helpers import helper_functions
from levelhead.export.kinds import is_struct
from levelhead.export.type_table import annotations

NAMES = {FLOAT: ctypes.c_double, INT: ctypes.c_int32}


def value_of(kind):
    """A value of a kind: a NamedTuple class, or a kind of number."""
    if is_struct(kind):
        hints = annotations(kind)
        return Record(kind, tuple(value_of(FLOAT if hints[name] is float else hints[name]) for name in kind._fields))
    return Operand("const", (), kind, 0)


def translated(function, *kinds, real="double"):
    """The program around one kernel, and its text; a kind may also be a NamedTuple class."""
    program = FlatProgram("lh_test", real, [Root("call", function, [value_of(kind) for kind in kinds])])
    kernels = [line for _, lines in program.sections() for line in lines]
    constants = program.constants.lines()
    types = [line for struct in program.private_types() for line in program.types.definition(struct)]
    helpers = helper_functions("\n".join(kernels), real)
    head = ["#include <math.h>", "#include <stdbool.h>", "#include <stdint.h>", "#define LH_CALLED", "#define LH_RARE"]
    return program, program.procedures["call"], "\n".join([*head, *types, *constants, *helpers, *kernels])


def called(function, kinds, real="double"):
    """A Python function that runs a kernel of numbers in C; a struct comes back as a tuple of its numbers."""
    program, procedure, text = translated(function, *kinds, real=real)
    given = list(function.__code__.co_varnames[: function.__code__.co_argcount])
    live = [node.content for node in procedure.arguments if node in program.live.nodes]
    declared = ", ".join(f"{program.writer.kind(kind)} {name}" for name, kind in zip(given, kinds, strict=True))
    call = f"{procedure.name}({', '.join(live)})"
    members = program.writer.result_members(procedure) if len(procedure.returned) > 1 else None
    if members:
        values = "; ".join(f"out[{i}] = (double)v.{name}" for i, name in members.items())
        body = f"const {program.writer.result_type(procedure)} v = {call}; {values};"
    else:
        body = f"out[0] = (double){call};"
    head = f"void call(double *out, {declared})"
    unused = "".join(f"(void){name}; " for name in given)
    text += f"\n{head};\n{head}\n{{\n    {unused}{body}\n}}\n"
    folder = Path(tempfile.mkdtemp(dir=KEPT.name))
    (folder / "kernel.c").write_text(text, encoding="utf-8")
    command = ["gcc", *WARNINGS, "-Werror", "-O2", "-shared", "-fPIC", "-o", "kernel.so", "kernel.c", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and not done.stderr, done.stderr + text
    library = ctypes.CDLL(str(folder / "kernel.so"))

    def run(*values):
        out = (ctypes.c_double * 64)()
        library.call(out, *(NAMES[kind](value) for kind, value in zip(kinds, values, strict=True)))
        return tuple(out[: len(members)]) if members else out[0]

    return run
