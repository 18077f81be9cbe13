"""The native engine: the filters of the house as C, generated from their kernels and compiled with the package.

A filter is an object of the extension with its own memory. Parameters and state go in and out as bytes, eight for each
number in order, as in ``Stream.save``. The extension holds for each filter the files from which it was generated, and
their digest: where a file has changed since, another engine takes the filter's place.
"""

import functools
import hashlib
import struct
import threading
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from levelhead import filters
from levelhead.compiler.mark import KernelFunction
from levelhead.compiler.tree import Tree, leaves, rebuild
from levelhead.engine.binding import is_guarded
from levelhead.filters.contract import Filter
from levelhead.filters.parameters import Params
from levelhead.recording import Array

PACKAGE = Path(__file__).resolve().parent.parent
KINDS = ("IMU_FILTERS", "AXIS_FILTERS", "SMOOTHERS")  # contents of the extension, by name


def native_name(flt: Filter, guarded: bool) -> str:
    """A filter's name in the extension."""
    return flt.name if guarded or not is_guarded(flt) else f"{flt.name}_unguarded"


def digest(files: Iterable[str]) -> str:
    """Sixteen hexadecimal digits of the text of files of the package."""
    found = hashlib.sha256()
    for name in files:
        found.update(_file_digest(name))
    return found.hexdigest()[:16]


@functools.cache
def _file_digest(name: str) -> bytes:
    try:
        return hashlib.sha256((PACKAGE / name).read_bytes()).digest()
    except FileNotFoundError:  # renamed since the extension was built
        return b""


@functools.cache
def extension() -> ModuleType | None:
    """The compiled module, or None where the package was built without a C compiler."""
    try:
        from levelhead.engine import _native
    except ImportError:
        return None
    return _native


SHIPPED = filters.ALL  # before anybody adds one of his own


class NativeFilter(NamedTuple):
    """The extension's facts of a filter."""

    files: str  # it was generated from
    digest: str
    params: struct.Struct  # how parameters, or the driver's settings, lie in bytes
    state: struct.Struct


@functools.cache
def _load_filter(name: str, kind: str) -> NativeFilter | None:
    """A filter of the extension, if it was generated from the files as they are."""
    module = extension()
    found = None if module is None else getattr(module, kind, {}).get(name)
    if found is None:
        return None
    flt = NativeFilter(files=found[0], digest=found[1], params=struct.Struct(found[2]), state=struct.Struct(found[3]))
    try:
        if digest(flt.files.split(",")) != flt.digest:
            with _WARNING:
                _warn_stale()
            return None
    except OSError:  # installed without sources: nothing that could have changed
        pass
    return flt


def up_to_date() -> bool:
    """Whether all filters of the extension were generated from the files as they are."""
    module = extension()
    if module is None:
        return False
    made = [entry for kind in KINDS for entry in getattr(module, kind, {}).values()]
    return hasattr(module, KINDS[-1]) and all(digest(files.split(",")) == digits for files, digits, *_ in made)


_WARNING = threading.Lock()  # a cache alone repeats the warning in each thread that comes before the first has ended


@functools.cache
def _warn_stale() -> None:
    import logging

    logging.getLogger("levelhead").warning(
        "sources have changed since the native engine was built; Numba or Python replaces it until `make native`"
    )


def _find_filter(flt: Filter, name: str, kind: str) -> NativeFilter | None:
    return _load_filter(name, kind) if any(flt is one for one in SHIPPED) else None


def has_imu(flt: Filter, guarded: bool) -> bool:
    """Whether there is a native engine for a filter on an IMU."""
    return _find_filter(flt, native_name(flt, guarded), "IMU_FILTERS") is not None


def has_axis(flt: Filter) -> bool:
    """Whether there is one for it on one axis."""
    return _find_filter(flt, flt.name, "AXIS_FILTERS") is not None


class FilterMemory:
    """A filter in the extension's memory, with the words of its parameters and state."""

    def __init__(self, flt: Filter, guarded: bool | None, params: Params, state: Tree) -> None:
        """``guarded`` None: the filter on one axis."""
        module, name = extension(), flt.name if guarded is None else native_name(flt, guarded)
        made = _load_filter(name, "AXIS_FILTERS" if guarded is None else "IMU_FILTERS")
        assert module is not None and made is not None
        self._layout, self._example = made, state
        packed = self._pack(made.params, params), self._pack(made.state, state)
        self.filter = module.Axis(name, *packed) if guarded is None else module.Imu(name, *packed)

    @staticmethod
    def _pack(words: struct.Struct, value: Tree) -> bytes:
        return words.pack(*leaves(value))

    @property
    def words(self) -> bytes:
        """The whole state as the filter has it."""
        found: bytes = self.filter.state()
        return found

    @words.setter
    def words(self, value: bytes) -> None:
        self.filter.set_state(value)

    @property
    def state(self) -> Tree:
        """The whole state."""
        return rebuild(self._example, iter(self._layout.state.unpack(self.words)))

    @state.setter
    def state(self, value: Tree) -> None:
        self.words = self._pack(self._layout.state, value)

    def set_params(self, value: Tree) -> None:
        """Other parameters from now on."""
        self.filter.set_params(self._pack(self._layout.params, value))


def smoother_name(flt: Filter, aided: bool) -> str:
    """A smoother's name in the extension; that of its forward run begins so."""
    return f"{flt.name}_aided" if aided else flt.name


def has_smoother(flt: Filter, guarded: bool, aided: bool) -> bool:
    """Whether there is a native smoother of a filter, with position, velocity and height or without."""
    name = smoother_name(flt, aided)
    ahead = native_name(flt._replace(name=f"{name}_forward"), guarded)
    return all(_find_filter(flt, *one) is not None for one in ((ahead, "IMU_FILTERS"), (name, "SMOOTHERS")))


class NativeSmoother:
    """A filter's run forward that keeps blocks, and the way back through them."""

    def __init__(self, name: str, ahead: Filter, guarded: bool, settings: Params, begin: Tree) -> None:
        """``name``: of ``smoother_name``; ``ahead``: the filter of the forward run, which begins so."""
        self._name, self._machine = name, FilterMemory(ahead, guarded, settings, begin)

    def pack(self, carry: Tree) -> bytes:
        """A Carry as ``forward`` takes it."""
        self._machine.state = carry
        return self._machine.words

    def unpack(self, carry: bytes) -> Tree:
        """The result of ``forward`` as a Carry."""
        self._machine.words = carry
        return self._machine.state

    def forward(self, carry: bytes, *arrays: object) -> tuple[bytes, int, int]:
        """``smoother_kernels.forward_stretch``, or with more arrays ``forward_stretch_with_aiding``."""
        self._machine.words = carry
        count, stop = self._machine.filter.forward(*arrays)
        return self._machine.words, count, stop

    def correct(self, t: Array, numbers: Array, end: Array, count: int, stop: int, *arrays: object) -> None:
        """``smoother_kernels.correct_stretch``, or with more arrays ``correct_stretch_with_nav``."""
        module = extension()
        assert module is not None
        module.correct_stretch(self._name, count, stop, t, numbers, end, *arrays)


def axis_run(flt: Filter) -> KernelFunction:
    """``axis_driver.run_axis`` of a filter, over arrays."""

    def run(params: Params, state: Tree, t: Array, level: Array, rate: Array, period: float, out: Array) -> Tree:
        machine = FilterMemory(flt, None, params, state)
        machine.filter.run(t, level, rate, period, out)
        return machine.state

    return run
