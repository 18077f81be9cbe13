"""The verdict on a layout of public code; importing this registers all rounds of them."""

from pathlib import Path

from tests.reference import (  # noqa: F401  (each registers its layouts)
    layouts_of_apps,
    layouts_of_firmware,
    layouts_of_instruments,
    layouts_of_laboratories,
    layouts_of_robots,
    layouts_of_strangers,
)
from tests.reference.dialects import Dialect, Motion, off
from tests.reference.layouts import ROUNDS, UNFUSABLE

import levelhead as lh
from levelhead.sources.hints import NeedsHints

__all__ = ["ROUNDS", "judge"]


def judge(name: str, write: Dialect, motion: Motion, folder: Path) -> tuple[str, str]:
    """(verdict, why); benchmarks/reader/layouts.py lists the verdicts."""
    path = write(folder, motion)
    fusable = name not in UNFUSABLE
    try:
        recording = lh.read(path)
    except lh.LevelheadError as error:
        if not (isinstance(error, NeedsHints) and error.path):
            return ("nowhere" if fusable else "refused"), str(error)
        if not fusable:
            return "mistaken", f"{error} reads what cannot be fused"
        wrong = off(lh.read(error.path, **error.suggested), motion)
        return ("mistaken", f"{error} -> {wrong}") if wrong else ("command", str(error))
    guesses = [note for note in recording.meta["notes"] if "a guess" in note]
    wrong = off(recording, motion) if fusable else "cannot be fused"
    if wrong:
        return "mistaken" if guesses else "WRONG", f"{wrong}; {'; '.join(recording.meta['notes'])}"
    return ("guess", "; ".join(guesses)) if guesses else ("right", "")
