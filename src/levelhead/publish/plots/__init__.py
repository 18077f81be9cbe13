"""Pictures. Their libraries come with ``pip install 'levelhead[plot]'`` and are imported when a picture is drawn.

Every function writes one file (PNG, SVG or PDF by its suffix), whole or not at all, and keeps no global state: it
works in threads, without a display, and leaves the caller's pyplot alone.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from levelhead.publish.plots.calibration_panels import calibration_picture
    from levelhead.publish.plots.lesson import lesson_picture
    from levelhead.publish.plots.orientation import track_picture
    from levelhead.publish.plots.recording_comparison import case_picture
    from levelhead.publish.plots.tuning import gain_picture, sweep_picture

__all__ = ["calibration_picture", "case_picture", "gain_picture", "lesson_picture", "sweep_picture", "track_picture"]

# Imported at first use: the picture of a track waits for neither comparisons nor sweeps.
_HOMES = {
    "calibration_picture": "calibration_panels",
    "case_picture": "recording_comparison",
    "lesson_picture": "lesson",
    "gain_picture": "tuning",
    "sweep_picture": "tuning",
    "track_picture": "orientation",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
