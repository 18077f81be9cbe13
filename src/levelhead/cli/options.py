"""Options that several verbs share, and what they stand for."""

import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from levelhead.errors import LevelheadError

if TYPE_CHECKING:
    from levelhead.recording import Recording


@Parameter(name="*")
@dataclass(frozen=True)
class Reading:
    """How to read the log, where the file does not say it itself."""

    map: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=gx,gy,gz")] = ()
    """Which columns are what: t, gyr, acc, mag, q. May be given several times; `mag=` leaves the magnetometer out."""
    units: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=deg/s")] = ()
    """Units that the header does not say."""
    lsb: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=131/deg/s")] = ()
    """Raw counts per unit: 131 counts are 1 deg/s."""
    rate: Annotated[float | None, Parameter(metavar="HZ")] = None
    """Samples a second, for a log without time stamps."""

    def read(self, log: Path) -> "Recording":
        """The recording in a log, with these hints."""
        from levelhead.sources import parse_lsb, parse_map, parse_units, read

        return read(
            log, map=parse_map(self.map), units=parse_units(self.units), lsb=parse_lsb(self.lsb), rate=self.rate
        )


def filter_names(_: Any) -> dict[str, str]:
    """Names of the filters and what they are, for the shell to complete."""
    from levelhead import filters

    return {flt.name: str(flt.params.__doc__).partition("\n")[0] for flt in filters.ALL}


def parameter_names(_: Any) -> dict[str, str]:
    """Names of all filters' parameters and what they mean, for the shell to complete."""
    from levelhead import filters
    from levelhead.filters.contract import settable

    return {name: param.doc for flt in filters.ALL for name, param in settable(flt.params).items()}


FilterName = Annotated[str | None, Parameter(completer=filter_names, metavar="NAME")]


def settings(pairs: Iterable[str]) -> dict[str, Any]:
    """``k=v`` words as keyword arguments of a Params class.

    Raises:
        LevelheadError: a word without ``=``, or the same name twice.
    """
    values: dict[str, Any] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name:
            raise LevelheadError(f"'{pair}' sets nothing; write a parameter and its value, such as r_measure=0.1")
        if name in values:
            raise LevelheadError(f"'{name}' is set twice; give it once")
        values[name] = {"true": True, "false": False}.get(text.lower(), text)
    return values


def chosen_filter(name: str | None, pairs: Sequence[str], recording: "Recording") -> Any:
    """The Params object for ``--filter NAME --set k=v``; without a name the best filter for the sensors there are."""
    from levelhead import filters

    if name is None:
        best = filters.best(recording.mag is not None)
        return best._replace(**settings(pairs)) if pairs else best
    return filters.find(name).params(**settings(pairs))


def listed_filter(word: str) -> Any:
    """A Params object from ``NAME`` or ``NAME:k=v,k=v``."""
    from levelhead import filters

    name, _, pairs = word.partition(":")
    return filters.find(name).params(**settings(pairs.split(",") if pairs else []))


def simulated(what: str, seed: int, duration: float = 60.0, rate: float = 100.0, sensor: str | None = None) -> Any:
    """The recording that ``--simulate WHAT`` stands for: the lesson, its hard case, or a motion seen by a sensor."""
    from levelhead import simulate
    from levelhead.errors import nearest
    from levelhead.simulate.motion import STYLES

    if seed < 0:
        raise LevelheadError(f"the seed is {seed}; it must be 0 or more")
    lessons = {"lesson": simulate.lesson, "hard": simulate.hard_lesson}
    if what in lessons:
        return lessons[what](seed)
    if what not in STYLES:
        raise LevelheadError(f"there is no simulation '{what}'; {nearest(what, [*lessons, *STYLES])}")
    return simulate.recording(sensor or "MPU-6050", what, duration, rate, seed)


def log_or_simulation(log: Path | None, simulate: str | None, seed: int | None, reading: Reading) -> "Recording":
    """The recording of a verb that takes a log or a simulation, one of the two."""
    if (log is None) == (simulate is None):
        raise LevelheadError("give either a log or --simulate, such as: --simulate lesson")
    if log is not None:
        return reading.read(log)
    recording: Recording = simulated(
        str(simulate), (42 if simulate in ("lesson", "hard") else 0) if seed is None else seed
    )
    return recording


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


def say(text: str) -> None:
    """A line for people, on standard output."""
    sys.stdout.write(f"{text}\n")


def say_json(value: dict[str, Any]) -> None:
    """The result for programs, on standard output."""
    json.dump(value, sys.stdout, indent=2, ensure_ascii=False, allow_nan=False)
    sys.stdout.write("\n")
