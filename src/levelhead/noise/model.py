"""A NoiseModel: the noise of a sensor's axes as numbers, for filters and simulations."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.filters import of as filter_of
from levelhead.filters.parameters import Params
from levelhead.json_file import read_json, write_json
from levelhead.noise.allan import AllanCurve
from levelhead.noise.fit import FLICKER_SHARE, NAMES, Coefficients
from levelhead.noise.temperature import TemperatureDrift
from levelhead.open_types import JsonObject
from levelhead.recording import Array
from levelhead.simulate import Imu, TriadErrors
from levelhead.units import DEGREE, GRAVITY

FORMAT = "levelhead noise 1"
MOTION = {"acc_noise", "r_measure"}
UNITS = {"gyr": "rad/s", "acc": "m/s²", "mag": "µT"}


@dataclass(frozen=True, eq=False)
class Coefficient:
    """One kind of noise of three axes.

    Attributes:
        value: (3,) its coefficient.
        sigma: (3,) 1σ of it.
        low: (3,) lower ends of the 95 % intervals; 0: this noise does not show.
        high: (3,) upper ends.
    """

    value: Array
    sigma: Array
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class TriadNoise:
    """The noise of three axes, with the names of IEEE Std 952; "unit" is rad/s, m/s² or µT.

    Attributes:
        rate: samples a second.
        white_noise_density: N in unit/√Hz (angle or velocity random walk).
        bias_instability: B in unit; the Allan deviation is flat at 0.664 B.
        random_walk: K in unit/√s (rate random walk).
        quantisation_noise: Q in unit·s.
        curves: the Allan deviations of x, y and z; empty when read from a file.
        fits: how they were fitted; empty when read from a file.
        drift: how the biases change with temperature, where the recording has one.
        rounding: size of a bit over the noise as read, the largest of the axes; 0: not rounded, or read from a file.
    """

    rate: float
    white_noise_density: Coefficient
    bias_instability: Coefficient
    random_walk: Coefficient
    quantisation_noise: Coefficient
    curves: tuple[AllanCurve, ...] = ()
    fits: tuple[Coefficients, ...] = ()
    drift: TemperatureDrift | None = None
    rounding: float = 0.0

    @classmethod
    def of(
        cls,
        rate: float,
        parts: Mapping[str, Coefficient],
        curves: tuple[AllanCurve, ...] = (),
        fits: tuple[Coefficients, ...] = (),
        drift: TemperatureDrift | None = None,
        rounding: float = 0.0,
    ) -> "TriadNoise":
        """From its coefficients by name."""
        quantisation, white, instability, walk = (parts[name] for name in NAMES)
        return cls(rate, white, instability, walk, quantisation, curves, fits, drift, rounding)

    @property
    def density(self) -> float:
        """N of an axis in the mean (root mean square)."""
        return _mean(self.white_noise_density)

    @property
    def walk(self) -> float:
        """K of a random walk that a filter should expect in place of bias instability and rate random walk.

        A filter averages the bias over about the time τ = N²/(0.44 B²) at which white noise and bias instability are
        equally large; the random walk that reaches the flat part there has K² = 3 · 0.44² B⁴/N².
        """
        n, b, k = (_mean(part) for part in (self.white_noise_density, self.bias_instability, self.random_walk))
        flicker = FLICKER_SHARE * b * b
        return math.sqrt(k * k + (3.0 * flicker * flicker / (n * n) if n > 0.0 else 0.0))


def _mean(part: Coefficient) -> float:
    return float(np.sqrt(np.mean(part.value**2)))


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """The noise of a sensor, from a recording at rest.

    Attributes:
        gyr: gyroscope, rad/s.
        acc: accelerometer, m/s².
        mag: magnetometer, µT, or None.
        duration: s at rest.
        source: where it comes from.
        recorded: s of the whole recording; 0: not known.
    """

    gyr: TriadNoise
    acc: TriadNoise
    mag: TriadNoise | None
    duration: float
    source: str = ""
    recorded: float = 0.0

    @property
    def triads(self) -> dict[str, TriadNoise]:
        """By name: "gyr", "acc" and perhaps "mag"."""
        return {name: one for name in UNITS if (one := getattr(self, name)) is not None}

    def parameters(self, params: Params) -> Params:
        """The same filter with this noise: Q and R of its model.

        ``ESKF`` and ``EKF``: density of rate and specific force, random walk of the biases. ``Kalman``: q_angle = N²,
        q_bias = K², r_measure = the variance of a sample's tilt. The R of ``EKF`` and ``Kalman`` includes the
        accelerations of the motion too, so noise can raise it and not lower it.

        Raises:
            LevelheadError: the filter has no noise to set.
        """
        flt = filter_of(params)
        known = set(params._fields)
        degrees = self.gyr.density / DEGREE, self.gyr.walk / DEGREE
        tilt = self.acc.density * math.sqrt(self.acc.rate) / GRAVITY / DEGREE
        values = {
            "gyr_noise": degrees[0], "bias_walk": degrees[1], "acc_noise": self.acc.density, "acc_walk": self.acc.walk,
            "q_angle": degrees[0] ** 2, "q_bias": degrees[1] ** 2, "r_measure": tilt**2,
        }  # fmt: skip
        mine = {name: value for name, value in values.items() if name in known}
        if flt.calibration is None:  # a filter without a velocity: its R holds all accelerations
            mine |= {name: max(mine[name], getattr(params, name)) for name in MOTION & known}
        if "q_per_sample" in known or "gyr_noise" in known:
            return params._replace(**mine)
        raise LevelheadError(f"{flt.name} has no noise to set; a noise file is for ESKF, EKF and Kalman")

    def imu(self, other: Imu | None = None) -> Imu:
        """Sensors with this noise, for ``simulate.observe``.

        Args:
            other: sensors whose scale factors, turn-on biases and full scales these keep; by default there are none of
                these errors. The size of a bit is left out, because its noise is part of the measured one.
        """
        other = Imu() if other is None else other
        parts = {name: _errors(one, getattr(other, name) or TriadErrors()) for name, one in self.triads.items()}
        return Imu(parts["gyr"], parts["acc"], parts.get("mag", other.mag), other.iron, f"{other.name}, noise measured")

    def to_dict(self) -> JsonObject:
        """For JSON."""
        return {"source": self.source, "duration_s": self.duration, "recorded_s": self.recorded} | {
            name: {"unit": UNITS[name], "rate_hz": one.rate} | {
                part: {field.name: getattr(getattr(one, part), field.name).tolist() for field in fields(Coefficient)}
                for part in NAMES
            } | ({} if one.drift is None else {"temperature": one.drift.to_dict()})
            for name, one in self.triads.items()
        }  # fmt: skip

    def save_kalibr(self, path: str | os.PathLike[str]) -> None:
        """Write the IMU's noise as YAML for Kalibr (flat keys) and OpenVINS (under ``imu0``), whole or not at all.

        The random walk is ``TriadNoise.walk``, which includes bias instability, or its bound where none shows:
        Kalibr takes none of 0. Densities are two-sided, as everywhere here.

        Raises:
            LevelheadError: the path cannot be written.
        """
        noise = [
            f"{name}_{kind}: {value:.6e}"
            for name, one in (("accelerometer", self.acc), ("gyroscope", self.gyr))
            for kind, value in (
                ("noise_density", one.density),
                ("random_walk", one.walk or float(one.random_walk.high.max())),
            )
        ]
        flat = [*noise, "rostopic: /imu0", f"update_rate: {self.gyr.rate:.2f}"]
        unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        chain = [f"T_i_b: {[[*row, 0.0] for row in unit] + [[0.0, 0.0, 0.0, 1.0]]}", *flat, "time_offset: 0.0"]
        chain += ["model: kalibr", *(f"{name}: {unit}" for name in ("Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC"))]
        chain.append(f"Tg: {[[0.0, 0.0, 0.0]] * 3}")
        with atomic_path(path) as temporary:
            lines = ["%YAML 1.0", "---", *flat, "imu0:", *(f"  {line}" for line in chain)]
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as JSON, whole or not at all.

        Raises:
            LevelheadError: the path cannot be written.
        """
        write_json(path, FORMAT, self.to_dict())

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> "NoiseModel":
        """The noise that ``save`` wrote, to the last bit.

        Raises:
            LevelheadError: no such file, or not such a file.
        """
        path = Path(path)
        whole = read_json(path, FORMAT, "noise file", "a file by `levelhead noise LOG -o FILE`")
        parts = {name: _read(path, name, whole.get(name)) for name in UNITS if name in whole or name != "mag"}
        try:
            numbers = float(whole["duration_s"]), str(whole["source"]), float(whole.get("recorded_s", 0.0))
            return cls(parts["gyr"], parts["acc"], parts.get("mag"), *numbers)
        except (KeyError, TypeError, ValueError):
            raise LevelheadError(f"{path}: duration_s or source is missing; expected a noise file as written") from None


def _errors(noise: TriadNoise, other: TriadErrors) -> TriadErrors:
    """The error model with this noise; the bias instability as true flicker noise."""

    def three(part: Coefficient) -> tuple[float, float, float]:
        x, y, z = part.value.tolist()
        return x, y, z

    return replace(
        other,
        white_noise_density=three(noise.white_noise_density),
        bias_instability=0.0,
        flicker_noise=three(noise.bias_instability),
        random_walk=three(noise.random_walk),
        quantisation_noise=three(noise.quantisation_noise),
        quantisation=0.0,
    )


def _read(path: Path, name: str, part: object) -> TriadNoise:
    """One sensor of a noise file."""
    try:
        if not isinstance(part, Mapping) or part["unit"] != UNITS[name]:
            raise ValueError
        found = {one: _coefficient(part[one]) for one in NAMES}
        rate = float(part["rate_hz"])
        drift = TemperatureDrift.from_dict(part["temperature"]) if "temperature" in part else None
        if not 0.0 < rate < math.inf:
            raise ValueError
    except (KeyError, TypeError, ValueError):
        raise LevelheadError(
            f"{path}: {name} is not whole; expected its unit {UNITS[name]}, rate_hz and {', '.join(NAMES)}, "
            "each with three numbers of 0 or more for value, sigma, low and high, and temperature whole or not at all"
        ) from None
    return TriadNoise.of(rate, found, drift=drift)


def _coefficient(part: Mapping[str, object]) -> Coefficient:
    numbers = {field.name: np.array(part[field.name], dtype=float) for field in fields(Coefficient)}
    if any(one.shape != (3,) or not (np.isfinite(one) & (one >= 0.0)).all() for one in numbers.values()):
        raise ValueError
    return Coefficient(**numbers)
