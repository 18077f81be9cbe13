"""Measured noise as a table in both conventions of units, and for programs."""

from levelhead.evaluate.text_table import Column, Row, plain_table
from levelhead.noise.assessment import NAMES, noise_rows, noise_verdict, spell
from levelhead.noise.model import NoiseModel
from levelhead.open_types import JsonObject
from levelhead.simulate.presets import Chip
from levelhead.units import factor

DRIFT_UNITS = {
    "gyr": ("(deg/s)/K", 1.0 / factor("gyr", "deg/s")),
    "acc": ("mg/K", 1.0 / factor("acc", "mg")),
    "mag": ("µT/K", 1.0),
}
COLUMNS = [Column("noise", "noise"), *(Column(axis, axis) for axis in "xyz"), Column("unit", "unit")]


def noise_table(model: NoiseModel, chip: Chip | None = None) -> str:
    """The table of all coefficients with 1σ, and the verdict below it."""
    lines: list[Row] = []
    for row in noise_rows(model):
        cells = dict(zip("xyz", row.cells(model.triads[row.name]), strict=True))
        lines.append({"noise": f"{NAMES[row.name]} {row.words}", **cells, "unit": row.unit})
    for name, triad in model.triads.items():
        if (drift := triad.drift) is not None:
            unit, scale = DRIFT_UNITS[name]
            slopes = zip("xyz", scale * drift.value[:, 1], scale * drift.sigma[:, 1], strict=True)
            cells = {axis: f"{value:.2g} ± {sigma:.2g}" for axis, value, sigma in slopes}
            words = f"{NAMES[name]} bias per K at {drift.reference:g} °C"
            lines.append({"noise": words, **cells, "unit": unit})
    head = f"{spell(model.duration)} at rest, ± 1σ; <: does not show, bound of the 95 % interval"
    return "\n".join([plain_table(COLUMNS, lines), "", head, *noise_verdict(model, chip)])


def noise_facts(model: NoiseModel, chip: Chip | None = None) -> JsonObject:
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
    return model.to_dict() | {"verdict": noise_verdict(model, chip), "allan": curves}
