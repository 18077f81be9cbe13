"""Height from air pressure: the lowest layer of the International Standard Atmosphere (ISO 2533:1975, clause 2).

With T₀ = 288.15 K and p₀ = 101325 Pa at sea level, a lapse rate of L = 6.5 K/km, R = 287.05287 J/(kg·K) and standard
gravity: h = T₀/L (1 − (p/p₀)^(R L/g)). Air that is warmer or colder than the standard's stretches heights by the ratio
of the absolute temperatures: 4 % at 11 K.
"""

from typing import Any

from levelhead.units import GRAVITY

SEA_LEVEL = 101325.0  # Pa
TEMPERATURE = 288.15  # K
LAPSE = 0.0065  # K/m
GAS = 287.05287  # J/(kg K), of dry air
EXPONENT = GAS * LAPSE / GRAVITY


def height(pressure: Any) -> Any:
    """Height in m above the level where air has 101325 Pa, from pressure in Pa, numbers or arrays; up to 11 km."""
    return TEMPERATURE / LAPSE * (1.0 - (pressure / SEA_LEVEL) ** EXPONENT)


def pressure(height: Any) -> Any:
    """Pressure in Pa at a height in m: the inverse."""
    return SEA_LEVEL * (1.0 - LAPSE / TEMPERATURE * height) ** (1.0 / EXPONENT)


def metres_per_pascal(pressure: Any) -> Any:
    """−dh/dp in m/Pa at a pressure in Pa, positive: what turns a σ of pressure into one of height."""
    return TEMPERATURE / LAPSE * EXPONENT / pressure * (pressure / SEA_LEVEL) ** EXPONENT
