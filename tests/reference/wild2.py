"""The verdict on a log of the second collection, by what is known of it."""

from pathlib import Path

import levelhead as lh
from levelhead import units
from levelhead.recording import Recording
from levelhead.sources.hints import NeedsHints

SIGN = "-"
CORE_MOTION = {"wristmotion_swim.csv", "airpods_headphone.zip"}  # by INDEX.json: specific force is −(gravity + …)


def judge(path: Path, entry: dict) -> tuple[str, str]:
    """(verdict, why)."""
    try:
        recording = lh.read(path)
    except NeedsHints as error:
        return _by_command(path, entry, error)
    except lh.LevelheadError as error:
        return ("dead end" if entry["fusable"] else "refused"), str(error)
    if not entry["fusable"]:
        return "WRONG", f"read, but {entry['why_not']}"
    wrong = differences(recording, entry["know"])
    if path.name in CORE_MOTION and not any(one.about == "acc.sign" for one in recording.meta["conclusions"]):
        wrong = "the accelerometer points down, as Core Motion's does"
    return ("WRONG", wrong) if wrong else ("right", repr(recording))


def _by_command(path: Path, entry: dict, error: NeedsHints) -> tuple[str, str]:
    if not error.path:
        return ("dead end" if entry["fusable"] else "refused"), str(error)
    options = dict(error.suggested)
    if "rate" in options and "rate" in entry["know"]:
        options["rate"] = float(entry["know"]["rate"])
    try:
        recording = lh.read(path, **options)
    except lh.LevelheadError as again:
        return "dead end", f"{error} -> {again}"
    if not entry["fusable"]:
        return "trap", str(error)
    wrong = differences(recording, entry["know"])
    return ("dead end", f"{error} -> {wrong}") if wrong else ("command", str(error))


def differences(recording: Recording, know: dict) -> str:
    """In what a recording is not as its owner knows it; "" if in nothing."""
    found = []
    for role, unit in know.get("units", {}).items():
        quantity = "time" if role == "t" else role
        taken = recording.meta["units"].get(role, "").removeprefix(SIGN)
        if role in ("gyr", "acc") and units.find_factor(quantity, taken) != units.factor(quantity, unit):
            found.append(f"{role} in {taken}, not {unit}")
    for role in ("gyr", "acc"):
        columns = recording.meta["columns"].get(role)
        if (
            role in know
            and columns is not None
            and [*columns] != know[role]
            and all(not c.isdigit() for c in know[role])
        ):
            found.append(f"{role} from {columns}, not {know[role]}")
    rate = 1.0 / float((recording.t[-1] - recording.t[0]) / max(1, len(recording.t) - 1))
    if "rate" in know and not 0.5 < rate / know["rate"] < 2.0:
        found.append(f"at {rate:.3g} Hz, not {know['rate']}")
    return "; ".join(found)
