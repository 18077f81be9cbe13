"""Filters, parameters and health bits as the page needs them: JSON."""

import math

from levelhead import filters
from levelhead.filters.health import AT_REST, FAULTS, NAMES
from levelhead.filters.parameters import Param, Params, param_table
from levelhead.open_types import JsonObject


def filter_description(params: Params) -> JsonObject:
    """Name and parameters of a filter, each with unit, meaning, range, the slider's range, and its value."""
    table = param_table(type(params))
    return {
        "name": type(params).__name__,
        "parameters": [
            {"name": name, "unit": param.unit, "doc": param.doc, "range": param.range}
            | _slider(param, getattr(params, name), params._field_defaults[name])
            for name, param in table.items()
        ],
    }


def _slider(param: Param, value: float | bool, default: float | bool) -> JsonObject:
    """Where a slider begins and ends: the part of the range worth a search, or around the value, within the range."""
    shown: JsonObject = {"value": _finite(value), "default": _finite(default), "switch": isinstance(value, bool)}
    if isinstance(value, bool):
        return shown
    low, high = param.sweep or (min(0.5 * value, value - 1.0), max(2.0 * value, value + 1.0))
    low, high = max(min(low, value), param.low), min(max(high, value), param.high)
    return shown | {"low": _finite(low), "high": _finite(high), "log": param.log and low > 0.0}


def _finite(value: float | bool) -> float | bool | None:
    """A number; JSON has no infinity."""
    return value if isinstance(value, bool) or math.isfinite(value) else None


def filter_names() -> list[JsonObject]:
    """All filters: name, and their first sentence."""
    return [{"name": flt.name, "doc": str(flt.params.__doc__).partition("\n")[0]} for flt in filters.ALL]


def health_names() -> list[JsonObject]:
    """Bits of the health of a sample: words, and whether it is a fault."""
    return [
        {"bit": bit, "words": words, "fault": bool(bit & FAULTS)} for bit, words in NAMES.items() if bit != AT_REST
    ] + [{"bit": AT_REST, "words": NAMES[AT_REST], "fault": False}]
