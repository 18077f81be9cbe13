"""``levelhead export FILTER``: from the notebook to the microcontroller."""

import json as reader
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead import filters
from levelhead.cli.options import (
    Axes,
    GuardWords,
    filter_names,
    parse_guard,
    parse_settings,
    print_json,
    print_line,
    read_prior,
    with_noise,
)
from levelhead.errors import LevelheadError
from levelhead.guard import Guard
from levelhead.open_types import Fields


def export(
    filter: Annotated[str, Parameter(name="FILTER", completer=filter_names)],
    /,
    *,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    tuned: Annotated[Path | None, Parameter(name="--from", metavar="FILE")] = None,
    noise: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    guard: GuardWords = (),
    prior: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    calibration: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    axes: Axes = "x,y,z",
    axis: Annotated[bool, Parameter(negative="")] = False,
    single: Annotated[bool, Parameter(name="--float", negative="")] = False,
    double: Annotated[bool, Parameter(negative="")] = False,
    arduino: Annotated[bool, Parameter(negative="")] = False,
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="DIR")] = Path(),
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """A filter with its numbers as C99: header, source, self-test, CMake file and a sketch for the MPU-6050.

    Args:
        filter: which one, such as EKF.
        set: a parameter of the filter, such as acc_tau=3; may be given several times.
        tuned: JSON with the filter's parameters, such as `levelhead sweep … --json` prints; --set comes on top.
        noise: the sensor's noise as `levelhead noise` has written it: Q and R of an ESKF, EKF or Kalman; --set comes
            on top.
        prior: the calibration of the same sensor from `levelhead fuse --save-calibration`: the filter starts with it.
        calibration: the same file for any other filter: the errors of the sensor are taken off its readings.
        axes: the sensor's axes that are the body's x (forward), y (left) and z (up), such as -y,x,z;
            `levelhead axes` finds them.
        axis: the filter of one angle and its rate instead of that of an IMU.
        single: all numbers as float, for boards without a fast double.
        double: all numbers as double, with the bits of Python: the default.
        arduino: as a library folder for the Arduino IDE, with the sketch as its example.
        out: folder for the files.
        json: print the result as JSON.
    """
    from levelhead.axis_map import IDENTITY, AxisMap
    from levelhead.calibration import Calibration
    from levelhead.export import ExportConfig, write

    if single and double:
        raise LevelheadError("--float and --double contradict each other; give one of them")
    flt, mounted = filters.find(filter), AxisMap.parse(axes)
    found = _read_tuned(flt, tuned)
    params = with_noise(flt.params(**found.get("params", {})), noise)
    changes = parse_settings(set)
    params = params._replace(**changes) if changes else params
    before = parse_guard(guard) if guard else Guard(**found.get("guard", {}))
    words = ["levelhead export", flt.name, *(f"--set {word}" for word in set)]
    words += [f"--from {tuned.name}"] if tuned else []
    words += [f"--noise {noise.name}"] if noise else []
    words += [f"--guard {word}" for word in guard]
    words += [f"--prior {prior.name}"] if prior else []
    words += [f"--calibration {calibration.name}"] if calibration else []
    words += [f"--axes {mounted}"] if mounted != IDENTITY else []
    words += ["--axis"] if axis else []
    words.append("--float" if single else "--double")
    words += ["--arduino"] if arduino else []
    known = read_prior(prior, params)
    config = ExportConfig(
        params,
        before,
        "float" if single else "double",
        axis,
        prior=known,
        axes=mounted,
        calibration=Calibration.read(calibration) if calibration else None,
        command=" ".join(words),
    )
    written = write(config, out, arduino)
    if json:
        print_json({"filter": flt.name, "params": dict(params._asdict()), "written": [str(path) for path in written]})
        return
    print_line("written: " + ", ".join(str(path) for path in written))


def _read_tuned(flt: filters.Filter, path: Path | None) -> Fields:
    """A filter from a JSON file: "filter" and "params", perhaps "guard"; of a sweep its minimum counts.

    Raises:
        LevelheadError: it is not there, no JSON, or about another filter.
    """
    if path is None:
        return {}
    try:
        found = reader.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise LevelheadError(f"there is no file {path}") from None
    except (OSError, ValueError) as error:
        raise LevelheadError(f"{path} cannot be read as JSON: {error}") from None
    if not isinstance(found, dict) or not isinstance(found.get("params"), dict):
        raise LevelheadError(f'{path} has no parameters; expected {{"filter": "{flt.name}", "params": {{…}}}}')
    if found.get("filter", flt.name) != flt.name:
        raise LevelheadError(f"{path} holds parameters of {found['filter']}, not of {flt.name}")
    guard = found.get("guard") or {}
    if not isinstance(guard, dict):
        raise LevelheadError(f"{path}: guard is {guard!r}, but it must hold thresholds by name")
    swept, minimum = found.get("parameter"), found.get("minimum")
    params: Fields = found["params"]
    if isinstance(swept, str) and isinstance(minimum, dict) and "value" in minimum:
        params = dict(flt.params(**params)._replace(**{swept: minimum["value"]})._asdict())
    return {"params": params, "guard": guard}
