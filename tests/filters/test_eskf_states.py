"""The declaration of the ESKF's states: all that follows from it, and that one more block of states is four files."""

import itertools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import levelhead as lh
from levelhead.filters.contract import POSITION, VELOCITY
from levelhead.filters.eskf import adaptation
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import state_variance
from levelhead.filters.eskf.filter import init, update_aiding
from levelhead.kernels.tilt import UNIFORM
from levelhead.kernels.vec3 import ZERO, Vec3

PACKAGE = Path(lh.__file__).parent

# Scale factors k of the accelerometer, f = R (1 − k) (a − c), as somebody would add them: file -> (before, after)
EDITS = {
    "state.py": (
        (
            'VELOCITY = states("velocity"',
            'ACC_SCALE = states("acc_scale", (3,), "", "accelerometer scale factors k", ALWAYS, '
            "calibration=True, prior=True)\n"
            'VELOCITY = states("velocity"',
        ),
        (
            "    declare_states(m, VELOCITY, 3,",
            "    declare_states(m, ACC_SCALE, 3, params.acc_scale, params.acc_scale_walk, 1.0)\n"
            "    declare_states(m, VELOCITY, 3,",
        ),
        ("INT_FORCE = place(3", 'INT_R_ACC = place(9, "m/s", "∫ R_ik f_k dt")\nINT_FORCE = place(3'),
    ),
    "params.py": (
        (
            "    velocity_density: Annotated[",
            '    acc_scale: Annotated[float, nonnegative("", "1σ of the accelerometer\'s scales", 0.001, 0.1)] = 0.02\n'
            '    acc_scale_walk: Annotated[float, nonnegative("1/√s", "random walk of these", 1e-6, 1e-3)] = 0.0\n'
            "    velocity_density: Annotated[",
        ),
    ),
    "preintegration.py": (
        (
            "    if tilt.is_present(acc):\n        x, y, z = acc\n",
            "    if tilt.is_present(acc):\n        x, y, z = acc\n"
            "        for k in range(3):\n"
            "            m[at.INT_R_ACC + 3 * k] += (r.xx if k == 0 else r.yx if k == 1 else r.zx) * x * dt\n"
            "            m[at.INT_R_ACC + 3 * k + 1] += (r.xy if k == 0 else r.yy if k == 1 else r.zy) * y * dt\n"
            "            m[at.INT_R_ACC + 3 * k + 2] += (r.xz if k == 0 else r.yz if k == 1 else r.zz) * z * dt\n"
            "        s = at.MEAN + at.ACC_SCALE\n"
            "        x, y, z = x * (1.0 - m[s]), y * (1.0 - m[s + 1]), z * (1.0 - m[s + 2])\n",
        ),
    ),
    "predict.py": (
        (
            "            m[t + at.GYR_BIAS + k] =",
            "            m[v + at.ACC_SCALE + k] = m[at.INT_R_ACC + 3 * i + k]\n            m[t + at.GYR_BIAS + k] =",
        ),
    ),
}

# A body that is held in six attitudes and turned from one to the next, with 1.5 % of scale error on z
RUN = """
import numpy as np
import levelhead as lh
from levelhead.filters.eskf import state as at

rate = np.zeros((6000, 3))
for k, start in enumerate(range(500, 5501, 500)):
    rate[start - 100 : start, k % 2] = np.pi / 2
up = np.array([0.0, 0.0, 9.80665])
acc = np.empty((6000, 3))
for i, w in enumerate(rate):
    acc[i] = up
    x, y = w[0] * 0.01, w[1] * 0.01
    c, s = np.cos(x), np.sin(x)
    up = np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ up
    c, s = np.cos(y), np.sin(y)
    up = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ up
rng = np.random.default_rng(0)
acc = (acc + rng.normal(0, 0.01, acc.shape)) * [1.0, 1.0, 1.0 / (1.0 - 0.015)]
recording = lh.Recording(np.arange(6000) / 100, rate + rng.normal(0, 1e-3, rate.shape), acc)
track = lh.fuse(recording, lh.ESKF(acc_bias=0.0), engine="python")
known = track.calibration
print(at.N, at.ROW, *known.acc_scale.value, *known.acc_scale.sigma)
print(known)
again = lh.fuse(recording, lh.ESKF(acc_bias=0.0), engine="python", prior=known)
print(again.calibration.acc_scale.sigma[2] < known.acc_scale.sigma[2])
"""


def test_everything_follows_from_the_declaration():
    """Offsets by name, without a hole; kernels declare the same sizes; rows are long enough and of whole vectors."""
    for block, after in itertools.pairwise(at.BLOCKS):
        assert getattr(at, block.name.upper()) == block.first
        assert after.first == block.first + block.size
    assert {block.first: block.size for block in at.BLOCKS} == {
        first: size for first, (size, _, _) in at.block_noise(lh.ESKF()).items()
    }
    exists = [block.exists for block in at.BLOCKS]
    assert exists == sorted(exists, key=[at.ALWAYS, at.WITH_MAG, at.WITH_AIDING].index), (
        "what exists always comes first"
    )
    assert at.FIELD <= at.N_INERTIAL <= at.N_MAGNETIC <= at.ROW and at.N <= at.ROW and at.POSITION <= at.N_MAGNETIC
    assert {length % 4 for length in (at.N_INERTIAL, at.N_MAGNETIC, at.ROW)} == {0}
    assert all(
        isinstance(value, int) for name, value in vars(at).items() if name.isupper() and name in ("P", "SIZE", "N")
    )


def test_walks_are_the_parameters():
    """Each parameter of a start or a walk reaches the block that it belongs to, and no other."""
    plain = at.block_noise(lh.ESKF())
    for name, block in (("acc_walk", at.ACC_BIAS), ("bias_start", at.GYR_BIAS), ("offset_walk", at.MAG_OFFSET)):
        changed = at.block_noise(lh.ESKF(**{name: 0.5 * getattr(lh.ESKF(), name)}))
        assert [first for first in plain if plain[first] != changed[first]] == [block]


@pytest.fixture
def package(tmp_path):
    """A copy of the package that a test may edit."""
    copy = tmp_path / "levelhead"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


@pytest.mark.slow
def test_one_more_block_of_states_is_four_files(package):
    for name, edits in EDITS.items():
        path = package / "filters" / "eskf" / name
        text = path.read_text(encoding="utf-8")
        for before, after in edits:
            assert text.count(before) == 1, (name, before)
            text = text.replace(before, after)
        path.write_text(text, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", RUN], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    first, *words, prior = done.stdout.splitlines()
    n, row, *numbers = map(float, first.split())
    assert (n, row) == (at.N + 3, at.fours(at.N + 3))
    scale, sigma = numbers[:3], numbers[3:]
    assert max(sigma) < 0.3 * 0.02, "the motion taught all three"
    for value, deviation, truth in zip(scale, sigma, (0.0, 0.0, 0.015), strict=True):
        assert abs(value - truth) < 4.0 * deviation
    assert any(line.startswith("accelerometer scale factors k") for line in words)
    assert prior == "True"


def test_the_memory_has_no_gap_and_no_place_twice():
    """Each place begins behind the one before, has a constant of the module, and the last is the size of all."""
    places = [one for one in at._places if one.size]
    ends = itertools.accumulate(one.size for one in places)
    assert [one.first for one in places[1:]] == list(ends)[:-1]
    constants = {value for name, value in vars(at).items() if name.isupper() and isinstance(value, int)}
    assert {one.first for one in places} <= constants
    assert places[-1].first + places[-1].size == at.SIZE


def test_the_walk_of_the_bias_is_bounded():
    m = [0.0] * at.SIZE
    m[at.BLOCK_TIME], m[at.X + at.GYR_BIAS] = 1.0, 1.0
    adaptation.adapt_bias_walk(m)
    assert m[at.BIAS_WALK] == adaptation.MOST_WALK**2


def test_the_first_velocity_makes_heading_unknown():
    """Without a field: a position gives a direction, and the first velocity one by which heading can be found."""
    params = lh.ESKF()
    state = init(params, ZERO, Vec3(0.0, 0.0, 9.81), ZERO)
    for row, sigma in ((POSITION, at.UNKNOWN), (VELOCITY, UNIFORM)):
        state = update_aiding(params, state, row, 0.0, 1.0, 0.0)
        assert state_variance(state.memory, at.HEADING) == pytest.approx(sigma**2)
