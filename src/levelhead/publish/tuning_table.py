"""The result of a search of parameters as text: verdict, parameters with their flat regions, logs, advice."""

from levelhead.evaluate.text_table import Column, Row, plain_table
from levelhead.tune import Tuning

PARAMETERS = (
    Column("name", "parameter"),
    Column("unit", "unit"),
    Column("before", "before", "", None),
    Column("found", "found", "", None),
    Column("flat", "within 5 %"),
    Column("note", ""),
)
LOGS = (
    Column("log", "log"),
    Column("reference", "reference"),
    Column("seconds", "scored", "s", 0),
    Column("before", "before", "°", 2),
    Column("after", "found", "°", 2),
)


def tuning_table(found: Tuning) -> str:
    """All of it."""
    names = tuple(f"{name} " for name in found.space.names)
    verdict = [f"{line if line.startswith(names) else line[:1].upper() + line[1:]}." for line in found.verdict()]
    parts = ["\n".join(verdict), plain_table(PARAMETERS, _parameters(found)), plain_table(LOGS, _logs(found))]
    if found.advice:
        lines = [f"  {one}" for one in found.advice]
        parts.append(
            "\n".join([f"The errors that are left, and how to lower them ({found.references[0].name}):", *lines])
        )
    return "\n\n".join(parts)


def _parameters(found: Tuning) -> list[Row]:
    rows: list[Row] = []
    for k, (one, curve) in enumerate(zip(found.space.ranges, found.curves, strict=True)):
        before, after = getattr(found.space.params, one.name), getattr(found.best, one.name)
        low, high = (float(curve.values[i]) for i in curve.flat)
        note = "as before: none is better by 1 %" if before == after else ""
        note = f"the {found.at_end(k)} value searched" if found.at_end(k) else note
        rows.append(
            {
                "name": one.name, "unit": one.param.unit, "before": before, "found": after,
                "flat": f"{low:.3g} to {high:.3g}", "note": note,
            }
        )  # fmt: skip
    return rows


def _logs(found: Tuning) -> list[Row]:
    rows: list[Row] = [
        {"log": one.name, "reference": one.kind, "seconds": one.seconds, "before": before, "after": after}
        for one, before, after in zip(found.references, found.before.tolist(), found.after.tolist(), strict=True)
    ]
    return rows + [
        {"log": f"left out: {one.name}", "reference": "", "seconds": None, "before": one.before, "after": one.after}
        for one in found.folds
    ]
