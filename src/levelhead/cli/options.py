"""Options that several verbs share, and their values."""

import json
import os
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from levelhead import filters
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import Params, settable
from levelhead.guard import Guard
from levelhead.open_types import JsonObject
from levelhead.standard_output import standard_output

if TYPE_CHECKING:
    from levelhead.bench.methods import Method
    from levelhead.calibration import Calibration
    from levelhead.parameter_file import ParameterFile
    from levelhead.recording import Array, Recording
    from levelhead.sources.hints import NeedsHints
    from levelhead.sources.interpretation import Interpretation
    from levelhead.track import Track


@Parameter(name="*")
@dataclass(frozen=True)
class Reading:
    """Hints for reading a log that does not name its columns or units."""

    map: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=gx,gy,gz")] = ()
    """Columns of t, gyr, acc, mag and q. May be given several times; `mag=` ignores the magnetometer."""
    units: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=deg/s")] = ()
    """Units that the header does not give."""
    counts: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=131/deg/s")] = ()
    """Raw counts per unit: 131 counts are 1 deg/s."""
    rate: Annotated[float | None, Parameter(metavar="HZ")] = None
    """Sample rate of a log without time stamps."""
    sensor: Annotated[str | None, Parameter(metavar="NAME")] = None
    """Select one of several sensors by a word in its column names. With `all`, `fuse` and `smooth` take each
    of them."""
    session: Annotated[int | None, Parameter(metavar="N")] = None
    """Part of a log whose clock restarts, counted from 1; by default the longest."""

    yes: Annotated[bool, Parameter(name=["--yes", "-y"], negative="")] = False
    """Accept the hints that an error proposes, such as a rate. Without it, a terminal asks for Enter."""

    def read(self, log: Path, adjust: "Callable[[Interpretation], Interpretation] | None" = None) -> "Recording":
        """The recording in a log, with these hints, or with those proposed if the user agrees.

        ``adjust`` may change the reader's conclusions.
        """
        from levelhead.publish.progress import progress
        from levelhead.sources.hints import NeedsHints, check_options
        from levelhead.sources.pipeline import read_file

        hints = self.hints()
        try:
            with progress(f"reading {log.name}"):
                return read_file(log, check_options(hints), adjust)
        except NeedsHints as error:
            if not error.path or not self._agrees(error):
                raise
            hints = error.suggested
        with progress(f"reading {log.name}"):
            return read_file(log, check_options(hints), adjust)

    def _agrees(self, error: "NeedsHints") -> bool:
        """Whether the user takes a proposal: by --yes, or by Enter in a terminal."""
        if not self.yes and not (sys.stdin.isatty() and sys.stderr.isatty()):
            return False
        words = error.command().partition(shlex.quote(error.path))[2].strip()
        sys.stderr.write(f"levelhead: {error.sentence}; {'read on' if self.yes else 'Enter reads on'} with {words}")
        sys.stderr.write("\n" if self.yes else " ")
        sys.stderr.flush()
        return self.yes or sys.stdin.readline() == "\n"

    def hints(self) -> JsonObject:
        """The hints as arguments of ``levelhead.read``."""
        from levelhead.sources import parse_counts, parse_map, parse_units

        return {
            "map": parse_map(self.map),
            "units": parse_units(self.units),
            "counts": parse_counts(self.counts),
            "rate": self.rate,
            "sensor": self.sensor,
            "session": self.session,
        }

    def orientation(self, log: Path | None, column: str) -> "Track":
        """The orientation in quaternion columns of the log, with these hints."""
        from levelhead.sources import orientation

        return orientation(_of_log(log, column), column, **self._clock_hints())

    def angle(self, log: Path | None, column: str) -> "tuple[str, Array, Array]":
        """Name, stamps and values of one angle in a column of the log, with these hints."""
        from levelhead.sources import angle

        return angle(_of_log(log, column), column, **self._clock_hints())

    def _clock_hints(self) -> JsonObject:
        """The hints that a column beside the sensors shares with them."""
        return {name: value for name, value in self.hints().items() if name not in ("sensor", "session")}


def _of_log(log: Path | None, column: str) -> Path:
    if log is None:
        raise LevelheadError(f"--track {column} names a column of a log; a simulation has none")
    return log


def column_names(words: Sequence[str]) -> list[str]:
    """The names of ``--track``, each once.

    Raises:
        LevelheadError: an empty name, or one that is given twice.
    """
    names: list[str] = []
    for name in (word.strip() for word in words):
        if not name:
            raise LevelheadError("--track needs the name of quaternion columns, such as --track ahrs_q")
        if name in names:
            raise LevelheadError(f"--track {name} is given twice; give it once")
        names.append(name)
    return names


def filter_names(_: object) -> dict[str, str]:
    """Names of the filters and their descriptions, for the shell to complete."""
    return {flt.name: str(flt.params.__doc__).partition("\n")[0] for flt in filters.ALL}


def filter_option(help: str) -> Parameter:
    """``--filter`` of a command that takes several filters with parameters; ``help`` lists them."""
    return Parameter(name=["--filter", "-f"], negative="", metavar="NAME[:K=V,…]", completer=filter_names, help=help)


def parameter_names(_: object) -> dict[str, str]:
    """Names of all filters' parameters and their meanings, for the shell to complete."""
    return {name: param.doc for flt in filters.ALL for name, param in settable(flt.params).items()}


def guard_names(_: object) -> dict[str, str]:
    """The values of ``--guard``, for the shell to complete."""
    names = {f"{name}=": param.doc for name, param in settable(Guard).items()}
    return {"off": "the filter alone, which gets every reading"} | names


FILTERS = ", ".join(flt.name for flt in filters.ALL)
FilterName = Annotated[
    str | None,
    Parameter(
        name=["--filter", "-f"],
        completer=filter_names,
        metavar="NAME",
        help=f"One of {FILTERS}. Without it, the default filter.",
    ),
]


GuardWords = Annotated[
    tuple[str, ...],
    Parameter(
        name="--guard",
        negative="",
        metavar="K=V",
        completer=guard_names,
        help="A threshold of the guard in front of the filter, such as rest_time=3; may be given several times. "
        f"The names are {', '.join(settable(Guard))}. `--guard off` removes the guard.",
    ),
]


Engine = Annotated[
    Literal["auto", "native", "compiled", "python"],
    Parameter(help="Code that runs the filter; the results are the same bits."),
]
FromFile = Annotated[
    Path | None,
    Parameter(
        name="--params",
        metavar="FILE",
        help="The filter with its parameters, as written by `levelhead tune` or `levelhead sweep … --json`; "
        "other options override it.",
    ),
]


FILE_SUFFIXES = {".csv", ".json", ".png", ".parquet", ".npz", ".mcap", ".db3", ".bag", ".md", ".h", ".c"}


def refuse_file_name(_: object, path: Path | None) -> None:
    """Refuses the name of a file where a folder is made.

    Raises:
        LevelheadError: with a folder of that name instead.
    """
    if path is not None and path.suffix.lower() in FILE_SUFFIXES and not path.is_dir():
        raise LevelheadError(
            f"It is the name of a file; expected a folder for the results, such as -o {path.with_suffix('')}"
        )


OUT_FOLDER = Parameter(name=["--out", "-o"], metavar="DIR", validator=refuse_file_name)
Axes = Annotated[str, Parameter(name="--axes", metavar="X,Y,Z", allow_leading_hyphen=True)]


def parse_settings(pairs: Iterable[str], example: str = "r_measure=0.1") -> JsonObject:
    """``k=v`` words as keyword arguments of a Params class.

    Raises:
        LevelheadError: a word without ``=``, or the same name twice.
    """
    values: JsonObject = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name:
            raise LevelheadError(f"'{pair}' sets nothing; write a parameter and its value, such as {example}")
        if name in values:
            raise LevelheadError(f"'{name}' is set twice; give it once")
        values[name] = {"true": True, "false": False}.get(text.lower(), _number_or_text(text))
    return values


def _number_or_text(text: str) -> float | str:
    """A value as a number; other text stays, and the class of the parameters refuses it by name."""
    try:
        return float(text)
    except ValueError:
        return text


def parse_filter(
    name: str | None,
    pairs: Sequence[str],
    default: Callable[[], Params] = filters.default,
    noise: Path | None = None,
    tuned: "ParameterFile | None" = None,
) -> Params:
    """The Params object for ``--filter NAME --params FILE --noise FILE --set k=v``; without a name the best
    filter of the file, or ``default``.
    """
    values = parse_settings(pairs)
    if tuned is not None:
        chosen = tuned.params
    elif name is not None:
        chosen = filters.find(name).params(**values)
    else:
        chosen = default()
        for parameter in values:
            require_parameter(chosen, parameter)
    chosen = with_noise(chosen, noise)
    return chosen._replace(**values) if values else chosen


def read_parameters(path: Path | None, name: str | None) -> "ParameterFile | None":
    """The parameters of ``--params FILE``, for the filter of ``--filter NAME`` if that is given."""
    if path is None:
        return None
    from levelhead.parameter_file import ParameterFile

    return ParameterFile.read(path, None if name is None else filters.find(name))


def with_noise(params: Params, noise: Path | None) -> Params:
    """The parameters with the noise in the file that ``--noise`` names."""
    if noise is None:
        return params
    from levelhead.noise import NoiseModel

    return NoiseModel.read(noise).parameters(params)


def parse_guard(words: Sequence[str], tuned: "ParameterFile | None" = None) -> Guard | None:
    """The guard for ``--guard k=v``; None for ``--guard off``; without words that of ``--params FILE``."""
    if not words and tuned is not None and tuned.guard is not None:
        return tuned.guard
    if not any(word.lower() == "off" for word in words):
        return Guard(**parse_settings(words, "rest_time=3, or off"))
    if len(words) > 1:
        raise LevelheadError("--guard off leaves no threshold to set; give either off or thresholds")
    return None


def require_parameter(params: Params, parameter: str) -> None:
    """Makes sure that the filter that was chosen for the user has a parameter that he names.

    Raises:
        LevelheadError: only other filters have it; the sentence names them.
    """
    owners = [flt.name for flt in filters.ALL if parameter in settable(flt.params)]
    if owners and filters.of(params).name not in owners:
        raise LevelheadError(
            f"{filters.of(params).name}, the best filter for these sensors, has no parameter '{parameter}'; "
            f"name one that has: {' or '.join(f'--filter {owner}' for owner in owners)}"
        )


def require_self_calibration(params: Params, option: str) -> None:
    """Makes sure that the filter estimates the errors of its sensor.

    Raises:
        LevelheadError: it does not; the sentence names those that do.
    """
    flt = filters.of(params)
    if flt.calibration is None:
        who = " or ".join(f"--filter {one.name}" for one in filters.ALL if one.calibration)
        raise LevelheadError(f"{option} needs a filter that learns its sensor, which {flt.name} does not; try {who}")


def read_prior(path: Path | None, params: Params) -> "Calibration | None":
    """The calibration in the file that ``--prior`` names, for a filter that can start with it."""
    from levelhead.calibration import Calibration

    if path is None:
        return None
    require_self_calibration(params, "--prior")
    return Calibration.read(path)


def parse_filter_spec(word: str) -> Params:
    """A Params object from ``NAME`` or ``NAME:k=v,k=v``."""
    name, _, pairs = word.partition(":")
    return filters.find(name).params(**parse_settings(pairs.split(",") if pairs else []))


def parse_method(word: str) -> "Method":
    """A filter of ours from ``NAME`` or ``NAME:k=v,k=v``, "default", "smoother", or a contender's name."""
    from levelhead.bench.methods import find_method, from_params

    return from_params(parse_filter_spec(word)) if ":" in word else find_method(word)


def simulate_recording(
    what: str,
    seed: int | None = None,
    duration: float | None = None,
    rate: float | None = None,
    sensor: str | None = None,
    noise: Path | None = None,
) -> "Recording":
    """The recording of ``--simulate NAME``: the lesson, its hard case, or a motion seen by a sensor.

    Without a seed it is 42 for the lessons, 0 otherwise; the lessons have their own duration, rate and sensor. The
    noise in a file takes the place of the sensor's own; without a sensor it is the only error.
    """
    from levelhead import simulate
    from levelhead.errors import nearest

    lessons = {"lesson": simulate.lesson, "hard": simulate.hard_lesson}
    if what in lessons:
        if (duration, rate, sensor, noise) != (None, None, None, None):
            raise LevelheadError(f"'{what}' has its own sensor, duration and rate; only --seed can be chosen")
        return lessons[what](42 if seed is None else seed)
    if what not in simulate.MOTIONS:
        raise LevelheadError(f"there is no simulation '{what}'; {nearest(what, [*lessons, *simulate.MOTIONS])}")
    chosen: Any = sensor
    if noise is not None:
        from levelhead.noise import NoiseModel

        chosen = NoiseModel.read(noise).imu(None if sensor is None else simulate.imu(sensor))
    wishes: JsonObject = {"seed": seed, "duration": duration, "rate": rate, "sensor": chosen}
    return simulate.recording(motion=what, **{name: wish for name, wish in wishes.items() if wish is not None})


def folder(path: Path) -> Path:
    """The folder for results, made if it is not there.

    Raises:
        LevelheadError: it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LevelheadError(f"cannot make the folder {path}: {error.strerror or error}") from None
    return path


NO_PICTURE = "no picture: it needs matplotlib (pip install 'levelhead[plot]')"


def can_draw() -> bool:
    """Whether there is something to draw with; tables and tracks are worth having all the same."""
    from importlib.util import find_spec

    return find_spec("matplotlib") is not None


def require_writable(path: Path) -> None:
    """Makes sure before the work that results can be written into a folder, which is not made yet.

    Raises:
        LevelheadError: it is not a folder, or cannot be made or written.
    """
    there = next(one for one in (path.absolute(), *path.absolute().parents) if one.exists())
    if not there.is_dir():
        raise LevelheadError(f"cannot make the folder {path}: {there} is a file")
    if not os.access(there, os.W_OK | os.X_OK):
        raise LevelheadError(f"cannot make the folder {path}: {there} cannot be written")


@standard_output()
def print_line(text: str) -> None:
    """A line for people, on standard output."""
    sys.stdout.write(f"{text}\n")


def print_written(written: Iterable[Path], plot: bool) -> None:
    """The last line: which files there are; before it why there is no picture, if one was asked for."""
    if plot and not can_draw():
        print_line(f"{NO_PICTURE}; --no-plot leaves this line out")
    print_line("written: " + ", ".join(str(path) for path in written))


@standard_output()
def print_json(value: Mapping[str, object]) -> None:
    """The result for programs, on standard output."""
    escape = "utf" not in (sys.stdout.encoding or "").lower()
    json.dump(value, sys.stdout, indent=2, ensure_ascii=escape, allow_nan=False)
    sys.stdout.write("\n")
