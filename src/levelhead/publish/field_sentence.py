"""A magnetometer beside the field of its place: one sentence."""

import math

import numpy as np

from levelhead.magnetic_model import EarthField
from levelhead.recording import Recording
from levelhead.track import Track

STRANGE = 0.2  # of the strength: more than iron in a building usually makes


def field_sentence(field: EarthField, recording: Recording, track: Track) -> str:
    """The field of the place, the field that was measured, and a cure where the two cannot be one.

    The field that a filter found, without the magnetometer's offset, counts before its mean length.
    """
    place = f"{field.strength:.1f} µT, dip {field.dip:.1f}°, declination {field.declination:.1f}° by the WMM"
    found = None if track.calibration is None else track.calibration.field
    if found is not None:
        across, up = found.value.tolist()
        measured, dip = math.hypot(across, up), f", dip {math.degrees(math.atan2(-up, across)):.1f}°"
    elif recording.mag is not None and np.isfinite(recording.mag).all(axis=1).any():
        measured, dip = float(np.nanmean(np.linalg.norm(recording.mag, axis=1))), ""
    else:
        return place.replace("-", "−")
    share = measured / field.strength - 1.0
    text = f"{place}; measured {measured:.1f} µT{dip}"
    if abs(share) > STRANGE:
        text += f", {100 * share:+.0f} %: iron, or a wrong unit or scale; `levelhead doctor` names it"
    return text.replace("-", "−")
