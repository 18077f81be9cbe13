"""The group of a recording: BROAD's groups, RepoIMU's devices, else the folder."""

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from levelhead.errors import LevelheadError

BROAD, REPOIMU = "BROAD", "RepoIMU"
MOTIONS, SPEEDS = ("rotation", "translation", "combined"), ("slow", "fast")
DISTURBANCES = {  # BROAD's word -> ours
    "tapping": "tapping",
    "vibration": "vibration",
    "stationary_magnet": "magnet nearby",
    "attached_magnet": "magnet attached",
    "office_environment": "office",
    "office": "office",
    "mixed": "mixed",
}
PHONE_MOTIONS = frozenset(  # of T. Michel and others, Attitude estimation for indoor navigation, 2018 (tyrex)
    {"ar", "texting", "phoning", "swinging", "frontpocket", "backpocket", "runninghand", "runningpocket"}
)
ORDER = (*(f"{motion} {speed}" for motion in MOTIONS for speed in SPEEDS), *dict.fromkeys(DISTURBANCES.values()))


class Group(NamedTuple):
    """The data set, and the group in it."""

    dataset: str
    name: str

    @property
    def place(self) -> tuple[int, str]:
        """Its place in a table: BROAD's groups in BROAD's order, then the others by name."""
        return (ORDER.index(self.name) if self.dataset == BROAD and self.name in ORDER else len(ORDER), self.name)


def group_of(path: Path) -> Group:
    """By ``trials.json`` beside the file, as BROAD ships it; without one, by the name of the file.

    Raises:
        LevelheadError: a ``trials.json`` that is none.
    """
    told = _trials(path.parent).get(path.stem)
    name = path.stem.lower()
    if told is not None or "_undisturbed_" in name or "_disturbed_" in name:
        return Group(BROAD, _broad(told if told is not None else _tags(name)))
    if name.startswith(("tstick", "pendulum")):
        return Group(REPOIMU, f"{REPOIMU} {path.stem.partition('_')[0]}")
    dataset = path.parent.name or "recordings"
    motion = path.stem.rpartition("_")[2].lower()
    return Group(dataset, f"{dataset} {motion}" if motion in PHONE_MOTIONS else dataset)


def _broad(tags: Sequence[str]) -> str:
    """The finest group that the tags name."""
    for tag, name in DISTURBANCES.items():
        if tag in tags:
            return name
    words = [word for kinds in (MOTIONS, SPEEDS) for word in kinds if word in tags]
    return " ".join(words) or "other"


def _tags(name: str) -> list[str]:
    """BROAD's tags from a file's name: "28_disturbed_stationary_magnet_A" has stationary_magnet."""
    words = name.split("_")
    return words + ["_".join(pair) for pair in pairwise(words)]


def _trials(folder: Path) -> dict[str, list[str]]:
    path = folder / "trials.json"
    if not path.is_file():
        return {}
    try:
        trials = json.loads(path.read_text(encoding="utf-8"))["trials"]
        return {str(name): list(trial["groups"]) for name, trial in trials.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise LevelheadError(
            f"{path} is not BROAD's list of trials; expected JSON with groups for each trial, or no such file"
        ) from None
