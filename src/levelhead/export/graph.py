"""Kernels as a graph of single operations: built by ``tracing``, pruned by ``liveness``, written by ``flat_c``.

A value is an ``Operand`` (one number, or an array) or a ``Record`` (a NamedTuple of values). ``Items`` compute
operands: the body of a procedure, one arm of a ``Branch``, or the body of a ``Loop``. Numbers that last from sample to
sample lie at a ``Place``, a member of a struct in C; between two changes of it, a place has one ``load`` node. An
array is written in place: each ``element`` is loaded from its place among the items, each ``Put`` changes one.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import Vec3
from levelhead.open_types import Untyped

FLOAT, INT, BOOL, ARRAY = "float", "int", "bool", "array"


class RecordField(NamedTuple):
    """A field of a NamedTuple class."""

    owner: type
    name: str


class Place(NamedTuple):
    """Where a number lies: the pointer or local struct that is its root, and the way down from there."""

    root: str
    members: tuple[RecordField, ...]

    @property
    def field(self) -> tuple[RecordField, ...]:
        """The meaning of a number: its field; with the field of its vector, where it is a part of one."""
        vector = len(self.members) > 1 and self.members[-1].owner in (Vec3, Quat)
        return self.members[-2:] if vector else self.members[-1:]

    def member(self, owner: type, name: str) -> "Place":
        """A member of the content."""
        return Place(self.root, (*self.members, RecordField(owner, name)))


@dataclass(eq=False)
class Operand:
    """One number, or an array.

    Attributes:
        op: "const", "named" (a constant of a module), "argument", "load", "phi" (of a branch), "carried" (from turn to
            turn of a loop), "counter" (of a loop), "result" (of a call), "memory" (an array at a place), "local" (an
            array of the procedure), "row" and "element" (of an array), or an operation.
        arguments: of an operation; the array and the indices of an element; the value of a carried number before the
            first turn, and after each.
        kind: "float", "int", "bool" or "array".
        content: value of a constant; name of an argument; place and version of a load; branch of a phi; loop of a
            carried number; call and number of a result; place of a memory.
        shape: of an array.
        block: where it is computed; None for a number that is not computed.
        hint: the variable of the kernel that holds it.
        origin: the kernel that computes it, or that has the constant.
        after: the item of the block behind which a load has the content of its place; None: its beginning.
    """

    op: str
    arguments: tuple["Operand", ...]
    kind: str
    content: Untyped = None
    block: "Items | None" = None
    hint: str = ""
    origin: Untyped = None
    after: Untyped = None
    shape: tuple[int, ...] = ()

    @property
    def base(self) -> "Operand":
        """The whole array of a row."""
        return self.arguments[0] if self.op == "row" else self


@dataclass(eq=False)
class Record:
    """A NamedTuple of values; ``place``: where all of it was loaded from."""

    cls: type
    values: tuple["Value", ...]
    place: Place | None = None

    def get(self, name: str) -> "Value":
        """A field's value."""
        return self.values[self.cls._fields.index(name)]  # type: ignore[attr-defined]


Value = Operand | Record


@dataclass(eq=False)
class Items:
    """Items in order, and the branch or loop of which it is an arm."""

    branch: "Branch | Loop | None" = None
    items: list["Item"] = field(default_factory=list)
    known: dict[Operand, bool] = field(default_factory=dict)  # conditions that are decided here
    nodes: dict[Untyped, Operand] = field(default_factory=dict)  # key -> the node that was computed here

    @property
    def parent(self) -> "Items | None":
        """The block of the branch."""
        return self.branch.block if self.branch else None

    @property
    def loop(self) -> "Loop | None":
        """The innermost loop around."""
        return next((block.branch for block in self.ancestors() if isinstance(block.branch, Loop)), None)

    def ancestors(self) -> Iterator["Items"]:
        """This block and those around it, inner ones first."""
        block: Items | None = self
        while block is not None:
            yield block
            block = block.parent


@dataclass(eq=False)
class Branch:
    """An ``if``: its arms, the holders of a value of either, and the content of places at the end of each arm."""

    condition: Operand
    block: Items
    arms: tuple[Items, Items] = ()  # type: ignore[assignment]
    phis: dict[tuple[Operand, Operand], Operand] = field(default_factory=dict)
    contents: tuple[dict[Place, Operand], dict[Place, Operand]] = ()  # type: ignore[assignment]
    homed: set[Place] = field(default_factory=set)


@dataclass(eq=False)
class Loop:
    """A ``for``: its counter runs from the first bound to before the second, by the third.

    Attributes:
        arms: its body.
        carried: numbers that change from turn to turn.
    """

    bounds: tuple[Operand, ...]
    block: Items
    counter: Operand
    arms: tuple[Items] = ()  # type: ignore[assignment]
    carried: list[Operand] = field(default_factory=list)


@dataclass(eq=False)
class Put:
    """A number put into an array."""

    array: Operand
    indices: tuple[Operand, ...]
    value: Operand


@dataclass(eq=False)
class Store:
    """A number put at a place; ``final``: for the next sample, not for a call that follows."""

    place: Place
    value: Operand
    final: bool = False


@dataclass(eq=False)
class Call:
    """A call of a procedure: the places of its records, its other arguments, and the nodes that are its results.

    ``reads``: place inside of the procedure -> its content, where nothing was stored for the call.
    """

    procedure: Untyped
    places: dict[str, Place]
    arguments: list[Operand]
    results: list[Operand] = field(default_factory=list)
    temporaries: dict[str, type] = field(default_factory=dict)
    reads: dict[Place, Operand] = field(default_factory=dict)


Item = Operand | Branch | Loop | Store | Put | Call


def leaves(value: Value) -> Iterator[Operand]:
    """The numbers of a value, in order."""
    if isinstance(value, Operand):
        yield value
    else:
        for part in value.values:
            yield from leaves(part)


def placed_leaves(value: Value, place: Place) -> Iterator[tuple[Place, Operand]]:
    """The numbers of a value, each with its place if the value lies at ``place``."""
    if isinstance(value, Operand):
        yield place, value
    else:
        for name, part in zip(value.cls._fields, value.values, strict=True):  # type: ignore[attr-defined]
            yield from placed_leaves(part, place.member(value.cls, name))


def items_within(block: Items) -> Iterator[tuple[Items, Item]]:
    """All items, those of arms behind their branch or loop, each with its block."""
    for item in block.items:
        yield block, item
        if isinstance(item, Branch | Loop):
            for arm in item.arms:
                yield from items_within(arm)


def are_exclusive(one: Items, other: Items) -> bool:
    """Whether two blocks are, or are in, different arms of one branch."""
    arms = {block.branch: block for block in one.ancestors() if block.branch is not None}
    return any(
        block.branch in arms and arms[block.branch] is not block
        for block in other.ancestors()
        if block.branch is not None
    )
