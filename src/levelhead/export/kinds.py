"""The kinds of values in the kernel language, and their names in C."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from typing import TypeGuard


@dataclass(frozen=True)
class Scalar:
    """A number: "float", "int" or "bool"."""

    name: str


@dataclass(frozen=True)
class Array:
    """Numbers in an array of constant shape."""

    shape: tuple[int, ...]


@dataclass(eq=False)
class Struct:
    """A NamedTuple; a field of unknown kind is None, until the first value of it is made.

    Attributes:
        name: of the class.
        fields: name -> kind, in order.
        origin: the class; None for a plain tuple.
    """

    name: str
    fields: "dict[str, Kind | None]"
    origin: type | None = None


Kind = Scalar | Array | Struct
FLOAT, INT, BOOL = Scalar("float"), Scalar("int"), Scalar("bool")
NUMBERS = {float: FLOAT, int: INT, bool: BOOL}


C_WORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool
    class delete explicit export friend mutable namespace new operator private protected public template this throw try
    typename using virtual catch and or not xor
    arrays fabs fabsf floorf memset result sqrtf
"""
RESERVED = frozenset(C_WORDS.split())


def variable(name: str) -> str:
    """A variable's or field's name; C has words of its own."""
    return f"{name}_" if name in RESERVED else name


def is_struct(value: object) -> TypeGuard[type[tuple[object, ...]]]:
    """Whether it is a NamedTuple class."""
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields")


def count_numbers(kind: "Kind | None") -> int:
    """How many numbers a value holds by itself."""
    if isinstance(kind, Struct):
        return sum(count_numbers(part) for part in kind.fields.values())
    return 1


def is_empty(kind: "Kind | None") -> bool:
    """Whether it is a struct without any number in it, which C99 does not have: it is left out everywhere."""
    return isinstance(kind, Struct) and count_numbers(kind) == 0


def within(kind: "Kind | None") -> Iterator[Struct]:
    """The structs of which a kind is made, inner ones first."""
    if isinstance(kind, Struct):
        for part in kind.fields.values():
            yield from within(part)
        yield kind


@dataclass(frozen=True)
class Machine:
    """How large things are on a machine: bytes of a float, and the largest alignment."""

    name: str
    real: int
    alignment: int

    def size(self, kind: Kind | None) -> tuple[int, int]:
        """Bytes and alignment of a value, as C compilers lay it out."""
        if isinstance(kind, Struct):
            at, widest = 0, 1
            for part in kind.fields.values():
                if not is_empty(part):
                    size, alignment = self.size(part)
                    at = -(-at // alignment) * alignment + size
                    widest = max(widest, alignment)
            return -(-at // widest) * widest, widest
        if isinstance(kind, Array):
            return prod(kind.shape) * self.real, min(self.real, self.alignment)
        assert isinstance(kind, Scalar)
        size = {FLOAT: self.real, INT: 4, BOOL: 1}[kind]
        return size, min(size, self.alignment)
