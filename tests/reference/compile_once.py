"""Numba's cache when several processes start with none: who comes second waits for the first and does not compile."""

import contextlib
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any


@contextlib.contextmanager
def compile_once(locks: Path) -> Iterator[None]:
    """While this is entered, a function with a cache on disk is compiled, or read, under its lock in this folder."""
    import fcntl

    from numba.core.dispatcher import Dispatcher

    compile_here = Dispatcher.compile

    def compile_locked(dispatcher: Any, signature: Any) -> Any:
        index = getattr(getattr(dispatcher._cache, "_cache_file", None), "_index_path", None)
        if index is None:  # inlined into another, which has a cache
            return compile_here(dispatcher, signature)
        with open(locks / f"{hashlib.sha256(index.encode()).hexdigest()[:16]}.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            return compile_here(dispatcher, signature)

    Dispatcher.compile = compile_locked
    try:
        yield
    finally:
        Dispatcher.compile = compile_here
