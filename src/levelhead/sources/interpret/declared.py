"""The unit of a sensor by hint, header or vendor."""

from levelhead import units
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import QUANTITY, Hints, Scale
from levelhead.sources.interpret.roles import Roles
from levelhead.sources.names.column_name import RELATIVE
from levelhead.sources.names.vendors import find_vendor, gyroflow_scale
from levelhead.sources.table import Table


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
