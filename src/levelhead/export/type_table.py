"""The types of a program: which NamedTuples it uses, how they are called in C, and their definitions."""

import math
from collections.abc import Sequence
from typing import get_args, get_origin, get_type_hints

from levelhead.errors import LevelheadError
from levelhead.export.kinds import FLOAT, NUMBERS, Array, Kind, Struct, is_empty, is_struct, variable, within
from levelhead.export.layout import STEP, add_comment, comment, docstring, snake
from levelhead.export.source import field_remarks
from levelhead.filters.parameters import description
from levelhead.kernels.single import round_constant, shortest


class TypeTable:
    """All types, each once.

    Args:
        prefix: of the types that other files see.
        real: "double" or "float".

    Attributes:
        public: types that other files see, inner ones first.
        public_names: of types that other files see by another name than their own.
    """

    def __init__(self, prefix: str, real: str) -> None:
        self.prefix, self.real = prefix, real
        self.public: list[Struct] = []
        self.public_names: dict[Struct, str] = {}
        self._structs: dict[object, Struct] = {}

    def struct(self, cls: type) -> Struct:
        """The kind of a NamedTuple, by its annotations; a field that they leave open has that of its first value."""
        if cls not in self._structs:
            struct = self._structs[cls] = Struct(cls.__name__, {}, cls)
            hints = annotations(cls)
            for name in cls._fields:  # type: ignore[attr-defined]
                struct.fields[name] = self.annotated_kind(hints.get(name))
        return self._structs[cls]

    def structs(self) -> Sequence[Struct]:
        """All of them."""
        return list(self._structs.values())

    def annotated_kind(self, hint: object) -> Kind | None:
        """The kind that an annotation means; None for one that leaves it open."""
        if get_origin(hint) is not None and hasattr(hint, "__metadata__"):
            hint = get_args(hint)[0]
        if isinstance(hint, type) and hint in NUMBERS:
            return NUMBERS[hint]
        return self.struct(hint) if is_struct(hint) else None

    def kind_of(self, value: object) -> Kind | None:
        """The kind of a constant: a number or a NamedTuple of numbers; None for anything else."""
        if type(value) in NUMBERS:
            return NUMBERS[type(value)]
        return self.struct(type(value)) if is_struct(type(value)) else None

    def modules(self) -> set[str]:
        """The modules in which the types are defined."""
        return {struct.origin.__module__ for struct in self._structs.values() if struct.origin is not None}

    def struct_name(self, struct: Struct) -> str:
        """A type's name in this file."""
        twins = [other for other in self._structs.values() if other.name == struct.name]
        if len(twins) == 1 or struct.origin is None:
            return struct.name
        return "".join(word.title() for word in struct.origin.__module__.rpartition(".")[2].split("_")) + struct.name

    def public_name(self, struct: Struct) -> str:
        """A type's name in all files."""
        return f"{self.prefix}_{self.public_names.get(struct) or snake(self.struct_name(struct))}"

    def name(self, kind: Kind, public: bool = False) -> str:
        """A type as C names it."""
        if isinstance(kind, Struct):
            return self.public_name(kind) if public else self.struct_name(kind)
        if isinstance(kind, Array):
            return self.real
        return {"float": self.real, "int": "int32_t", "bool": "bool", "void": "void"}[kind.name]

    def publish(self, kind: Kind) -> None:
        """Makes a type and those inside it known to other files."""
        for struct in within(kind):
            if struct not in self.public and not is_empty(struct):
                self.public.append(struct)

    def definition(self, struct: Struct, remarks: dict[str, str] | None = None) -> list[str]:
        """A type as lines of C; ``remarks``: field -> comment, otherwise the comments in the source."""
        public, lines = struct in self.public, []
        if struct.origin is not None and struct.origin.__doc__:
            lines = comment(docstring(description(struct.origin) or struct.origin.__doc__))
        if remarks is None:
            remarks = field_remarks(struct.origin) if struct.origin else {}
        lines.append("typedef struct {")
        for name, kind in struct.fields.items():
            if kind is None:
                raise LevelheadError(f"the kind of {struct.name}.{name} is unknown: no kernel makes a value of it")
            if not is_empty(kind):
                code = f"{STEP}{self.name(kind, public)} {declarator(kind, variable(name))};"
                lines += add_comment([code], remarks.get(name, ""))
        return [*lines, f"}} {self.public_name(struct) if public else self.struct_name(struct)};", ""]

    def number(self, value: float) -> str:
        """A float as a literal.

        Raises:
            OverflowError: it is not finite, or out of the range of single precision.
        """
        if not math.isfinite(value):
            raise OverflowError(f"{value} is not a number that C99 can write")
        return decimal(value) if self.real == "double" else f"{decimal(shortest(round_constant(value)))}f"

    def literal(self, value: object, kind: Kind) -> str:
        """A constant as an initialiser.

        Raises:
            OverflowError: as ``number``.
        """
        if isinstance(kind, Struct):
            assert isinstance(value, tuple)
            parts = zip(value, kind.fields.values(), strict=True)
            return "{" + ", ".join(self.literal(part, inner or FLOAT) for part, inner in parts) + "}"
        assert isinstance(value, int | float)
        if isinstance(value, bool):
            return str(value).lower()
        return self.number(float(value)) if kind is FLOAT else str(value)


def declarator(kind: Kind, name: str) -> str:
    """A name as it is declared."""
    return name + "".join(f"[{size}]" for size in kind.shape) if isinstance(kind, Array) else name


def decimal(value: float) -> str:
    """A float as people write it: 1e9, not 1000000000.0.

    >>> decimal(1e9), decimal(0.1), decimal(12582912.0)
    ('1e9', '0.1', '12582912.0')
    """
    short = f"{value:g}".replace("e+0", "e").replace("e+", "e")
    return short if abs(value) >= 1e6 and float(short) == value else repr(value)


def annotations(thing: object) -> dict[str, object]:
    """Annotations of a class or function, each for itself: one that cannot be read leaves the others as they are."""
    try:
        return get_type_hints(thing, include_extras=True)
    except NameError:
        return {name: hint for name, hint in getattr(thing, "__annotations__", {}).items() if not isinstance(hint, str)}
