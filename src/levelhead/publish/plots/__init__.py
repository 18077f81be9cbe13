"""Pictures. matplotlib comes with ``pip install 'levelhead[plot]'`` and is imported when a picture is drawn.

Every function writes one file (PNG, SVG or PDF by its suffix), whole or not at all, and keeps no global state: it
works in threads, without a display, and leaves the caller's pyplot alone.
"""

from levelhead.publish.plots.calibration_panels import calibration_picture
from levelhead.publish.plots.cases import case_picture
from levelhead.publish.plots.orientation import track_picture
from levelhead.publish.plots.panels import four_panels
from levelhead.publish.plots.tuning import gain_picture, sweep_picture

__all__ = ["calibration_picture", "case_picture", "four_panels", "gain_picture", "sweep_picture", "track_picture"]
