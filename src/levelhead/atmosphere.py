"""Height from air pressure: the lowest layer of the International Standard Atmosphere (ISO 2533:1975, clause 2).

With T₀ = 288.15 K and p₀ = 101325 Pa at sea level, a lapse rate of L = 6.5 K/km, R = 287.05287 J/(kg·K) and standard
gravity: h = T₀/L (1 − (p/p₀)^(R L/g)). Air that is warmer or colder than the standard's stretches heights by the ratio
of the absolute temperatures: 4 % at 11 K.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from levelhead.units import GRAVITY

Numbers = TypeVar("Numbers", float, NDArray[np.float64])  # a number, or an array of numbers

SEA_LEVEL = 101325.0  # Pa
TEMPERATURE = 288.15  # K
LAPSE = 0.0065  # K/m
GAS = 287.05287  # J/(kg K), of dry air
EXPONENT = GAS * LAPSE / GRAVITY


def height(pressure: Numbers) -> Numbers:
    """Height in m above the level where air has 101325 Pa, from pressure in Pa, numbers or arrays; up to 11 km."""
    result: Numbers = TEMPERATURE / LAPSE * (1.0 - (pressure / SEA_LEVEL) ** EXPONENT)
    return result


def pressure_at(height: Numbers) -> Numbers:
    """Pressure in Pa at a height in m: the inverse."""
    result: Numbers = SEA_LEVEL * (1.0 - LAPSE / TEMPERATURE * height) ** (1.0 / EXPONENT)
    return result


def metres_per_pascal(pressure: Numbers) -> Numbers:
    """−dh/dp in m/Pa at a pressure in Pa, positive: the factor from a σ of pressure to one of height."""
    result: Numbers = TEMPERATURE / LAPSE * EXPONENT / pressure * (pressure / SEA_LEVEL) ** EXPONENT
    return result
