"""Branches on one condition, one right behind the other, become one: an arm of the second follows that of the first.

A sample that the driver conditions is either the first or not, and later code tests the same once more.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from levelhead.export.graph import Branch, Call, Item, Items, Loop, Operand, Put, Store


def fuse(block: Items, loads: list[Operand]) -> None:
    """Fuses the branches of a block and of those inside; ``loads``: all loads of the procedure."""
    at = 0
    while at < len(block.items):
        item = block.items[at]
        following = block.items[at + 1] if at + 1 < len(block.items) else None
        if isinstance(item, Branch) and isinstance(following, Branch) and item.condition is following.condition:
            _join(item, following, loads)
            block.items.remove(following)
            continue
        if isinstance(item, Branch | Loop):
            for arm in item.arms:
                fuse(arm, loads)
        at += 1


def _join(first: Branch, second: Branch, loads: list[Operand]) -> None:
    between = [load for load in loads if load.op == "load" and load.after is first]
    for k in (0, 1):
        instead = {phi: phi.arguments[k] for phi in first.phis.values()}
        instead |= {load: first.contents[k][load.content[0]] for load in between}
        substitution = _Substitution(instead, second.arms[k], first.arms[k])
        for item in second.arms[k].items:
            substitution.apply(item)
        contents = {place: instead.get(node, node) for place, node in second.contents[k].items()}
        second.contents = (contents, second.contents[1]) if k == 0 else (second.contents[0], contents)
        for phi in second.phis.values():
            value = instead.get(phi.arguments[k], phi.arguments[k])
            phi.arguments = (value, phi.arguments[1]) if k == 0 else (phi.arguments[0], value)
        first.arms[k].items += second.arms[k].items
    for load in between:
        place = load.content[0]
        load.op, load.content = "phi", first
        load.arguments = (first.contents[0][place], first.contents[1][place])
        first.phis.setdefault(load.arguments, load)
        if first.phis[load.arguments] is not load:
            first.phis[load, load] = load
    for load in loads:
        load.after = first if load.after is second else load.after
        for old, new in zip(second.arms, first.arms, strict=True):
            load.block = new if load.block is old else load.block
    for phi in second.phis.values():
        phi.content = first
    first.phis |= {(phi, phi): phi for phi in second.phis.values()}  # a key of its own: arguments may be alike
    first.contents = second.contents
    first.homed |= second.homed


@dataclass(frozen=True)
class _Substitution:
    """Puts the values of an arm where an item has those of either arm, and the item into the arm's block."""

    values: dict[Operand, Operand]
    old: Items
    new: Items

    def of(self, nodes: Iterable[Operand]) -> tuple[Operand, ...]:
        """The replacement of some nodes."""
        return tuple(self.values.get(node, node) for node in nodes)

    def apply(self, item: Item) -> None:
        """Substitutes in an item and in those within it."""
        if isinstance(item, Operand):
            item.arguments = self.of(item.arguments)
            self._move(item)
        elif isinstance(item, Store):
            (item.value,) = self.of((item.value,))
        elif isinstance(item, Put):
            item.value, *indices = self.of((item.value, *item.indices))
            item.indices = tuple(indices)
        elif isinstance(item, Call):
            item.arguments = list(self.of(item.arguments))
            item.reads = dict(zip(item.reads, self.of(item.reads.values()), strict=True))
            for node in item.results:
                self._move(node)
        elif isinstance(item, Loop):
            item.bounds = self.of(item.bounds)
            self._apply_within(item, item.carried)
        else:
            self._apply_to_branch(item)

    def _apply_to_branch(self, branch: Branch) -> None:
        (branch.condition,) = self.of((branch.condition,))
        for phi in branch.phis.values():
            self._move(phi)
        one, other = (dict(zip(held, self.of(held.values()), strict=True)) for held in branch.contents)
        branch.contents = one, other
        self._apply_within(branch, branch.phis.values())

    def _apply_within(self, item: Branch | Loop, phis: Iterable[Operand]) -> None:
        self._move(item)
        for phi in phis:
            phi.arguments = self.of(phi.arguments)
        for arm in item.arms:
            for inner in arm.items:
                self.apply(inner)

    def _move(self, item: Operand | Branch | Loop) -> None:
        item.block = self.new if item.block is self.old else item.block
