"""From kernels to machine code: what marks a kernel, what compiles it, what keeps the result.

``mark`` is all that kernels and filters import. Numba and LLVM stand behind this room's wall and nowhere else.
"""
