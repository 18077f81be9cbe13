"""The border to Numba and llvmlite, which declare no types: one name for each kind of thing that crosses it."""

from typing import Any

NumbaOptions = dict[str, Any]  # keywords of numba.njit, each of a type of its own
CompiledFunction = Any  # numba's Dispatcher, or the entry point that it made: called with its kernel's arguments
NumbaType = Any  # numba.core.types.Type: the kind of a value of compiled code
TypingContext = Any  # numba's, while it infers types
CodeContext = Any  # numba's, while it writes LLVM
Builder = Any  # llvmlite.ir.IRBuilder: adds one instruction after the other
LlvmValue = Any  # llvmlite.ir.Value: an instruction's result, an address, a type's constant
LlvmModule = Any  # llvmlite.ir.Module
Intrinsic = Any  # the result of ``numba.extending.intrinsic``, and the pair that such a function returns
