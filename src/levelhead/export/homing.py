"""Numbers of a state that one arm of a branch changes are stored in that arm, and stay where they are in the other.

Without that, a covariance that changes at every second sample would be read and written at each.
"""

from collections import Counter

from levelhead.export.graph import Branch, Call, Item, Items, Loop, Operand, Place, Store, items_within
from levelhead.export.procedures import Procedure, list_operands, outer_place


def home_phis(procedure: Procedure) -> None:
    """Moves stores into arms, wherever the place is left alone from the branch to the store."""
    items = list(items_within(procedure.graph.body))
    users = Counter(id(operand) for _, item in items for operand in list_operands(item))
    for block, item in items:
        if isinstance(item, Store):
            _home(procedure, block, item, users)


def _home(procedure: Procedure, block: Items, store: Store, users: Counter[int]) -> None:
    """``users``: id of a number -> the items that take it, counted."""
    phi = store.value
    if phi.op != "phi" or phi.content.block is not block:
        return
    branch: Branch = phi.content
    first, last = block.items.index(branch), block.items.index(store)
    if any(touches(item, store.place) for item in block.items[first + 1 : last]) or not (
        (users[id(phi)] == 1 and phi not in procedure.returned) or _gains(phi, store.place)
    ):
        return
    block.items.remove(store)
    inner = []
    for arm, value, contents in zip(branch.arms, phi.arguments, branch.contents, strict=True):
        if contents.get(store.place) is not value:
            inner.append((arm, Store(store.place, value, store.final)))
            arm.items.append(inner[-1][1])
            users[id(value)] += 1
            contents[store.place] = value
    users.subtract(id(value) for value in (phi, *phi.arguments))
    branch.phis = {key: one for key, one in branch.phis.items() if one is not phi}
    phi.op, phi.arguments, phi.content, phi.after = "load", (), (store.place, -1), branch
    procedure.graph.loads.append(phi)
    for arm, one in inner:
        _home(procedure, arm, one, users)


def _gains(phi: Operand, place: Place) -> bool:
    branch: Branch = phi.content
    for arm, value, contents in zip(branch.arms, phi.arguments, branch.contents, strict=True):
        if contents.get(place) is value:
            return True
        if value.op == "phi" and value.content.block is arm and _gains(value, place):
            return True
    return False


def touches(item: Item, place: Place) -> bool:
    """Whether an item reads or writes the content of a place, other than by a load."""
    if isinstance(item, Store):
        return item.place == place
    if isinstance(item, Call):
        known = item.procedure.reads | item.procedure.writes.keys()
        return any(outer_place(item, inner) == place for inner in known)
    if isinstance(item, Branch | Loop):
        return any(touches(inner, place) for arm in item.arms for _, inner in items_within(arm))
    return False


def writes(item: Item, place: Place) -> bool:
    """Whether an item by itself changes the content of a place."""
    if isinstance(item, Store):
        return item.place == place
    return isinstance(item, Call) and any(outer_place(item, inner) == place for inner in item.procedure.writes)
