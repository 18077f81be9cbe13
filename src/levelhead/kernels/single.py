"""Numbers that mean another one in single precision.

Nearly every constant of a kernel is a quantity, and is rounded. These are facts about the arithmetic itself: how to
round to a whole number, π/2 in parts whose products with whole numbers are exact, and the size below which a square has
lost its digits. ``tests/export/test_single.py`` derives them.
"""

import struct

from levelhead.kernels import tilt, trig, vec3

INSTEAD = {
    trig.ROUND: 12582912.0,  # 1.5·2²³
    trig.HALF_PI_1: 1.5703125,  # 8 bits: k times it is exact up to k = 2¹⁶
    trig.HALF_PI_2: 0.0004837512969970703,  # 11 bits
    trig.HALF_PI_3: 7.549789948768648e-08,
    trig.PI_SHORT: -2.7827534e-08,  # π/4 in single precision is too long, not too short
    vec3.SHORTEST: 1e-18,
    tilt.NO_LENGTH: 1e-30,
}

REMARKS = {
    trig.ROUND: "1.5·2²³: added and taken off again it rounds to a whole number",
    trig.HALF_PI_1: "π/2 in three parts, the first two so short (8 and 11 bits) that k times them is exact",
    trig.QUARTER: "π/4; its multiples up to 4 are exact, and above π by 2.8e-8 of themselves:",
}


def single(value: float) -> float:
    """The nearest number of single precision.

    Raises:
        OverflowError: there is none.
    """
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        raise OverflowError(f"{value:g} is out of the range of single precision") from None


def round_constant(value: float) -> float:
    """A constant in single precision.

    Raises:
        OverflowError: it is too large for that, or so small that nothing but zero is left.
    """
    value = INSTEAD.get(value, value)
    rounded = single(value)
    if value != 0.0 and abs(rounded) < 1.2e-38:
        raise OverflowError(f"{value:g} is out of the range of single precision")
    return rounded


def shortest(value: float) -> float:
    """The shortest decimal that reads back as the same number of single precision."""
    for digits in range(1, 10):
        short = float(f"{value:.{digits}g}")
        if single(short) == value:
            return short
    return value
