"""``levelhead gait LOG``: the path and the strides of a foot with a sensor on it."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import (
    OUT_FOLDER,
    Reading,
    can_draw,
    folder,
    print_json,
    print_line,
    print_written,
    require_writable,
)


def gait(
    log: Annotated[Path, Parameter(name="LOG")],
    /,
    *,
    level: bool = True,
    out: Annotated[Path, OUT_FOLDER] = Path(),
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Find the path of a foot and its strides, from a sensor on the shoe.

    The foot is on the ground at each step: its zero velocity bounds position. A log without such stances is refused.

    Args:
        log: Log of the sensor, at least 50 samples a second.
        level: Take strides that rise by no more than their error as level; stairs are kept.
        out: Folder for LOG-gait.csv (orientation, position, velocity, σ), LOG-strides.csv and LOG-gait.png.
        plot: Draw the picture (needs the extra levelhead[plot]).
        json: Print the figures as JSON.
    """
    from levelhead.gaits import gait as find
    from levelhead.publish.progress import progress
    from levelhead.publish.tables import write_table
    from levelhead.publish.writers import write_track

    require_writable(out)
    recording = reading.read(log)
    with progress(f"smoothing {log.name}") as advance:
        found = find(recording, level=level, progress=advance)
    stem = folder(out) / log.stem
    written = [stem.with_name(f"{log.stem}-gait.csv"), stem.with_name(f"{log.stem}-strides.csv")]
    write_track(found.track, written[0])
    write_table(found.strides.columns(), written[1], ".csv")
    if plot and can_draw():
        from levelhead.publish.plots.gait_picture import gait_picture

        written.append(stem.with_name(f"{log.stem}-gait.png"))
        gait_picture(found, written[2])
    if json:
        strides = {name: values.tolist() for name, values in found.strides.columns().items()}
        facts = {"distance_m": found.distance, "gap_m": found.gap, "strides": strides}
        print_json(facts | {"written": [str(path) for path in written]})
    else:
        print_line(str(found))
        print_line(f"from the first position to the last: {found.gap:.2f} m")
        print_written(written, plot)
