"""The magnetometer beside the earth's field at the place of the log, by the World Magnetic Model."""

from collections.abc import Iterator
from importlib.util import find_spec

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.inspection.findings import Finding
from levelhead.magnetic_model import earth_field
from levelhead.recording import Recording
from levelhead.signals.hard_iron import hard_iron
from levelhead.sources.place import place_of

IRON = 0.2  # share of the field that iron fixed to the sensor may add where the motion does not tell it apart
ROOM = 0.1  # share by which buildings change the field
UNITS = {10.0: "mG", 0.01: "G", 1000.0: "nT"}  # by how much the numbers are too large for µT
SAME_UNIT = 1.3  # ratio within which a unit explains the strength


def examine_place(recording: Recording) -> Iterator[Finding]:
    """The strength of the field beside that of the place; nothing without a place, a date and a unit."""
    here = place_of(recording)
    if recording.mag is None or here is None or here.date is None or "mag_unit" in recording.meta:
        return
    if find_spec("pygeomag") is None:
        return
    try:
        there = earth_field(here.latitude, here.longitude, here.altitude, date=here.date)
    except LevelheadError:  # a date outside of the model
        return
    length = np.linalg.norm(recording.mag, axis=1)
    length = length[np.isfinite(length) & (length > 0.0)]
    if len(length) < 20:
        return
    sphere = hard_iron(recording)
    if sphere is None:
        measured, sigma, how = float(np.median(length)), IRON, "median length, iron of the device included"
    else:
        measured, sigma, how = sphere.field, ROOM + sphere.sigma / sphere.field, "radius about its offset"
    ratio = measured / there.strength
    low, high = ratio * (1.0 - 2.0 * sigma), ratio * (1.0 + 2.0 * sigma)
    if low <= 1.0 <= high:
        return
    unit = next((name for off, name in UNITS.items() if 1.0 / SAME_UNIT < ratio / off < SAME_UNIT), "")
    option = f"--units mag={unit}" if unit else f"--counts mag={ratio:.3g}/uT"
    yield Finding(
        "mag_strength",
        "warning",
        f"the magnetometer reads {ratio:.3g} times the field of the place",
        f"{measured:.1f} µT, {how}; {there.strength:.1f} ± {there.sigma_strength:.1f} µT by the World Magnetic Model",
        f"{'Its unit' if unit else 'Its scale'} is wrong ({option}), or iron is near.",
        value=ratio,
        interval=(low, high),
    )
