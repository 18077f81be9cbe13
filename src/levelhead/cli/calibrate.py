"""``levelhead calibrate LOG…``: the errors of a sensor from poses by hand."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import (
    NO_PICTURE,
    Reading,
    can_draw,
    folder,
    print_json,
    print_line,
    require_writable,
)
from levelhead.errors import LevelheadError
from levelhead.units import GRAVITY


def calibrate(
    logs: Annotated[tuple[Path, ...], Parameter(metavar="LOG", negative="")],
    /,
    *,
    gravity: Annotated[float, Parameter(metavar="M/S²")] = GRAVITY,
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="DIR")] = Path(),
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Calibrate a sensor: put it down in a dozen poses, still for 2 s each, and turn it by hand from one to the next.

    Finds the poses, solves for accelerometer, gyroscope and magnetometer, and says how sure each number is, which the
    poses could not tell and which pose would, and how much better it is on poses that were held out. Writes
    LOG-calibration.json, which `fuse --prior` and `export --prior` or `--calibration` take, and LOG-poses.png.

    Args:
        logs: recordings of one sensor, without switching it off between them.
        gravity: at the place; 9.780 at the equator, 9.832 at a pole.
        out: folder for the results.
        plot: draw the picture (needs the extra levelhead[plot]).
        json: print numbers, residuals and verdict as JSON.
    """
    from levelhead.calibrate import calibrate_sensor
    from levelhead.publish.progress import progress

    if not logs:
        raise LevelheadError("calibrate needs a log; expected: levelhead calibrate LOG …")
    require_writable(out)
    with progress("reading"):
        recordings = [reading.read(log) for log in logs]
    with progress("calibrating") as report:
        found = calibrate_sensor(recordings, gravity=gravity, progress=report)
    name = logs[0].stem
    written = [folder(out) / f"{name}-calibration.json"]
    found.calibration.save(written[0])
    if plot and can_draw():
        from levelhead.publish.plots.pose_panels import pose_picture

        written.append(out / f"{name}-poses.png")
        pose_picture(found, written[1])
    if json:
        print_json(found.to_dict() | {"written": [str(path) for path in written]})
        return
    for line in (*found.verdict(), "", *found.calibration.words()):
        print_line(line)
    if plot and not can_draw():
        print_line(f"{NO_PICTURE}; --no-plot leaves this line out")
    print_line("written: " + ", ".join(str(path) for path in written))
