"""The cache of machine code: the same key in every process, nothing stale kept, no crash where there is no place."""

import os
import subprocess
import sys

import pytest

from levelhead.compiler.cache import remove_stale

FUSE = """
import sys
import numpy as np, levelhead as lh
from levelhead import filters
from levelhead.engine.binding import bind
from levelhead.compiler.compile import compile_kernel
flt = filters.find(sys.argv[1])
n = 50
rec = lh.Recording(np.arange(n) / 100, np.zeros((n, 3)), np.tile([0.0, 0.0, 9.81], (n, 1)))
track = lh.fuse(rec, flt.params(), engine="compiled")
assert np.allclose(track.quat, [1, 0, 0, 0])
print("compiled" if sum(compile_kernel(bind(flt).run).stats.cache_misses.values()) else "cached")
"""


KEYS = """
from levelhead import filters
from levelhead.compiler.cache import code_hash
from levelhead.engine.binding import bind
print(*(code_hash(bind(flt).run) for flt in filters.ALL))
"""


@pytest.mark.slow
def test_the_key_of_every_filter_is_the_same_in_every_process():
    """Hashes of strings differ between the two, as they do between any two processes of a user."""
    keys = [
        subprocess.run(
            [sys.executable, "-c", KEYS], env=os.environ | {"PYTHONHASHSEED": seed}, stdout=subprocess.PIPE, check=True
        ).stdout.split()
        for seed in "12"
    ]
    assert keys[0] == keys[1] and len(set(keys[0])) == len(keys[0]) > 9


def run_fuse(name, **environment):
    done = subprocess.run(
        [sys.executable, "-c", FUSE, name], env=os.environ | environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.full
@pytest.mark.compiled
def test_a_second_process_compiles_nothing(tmp_path):
    """Of one filter; the test of the keys has all."""
    assert run_fuse("AccelTilt", NUMBA_CACHE_DIR=str(tmp_path), PYTHONHASHSEED="1") == "compiled"
    assert run_fuse("AccelTilt", NUMBA_CACHE_DIR=str(tmp_path), PYTHONHASHSEED="2") == "cached"


@pytest.mark.full  # the second tier has a read-only install without a home (tests/cli/test_process.py)
def test_no_place_for_a_cache_is_no_reason_to_crash():
    """As in a read-only install whose user has no home: Numba finds no locator for the cache."""
    nowhere = "UserProvidedCacheLocator"  # the only locator tried; it needs NUMBA_CACHE_DIR, which is not set
    assert run_fuse("AccelTilt", NUMBA_CACHE_LOCATOR_CLASSES=nowhere, NUMBA_CACHE_DIR="") == "compiled"


def test_files_of_older_code_are_removed_and_all_others_kept(tmp_path):
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    new, old = "0" * 15 + "1", "0" * 15 + "2"
    kept = [
        f"driver.run_ESKF_{new}-279.{python}.nbi",
        f"driver.run_ESKF_{new}-279.{python}.1.nbc",
        f"driver.run_ESKF_unguarded_{old}-279.{python}.nbi",
        f"driver.run_EKF_{old}-279.{python}.nbi",
        f"driver.run_ESKF_{old}-279.py39.nbi",
        f"driver.run_ESKF_{old}-279.{python}.pyc",
    ]
    stale = [f"driver.run_ESKF_{old}-279.{python}.nbi", f"driver.run_ESKF_{old}-301.{python}.2.nbc"]
    for name in kept + stale:
        (tmp_path / name).touch()
    remove_stale(tmp_path, "run_ESKF", new)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(kept)
