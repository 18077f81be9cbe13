"""The unit of the magnetometer, by the length of the earth's field: of the part that turns with the body."""

from levelhead import units
from levelhead.recording import Array
from levelhead.signals.field_turn import FieldTurn
from levelhead.signals.gravity_turn import median_norm
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import Scale, count_word
from levelhead.sources.interpret.counts import field_sensitivity
from levelhead.sources.interpret.evidence import Evidence, are_whole

OFFSET_ALONE = 0.8  # share of a field's turns by offset and axes that an offset explains alone, at least,
LEAST_FREE = 0.5  # where they explain so much (a correlation)


def mag_scale(
    values: Array, scale: Scale | None, relative: bool, evidence: Evidence, turn: FieldTurn | None
) -> Scale | None:
    """The scale of (n, 3) ``values`` of a magnetometer; None: without unit.

    ``turn``: of the values as they are. A raw chip's iron is several times the earth's field.
    """
    if scale is not None:
        return scale
    norm = median_norm(values)
    whole = not relative and are_whole(values)
    per = field_sensitivity(evidence.chip, norm) if whole and evidence.chip is not None else None
    if per is not None and evidence.chip is not None:
        scale = Scale(1.0, f"counts, {per:g} per µT", per)
        facts, confirm = (
            {"per": per, "chip": evidence.chip.name, "norm": norm},
            {"counts": {"mag": f"{count_word(per)}/µT"}},
        )
        evidence.conclude("mag.unit", "counts", scale, Basis.GUESS, facts, confirm)
        return scale
    unit = None if relative else mag_unit(norm)
    free = None if relative or whole or turn is None or not turn.shows_field else unit_of_field(turn)
    if turn is not None and free not in (None, unit):
        scale = Scale(units.factor("mag", free), free)
        facts, confirm = {"norm": turn.length}, {"units": {"mag": free}}
        evidence.conclude("mag.unit", "turn", scale, Basis.GUESS, facts, confirm)
        return scale
    if unit is None:
        evidence.conclusions.append(Conclusion("mag.unit", "unknown", None, Basis.NUMBERS, {"norm": norm}))
        return None
    scale = Scale(units.factor("mag", unit), unit)
    evidence.conclude(
        "mag.unit",
        "whole" if whole else "length",
        scale,
        Basis.GUESS if whole else Basis.NUMBERS,
        {"norm": norm},
        {"units": {"mag": unit}},
    )
    return scale


def is_explained_by_offset(turn: FieldTurn, free: float) -> bool:
    """Whether an offset, such as a raw chip's iron, is all that keeps the field from turning with the body.

    ``free``: ``field_turn.free_correlation``, with the axes free too.
    """
    return turn.offset >= OFFSET_ALONE * max(free, LEAST_FREE)


def mag_unit(norm: float, error: float = 0.0) -> str | None:
    """The unit in which a length, up to an error, is that of the earth's field; None if there is none, or several."""
    fits = [
        unit for unit, low, high in (("µT", 20.0, 70.0), ("G", 0.2, 0.7), ("mG", 200.0, 700.0), ("nT", 20e3, 70e3))
        if low - error <= norm <= high + error
    ]  # fmt: skip
    return fits[0] if len(fits) == 1 else None


def unit_of_field(turn: FieldTurn) -> str | None:
    """The unit in which the field that turns with the body is the earth's; None if it is in none."""
    return mag_unit(turn.length, turn.error)
