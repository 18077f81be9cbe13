"""A comparison of methods as files: picture, CSV, JSON and Markdown."""

import csv
import json
from importlib.util import find_spec
from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.bench.accuracy import Accuracy
from levelhead.publish.bench_tables import markdown

NAME = "accuracy"


def write_accuracy(result: Accuracy, folder: Path) -> list[Path]:
    """Write accuracy.png, .csv (a row per recording and method, degrees), .json (everything) and .md into the folder.

    Returns:
        The files; no picture where matplotlib is not installed.

    Raises:
        LevelheadError: the folder cannot be written.
    """
    picture, table, everything, page = paths = [folder / f"{NAME}.{kind}" for kind in ("png", "csv", "json", "md")]
    if find_spec("matplotlib") is None:
        paths.remove(picture)
    else:
        from levelhead.publish.plots.accuracy_chart import accuracy_picture

        accuracy_picture(result, picture)
        if result.ratios:
            from levelhead.publish.plots.ratio_chart import ratio_picture

            paths.insert(1, folder / f"{NAME}-ratios.png")
            ratio_picture(result.ratios, paths[1])
    with atomic_path(table) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(result.long[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(result.long)
    with atomic_path(everything) as temporary:
        text = json.dumps(result.to_dict(), indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")
    with atomic_path(page) as temporary:
        temporary.write_text(markdown(result), encoding="utf-8")
    return paths
