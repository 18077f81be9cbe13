"""The meaning of one column name by itself: sensor, axis, unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from levelhead import units
from levelhead.errors import LevelheadError, nearest
from levelhead.sources.hints import MEANING, QUANTITY
from levelhead.sources.names.vocabulary import (
    DERIVED,
    FILLERS,
    INCREMENTS,
    INTERVALS,
    LETTERS,
    NO_TIMES,
    PAIRS,
    REFERENCES,
    TIME_ALONE,
    TIMES,
    WORDS,
)

RELATIVE = "relative"  # the "unit" of a magnetometer that was divided by the local field strength

_BRACKETS = re.compile(r"[\(\[\{]([^()\[\]{}]*)[\)\]\}]")
_TOKENS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+\d*|[A-Z]+\d*|\d+|[^\W\d_]+")
_REMARKS = {"raw", "cal", "calibrated", "uncal", "uncalibrated", "filtered", "left", "right", "front", "back", "body"}
_REMARKS |= {"sensor", "counts", "count", "lsb", "adc", "digits", "ticks", "none", "local", "world", "earth", "device"}
_REMARKS |= {"x", "y", "z", "imu", "avg", "mean", "int", "float", "double", "hex", "foot", "hand", "wrist", "hip"}
_REMARKS |= {"utc", "gmt", "unix", "posix", "tai", "gps", "gpst"}  # scales of a clock
_REMARKS |= {"relative", "normalized", "normalised", "a.u.", "au", "head", "chest", "thigh", "shank", "arm"}
_NUMBERED = re.compile(r"([a-z]*?)([xyz])(\d+)")  # ax1, and the x1 of accX1
_AXES = "xyzw"
_XYZ = frozenset("xyz")
_GREEK = {"alpha": "x", "beta": "y", "gamma": "z"}  # of DeviceMotion's rotationRate: browsers give x, y, z
_VEHICLE = re.compile(
    r"(roll|pitch|yaw)(?:rate|speed|vel|velocity|angularvelocity)|(?:bodyrate|rate|[a-z]*angularvelocity)(roll|pitch|yaw)"
)
_PERSON = re.compile(r"user\d+")  # whose the file is; "user" alone is user acceleration
_RATES = {"roll": "x", "pitch": "y", "yaw": "z", "p": "x", "q": "y", "r": "z"}


@dataclass(frozen=True)
class Name:
    """One column name, understood.

    Attributes:
        raw: as the file spells it.
        role: "t", "gyr", "acc", "mag", "q", "bias", "moving", "seen" (whether the reference is good), or "" when it is
            none of them.
        axis: "x", "y", "z", "w" or a digit; "" if the name has none.
        stem: the rest without axis and unit, in lower case: columns that share it belong together.
        exact: a time that is called just that, before "gps_time" and the like.
        reference: a quaternion whose name shows a reference system.
    """

    raw: str
    role: str
    axis: str
    stem: str
    exact: bool = False
    reference: bool = False


def understand(raw: str, context: str = "") -> Name:
    """The meaning of the name; never an error.

    ``context``, the name of the file or sheet, counts for a name that has only its axis ("x", "z_value").
    """
    name = _understand(raw)
    if name.role or not context or not (name.axis or split(raw)[:1] in (["x"], ["y"], ["z"])):
        return name
    named = _understand(f"{context} {raw}")
    return Name(raw, named.role, named.axis, named.stem, named.exact, named.reference) if named.role else name


def _understand(raw: str) -> Name:
    tokens = split(raw)
    stem, axis = _axis(tokens)
    if (name := _reference_flag(raw, stem, axis)) is not None:
        return name
    if turned := _turn_rate(raw, tokens):
        return Name(raw, "gyr", turned, "rollpitchyawrate")
    bare = _without_unit(stem)
    role = _role(bare) or (_role_of_unit(raw, bare) if axis else "")
    if role and axis and (axis != "w" or role == "q"):
        return Name(raw, role, axis, "".join(bare), reference=_is_reference(bare))
    if not role and (_is_time(tokens) or _is_abscissa(raw)):
        left = "".join(_time_unit(tokens)[0])
        return Name(raw, "t", "", "".join(tokens), exact=left in TIMES or left == "")
    return Name(raw, "", axis, "".join(stem))


def name_increment(raw: str) -> tuple[str, str]:
    """(sensor, axis or digit) of an angle ("gyr") or a velocity ("acc") gained since the row before; else ("", "").

    The axis is "dt" for the interval over which it was gained, of sensor "t" if both have the same one.
    """
    label = "".join(words := split(raw))
    interval = label if label in INTERVALS else "".join(_time_unit(words)[0])  # dt_ms
    if interval in INTERVALS:
        return INTERVALS[interval], "dt"
    sensor = INCREMENTS.get(label[:-1], "")
    return (sensor, label[-1]) if sensor and label[-1] in "xyz012" else ("", "")


def _reference_flag(raw: str, stem: Sequence[str], axis: str) -> Name | None:
    """The meaning of a reference system's other columns: a bias, whether it moved, whether it was seen; else None."""
    label = "".join(stem)
    if {"truth", "bias"} <= set(stem) and axis:
        return Name(raw, "bias", axis, label)
    seen = REFERENCES & set(stem) and {"ok", "valid"} & set(stem)
    if not axis and (seen or label in {"moving", "movement", "truthmoving"}):
        return Name(raw, "seen" if seen else "moving", "", label)
    return None


def split(raw: str) -> list[str]:
    """The words of a name in lower case, without brackets and their contents; an index such as [0] counts as a word."""
    inside = [text.strip().lower() for text in _BRACKETS.findall(raw)]
    words = [token.lower() for token in _TOKENS.findall(_BRACKETS.sub(" ", raw))]
    axes = [text for text in inside if text in {"x", "y", "z"}] if len(words) > 0 else []  # "Gyroscope (z) [rad/s]"
    return words + axes + [text for text in inside if text.isdigit()]


def _turn_rate(raw: str, tokens: Sequence[str]) -> str:
    """The axis of a rate about the axes of a vehicle: roll rate, yawspeed, or p, q, r with a unit of rates; else ""."""
    if DERIVED & set(tokens) or REFERENCES & set(tokens):
        return ""
    left = next((tokens[:-count] for count, text in _suffixes(tokens) if _sensor_unit("gyr", text)), None)
    inside = any(units.find_factor("gyr", text.strip()) is not None for text in _BRACKETS.findall(raw))
    merged = "".join(tokens if left is None else left)
    if merged in _RATES and (left is not None or inside):
        return _RATES[merged]
    found = _VEHICLE.fullmatch(merged)
    return _RATES[found[1] or found[2]] if found else ""


_KNOWN = frozenset().union(*WORDS.values(), *LETTERS.values())
_INDICES = frozenset("01234")


def _axis(tokens: Sequence[str]) -> tuple[list[str], str]:
    """(words without the axis, axis): the first of these ways in which the name has one; (words, "") if in none."""
    for find in (_own_word, _greek, _numbered_letter, _letter_at_end, _letter_of_all, _index):
        if (found := find(tokens)) is not None:
            return found
    return list(tokens), ""


def _own_word(tokens: Sequence[str]) -> tuple[list[str], str] | None:
    """A word of its own: acc x."""
    for i in reversed(range(len(tokens))):
        if tokens[i] in _AXES and len(tokens) > 1 and not (tokens[i] == "w" and tokens[-1] in "xyz"):
            return [*tokens[:i], *tokens[i + 1 :]], tokens[i]
    return None


def _greek(tokens: Sequence[str]) -> tuple[list[str], str] | None:
    """The name of an angle of a gyroscope: rotationRate alpha."""
    if tokens and tokens[-1] in _GREEK and set(tokens[:-1]) & (WORDS["gyr"] | {"rotation"}):
        return list(tokens[:-1]), _GREEK[tokens[-1]]
    return None


def _numbered_letter(tokens: Sequence[str]) -> tuple[list[str], str] | None:
    """A letter before a number: ax1, acc x1."""
    for i in reversed(range(len(tokens))):
        match = _NUMBERED.fullmatch(tokens[i])
        if match and (match[1] in _KNOWN or (not match[1] and len(tokens) > 1)):
            return [*tokens[:i], match[1] + match[3], *tokens[i + 1 :]], match[2]
    return None


def _letter_at_end(tokens: Sequence[str]) -> tuple[list[str], str] | None:
    """A letter at the end or the start of a known word: gx, accx, xacc."""
    for i in reversed(range(len(tokens))):
        token = tokens[i]
        for axis, rest in ((token[-1:], token[:-1]), (token[:1], token[1:])):
            if axis in _AXES and rest in _KNOWN and (len(rest) > 2 or axis == token[-1]):
                return [*tokens[:i], rest, *tokens[i + 1 :]], axis
    return None


def _letter_of_all(tokens: Sequence[str]) -> tuple[list[str], str] | None:
    """A letter at the end of all words together, which are a known one: Gy ro X is read as gyrox."""
    merged = "".join(tokens)
    return ([merged[:-1]], merged[-1]) if merged[-1:] in _XYZ and merged[:-1] in _KNOWN else None


def _index(tokens: Sequence[str]) -> tuple[list[str], str] | None:
    """A digit: acc 0, or acc0."""
    if len(tokens) > 1 and tokens[-1] in _INDICES:
        return list(tokens[:-1]), tokens[-1]
    if tokens and tokens[-1][-1:] in _INDICES and tokens[-1][:-1] in _KNOWN:
        return [*tokens[:-1], tokens[-1][:-1]], tokens[-1][-1]
    return None


def _role(stem: Sequence[str]) -> str:
    """The sensor that the words name, or "" when they name none, two, or something derived from one."""
    words = [token.rstrip("0123456789") for token in stem if not _PERSON.fullmatch(token)]
    if not words or (DERIVED & set(words) and not holds_gravity(words)):
        return ""
    roles = _roles_of_words(words) or _roles_of_letters(words)
    if len(roles) != 1:
        return ""
    role = roles.pop()
    return "" if role != "q" and REFERENCES & set(words) else role


def holds_gravity(words: Sequence[str]) -> bool:
    """Whether words mark gravity as included, as a browser's accelerationIncludingGravity."""
    said = DERIVED & {*words}
    return bool(said) and said <= {"gravity", "grav"} and bool({"including", "with", "incl", "inc"} & {*words})


def _roles_of_words(words: Sequence[str]) -> set[str]:
    """The sensors that words, all of them together, or two neighbours name."""
    roles = {role for role, known in WORDS.items() if known & {*words, "".join(words)}}
    if PAIRS & set(pairwise(words)):
        roles.add("gyr")
    return roles - {"acc"} if "angular" in words else roles


def _roles_of_letters(words: Sequence[str]) -> set[str]:
    """The sensors that a letter names where the name has nothing else."""
    rest = "".join(word for word in words if word not in FILLERS)
    roles = {role for role, letters in LETTERS.items() if rest in letters}
    if not roles and "".join(word for word in words if word not in FILLERS | REFERENCES) == "q":
        return {"q"}
    return roles


def _role_of_unit(raw: str, stem: Sequence[str]) -> str:
    """The sensor of the unit in brackets: "x-axis (deg/s)" can be a gyroscope only; (G) may be two things."""
    words = [token.rstrip("0123456789") for token in stem]
    if DERIVED & set(words) or REFERENCES & set(words) or {"velocity", "speed", "linear"} & set(words):
        return ""
    inside = [text.strip() for text in _BRACKETS.findall(raw) if text.strip() and not text.strip().isdigit()]
    found = {
        role
        for text in inside
        for role in ("gyr", "acc", "mag")
        if text != "G"
        and units.find_factor(QUANTITY[role], text) is not None
        and units.find_factor("time", text) is None
    }
    if found == {"acc", "mag"} and inside[-1] in {"g", "mg"}:
        found = {"acc"}
    return found.pop() if len(found) == 1 else ""


def _is_reference(stem: Sequence[str]) -> bool:
    """A reference's quaternion has a mark, or is called just q."""
    return bool(REFERENCES & set(stem)) or "".join(stem) == "q"


def _is_time(tokens: Sequence[str]) -> bool:
    left, _ = _time_unit(tokens)
    if not left:
        return bool(tokens) and tokens[0] in TIME_ALONE
    if "".join(tokens) in TIMES or "".join(tokens[-2:]) in TIMES:  # Clock:offsetTime
        return True
    return bool(TIMES & {*left, "".join(left)}) and not NO_TIMES & set(left) and _role(left) == ""


def _is_abscissa(raw: str) -> bool:
    """Whether a name is X with a unit of time, as plotting programs call it."""
    inside = _BRACKETS.findall(raw)
    return _BRACKETS.sub("", raw).strip().lower() == "x" and any(
        text.strip() in {"s", "ms", "us", "sec"} for text in inside
    )


def _time_unit(tokens: Sequence[str]) -> tuple[list[str], str | None]:
    """(words without the unit, unit): time_ms, TimeUS, timems, seconds_elapsed."""
    if not tokens:
        return [], None
    if units.find_factor("time", tokens[-1]) is not None and tokens[-1] != "min":
        return list(tokens[:-1]), tokens[-1]
    if len(tokens[0]) > 1 and units.find_factor("time", tokens[0]) is not None and tokens[0] != "min":
        return list(tokens[1:]), tokens[0]
    for word in ("timestamp", "time", "stamp", "t"):
        rest = tokens[-1].removeprefix(word)
        if rest not in (tokens[-1], "s", "") and units.find_factor("time", rest) is not None:
            return [*tokens[:-1], word], rest
    return list(tokens), None


def _suffixes(stem: Sequence[str]) -> list[tuple[int, str]]:
    """Endings of the words that could be a unit, the longest first: (number of words, "ms2")."""
    if holds_gravity(stem):
        return []
    return [
        (count, "".join("/" if word == "per" else word for word in stem[-count:]))
        for count in (3, 2, 1)
        if count < len(stem)
    ]


def _sensor_unit(role: str, text: str) -> str | None:
    if role == "gyr" and text in {"rad", "deg"}:
        return f"{text}/s"
    return _WITHOUT_SLASH.get(text, text) if units.find_factor(QUANTITY[role], text) is not None else None


_WITHOUT_SLASH = {"rads": "rad/s", "mrads": "mrad/s", "degs": "deg/s", "ms2": "m/s²", "mms2": "mm/s²"}  # split at it


def _without_unit(stem: Sequence[str]) -> list[str]:
    for count, text in _suffixes(stem):
        left = stem[:-count]
        role = _role(left)
        if role in QUANTITY and _sensor_unit(role, text):
            return list(left)
    return list(stem)


def unit_in(raw: str, role: str, source: str) -> str | None:
    """The unit that a name gives to a quantity: in brackets, or as its last words (acc_x_mg, time_us); None if none.

    Raises:
        LevelheadError: brackets hold text that looks like a unit but is not one; the nearest is named.
    """
    quantity = QUANTITY[role]
    inside: list[str] = [_bare(text) for text in _BRACKETS.findall(raw) if text.strip() and not text.strip().isdigit()]
    for text in reversed(inside):
        if units.find_factor(quantity, text) is not None:
            return text
        if role == "mag" and text.lower() in {RELATIVE, "normalized", "normalised", "a.u.", "au"}:
            return RELATIVE
    for text in reversed(inside):
        if _looks_like_unit(quantity, text):
            raise LevelheadError(
                f"{source}, column '{raw}': '{text}' is not a unit of the {MEANING[role]} of levelhead; "
                f"{nearest(text, units.FACTORS[quantity])}; or give the hint units {role}=…"
            )
    if role == "t":
        return _time_unit(split(raw))[1]
    stem, _ = _axis(split(raw))
    return next((unit for _, text in _suffixes(stem) if (unit := _sensor_unit(role, text))), None)


def _bare(text: str) -> str:
    """The unit in words of a sentence: "in G's" is G."""
    return re.sub(r"^in\s+|['’]s$", "", text.strip())


def _looks_like_unit(quantity: str, text: str) -> bool:
    """Brackets hold units, but also remarks such as (raw), (left foot) or [x8004]."""
    plain = re.fullmatch(r"[^\W\d_]+(?:[/.*^-][\w^]+)*", text) is not None and text.lower() not in _REMARKS
    near = "/" in text or "^" in text or "did you mean" in nearest(text, units.FACTORS[quantity])
    return len(text) <= 12 and (near or plain) and text.lower() not in _REMARKS
