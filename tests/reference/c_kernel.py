"""A few kernels of a test's own as C, to be called with numbers."""

import ctypes
import subprocess
import tempfile
from pathlib import Path

from tests.reference.c_engine import KEPT, WARNINGS

from levelhead.export.helpers import helper_functions
from levelhead.export.kinds import FLOAT, INT, Struct
from levelhead.export.program import Program

NAMES = {FLOAT: ctypes.c_double, INT: ctypes.c_int32}


def translated(function, *kinds, real="double"):
    """The program around one kernel, and its text; a kind may also be a NamedTuple class."""
    program = Program("lh_test", real)
    kernel = program.kernel(
        function, [program.types.struct(kind) if isinstance(kind, type) else kind for kind in kinds]
    )
    kernels = [line for _, lines in program.sections() for line in lines]
    constants = program.constants.lines()
    types = [line for struct in program.private_types() for line in program.types.definition(struct)]
    helpers = helper_functions("\n".join(kernels), real)
    arrays = program.arrays_definition()
    head = ["#include <math.h>", "#include <stdbool.h>", "#include <stdint.h>", "#include <string.h>"]
    return program, kernel, "\n".join([*head, *types, *arrays, *constants, *helpers, *kernels])


def called(function, kinds, real="double"):
    """A Python function that runs a kernel of numbers in C; a struct comes back as a tuple of its numbers."""
    program, kernel, text = translated(function, *kinds, real=real)
    plain = list(kernel.parameters)
    returns = kernel.returns
    storage = "static lh_test_arrays arrays; " if program.makes_arrays(function) else ""
    arguments = ", ".join([*(["&arrays"] if storage else []), *plain])
    declared = ", ".join(f"{program.types.name(kind)} {name}" for name, kind in kernel.parameters.items())
    if isinstance(returns, Struct):
        values = "; ".join(f"out[{i}] = (double)v.{name}" for i, name in enumerate(returns.fields))
        body = f"const {program.types.struct_name(returns)} v = {kernel.name}({arguments}); {values};"
    else:
        body = f"out[0] = (double){kernel.name}({arguments});"
    head = f"void call(double *out, {declared})"
    text += f"\n{head};\n{head}\n{{\n    {storage}{body}\n}}\n"
    folder = Path(tempfile.mkdtemp(dir=KEPT.name))
    (folder / "kernel.c").write_text(text, encoding="utf-8")
    command = ["gcc", *WARNINGS, "-Werror", "-O2", "-shared", "-fPIC", "-o", "kernel.so", "kernel.c", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and not done.stderr, done.stderr + text
    library = ctypes.CDLL(str(folder / "kernel.so"))

    def run(*values):
        out = (ctypes.c_double * 64)()
        library.call(out, *(NAMES[kind](value) for kind, value in zip(kernel.parameters.values(), values, strict=True)))
        count = len(returns.fields) if isinstance(returns, Struct) else 1
        return tuple(out[:count]) if isinstance(returns, Struct) else out[0]

    return run
