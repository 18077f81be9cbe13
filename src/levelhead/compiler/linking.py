"""Numba's pipeline for a kernel that other kernels call: code for them to link, and no machine code of its own.

Numba optimises each function and makes machine code of it before a caller links it, and optimises the outermost
function again, with all its calls. The machine code of the calls has no use. Their optimisation has one in a loop over
lanes: LLVM makes SIMD of a loop without branches, and those of its calls become selections before they are linked.
"""

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from levelhead.compiler.borders import CodeContext, NumbaOptions, TypingContext


class _NoEnvironment:
    """The place of a function's globals as Python objects; a kernel has none."""

    def set_env(self, name: str, env: object) -> None:
        """Numba's interface."""


class OptimizedLibrary(JITCodeLibrary):
    """Code of a kernel and of its calls, optimised, for a caller to link."""

    codegen = _NoEnvironment()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Null: Python calls none of them."""
        self._ensure_finalized()  # type: ignore[no-untyped-call]
        return 0


class PlainLibrary(OptimizedLibrary):
    """The same, optimised only where the kernel calls no other: a deep caller would repeat the work for each level."""

    def _optimize_final_module(self) -> None:
        if not self._linking_libraries:
            super()._optimize_final_module()  # type: ignore[no-untyped-call]


class LinkedCompiler(Compiler):
    """Numba's usual passes, into a ``PlainLibrary``."""

    library: type[OptimizedLibrary] = PlainLibrary

    def __init__(self, typing: TypingContext, target: CodeContext, _: None, *rest: NumbaOptions) -> None:
        library = self.library(target.codegen(), "linked")
        super().__init__(typing, target, library, *rest)  # type: ignore[no-untyped-call]


class LaneCompiler(LinkedCompiler):
    """Numba's usual passes, into an ``OptimizedLibrary``."""

    library = OptimizedLibrary
