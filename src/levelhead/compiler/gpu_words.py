"""What a GPU's program says that a processor's does not."""

import importlib

from levelhead.compiler.borders import Cuda

cuda: Cuda = importlib.import_module("numba.cuda")


def _thread_number() -> int:
    number: int = cuda.grid(1)
    return number


thread_number = cuda.jit(device=True)(_thread_number)  # ``engine.thread_kernels.thread_number``
