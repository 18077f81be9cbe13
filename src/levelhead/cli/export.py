"""``levelhead export FILTER``: from the notebook to the microcontroller."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead import filters
from levelhead.cli.options import (
    OUT_FOLDER,
    FromFile,
    GuardWords,
    filter_names,
    parse_filter,
    parse_guard,
    print_json,
    print_line,
    read_parameters,
    read_prior,
)
from levelhead.cli.placement import Placement
from levelhead.errors import LevelheadError


def export(
    filter: Annotated[str, Parameter(name="FILTER", completer=filter_names)],
    /,
    *,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    tuned: FromFile = None,
    noise: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    guard: GuardWords = (),
    prior: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    calibration: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    placement: Placement = Placement(),  # noqa: B008
    axis: Annotated[bool, Parameter(negative="")] = False,
    without: Annotated[tuple[str, ...], Parameter(negative="", metavar="PART")] = (),
    lean: Annotated[bool, Parameter(negative="")] = False,
    single: Annotated[bool, Parameter(name="--float", negative="")] = False,
    double: Annotated[bool, Parameter(negative="")] = False,
    arduino: Annotated[bool, Parameter(negative="")] = False,
    wasm: Annotated[bool, Parameter(negative="")] = False,
    board: Annotated[str, Parameter(metavar="NAME")] = "",
    chip: Annotated[str, Parameter(metavar="NAME")] = "MPU-6050",
    out: Annotated[Path, OUT_FOLDER] = Path(),
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """A filter with its numbers as C99: header, source, self-test, CMake file and a sketch for a chip.

    Args:
        filter: Name of the filter, such as EKF.
        set: A parameter of the filter, such as acc_tau=3; may be given several times.
        noise: The sensor's noise, as written by `levelhead noise`: Q and R of an ESKF, EKF or Kalman. --set overrides
            it.
        prior: Calibration of the same sensor from `levelhead fuse --save-calibration`; the filter starts with it.
        calibration: The same file for any other filter; the sensor's errors are corrected in its readings.
        axis: Export the filter of one angle and its rate instead of that of an IMU.
        without: Leave a part out: sigma, health, bias, guard; mag, if there is no magnetometer; parameters, which
            become constants. May be given several times.
        lean: Export attitude and bias only: without sigma, health, guard and parameters.
        single: Write all numbers as float, for boards without a fast double.
        double: Write all numbers as double, with the bits of Python; this is the default.
        arduino: Write a library folder for the Arduino IDE, with the sketch as its example.
        wasm: Write a package for npm instead of C alone: WebAssembly without imports, JavaScript and types. Needs clang
            and lld.
        board: Refuse a filter that this board cannot hold: uno, nano, nano-every, mega, m0, m4, rp2040 or esp32.
        chip: Chip that the sketch reads: MPU-6050, MPU-9250 or ICM-20948 with magnetometer, LSM6DSO32, LSM6DSOX or
            LSM6DS3 (+LIS3MDL: the board's magnetometer too), BMI160 or BNO055 (its readings without its fusion).
        out: Folder for the files.
        json: Print the result as JSON.
    """
    from levelhead.axis_map import IDENTITY
    from levelhead.calibration import Calibration
    from levelhead.export import ExportConfig, write, write_package
    from levelhead.export.config import LEAN

    if single and double:
        raise LevelheadError("--float and --double contradict each other; give one of them")
    if wasm and (arduino or board):
        raise LevelheadError("--wasm is for no board; leave --arduino and --board out")
    flt, mounted = filters.find(filter), placement.mounting or IDENTITY
    found = read_parameters(tuned, flt.name)
    params, before = parse_filter(flt.name, set, noise=noise, tuned=found), parse_guard(guard, found)
    words = ["levelhead export", flt.name, *(f"--set {word}" for word in set)]
    words += [f"--params {tuned.name}"] if tuned else []
    words += [f"--noise {noise.name}"] if noise else []
    words += [f"--guard {word}" for word in guard]
    words += [f"--prior {prior.name}"] if prior else []
    words += [f"--calibration {calibration.name}"] if calibration else []
    words += [f"--axes {mounted}"] if mounted != IDENTITY else []
    words += [f"--frame {placement.frame}"] if placement.frame != Placement.frame else []
    words += ["--axis"] if axis else []
    words += ["--lean"] if lean else []
    words += [f"--without {word}" for word in without]
    words += [f"--board {board}"] if board else []
    words += [f"--chip {chip}"] if chip != ExportConfig.chip else []
    words.append("--float" if single else "--double")
    words += ["--arduino"] if arduino else []
    words += ["--wasm"] if wasm else []
    known = read_prior(prior, params)
    parts = frozenset(without) | (LEAN | {"guard"} if lean else frozenset())
    config = ExportConfig(
        params,
        None if "guard" in parts else before,
        "float" if single else "double",
        axis,
        prior=known,
        axes=mounted,
        frame=placement.frame,
        calibration=Calibration.read(calibration) if calibration else None,
        without=parts - {"guard"},
        board=board,
        chip=chip,
        command=" ".join(words),
    )
    written = write_package(config, out) if wasm else write(config, out, arduino)
    if json:
        print_json({"filter": flt.name, "params": dict(params._asdict()), "written": [str(path) for path in written]})
        return
    print_line("written: " + ", ".join(str(path) for path in written))
