"""Fixed-size memory inside a filter's state: rows that are too large for a NamedTuple of numbers.

A kernel sees a row of floats that it reads and writes by a whole number. In plain Python it is a list, which is indexed
several times faster than a NumPy array; compiled it is an array of float64; in C it becomes a member of a struct. It
is made once, by a filter's ``init``, and written in place by ``step``.

Its words are written once for each engine: plain Python runs these, compiled code the functions of the same name in
``compiler/intrinsics.py``, and C is translated from the loop that defines a word.
"""

from levelhead.compiler.mark import kernel, primitive

Floats = list[float]


@kernel
def zeros(count: int) -> Floats:
    """``count`` zeros."""
    return [0.0] * count


zeros.__memory__ = True  # type: ignore[attr-defined]
zeros.__native__ = True  # type: ignore[attr-defined]


@kernel
def copy_each(m: Floats, to: int, at: int, count: int) -> None:
    """Puts the ``count`` numbers at ``at`` to ``to``; the two must not overlap."""
    for j in range(count):
        m[to + j] = m[at + j]


@kernel
def add_each_scaled(m: Floats, to: int, weight: float, at: int, count: int) -> None:
    """Adds ``weight`` times the ``count`` numbers at ``at`` to those at ``to``; the two must not overlap."""
    for j in range(count):
        m[to + j] += weight * m[at + j]


@kernel
def subtract_each_row(
    m: Floats, to: int, weight: int, step: int, row: int, stride: int, count: int, width: int
) -> None:
    """Subtracts ``count`` weighted rows of ``width`` numbers from the one at ``to``; none of them may overlap it.

    Rows stand ``stride`` apart from ``row`` on, their weights ``step`` apart from ``weight`` on. Vector
    registers hold up to 32 numbers of a row at once.
    """
    for k in range(count):
        one = m[weight + k * step]  # C could not tell that the loop leaves it alone
        for j in range(width):
            m[to + j] -= one * m[row + k * stride + j]


@primitive(copy_each)
def copy(m: Floats, to: int, at: int, count: int) -> None:
    """``copy_each``."""
    m[to : to + count] = m[at : at + count]


@primitive(add_each_scaled)
def add_scaled(m: Floats, to: int, weight: float, at: int, count: int) -> None:
    """``add_each_scaled``."""
    m[to : to + count] = [a + weight * b for a, b in zip(m[to : to + count], m[at : at + count], strict=True)]


@primitive(subtract_each_row)
def subtract_rows(m: Floats, to: int, weight: int, step: int, row: int, stride: int, count: int, width: int) -> None:
    """``subtract_each_row``."""
    for k in range(count):
        add_scaled(m, to, -m[weight + k * step], row + k * stride, width)
