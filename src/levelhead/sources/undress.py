"""Lines that a terminal or a protocol has dressed up: a clock and an arrow, $SENTENCES, names before brackets."""

import re
from collections.abc import Sequence

from levelhead.sources.labelled import looks_labelled
from levelhead.sources.splitting import lines_of

MOST = 0.6  # share of the lines that must be dressed alike
_ARROW = re.compile(r"\s*\[?(?:\d{4}-\d\d-\d\d[ T])?(\d\d?:\d\d:\d\d[.,]\d+)\]?\s*(?:->|>)\s?(.*)$")
_SENTENCE = re.compile(r"\s*\$(VN[A-Z]{3}),(.*?)(?:\*[0-9A-Fa-f]{2,4})?\s*$")
_BRACKETS = re.compile(r"([A-Za-z]+)\s*\(([^)]*)\)\s*\[([^\]]*)\]")
_FIELD = [f"mag_{axis} [G]" for axis in "xyz"]
_ACC, _GYR = [f"acc_{axis} [m/s²]" for axis in "xyz"], [f"gyr_{axis} [rad/s]" for axis in "xyz"]
_VECTORNAV = {  # VN-100 user manual, asynchronous ASCII messages
    "VNIMU": [*_FIELD, *_ACC, *_GYR, "temperature", "pressure"],
    "VNYMR": ["yaw", "pitch", "roll", *_FIELD, *_ACC, *_GYR],
    "VNQMR": ["quat_x", "quat_y", "quat_z", "quat_w", *_FIELD, *_ACC, *_GYR],
}


def undress_text(text: str) -> str | None:
    """The text as a table, or None if its lines are dressed in no way that is known here."""
    lines = [line for line in lines_of(text) if line.strip()]
    sample = lines[:200]
    for pattern, plain in ((_ARROW, _without_arrows), (_SENTENCE, _without_sentences), (_BRACKETS, _without_brackets)):
        if sum(pattern.search(line) is not None for line in sample) > MOST * len(sample):
            return plain(lines)
    return None


def _without_arrows(lines: Sequence[str]) -> str | None:
    """The serial monitor of the Arduino IDE with time stamps: "12:30:15.250 -> 0.1,0.2"."""
    found = [match.groups() for line in lines if (match := _ARROW.match(line))]
    labelled = looks_labelled([rest for _, rest in found[1:40]])
    made = []
    for clock, rest in found:
        if labelled:
            hour, minute, second = clock.replace(",", ".").split(":")
            made.append(f"time_s: {3600 * int(hour) + 60 * int(minute) + float(second):.6f} {rest}")
        else:
            delimiter = next((sign for sign in "\t;," if sign in rest), " ")
            numbers = sum(sign.isdigit() for sign in rest) > 0.3 * len(rest)
            made.append(f"{clock if numbers else 'time'}{delimiter}{rest}")
    return "\n".join(made)


def _without_sentences(lines: Sequence[str]) -> str | None:
    """VectorNav's ASCII messages; of several kinds the first that has a gyroscope."""
    found = [match.groups() for line in lines if (match := _SENTENCE.match(line))]
    kind = next((word for word, _ in found if word in _VECTORNAV), None)
    if kind is None:
        return None
    return "\n".join([",".join(_VECTORNAV[kind]), *(rest for word, rest in found if word == kind)])


def _without_brackets(lines: Sequence[str]) -> str | None:
    """SparkFun's examples: "Acc (mg) [ -16.11, 33.69, 994.14 ], Gyr (DPS) [ … ]"."""
    rows = [_BRACKETS.findall(line) for line in lines]
    names = next((parts for parts in rows if len(parts) > 1), [])
    if not names:
        return None
    titles = [
        f"{name}_{axis} [{unit}]" if len(numbers.split(",")) == 3 else name
        for name, unit, numbers in names
        for axis in ("xyz" if len(numbers.split(",")) == 3 else "x")
    ]
    body = [", ".join(numbers.strip() for _, _, numbers in parts) for parts in rows if len(parts) == len(names)]
    return "\n".join([",".join(titles), *body])
