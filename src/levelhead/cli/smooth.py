"""``levelhead smooth LOG``: ``fuse`` with the whole recording used at every instant."""

from pathlib import Path

from levelhead.cli.fuse import fuse_logs
from levelhead.cli.fuse_options import FuseArguments


def smooth(*logs: Path, arguments: FuseArguments = FuseArguments()) -> None:  # noqa: B008
    """Estimate orientation with the whole recording used at every instant: the best there is after the fact.

    Args:
        logs: .csv, .tsv, .jsonl, .mat, .h5, .npz or .parquet with gyroscope and accelerometer, or a folder of such
            files. Units and columns are detected. If one of several logs fails, the others are smoothed all the same
            and the exit code is 2.
    """
    fuse_logs(logs, arguments, smooth=True)
