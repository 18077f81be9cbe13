"""The twins that exports are measured beside do what their papers say: they find tilt, heading and an angle."""

import ctypes
import subprocess

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference import c_engine
from tests.reference.twins import LEAN, NAMES, TWINS

from levelhead.export import ExportConfig, write
from levelhead.export.config import LEAN as PARTS
from levelhead.filters import EKF, Mahony

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(not c_engine.COMPILERS, reason="no C compiler (gcc or clang) on the PATH"),
]


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    path = tmp_path_factory.mktemp("twins") / "twins.so"
    sources = [str(TWINS / f"{name}.c") for name in NAMES]
    command = [c_engine.COMPILERS[0], *c_engine.WARNINGS, "-Werror", "-O1", "-shared", "-fPIC", *sources, "-lm"]
    subprocess.run([*command, "-o", str(path)], check=True)
    return ctypes.CDLL(str(path))


@pytest.mark.parametrize("name", NAMES[:2])
def test_it_finds_the_orientation_and_follows_it(library, name):
    """From the identity, a minute of a turning body whose sensors have no errors; then within 3° of the truth."""
    t = np.arange(0.0, 60.0, 0.01)
    angles = np.stack([0.6 * np.sin(0.3 * t), 0.4 * np.sin(0.9 * t), 0.5 * np.sin(0.7 * t)], axis=1)
    truth = Rotation.from_euler("ZYX", angles)
    gyr = (truth[:-1].inv() * truth[1:]).as_rotvec() / 0.01
    earth = truth[1:].inv()
    readings = [gyr, earth.apply([0.0, 0.0, 9.81]), earth.apply([0.0, 20.0, -40.0])]
    rows = [np.ascontiguousarray(a, np.float32) for a in readings]
    state = (ctypes.c_float * 7)()
    getattr(library, f"{name}_init")(state)
    update, found = getattr(library, f"{name}_update"), np.empty((len(gyr), 4))
    for i in range(len(gyr)):
        assert update(state, *(ctypes.c_void_p(a.ctypes.data + 12 * i) for a in rows), ctypes.c_float(0.01))
        found[i] = state[:4]
    apart = Rotation.from_quat(found[:, [1, 2, 3, 0]]).inv() * truth[1:]
    assert np.degrees(apart[3000:].magnitude()).max() < 3.0


def test_the_angle_of_the_lesson(library):
    """A slow swing with noise and a bias of 2 deg/s, which it finds."""
    rng, t = np.random.default_rng(1), np.arange(0.0, 60.0, 0.01)
    angle, rate = 30.0 * np.sin(0.5 * t), 15.0 * np.cos(0.5 * t) + 2.0
    level = angle + rng.normal(0.0, 1.0, len(t))
    state, error = (ctypes.c_float * 6)(), []
    library.twin_kalman_axis_init(state, ctypes.c_float(level[0]))
    for i in range(len(t)):
        one = [ctypes.c_float(x) for x in (level[i], rate[i], 0.01, 0.0)]
        library.twin_kalman_axis_update(state, *one, None)
        error.append(state[0] - angle[i])
    assert np.std(error[3000:]) < 0.5 and abs(state[1] - 2.0) < 0.5


@pytest.mark.parametrize("params", [Mahony(), EKF()], ids=["Mahony", "EKF"])
def test_the_lean_filter_by_hand_has_the_bits_of_the_export(params, tmp_path):
    """On 300,000 samples, hard ones among them; the program prints the first that differs."""
    config = ExportConfig(params, None, "float", without=PARTS)
    write(config, tmp_path)
    name = config.name.removeprefix("lh_")
    sources = [LEAN / "same.c", LEAN / f"lean_{name}.c", tmp_path / f"{config.name}.c"]
    headers = [f'-DEXPORTED_H="{config.name}.h"', f'-DBY_HAND_H="lean_{name}.h"', f"-DFILTER={name}"]
    command = [
        "gcc",
        "-std=gnu11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-O2",
        *headers,
        f"-I{LEAN}",
        f"-I{tmp_path}",
        *map(str, sources),
    ]
    subprocess.run([*command, "-lm", "-o", str(tmp_path / "same")], check=True)
    assert subprocess.run([tmp_path / "same"], stdout=subprocess.PIPE, check=False).stdout == b"-1\n"
