"""An assessment of measured noise: beside data sheets, in sentences, and the gain of a longer recording."""

import math

import numpy as np

from levelhead.errors import LevelheadError, nearest
from levelhead.noise.fit import FLICKER_SHARE
from levelhead.noise.model import NoiseModel, TriadNoise
from levelhead.noise.rounding import MAX_CORRECTED, MIN_NAMED
from levelhead.noise.temperature import WEAK_SPAN, TemperatureDrift
from levelhead.simulate.presets import ACC_INSTABILITY, CHIPS, GYR_INSTABILITY, ONE_SIDED, Chip
from levelhead.units import factor

NAMES = {"gyr": "gyroscope", "acc": "accelerometer", "mag": "magnetometer"}
SHEET_UNITS = {"gyr": "deg/s", "acc": "g", "mag": "µT"}
AS_SAID = 1.25  # a ratio from 1/1.25 to 1.25 agrees with the sheet
SAME = 1.05  # where the chip is not known: the sheets that are as near are named
LENGTHS = 100.0  # times the τ at which an Allan deviation is flat, that a recording needs to show it
WHOLE = 0.9  # of a recording at rest: with less a sentence warns
BAD_FIT = 6.0  # mean squared misfit in σ from which there is more than these noises


def find_chip(name: str) -> Chip:
    """The data sheet of a chip by name; case and dashes do not count.

    Raises:
        LevelheadError: there is none; the nearest is named.
    """

    def plain(word: str) -> str:
        return "".join(letter for letter in word.lower() if letter.isalnum())

    found = {plain(one.name): one for one in CHIPS}.get(plain(name))
    if found is None:
        raise LevelheadError(f"'{name}' is not a sensor of levelhead; {nearest(name, [one.name for one in CHIPS])}")
    return found


def noise_verdict(model: NoiseModel, chip: Chip | None = None) -> list[str]:
    """Sentences, the most important first: density beside data sheets, the visible noises, and those that need a longer
    log.

    Args:
        model: from ``measure_noise``.
        chip: the sensor, if it is known; by default all data sheets of levelhead are compared.
    """
    lines = []
    if model.duration < WHOLE * model.recorded:
        lines.append(
            f"the sensor moved or was touched: measured is the longest stretch at rest, {spell(model.duration)} of "
            f"{spell(model.recorded)}"
        )
    for name, triad in model.triads.items():
        if name in ("gyr", "acc"):
            lines.append(_density(name, triad, chip))
            lines.append(_instability(name, triad, model.duration))
        lines += _fit(name, triad)
        if triad.drift is not None:
            lines += _drift(name, triad.drift)
    return lines


def _sheets(name: str) -> dict[str, float]:
    """Chip -> one-sided noise density at its default full scale, in the sheet's unit."""
    pages = {one.name: getattr(one, name) for one in CHIPS}
    return {chip: page.scales[page.default].noise_density for chip, page in pages.items()}


def _density(name: str, triad: TriadNoise, chip: Chip | None) -> str:
    unit = "(deg/s)/√Hz" if name == "gyr" else "µg/√Hz"
    scale = 1.0 if name == "gyr" else 1e6
    mine = ONE_SIDED * triad.density / factor(name, SHEET_UNITS[name])
    head = f"{NAMES[name]}: noise density {scale * mine:.3g} {unit} as data sheets give it (one-sided): "
    sheets = _sheets(name)
    if chip is not None:
        theirs = sheets[chip.name]
        ratio = mine / theirs
        if 1.0 / AS_SAID <= ratio <= AS_SAID:
            return f"{head}as in the {chip.name}'s sheet ({scale * theirs:g})"
        word = "times" if ratio > 1.0 else "of"
        return f"{head}{ratio:.2g} {word} the density of the {chip.name}'s sheet ({scale * theirs:g})"
    ordered = sorted(sheets.items(), key=lambda pair: pair[1])
    same = [one for one, density in ordered if 1.0 / SAME <= mine / density <= SAME]
    if same:
        return f"{head}as the sheet{'s' * (len(same) > 1)} of {' and '.join(same)} ({scale * sheets[same[0]]:g})"
    below = [f"{one} ({scale * density:g})" for one, density in ordered if density <= mine]
    above = [f"{one} ({scale * density:g})" for one, density in ordered if density > mine]
    if not below:
        return f"{head}less than the quietest data sheet here, {above[0]}"
    if not above:
        return f"{head}more than the noisiest data sheet here, {below[-1]}"
    return f"{head}between those of {below[-1]} and {above[0]}"


def _instability(name: str, triad: TriadNoise, duration: float) -> str:
    """Which axes show bias instability; otherwise its bound and how long a recording would have to be."""
    part = triad.bias_instability
    typical = GYR_INSTABILITY if name == "gyr" else ACC_INSTABILITY
    si = factor(name, SHEET_UNITS[name])
    scale, unit = (3600.0, "deg/h") if name == "gyr" else (1e6, "µg")
    shown = [i for i in range(3) if part.low[i] > 0.0]
    if shown:
        said = ", ".join(f"{'xyz'[i]} {scale * part.value[i] / si:.2g}" for i in shown)
        line = f"{NAMES[name]}: bias instability {said} {unit}"
        rest = "".join("xyz"[i] for i in range(3) if i not in shown)
        return f"{line} (typical {scale * typical:g})" + (f"; of {rest} it does not show" if rest else "")
    bound = float(part.high.max()) / si
    line = (
        f"{NAMES[name]}: bias instability does not show in {spell(duration)}: below {scale * bound:.0f} {unit} (95 %)"
    )
    needed = LENGTHS * triad.density**2 / (FLICKER_SHARE * (typical * si) ** 2)
    if needed > duration:
        line += f"; a typical {scale * typical:g} {unit} would need {spell(needed)} at rest"
    return line


def _drift(name: str, drift: TemperatureDrift) -> list[str]:
    """The effect of temperature on the bias, and its size."""
    unit = {"gyr": "deg/s", "acc": "mg", "mag": "µT"}[name]
    scale = 1.0 / factor(name, unit)
    slopes = ", ".join(f"{axis} {scale * drift.value[i, 1]:.2g}" for i, axis in enumerate("xyz"))
    moved = scale * float(np.ptp(drift.bias(np.linspace(drift.low, drift.high, 50)), axis=0).max())
    line = (
        f"{NAMES[name]}: with temperature its bias changes by {slopes} {unit} per K at {drift.reference:g} °C, "
        f"{moved:.2g} {unit} in all from {drift.low:.1f} to {drift.high:.1f} °C"
    )
    walk = [
        f"{NAMES[name]}: its random walk K is of the temperature, which changed by {drift.span:.1f} K: measure K again "
        "when the sensor is warm"
    ]
    if not drift.clear:
        walk = []
        line = (
            f"{NAMES[name]}: no change of its bias with temperature shows from {drift.low:.1f} to {drift.high:.1f} °C"
        )
    if drift.span < WEAK_SPAN:
        line += f"; weak, for it is {drift.span:.1f} K only: start with a cold sensor, {WEAK_SPAN:g} K or more"
    return [line, *walk]


def _fit(name: str, triad: TriadNoise) -> list[str]:
    lines = []
    begun = max((float(curve.tau[one.used][0]) for curve, one in zip(triad.curves, triad.fits, strict=True)
                 if one.used.any()), default=0.0)  # fmt: skip
    if begun > 1.5 / triad.rate:
        lines.append(f"{NAMES[name]}: below {begun:.2g} s it is quieter than white noise (the chip's filter): left out")
    if triad.rounding > MAX_CORRECTED:
        lines.append(
            f"{NAMES[name]}: a bit is {triad.rounding:.2g} times the noise as read, so that N is of the rounding: "
            "set a smaller full scale"
        )
    elif triad.rounding > MIN_NAMED:
        lines.append(f"{NAMES[name]}: a bit is {triad.rounding:.2g} times the noise as read: N is without the rounding")
    worst = max((one.misfit for one in triad.fits), default=0.0)
    if worst > BAD_FIT:
        lines.append(
            f"{NAMES[name]}: the Allan deviation is not that of these noises (misfit {math.sqrt(worst):.1f} σ): look "
            "for a hum, a fan, warming or a table that moves; the intervals are wider for it"
        )
    return lines


def spell(seconds: float) -> str:
    """A duration in words: 40 s, 6 min, 2.5 h."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.2g} h"


class NoiseRow:
    """A kind of noise in a unit: its factor from SI (0: the root of the rate) and how three axes are written."""

    def __init__(self, name: str, kind: str, words: str, unit: str, factor: float) -> None:
        self.name, self.kind, self.words, self.unit, self.factor = name, kind, words, unit, factor

    def cells(self, triad: TriadNoise) -> list[str]:
        """Of x, y and z: value ± 1σ, or the bound below which it lies."""
        part = getattr(triad, self.kind)
        scale = self.factor or float(np.sqrt(triad.rate))
        return [
            f"{scale * part.value[i]:.3g} ± {scale * part.sigma[i]:.1g}"
            if part.low[i] > 0.0
            else f"< {scale * part.high[i]:.2g}"
            for i in range(3)
        ]


_D, _G = 1.0 / factor("gyr", "deg/s"), 1.0 / factor("acc", "g")
ROWS = (
    NoiseRow("gyr", "white_noise_density", "white noise N", "(deg/s)/√Hz", _D),
    NoiseRow("gyr", "white_noise_density", "white noise as angle random walk", "deg/√h", 60.0 * _D),
    NoiseRow("gyr", "white_noise_density", "white noise as a data sheet's density", "(deg/s)/√Hz", ONE_SIDED * _D),
    NoiseRow("gyr", "bias_instability", "bias instability B", "deg/h", 3600.0 * _D),
    NoiseRow("gyr", "random_walk", "rate random walk K", "(deg/s)/√s", _D),
    NoiseRow("gyr", "quantisation_noise", "quantisation noise Q", "deg", _D),
    NoiseRow("acc", "white_noise_density", "white noise N", "(m/s²)/√Hz", 1.0),
    NoiseRow("acc", "white_noise_density", "white noise as velocity random walk", "(m/s)/√h", 60.0),
    NoiseRow("acc", "white_noise_density", "white noise as a data sheet's density", "µg/√Hz", ONE_SIDED * 1e6 * _G),
    NoiseRow("acc", "bias_instability", "bias instability B", "µg", 1e6 * _G),
    NoiseRow("acc", "random_walk", "acceleration random walk K", "(m/s²)/√s", 1.0),
    NoiseRow("acc", "quantisation_noise", "quantisation noise Q", "m/s", 1.0),
    NoiseRow("mag", "white_noise_density", "white noise N", "µT/√Hz", 1.0),
    NoiseRow("mag", "white_noise_density", "white noise as a data sheet's RMS noise at its rate", "µT", 0.0),
    NoiseRow("mag", "bias_instability", "bias instability B", "µT", 1.0),
    NoiseRow("mag", "random_walk", "random walk K", "µT/√s", 1.0),
)


def noise_rows(model: NoiseModel) -> list[NoiseRow]:
    """The rows of the table: quantisation noise only where it shows."""
    triads = model.triads
    return [
        row for row in ROWS
        if row.name in triads
        and (row.kind != "quantisation_noise" or bool(np.any(triads[row.name].quantisation_noise.low > 0.0)))
    ]  # fmt: skip
