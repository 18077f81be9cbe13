"""``levelhead stress LOG|--simulate``: the response of filters to sensor failures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.calibrated_log import CalibrationFile, read_calibrated
from levelhead.cli.options import (
    FILTERS,
    NO_PICTURE,
    OUT_FOLDER,
    FromFile,
    GuardWords,
    Reading,
    can_draw,
    filter_option,
    folder,
    parse_guard,
    parse_method,
    print_json,
    print_line,
    read_parameters,
    require_writable,
)
from levelhead.errors import LevelheadError, nearest

if TYPE_CHECKING:
    from levelhead.recording import Recording

SENSOR, MAGNETOMETER, DURATION = "BMI160", "HMC5883L", 180.0  # of a simulation, whose log has every sensor


def fault_names(_: object) -> dict[str, str]:
    """The names of faults with their meanings, for the shell to complete."""
    from levelhead.simulate.fault import KINDS

    return {kind.name: f"{kind.words} [{kind.unit}]" for kind in KINDS}


def stress(
    log: Path | None = None,
    /,
    *,
    simulate: Annotated[str | None, Parameter(metavar="MOTION")] = None,
    seed: int = 0,
    fault: Annotated[
        tuple[str, ...],
        Parameter(negative="", metavar="NAME[=SIZE][@START[+LENGTH]]", completer=fault_names),
    ] = (),
    filter: Annotated[
        tuple[str, ...],
        filter_option(
            f"{FILTERS}, `default`, `smoother`, or a contender such as `vqf.VQF`; may be given several times. The "
            "default and one filter of each other package that is installed if none is named."
        ),
    ] = (),
    tuned: FromFile = None,
    calibration: CalibrationFile = None,
    guard: GuardWords = (),
    list: Annotated[bool, Parameter(negative="")] = False,
    out: Annotated[Path | None, OUT_FOLDER] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Put faults on a recording, one at a time: error, recovery, health and honesty of σ of each filter.

    Errors are against the truth; without it, differences from the same filter's run without the fault.

    Args:
        log: A recording of 20 s or more, real or simulated.
        simulate: Use a simulation instead of a log: 180 s of a motion (hand, walking, drone, robot, still) with a
            BMI160 and an HMC5883L.
        seed: Seed of the simulation and of the faults' random numbers.
        fault: A fault with size, start and length in s, such as gyr_spikes=500@20+5; may be given several times. By
            default, every fault that fits the sensors, each at 40 % of the recording.
        list: Print the faults with unit and usual size, and end.
        out: Folder for the picture stress.png; without it, no picture is drawn.
        json: Print all figures as JSON.
    """
    from levelhead.bench.methods import distinct_methods, from_params
    from levelhead.bench.stress import stress as run
    from levelhead.bench.stress import usual_methods
    from levelhead.publish.progress import progress
    from levelhead.simulate.fault import all_faults, complete, parse_fault

    if list:
        print_line(_fault_table())
        return
    faults = [parse_fault(word) for word in fault]
    file = read_parameters(tuned, None)
    methods, left_out = ([parse_method(word) for word in filter], []) if filter else usual_methods()
    if file is not None:
        methods = distinct_methods([from_params(file.params), *methods])
    before = parse_guard(guard, file)
    if out is not None:
        require_writable(out)
    recording = _recording(log, simulate, seed, reading, calibration)
    faults = [complete(one, recording) for one in faults] or all_faults(recording)
    if not fault and recording.mag is None:
        left_out.append("There is no magnetometer in the log: its faults are left out.")
    with progress("stressing") as report:
        result = run(recording, faults, methods, guard=before, seed=seed, left_out=left_out, progress=report)
    picture = None
    if out is not None and can_draw():
        from levelhead.publish.plots.stress import stress_picture

        picture = folder(out) / "stress.png"
        stress_picture(result, picture)
    if json:
        print_json(result.to_dict() | {"written": [str(picture)] if picture else []})
        return
    print_line(str(result))
    if picture is not None:
        print_line(f"written: {picture}")
    else:
        print_line("no picture asked for: -o DIR draws the errors through every fault" if out is None else NO_PICTURE)


def _fault_table() -> str:
    """The faults as a table; of a size that depends on the recording no number."""
    from levelhead.evaluate.text_table import Column, plain_table
    from levelhead.simulate.fault import KINDS

    columns = [Column("name", "fault"), Column("words", "the fault"), Column("size", "usual size")]
    rows = [
        {
            "name": kind.name,
            "words": kind.words,
            "size": f"below the largest reading [{kind.unit}]"
            if callable(kind.size)
            else f"{kind.size:.4g} {kind.unit}",
        }
        for kind in KINDS
    ]
    return plain_table(columns, rows)


def _recording(
    log: Path | None, motion: str | None, seed: int, reading: Reading, calibration: Path | None
) -> "Recording":
    from levelhead import simulate
    from levelhead.simulate.motion import STYLES

    if (log is None) == (motion is None):
        raise LevelheadError("give either a log or --simulate, such as: levelhead stress --simulate hand")
    if log is not None:
        return read_calibrated(reading, log, calibration)
    if calibration is not None:
        raise LevelheadError("--calibration is for a log; --simulate has a sensor of its own")
    if reading != Reading():
        raise LevelheadError("--map, --units, --counts and --rate are for a log; --simulate needs none of them")
    if motion not in STYLES:
        raise LevelheadError(f"there is no motion '{motion}'; {nearest(str(motion), STYLES)}")
    return simulate.recording(SENSOR, str(motion), DURATION, seed=seed, mag=MAGNETOMETER)
