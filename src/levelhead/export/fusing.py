"""Branches on one condition, one right behind the other, become one: an arm of the second follows that of the first.

A sample that the driver conditions is either the first or not, and what follows asks the same once more.
"""

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
        for item in second.arms[k].items:
            _replace(item, instead, second.arms[k], first.arms[k])
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


def _replace(item: Item, instead: dict[Operand, Operand], old: Items, new: Items) -> None:
    """Puts the values of an arm where an item has those that either arm might give, and the item into its new block."""
    if isinstance(item, Operand):
        item.arguments = tuple(instead.get(node, node) for node in item.arguments)
        item.block = new if item.block is old else item.block
    elif isinstance(item, Store):
        item.value = instead.get(item.value, item.value)
    elif isinstance(item, Put):
        item.value = instead.get(item.value, item.value)
        item.indices = tuple(instead.get(node, node) for node in item.indices)
    elif isinstance(item, Loop):
        item.bounds = tuple(instead.get(node, node) for node in item.bounds)
        item.block = new if item.block is old else item.block
        for phi in item.carried:
            phi.arguments = tuple(instead.get(node, node) for node in phi.arguments)
        for inner in item.arms[0].items:
            _replace(inner, instead, old, new)
    elif isinstance(item, Call):
        item.arguments = [instead.get(node, node) for node in item.arguments]
        for node in item.results:
            node.block = new if node.block is old else node.block
    else:
        item.condition = instead.get(item.condition, item.condition)
        item.block = new if item.block is old else item.block
        for phi in item.phis.values():
            phi.arguments = tuple(instead.get(node, node) for node in phi.arguments)
            phi.block = new if phi.block is old else phi.block
        item.contents = tuple({p: instead.get(n, n) for p, n in held.items()} for held in item.contents)  # type: ignore[assignment]
        for arm in item.arms:
            for inner in arm.items:
                _replace(inner, instead, old, new)
