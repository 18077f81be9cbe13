"""levelhead turns the contradictory readings of an IMU into an orientation that people can trust.

    import levelhead as lh

    rec = lh.read("flight.csv")                        a Recording: t, gyr, acc, mag | None, truth | None, SI units
    track = lh.fuse(rec)                               a Track: t, quat (n, 4), bias, sigma, health
    track = lh.fuse(rec, lh.Kalman(r_measure=0.1))     a filter is chosen by its parameters
    table = lh.compare(rec, [lh.Complementary(), lh.Kalman()])
    live = lh.Stream(lh.Kalman())
    quat = live.update(gyr=g, acc=a, dt=0.01)

The conventions, which hold everywhere:

* Earth frame **ENU**: x east, y (magnetic) north, z up. Without a magnetometer heading starts at 0 and is relative.
* Orientation: unit quaternion **wxyz** that rotates sensor-frame vectors into the earth frame. Euler angles are
  intrinsic z-y-x: yaw, then pitch, then roll; roll is about x. Yaw 0 points the sensor's x axis east.
* ``acc`` is **specific force** in m/s²: a level sensor at rest reads (0, 0, +9.81). ``gyr`` is in rad/s, ``mag`` in µT,
  ``t`` in seconds.
* ``dt`` is always an argument; nothing is measured in sample counts.
* NED, xyzw and degrees exist at the edges only: ``Track.as_rotation``, ``Track.euler``, printing, plots. Each
  parameter has its own unit.
* A missing reading is NaN in a Recording and is never filled in silently: ``Track.health`` has the measures taken.

An error that the user can correct raises ``LevelheadError`` with one sentence: the fault, the place, the remedy.
"""

import importlib
from typing import TYPE_CHECKING, Any

from levelhead.version import VERSION

if TYPE_CHECKING:
    from levelhead import simulate as simulate
    from levelhead.calibrate import calibrate_magnetometer as calibrate_magnetometer
    from levelhead.calibrate import calibrate_sensor as calibrate_sensor
    from levelhead.calibrate import correct_magnetometer as correct_magnetometer
    from levelhead.calibration import Calibration as Calibration
    from levelhead.corpora.runner import corpus as corpus
    from levelhead.corpora.tune_corpus import tune_corpus as tune_corpus
    from levelhead.engine import AxisStream as AxisStream
    from levelhead.engine import Stream as Stream
    from levelhead.engine import fuse as fuse
    from levelhead.engine import fuse_axis as fuse_axis
    from levelhead.engine import fuse_chunks as fuse_chunks
    from levelhead.engine import fuse_parameter_sets as fuse_parameter_sets
    from levelhead.engine import fuse_recordings as fuse_recordings
    from levelhead.engine import smooth as smooth
    from levelhead.engine.smooth_chunks import smooth_chunks as smooth_chunks
    from levelhead.errors import LevelheadError as LevelheadError
    from levelhead.evaluate.align.search import align as align
    from levelhead.evaluate.compare import compare as compare
    from levelhead.filters import EKF as EKF
    from levelhead.filters import ESKF as ESKF
    from levelhead.filters import AccelTilt as AccelTilt
    from levelhead.filters import BiasRateKalman as BiasRateKalman
    from levelhead.filters import Complementary as Complementary
    from levelhead.filters import GyroIntegration as GyroIntegration
    from levelhead.filters import Kalman as Kalman
    from levelhead.filters import Madgwick as Madgwick
    from levelhead.filters import Mahony as Mahony
    from levelhead.filters import RollPitchKalman as RollPitchKalman
    from levelhead.filters import Triad as Triad
    from levelhead.gaits import Gait as Gait
    from levelhead.gaits import GaitStream as GaitStream
    from levelhead.gaits import gait as gait
    from levelhead.guard import Guard as Guard
    from levelhead.heave import Heave as Heave
    from levelhead.heave import HeaveFilter as HeaveFilter
    from levelhead.heave import Sea as Sea
    from levelhead.inspection import inspect as inspect
    from levelhead.joints import Joint as Joint
    from levelhead.joints import joint as joint
    from levelhead.magnetic_model import earth_field as earth_field
    from levelhead.noise import NoiseModel as NoiseModel
    from levelhead.noise import measure_noise as measure_noise
    from levelhead.parameter_file import ParameterFile as ParameterFile
    from levelhead.recording import Gnss as Gnss
    from levelhead.recording import Pressure as Pressure
    from levelhead.recording import Recording as Recording
    from levelhead.recording import Truth as Truth
    from levelhead.recording import ZeroVelocity as ZeroVelocity
    from levelhead.sources import read as read
    from levelhead.sources.chunked import read_chunks as read_chunks
    from levelhead.sources.formats.c3d import read_c3d as read_c3d
    from levelhead.sources.formats.opensim import read_mot as read_mot
    from levelhead.sources.formats.opensim import read_sto as read_sto
    from levelhead.sources.pipeline import interpret as interpret
    from levelhead.track import Track as Track
    from levelhead.tune.sweep import sweep as sweep
    from levelhead.tune.tune_filter import tune_filter as tune_filter

__version__ = VERSION

# Imported at first use: `import levelhead` costs nothing, and an unused part takes no time.
_HOMES = {
    "levelhead.calibrate": ("calibrate_magnetometer", "calibrate_sensor", "correct_magnetometer"),
    "levelhead.calibration": ("Calibration",),
    "levelhead.corpora.runner": ("corpus",),
    "levelhead.corpora.tune_corpus": ("tune_corpus",),
    "levelhead.magnetic_model": ("earth_field",),
    "levelhead.engine": (
        "AxisStream",
        "Stream",
        "fuse",
        "fuse_axis",
        "fuse_chunks",
        "fuse_parameter_sets",
        "fuse_recordings",
        "smooth",
    ),
    "levelhead.engine.smooth_chunks": ("smooth_chunks",),
    "levelhead.errors": ("LevelheadError",),
    "levelhead.evaluate": ("align", "compare"),
    "levelhead.filters": (
        "AccelTilt", "BiasRateKalman", "Complementary", "EKF", "ESKF", "GyroIntegration", "Kalman", "Madgwick",
        "Mahony", "RollPitchKalman", "Triad",
    ),
    "levelhead.gaits": ("Gait", "GaitStream", "gait"),
    "levelhead.guard": ("Guard",),
    "levelhead.heave": ("Heave", "HeaveFilter", "Sea"),
    "levelhead.inspection": ("inspect",),
    "levelhead.joints": ("Joint", "joint"),
    "levelhead.noise": ("NoiseModel", "measure_noise"),
    "levelhead.parameter_file": ("ParameterFile",),
    "levelhead.recording": ("Gnss", "Pressure", "Recording", "Truth", "ZeroVelocity"),
    "levelhead.sources": ("read",),
    "levelhead.sources.chunked": ("read_chunks",),
    "levelhead.sources.formats.c3d": ("read_c3d",),
    "levelhead.sources.formats.opensim": ("read_mot", "read_sto"),
    "levelhead.sources.pipeline": ("interpret",),
    "levelhead.track": ("Track",),
    "levelhead.tune": ("sweep", "tune_filter"),
}  # fmt: skip
_HOME = {name: home for home, names in _HOMES.items() for name in names}
_ROOMS = (
    "simulate", "filters", "guard", "sources", "engine", "evaluate", "inspection", "noise", "tune", "live", "publish",
    "corpora",
)  # fmt: skip

__all__ = [*_HOME, "simulate"]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(importlib.import_module(_HOME[name]), name)
    elif name in _ROOMS:
        value = importlib.import_module(f"levelhead.{name}")
    else:
        from levelhead.errors import nearest

        raise AttributeError(f"levelhead has no '{name}'; {nearest(name, __all__)}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
