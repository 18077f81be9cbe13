"""The unit of a sensor by hint, header or vendor, and the conclusions about units."""

from dataclasses import dataclass

import numpy as np

from levelhead import units
from levelhead.open_types import ReadOnlyJson
from levelhead.recording import Array
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.hints import QUANTITY, Hints, Scale
from levelhead.sources.interpret.counts import Chip
from levelhead.sources.interpret.roles import Roles
from levelhead.sources.names.column_name import RELATIVE
from levelhead.sources.names.vendors import find_vendor, gyroflow_scale
from levelhead.sources.table import Table


@dataclass
class Evidence:
    """The conclusions on the way from a table to a recording.

    Attributes:
        conclusions: in the order in which they were made.
        acc_per_g: numbers per g, if the accelerometer gives whole ones: a chip's counts, mg, thousandths of 1 m/s².
        acc_norm: their usual length.
        chip: whose sensitivity the gyroscope seems to have, if its numbers are whole.
        adds_gravity: whether gravity, which has columns of its own, is added to the acceleration.
    """

    conclusions: list[Conclusion]
    acc_per_g: float | None = None
    acc_norm: float | None = None
    chip: Chip | None = None
    adds_gravity: bool = False

    def conclude(
        self, about: str, reason: str, scale: Scale, basis: Basis, facts: ReadOnlyJson, confirm: ReadOnlyJson
    ) -> None:
        """Adds a conclusion about a unit."""
        self.conclusions.append(Conclusion(about, reason, scale.name, basis, facts, confirm))


def declared_scale(role: str, table: Table, roles: Roles, hints: Hints, found: list[Conclusion]) -> Scale | None:
    """The scale that a hint gives, the file, or the custom of the program that wrote it; a hint wins."""
    said = roles.units.get(role) or table.units.get(role)
    if said is None and role not in hints.scale and (scale := gyroflow_scale(role, table.origin)) is not None:
        found.append(Conclusion(f"{role}.unit", "preamble", scale.name, Basis.HEADER))
        return scale
    if said is None and role not in hints.scale and role not in hints.map:
        vendor = find_vendor([*table.names, *table.origin])
        if vendor is not None and role in vendor.units:
            said = vendor.units[role]
            facts, confirm = {"vendor": vendor.name}, {"units": {role: said}}
            found.append(Conclusion(f"{role}.unit", "vendor", said, Basis.VENDOR, facts, confirm))
    if role in hints.scale:
        if said is not None and units.find_factor(QUANTITY[role], said) != hints.scale[role].factor:
            facts = {"file": said}
            found.append(Conclusion(f"{role}.unit", "hint_against_file", hints.scale[role].name, Basis.HINT, facts))
        return hints.scale[role]
    if said is None or said == RELATIVE:
        return None
    return Scale(units.factor(QUANTITY[role], said), said)


def are_whole(values: Array) -> bool:
    """Whether all numbers are whole, and reach more than a few: counts."""
    finite = values[np.isfinite(values)]
    return len(finite) > 0 and bool(np.array_equal(finite, np.rint(finite))) and float(np.abs(finite).max()) > 3.0
