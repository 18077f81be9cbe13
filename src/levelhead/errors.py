"""The one error that levelhead raises for input that a user can correct, and the families of its messages."""

import difflib
import importlib.util
import inspect
import sys
from collections.abc import Iterable
from typing import NamedTuple


class Family(NamedTuple):
    """Messages of one cause.

    Attributes:
        code: its name: ``LevelheadError.code``, and a topic of ``levelhead help``.
        cause: why a message of this family appears.
        cure: how to correct the input.
        page: the page of the documentation with more, also a topic of ``levelhead help``.
        rooms: the modules and packages that raise these messages, by their path below ``levelhead``.
    """

    code: str
    cause: str
    cure: str
    page: str
    rooms: tuple[str, ...]


FAMILIES = (
    Family(
        "file",
        "A file is absent, damaged, empty, or of a format that levelhead does not read.",
        "Check the path. Export the log again, or convert it to a format of the list.",
        "formats",
        (
            "cli.fuse",
            "json_file",
            "sources.chunked",
            "sources.devices.replay",
            "sources.formats",
            "sources.pipeline",
            "sources.table",
        ),
    ),
    Family(
        "column",
        "A log lacks a column, or its names and numbers do not show which column is which.",
        "Name the columns: `--map gyr=gx,gy,gz --map acc=ax,ay,az --map t=time`. The message proposes a command.",
        "reading",
        ("sources.hints", "sources.interpret", "sources.names", "sources.tracks"),
    ),
    Family(
        "unit",
        "A unit is unknown, or the numbers contradict it.",
        "Give the unit, `--units gyr=deg/s`, or the sensitivity of raw counts, `--counts gyr=131/deg/s`.",
        "units",
        (
            "sources.interpret.accelerometer",
            "sources.interpret.by_numbers",
            "sources.interpret.gyroscope",
            "sources.names.column_name",
            "units",
        ),
    ),
    Family(
        "clock",
        "Time stamps are absent, do not increase, have an unknown unit, or share no instant with a second log.",
        "Name the column, `--map t=NAME`, its unit, `--units t=ms`, or the rate of a log without stamps, `--rate 100`.",
        "time-stamps",
        (
            "evaluate.clock_difference",
            "sources.formats.text.dates",
            "sources.interpret.clock",
            "sources.interpret.clock_choice",
            "sources.interpret.clock_repair",
            "sources.join",
        ),
    ),
    Family(
        "recording",
        "Arrays of a recording differ in length or shape, or are not finite where they must be.",
        "Give t (n,) in s, gyr (n, 3) in rad/s, acc (n, 3) in m/s² and mag (n, 3) in µT or None. NaN marks a gap.",
        "conventions",
        ("recording",),
    ),
    Family(
        "parameter",
        "A filter or a parameter has an unknown name, or a value is outside its range.",
        "Take a name and a value of the filter's table; `levelhead fuse --help` lists the filters.",
        "filters",
        ("filters", "parameter_file"),
    ),
    Family(
        "axes",
        "A mounting or a frame is not a rotation, or the motion does not show how the sensor is mounted.",
        "Name each axis once, `--axes -y,x,z`, or hold the body still and level, then lean it to its right.",
        "mounting",
        ("axis_map", "cli.axes", "earth_frame"),
    ),
    Family(
        "place",
        "A place or a date is outside the World Magnetic Model, or is not written as numbers.",
        "Give degrees and m, `--place 48.1,11.6,520`, and a date, `--date 2026-05-17`.",
        "true-north",
        ("magnetic_model",),
    ),
    Family(
        "run",
        "An engine, a stream or a saved state does not fit the filter, the samples or this version.",
        "Check the sensors and units of each sample. Start a saved run again with the same options.",
        "stream",
        ("cli.resume", "engine"),
    ),
    Family(
        "track",
        "A track lacks a quantity, or has another length or shape than the recording.",
        "Take the track and the recording of one run. The page lists the content of a track.",
        "conventions",
        ("heave", "track"),
    ),
    Family(
        "truth",
        "A comparison needs a reference orientation, and the log has none, or it shares no samples with the track.",
        "Name the columns of the reference, `--map q=qw,qx,qy,qz`, and bring both to one clock.",
        "aligning",
        ("evaluate",),
    ),
    Family(
        "search",
        "A sweep or a search has no parameter, range or scored time to work with.",
        "Name a numeric parameter and a range inside its limits. Use logs with some minutes of motion.",
        "tuning",
        ("cli.tune", "tune"),
    ),
    Family(
        "simulated",
        "A motion, a chip or a fault is unknown, or its numbers are out of range.",
        "Take a name from the tables of the page, and finite values with the units given there.",
        "simulation",
        ("simulate",),
    ),
    Family(
        "pose",
        "A calibration has too few poses or turns, or a calibration file is not whole.",
        "Hold the sensor still for 2 s on each of its sides, then turn it slowly about each axis.",
        "calibration",
        ("calibrate", "calibration", "cli.calibrate", "cli.calibrated_log"),
    ),
    Family(
        "rest",
        "A measurement of noise needs a log at rest, and this one is too short or moves.",
        "Fix the sensor to a heavy table and record an hour at its usual rate.",
        "noise",
        ("noise",),
    ),
    Family(
        "segment",
        "Two logs of a joint, or the log of a foot, share too little time or show too little motion.",
        "Record both sensors with one clock, and bend the joint through its range; for a foot, walk and stand.",
        "joints",
        ("cli.joint", "gaits", "joints"),
    ),
    Family(
        "device",
        "A chip or a serial line is absent, wrongly wired, or sends other values than expected.",
        "Look at `levelhead ports`. Check wiring, address, baud rate, and the right to open the device.",
        "sensors",
        ("sources.devices", "sources.sensors"),
    ),
    Family(
        "node",
        "A live node, its bus or one of its readers cannot start, or a message has another version.",
        "Check the source and the address. Run the same version of levelhead on both ends.",
        "live",
        ("cli.run", "live"),
    ),
    Family(
        "board",
        "A filter, an option or a number cannot become C, or does not fit the board.",
        "Choose a smaller filter, `--lean`, `--without PART`, or another board.",
        "export",
        ("cli.export", "export"),
    ),
    Family(
        "collection",
        "A place of many recordings is empty or unknown, or a cluster or a folder of results does not answer.",
        "Check the pattern or URL, and the extra that its protocol needs. Start the same command again to go on.",
        "corpus",
        ("corpora",),
    ),
    Family(
        "output",
        "A result cannot be written: the folder is absent, closed or full, or its suffix is unknown.",
        "Make the folder, or give a file with a suffix of the message, such as `-o result.csv`.",
        "command-line",
        ("atomic", "cli.convert", "cli.outputs", "inspection.repair", "publish"),
    ),
    Family(
        "package",
        "A picture, format or transport needs a package that is not installed.",
        "Install the extra that the message names, such as `pip install 'levelhead[plot]'`.",
        "platforms",
        ("errors",),
    ),
    Family(
        "method",
        "A package or a data set of `levelhead bench` is absent or unknown.",
        "Install `levelhead[bench]`, and name the folder of the data set.",
        "benchmarks",
        ("bench", "cli.bench"),
    ),
    Family(
        "option",
        "An argument or an option is unknown, absent, or contradicts another one.",
        "See `levelhead VERB --help`; every verb shows its arguments, options and defaults.",
        "command-line",
        ("cli", "inspection"),
    ),
)


class LevelheadError(ValueError):
    """Bad input, in one sentence: the fault, its place, and the right input.

    The command line prints it on one line and exits with ``exit_code``.

    Attributes:
        code: the family of the message, such as "clock", a topic of ``levelhead help``; "" outside levelhead. An error
            that is raised while another is handled has the code of that one.
    """

    exit_code = 2
    code: str

    def __init__(self, *words: object) -> None:
        super().__init__(*words)
        handled = sys.exception()
        self.code = handled.code if isinstance(handled, LevelheadError) else family_code(self._raising_module())

    def _raising_module(self) -> str:
        """The module that makes this error, outside the constructors of its own class."""
        frame = inspect.currentframe()
        while frame is not None and frame.f_locals.get("self") is self:
            frame = frame.f_back
        return "" if frame is None else str(frame.f_globals.get("__name__", ""))


def family_code(module: str) -> str:
    """The code of the family to which a module's messages belong; "" for a module outside levelhead.

    A module has one subject, so it decides. The longest path wins.

    >>> family_code("levelhead.sources.interpret.clock")
    'clock'
    """
    rooms = {f"levelhead.{room}": family.code for family in FAMILIES for room in family.rooms}
    while module and module not in rooms:
        module = module.rpartition(".")[0]
    return rooms.get(module, "")


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint for a word that is not known: the nearest known one, or the whole list.

    >>> nearest("r_mesure", ["q_angle", "q_bias", "r_measure"])
    "did you mean 'r_measure'?"
    """
    names = list(known)
    lowered = {name.lower(): name for name in names}
    close = difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=0.5)
    if close:
        return f"did you mean '{lowered[close[0]]}'?"
    return f"known: {', '.join(names)}" if names else "there are none"


def require(package: str, what: str, extra: str) -> None:
    """Makes sure that a package is installed that only some uses need.

    Raises:
        LevelheadError: it is not; the sentence names the extra that brings it.
    """
    if importlib.util.find_spec(package) is None:
        raise LevelheadError(f"{what} needs {package}: pip install 'levelhead[{extra}]'")
