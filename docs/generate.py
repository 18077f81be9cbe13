"""Writes into the pages what the source knows better: filters, thresholds, health bits, units, motions and chips.

Each filter has a page docs/reference/filters/NAME.md, made where there is none: what its module and its Params class
say, and below that whatever people write. Every block between <!-- generated: NAME --> and <!-- end --> is rewritten.
With --check nothing is changed; a page that is out of date is named, and the exit code is 1. With --pictures the
pictures are made anew as well, and kept with fewer colours.
"""

import argparse
import contextlib
import inspect
import math
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from levelhead import cli, filters, guard, units
from levelhead.axis_map import AxisMap
from levelhead.calibrate import calibrate_magnetometer
from levelhead.cli import help as cli_help
from levelhead.engine import fuse
from levelhead.engine.binding import is_guarded
from levelhead.engine.calibration_history import calibration_history
from levelhead.errors import FAMILIES
from levelhead.filters import health
from levelhead.filters.contract import Filter
from levelhead.filters.eskf import state as eskf_state
from levelhead.filters.parameters import Param, derived_table, param_table
from levelhead.inspection import symptoms
from levelhead.live.events import EVENTS
from levelhead.publish.plots import calibration_picture, style
from levelhead.publish.plots.axes_picture import frames_picture, mounting_picture
from levelhead.publish.plots.chart import draw
from levelhead.publish.plots.field_sphere import sphere_picture
from levelhead.publish.plots.picture import Band, Line, Panel, Picture
from levelhead.recording import Array, Recording
from levelhead.rotations import conjugate, product
from levelhead.simulate import recording
from levelhead.simulate.fault import KINDS
from levelhead.simulate.motion import STYLES
from levelhead.simulate.presets import CHIPS, MAGNETOMETERS, DataSheet
from levelhead.sources.formats import FORMATS
from levelhead.track import Track

DOCS = Path(__file__).resolve().parent
BLOCK = re.compile(r"(<!-- generated: (.+?) -->\n).*?(<!-- end -->)", re.DOTALL)
COLOURS = 96  # in a picture's palette: no difference to the eye, a third of the bytes


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; bars inside cells are escaped."""
    first, *others = ("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in (header, *rows))
    return "".join([first, "|---" * len(header) + "|\n", *others])


def number(value: float) -> str:
    """As one would type it."""
    return str(value) if isinstance(value, bool) else f"{value:g}"


def code(text: str) -> str:
    """In the type of code."""
    return f"`{text}`"


def parameters(params: type) -> str:
    """Name, unit, default, range, range worth sweeping and meaning of every parameter, and of every other name."""
    defaults = params()
    facts: list[tuple[str, Param, str]] = [
        (name, param, number(getattr(defaults, name))) for name, param in param_table(params).items()
    ]
    for name, derived in derived_table(params).items():
        facts.append((name, derived.param, f"{number(getattr(defaults, name))} (from {derived.field})"))
    if not facts:
        return "No parameters.\n"
    rows = []
    for name, param, default in facts:
        switch = isinstance(getattr(defaults, name), bool)
        sweep = f"{param.sweep[0]:g} … {param.sweep[1]:g}" if param.sweep else "–"
        rows.append(
            [code(name), param.unit or "–", default, "True or False" if switch else param.range, sweep, param.doc]
        )
    return table(["parameter", "unit", "default", "range", "default sweep", "meaning"], rows)


def markdown(text: str) -> str:
    """A docstring as Markdown: what is indented is set as it stands."""
    lines, inside = [], False
    for line in [*inspect.cleandoc(text).splitlines(), "."]:
        if line and line.startswith("    ") != inside:
            inside = not inside
            lines += ["```"] if inside else []
            if not inside:  # before the empty line that ended the block
                lines.insert(len(lines) - (lines[-1] == ""), "```")
        lines.append(line.removeprefix("    ") if inside else line.replace("``", "`"))
    return "\n".join(lines[:-1]) + "\n"


def seconds(value: float) -> str:
    """Time in which an error is corrected."""
    return "never" if math.isinf(value) else "with the next sample" if value == 0.0 else f"within {value:g} s"


def sensors(flt: Filter) -> str:
    """What it runs on."""
    return ", ".join(sensor for sensor in ("gyr", "acc", "mag") if sensor in flt.uses)


def gives(flt: Filter) -> str:
    """What it estimates by itself; σ it always gives, by itself or through its gains."""
    return ", ".join(fact for fact in ("tilt", "heading", "bias") if fact in flt.estimates)


def filter_page(flt: Filter) -> str:
    """All that the source says about a filter."""
    module = sys.modules[filters.module_of(flt)]
    title, colon, words = inspect.cleandoc(str(module.__doc__)).partition(": ")
    title, words = (title, words) if colon and "\n" not in title else (flt.name, f"{title}{colon}{words}")
    facts = [
        ("uses", sensors(flt)),
        ("estimates", gives(flt)),
        ("σ", "its own covariance" if "sigma" in flt.estimates else "the covariance of an observer with its gains"),
        ("[guard](../../explanation/robustness.md)", "in front of it" if is_guarded(flt) else "none"),
        ("[one axis](../../howto/any-units.md)", "yes" if flt.axis else "no"),
        ("a wrong tilt is corrected", seconds(flt.settles.tilt)),
        ("a wrong heading is corrected", seconds(flt.settles.heading)),
        ("source", flt.citation),
    ]
    head = markdown(words[:1].upper() + words[1:])
    return f"# {title}\n\n{head}\n{table(['', ''], facts)}\n## Parameters\n\n{parameters(flt.params)}"


def overview() -> str:
    """Which filter needs and gives what."""
    rows = []
    for flt in filters.ALL:
        page = f"[`{flt.name}`](filters/{flt.name}.md)"
        settles = f"{seconds(flt.settles.tilt)} / {seconds(flt.settles.heading)}"
        axis = "yes" if flt.axis else "no"
        rows.append([page, sensors(flt), gives(flt), settles, axis, str(flt.params.__doc__).splitlines()[0]])
    header = ["filter", "uses", "estimates", "a wrong tilt / heading is corrected", "one axis", "method"]
    return table(header, rows)


def verbs() -> str:
    """The verbs of the command line."""
    return table(["command", "result"], ([code(f"levelhead {name}"), words] for name, words in cli.VERBS.items()))


def bits() -> str:
    """The health bits."""
    names = {value: name for name, value in vars(health).items() if isinstance(value, int)}
    return table(
        ["bit", "name", "meaning"], ([str(bit), code(names[bit]), words] for bit, words in health.NAMES.items())
    )


def events() -> str:
    """What can happen to a node."""
    return table(["event", "meaning"], ([code(name), words] for name, words in EVENTS.items()))


def formats() -> str:
    """Formats, suffixes, who writes them, what is read and what is not, what must be installed."""
    rows = [
        [one.name, " ".join(code(suffix) for suffix in one.suffixes), one.devices, one.reads, one.leaves or "–",
         code(f"levelhead[{one.extra.split()[0]}]") if one.extra else "–"]
        for one in FORMATS
    ]  # fmt: skip
    return table(["format", "suffixes", "written by", "read", "not read", "needs"], rows)


def symptom_table() -> str:
    """The symptoms of `levelhead explain`."""
    return table(
        ["symptom", "unit", "measured as", "reported above"],
        ([kind.name, kind.unit, kind.measure, kind.bound] for kind in symptoms.ALL),
    )


def spellings() -> str:
    """Every unit that the reader knows."""
    return table(
        ["quantity", "SI unit", "spellings"],
        ([what, units.SI[what], ", ".join(code(name) for name in known)] for what, known in units.FACTORS.items()),
    )


def motions() -> str:
    """The styles of ``simulate.motion``."""
    rows = []
    for name, motion in STYLES.items():
        turn, shift = (", ".join(f"{value:g}" for value in values) for values in (motion.rotation, motion.translation))
        bands = (f"{low:g} … {high:g}" for low, high in (motion.rotation_band, motion.translation_band))
        turn_band, shift_band = bands
        rows.append([code(name), turn, turn_band, shift, shift_band])
    return table(
        ["style", "roll, pitch, yaw rates [°/s RMS]", "band [Hz]", "east, north, up [m/s² RMS]", "band [Hz]"], rows
    )


def scales(sheet: DataSheet) -> str:
    """The full scales of a sheet; the default one in bold."""
    return ", ".join(f"**{one:g}**" if one == sheet.default else f"{one:g}" for one in sheet.scales)


def zero(sheet: DataSheet) -> str:
    """The tolerance of the zero level."""
    values = sheet.zero if isinstance(sheet.zero, tuple) else (sheet.zero,)
    return ", ".join(f"{value:g}" for value in values)


def sheets(rows: Iterable[tuple[str, DataSheet]], extra: Sequence[str] = ()) -> str:
    """Sheets as they are in the source, in their own unit."""
    header = ["chip", *extra, "full scales", "noise density [unit/√Hz]", "zero level ±", "sensitivity ±", "cross-axis"]
    return table(
        header,
        (
            [
                name,
                *([sheet.unit] if extra else []),
                scales(sheet),
                f"{sheet.scales[sheet.default].noise_density:.3g}",
                zero(sheet),
                f"{100 * sheet.sensitivity:g} %",
                f"{100 * sheet.cross_axis:g} %",
            ]
            for name, sheet in rows
        ),
    )


def chips() -> str:
    """The chips: documents, gyroscopes, accelerometers, magnetometers."""
    documents = table(["chip", "document and table"], ([chip.name, chip.source] for chip in CHIPS))
    gyroscopes = sheets((chip.name, chip.gyr) for chip in CHIPS)
    accelerometers = sheets((chip.name, chip.acc) for chip in CHIPS)
    magnetometers = sheets(MAGNETOMETERS.items(), ["unit"])
    return (
        f"{documents}\nGyroscopes, in °/s (bold: the default of `imu`):\n\n{gyroscopes}\n"
        f"Accelerometers, in g:\n\n{accelerometers}\nMagnetometers:\n\n{magnetometers}"
    )


class _Names:
    """Parameters of which each is its own name, whatever it is multiplied by."""

    class Name(str):
        """A name in the type of code."""

        def __mul__(self, factor: object) -> "_Names.Name":  # type: ignore[override]
            return self

    def __getattr__(self, name: str) -> "_Names.Name":
        return _Names.Name(code(name))


def eskf_states() -> str:
    """The blocks of states of the ESKF, as it declares them."""
    declared, rows = eskf_state.block_noise(_Names()), []
    for block in eskf_state.BLOCKS:
        _, *deviations = declared[block.first]
        start, walk = (one if isinstance(one, str) else f"{one:g}" if one else "–" for one in deviations)
        unit = "u" if block.relative else block.unit or "–"
        prior = "yes" if block.prior else "–"
        rows.append([code(block.name.upper()), str(block.size), block.meaning, unit, start, walk, block.exists, prior])
    header = ["offset", "states", "meaning", "unit", "σ at the start", "random walk", "exists", "can be a prior"]
    return table(header, rows)


def faults() -> str:
    """The faults of `levelhead stress`."""
    rows = []
    for kind in KINDS:
        size = "below the largest reading" if callable(kind.size) else f"{kind.size:.3g}"
        length = "to the end" if math.isinf(kind.length) else f"{kind.length:g} s"
        rows.append([code(kind.name), kind.words, size, kind.unit, length])
    return table(["fault", "its effect", "usual size", "unit", "usual length"], rows)


def errors() -> str:
    """Each family of error messages: code, cause, cure, page."""
    found = cli_help.pages()
    sections = []
    for family in FAMILIES:
        page = found[family.page]
        link = Path(os.path.relpath(page, DOCS / "reference")).as_posix()
        more = f"More: [{cli_help.title(page)}]({link})"
        sections.append(f"## {family.code}\n\n{family.cause}\n\n**Cure.** {family.cure}\n\n{more}\n")
    return "\n".join(sections)


BLOCKS: dict[str, Callable[[], str]] = {
    "errors": errors,
    "verbs": verbs,
    "filters": overview,
    "health": bits,
    "units": spellings,
    "formats": formats,
    "events": events,
    "motions": motions,
    "chips": chips,
    "faults": faults,
    "symptoms": symptom_table,
    "eskf states": eskf_states,
    "guard": lambda: parameters(guard.Guard),
    **{f"filter {flt.name}": lambda flt=flt: filter_page(flt) for flt in filters.ALL},
}


def renewed(text: str) -> str:
    """A page with its generated blocks as the source wants them.

    Raises:
        KeyError: a block whose name is not in ``BLOCKS``.
    """
    return BLOCK.sub(lambda match: f"{match[1]}\n{BLOCKS[match[2]]()}\n{match[3]}", text)


def pictures() -> None:
    """The pictures of `levelhead demo --full`, `levelhead stress` and a calibration, with few colours to be small."""
    from PIL import Image  # noqa: PLC0415 - only here, so that --check needs no pictures

    with tempfile.TemporaryDirectory() as folder:
        if cli.main(["demo", "--full", "--out", folder]) != 0:
            raise SystemExit("levelhead demo --full failed")
        if cli.main(["stress", "--simulate", "hand", "--seed", "1", "--out", folder]) != 0:
            raise SystemExit("levelhead stress failed")
        known = recording("LSM6DSO32", "hand", duration=120.0, seed=3, mag="HMC5883L")
        calibration_picture(calibration_history(known, filters.ESKF()), Path(folder) / "calibration.png")
        raw = recording("ICM-20948", "hand", duration=60.0, seed=1)
        sphere_picture(calibrate_magnetometer(raw), Path(folder) / "magnetometer.png")
        tutorial_pictures(Path(folder))
        north_picture(Path(folder) / "north.png")
        frames_picture(Path(folder) / "earth-frames.png")
        mounting_picture(AxisMap.parse("ZYX:90,0,30"), Path(folder) / "mounting.png")
        for path in sorted(Path(folder).glob("*.png")):
            with Image.open(path) as picture:
                few = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
                few.save(DOCS / "pictures" / path.name, optimize=True)


TUTORIALS = (  # the commands of the engineer, the maker and the roboticist, and their pictures
    ("simulate still --sensor ICM-20948 --seed 5 --duration 120 -o still.csv", "", ""),
    ("simulate poses --sensor ICM-20948 --seed 5 -o poses.csv", "", ""),
    ("simulate hand --sensor ICM-20948 --seed 5 --duration 40 -o motion.csv", "", ""),
    ("noise still.csv", "still-noise.png", "engineer-noise.png"),
    ("calibrate poses.csv", "", ""),
    ("tune motion.csv -f Mahony --calibration poses-calibration.json", "tuned.png", "engineer-tuned.png"),
    ("simulate hand --sensor MPU-6050 --seed 1 --duration 30 -o log.csv", "", ""),
    ("fuse log.csv -f Mahony", "log-track.png", "maker-track.png"),
    ("run --source emulated:mpu6050 --duration 10 --box flight.mcap", "", ""),
    ("fuse flight.mcap", "flight-track.png", "roboticist-track.png"),
)


def tutorial_pictures(folder: Path) -> None:
    """What the commands of the tutorials draw."""
    with tempfile.TemporaryDirectory() as work, contextlib.chdir(work):
        for words, drawn, name in TUTORIALS:
            if cli.main(words.split()) != 0:
                raise SystemExit(f"levelhead {words} failed")
            if name:
                shutil.copy(drawn, folder / name)


def north_picture(path: Path) -> None:
    """A raw magnetometer's first minute without and with a calibration of `levelhead calibrate`: its offset, the north
    that was found, and the error of the heading, each with 2σ."""
    raw = recording("ICM-20948", "hand", duration=60.0, seed=1)
    known = calibrate_magnetometer(raw).calibration
    panels = zip(_first_minute(raw, "as it comes"), _first_minute(known.apply(raw), "calibrated"), strict=True)
    title = "A raw magnetometer finds north once it turns; with a calibration heading begins there"
    draw(Picture(title, [panel for pair in panels for panel in pair], (0.0, 60.0), 11.0, 8.0, columns=2), path)


def _first_minute(raw: Recording, words: str) -> list[Panel]:
    history, track = calibration_history(raw, filters.ESKF()), fuse(raw)
    t, truth = history.t, raw.truth
    assert truth is not None and track.sigma_heading is not None

    def error(one: Track) -> Array:
        turn = product(one.quat, conjugate(truth.quat))
        off = np.degrees(2.0 * np.arctan2(turn[:, 3], turn[:, 0]))
        return half_turn(off)

    def half_turn(angle: Array) -> Array:
        return np.asarray((angle + 270.0) % 360.0 - 270.0)  # ±180° is drawn without a jump

    def course(value: Array, sigma: Array, colour: str, label: str) -> list[Line | Band]:
        return [Band(t, value - 2.0 * sigma, value + 2.0 * sigma, colour, 0.18), Line(t, value, colour, 1.5, label)]

    north, sigma = (np.degrees(history.series("north", part).reshape(-1)) for part in ("value", "sigma"))
    offset, offset_sigma = history.series("mag_offset"), history.series("mag_offset", "sigma")
    seen = np.searchsorted(raw.t, t, side="right") - 1
    marks = [course(offset[:, i], offset_sigma[:, i], style.AXES[i], "xyz"[i]) for i in range(3)]
    pointed, rows = track.to_north(), np.arange(0, len(raw), 20)
    assert pointed.sigma_heading is not None
    half = 2.0 * np.degrees(pointed.sigma_heading[rows])
    off = error(pointed)[rows]
    headings: list[Line | Band] = [
        Band(raw.t[rows], off - half, off + half, style.BLUE, 0.18),
        Line(raw.t[rows], error(track)[rows], style.VERMILION, 1.5, "live"),
        Line(raw.t[rows], off, style.BLUE, 1.5, "turned"),
    ]
    truth_line = Line(t, half_turn(-error(track)[seen]), "#333333", 1.0, "true", dashed=True)
    return [
        Panel(f"Offset, {words}, ±2σ", "[µT]", [mark for axis in marks for mark in axis], (-260.0, 260.0)),
        Panel(
            f"Azimuth of north, {words}, ±2σ",
            "[°]",
            [*course(north, sigma, style.BLUE, "found"), truth_line],
            (-280.0, 190.0),
            True,
        ),
        Panel(f"Error of heading, {words}, ±2σ", "[°]", headings, (-280.0, 190.0), True),
    ]


def main() -> int:
    """Rewrite or check all pages; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="change nothing, fail where a page is out of date")
    parser.add_argument("--pictures", action="store_true", help="also make the pictures anew")
    given = parser.parse_args()
    stale, shown = [], set()
    for flt in filters.ALL:
        page = DOCS / "reference" / "filters" / f"{flt.name}.md"
        if not page.exists() and not given.check:
            page.write_text(f"<!-- generated: filter {flt.name} -->\n<!-- end -->\n", encoding="utf-8")
    for path in [DOCS.parent / "README.md", *sorted(DOCS.rglob("*.md"))]:
        text = path.read_text(encoding="utf-8")
        wanted = renewed(text)
        shown |= {match[2] for match in BLOCK.finditer(text)}
        if wanted != text:
            stale.append(path)
            if not given.check:
                path.write_text(wanted, encoding="utf-8")
    if given.pictures and not given.check:
        pictures()
    for path in stale:
        what = "is out of date; run python docs/generate.py" if given.check else "rewritten"
        sys.stdout.write(f"{path.relative_to(DOCS.parent).as_posix()} {what}\n")
    absent = [name for name in BLOCKS if name not in shown]
    for name in absent:
        sys.stdout.write(f"no page has the block <!-- generated: {name} --> … <!-- end -->\n")
    return 1 if absent or (stale and given.check) else 0


if __name__ == "__main__":
    sys.exit(main())
