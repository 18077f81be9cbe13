"""Measured noise as a table in both conventions of units, and for programs."""

from levelhead.evaluate.text_table import Column, Row, plain_table
from levelhead.noise.assessment import NAMES, rows, spell, verdict
from levelhead.noise.model import NoiseModel
from levelhead.open_types import Fields
from levelhead.simulate.presets import Chip

COLUMNS = [Column("noise", "noise"), *(Column(axis, axis) for axis in "xyz"), Column("unit", "unit")]


def noise_table(model: NoiseModel, chip: Chip | None = None) -> str:
    """The table of all coefficients with 1σ, and the verdict below it."""
    lines: list[Row] = []
    for row in rows(model):
        cells = dict(zip("xyz", row.cells(model.triads[row.name]), strict=True))
        lines.append({"noise": f"{NAMES[row.name]} {row.words}", **cells, "unit": row.unit})
    head = f"{spell(model.duration)} at rest, ± 1σ; <: does not show, bound of the 95 % interval"
    return "\n".join([plain_table(COLUMNS, lines), "", head, *verdict(model, chip)])


def noise_facts(model: NoiseModel, chip: Chip | None = None) -> Fields:
    """The same for JSON, with the Allan deviations."""
    curves = {
        name: {
            axis: {
                "tau_s": curve.tau.tolist(),
                "deviation": curve.deviation.tolist(),
                "degrees_of_freedom": one.freedom.tolist(),
                "misfit": one.misfit,
            }
            for axis, curve, one in zip("xyz", triad.curves, triad.fits, strict=True)
        }
        for name, triad in model.triads.items()
    }
    return model.to_dict() | {"verdict": verdict(model, chip), "allan": curves}
