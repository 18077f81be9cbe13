"""``levelhead calibrate LOG…`` and ``calibrate --live``: the errors of a sensor, from poses by hand or any motion."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.calibrated_log import read_with_field
from levelhead.cli.options import (
    OUT_FOLDER,
    Axes,
    Reading,
    can_draw,
    folder,
    print_json,
    print_line,
    print_written,
    require_writable,
)
from levelhead.errors import LevelheadError
from levelhead.units import GRAVITY

LIVE_NAME = "sensor"  # of the files of a calibration without a log


def calibrate(
    logs: Annotated[tuple[Path, ...], Parameter(metavar="LOG", negative="")] = (),
    /,
    *,
    magnetometer: Annotated[bool, Parameter(negative="")] = False,
    live: Annotated[bool, Parameter(negative="")] = False,
    source: Annotated[str | None, Parameter(name=["--source", "-s"], metavar="WHAT")] = None,
    poses: Annotated[int | None, Parameter(metavar="N")] = None,
    view: Annotated[bool, Parameter(negative="")] = False,
    speed: Annotated[float, Parameter(metavar="X")] = 1.0,
    axes: Axes = "x,y,z",
    gyr_range: Annotated[float, Parameter(metavar="DEG/S")] = 500.0,
    acc_range: Annotated[float, Parameter(metavar="G")] = 4.0,
    gravity: Annotated[float, Parameter(metavar="M/S²")] = GRAVITY,
    turn: Annotated[float | None, Parameter(metavar="DEG")] = None,
    out: Annotated[Path, OUT_FOLDER] = Path(),
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Calibrate a sensor: put it down in a dozen poses, still for 2 s each, and turn it by hand from one to the next.

    Finds the poses, put down or held by hand, and solves for the errors of accelerometer, gyroscope and magnetometer.
    Six sides give offsets and scales; edges add cross-axis numbers. Prints each number with its σ, the poses that are
    missing, and the gain on poses that were left out. A sensor without a gain is left out of the file. An axis that is
    reversed, swapped, clipped or stuck is named, and there is no file. Writes LOG-calibration.json for the
    --prior of `fuse` and `export` and for --calibration, and LOG-poses.png. With --live it guides you from pose to pose
    until every number is determined. Ctrl-C ends without a file.

    With --magnetometer any motion will do, without poses: turn the sensor about two axes for half a minute, away from
    iron. The command prints the offset, the gain on parts that were left out, and the turn that is missing. The picture
    is LOG-magnetometer.png.

    Args:
        logs: Recordings of one sensor that stayed on between them.
        magnetometer: Calibrate the magnetometer alone, from any motion.
        live: Use a connected sensor instead of a log; the files are sensor-calibration.json and sensor-poses.png.
        source: With --live, the sensor as for `levelhead run`: emulated:mpu6050 (no hardware, moved by itself), mpu6050
            or another chip on I²C, serial:/dev/ttyUSB0@115200, or replay:FILE.
        poses: With --live, the minimum number of poses: 6 or more, by default 12.
        view: With --live, show the wanted pose in the browser as well.
        speed: Speed of a replay: 2 is twice as fast, inf as fast as possible.
        axes: The sensor's axes that are the body's x (forward), y (left) and z (up), such as -y,x,z.
        gyr_range: Full scale of a chip's gyroscope.
        acc_range: Full scale of a chip's accelerometer.
        gravity: Gravity at your place in m/s²: 9.780 at the equator, 9.832 at a pole.
        turn: Known angle of turns on a level table, in degrees. Lay an edge against a ruler, wait, turn the sensor by a
            multiple of the angle, and lay the same edge there again. --turn 360 is for whole turns.
        out: Folder for the results.
        plot: Draw the picture (needs the extra levelhead[plot]).
        json: Print numbers, residuals and verdict as JSON.
    """
    from levelhead.calibrate import calibrate_sensor
    from levelhead.publish.progress import progress

    _require_one_way(logs, live, source, poses, view)
    require_writable(out)
    if magnetometer:
        if live:
            raise LevelheadError("--magnetometer needs a log of any motion; leave --live out")
        _calibrate_magnetometer(logs, out, plot, json, reading)
        return
    if source is not None:
        from levelhead.cli.live_poses import record_live_poses

        recordings = [record_live_poses(source, poses, view, speed, axes, gyr_range, acc_range, gravity, reading)]
    else:
        with progress("reading"):
            recordings = [reading.read(log) for log in logs]
    with progress("calibrating") as report:
        found = calibrate_sensor(recordings, gravity=gravity, turn=turn, progress=report)
    name = logs[0].stem if logs else LIVE_NAME
    written = [folder(out) / f"{name}-calibration.json"]
    found.calibration.save(written[0])
    if plot and can_draw():
        from levelhead.publish.plots.pose_panels import pose_picture

        written.append(out / f"{name}-poses.png")
        pose_picture(found, written[1])
    if json:
        print_json(found.to_dict() | {"written": [str(path) for path in written]})
        return
    print_line("\n".join([*found.verdict(), "", *found.calibration.words()]))
    print_written(written, plot)


def _calibrate_magnetometer(logs: tuple[Path, ...], out: Path, plot: bool, json: bool, reading: Reading) -> None:
    """``calibrate --magnetometer``."""
    from levelhead.calibrate import calibrate_magnetometer
    from levelhead.publish.progress import progress

    with progress("reading"):
        recordings = [read_with_field(reading, log) for log in logs]
    with progress("calibrating") as report:
        found = calibrate_magnetometer(recordings, progress=report)
    written = [folder(out) / f"{logs[0].stem}-calibration.json"]
    found.calibration.save(written[0])
    if plot and can_draw():
        from levelhead.publish.plots.field_sphere import sphere_picture

        written.append(out / f"{logs[0].stem}-magnetometer.png")
        sphere_picture(found, written[1])
    if json:
        print_json(found.to_dict() | {"written": [str(path) for path in written]})
        return
    print_line("\n".join([*found.verdict(), "", *found.calibration.words()]))
    print_written(written, plot)


def _require_one_way(logs: tuple[Path, ...], live: bool, source: str | None, poses: int | None, view: bool) -> None:
    """Makes sure that there are either logs or a live source.

    Raises:
        LevelheadError: neither, both, or an option of the other.
    """
    if live and logs:
        raise LevelheadError("calibrate takes either logs or --live; leave one of them out")
    if live and source is None:
        raise LevelheadError("calibrate --live needs a source, such as: --source emulated:mpu6050")
    if not live and (source is not None or poses is not None or view):
        raise LevelheadError("--source, --poses and --view are for calibrate --live; add --live or leave them out")
    if not live and not logs:
        raise LevelheadError("calibrate needs a log; expected: levelhead calibrate LOG …, or --live --source WHAT")
