"""Fixed-size memory inside a filter's state: what is too large for a NamedTuple of numbers.

A kernel sees a row of floats that it reads and writes by a whole number. In plain Python it is a list, which is indexed
several times faster than a NumPy array; compiled it is an array of float64; in C it becomes a member of a struct. It
is made once, by a filter's ``init``, and written in place by ``step``.

What is marked as native has a compiled twin of the same name, by hand, in ``kernels/native.py``.
"""

from levelhead.kernels.jit import kernel

Floats = list[float]


@kernel
def zeros(count: int) -> Floats:
    """``count`` zeros."""
    return [0.0] * count


zeros.__memory__ = True  # type: ignore[attr-defined]
zeros.__native__ = True  # type: ignore[attr-defined]


@kernel
def copy(m: Floats, to: int, at: int, count: int) -> None:
    """Puts the ``count`` numbers at ``at`` to ``to``; the two must not overlap."""
    for j in range(count):
        m[to + j] = m[at + j]


copy.__native__ = True  # type: ignore[attr-defined]


@kernel
def add_scaled(m: Floats, to: int, weight: float, at: int, count: int) -> None:
    """Adds ``weight`` times the ``count`` numbers at ``at`` to those at ``to``; the two must not overlap."""
    for j in range(count):
        m[to + j] += weight * m[at + j]


add_scaled.__native__ = True  # type: ignore[attr-defined]
