"""From kernels to machine code: the mark of a kernel, its compilation, and the cache.

``mark`` is all that kernels and filters import. Numba and LLVM stand behind this room's wall and nowhere else.
"""
