"""The unit of the magnetometer: the length of the earth's field tells it."""

from levelhead import units
from levelhead.recording import Array
from levelhead.signals.gravity_turn import median_norm
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.hints import Scale
from levelhead.sources.interpret.declared import Evidence


def mag_scale(values: Array, scale: Scale | None, relative: bool, evidence: Evidence) -> Scale | None:
    """The scale of (n, 3) ``values`` of a magnetometer; None: without unit."""
    if scale is not None:
        return scale
    norm = median_norm(values)
    unit = None if relative else mag_unit(norm)
    if unit is None:
        evidence.conclusions.append(Conclusion("mag.unit", "unknown", None, Basis.NUMBERS, {"norm": norm}))
        return None
    scale = Scale(units.factor("mag", unit), unit)
    evidence.conclude("mag.unit", "length", scale, Basis.NUMBERS, {"norm": norm}, {"units": {"mag": unit}})
    return scale


def mag_unit(norm: float) -> str | None:
    """The unit in which a median norm is the earth's field; None if there is none."""
    for unit, low, high in (("µT", 20.0, 70.0), ("G", 0.2, 0.7), ("mG", 200.0, 700.0), ("nT", 20e3, 70e3)):
        if low <= norm <= high:
            return unit
    return None
