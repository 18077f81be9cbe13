"""An orientation as OpenSim reads it: a STO file of quaternions (OpenSense, ``DataType=Quaternion``)."""

import math
from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.track import Track

SENSOR = "imu"  # the name of the column; OpenSense wants that of a body, such as pelvis_imu


def write_sto(track: Track, path: Path, sensor: str = SENSOR) -> None:
    """Writes the quaternions (wxyz, sensor to earth) of a track; rows without one are left out.

    Raises:
        LevelheadError: the file cannot be written.
    """
    track = track.to_frame("ENU")
    rows = [row for row in zip(track.t.tolist(), track.quat.tolist(), strict=True) if math.isfinite(sum(row[1]))]
    rate = 1.0 if len(rows) < 2 else (len(rows) - 1) / (rows[-1][0] - rows[0][0])
    head = f"DataRate={rate:.6f}\nDataType=Quaternion\nversion=3\nOpenSimVersion=4.5\nendheader\n"
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        file.write(f"{head}time\t{sensor}\n")
        for t, quat in rows:
            file.write(f"{t!r}\t{','.join(map(repr, quat))}\n")
