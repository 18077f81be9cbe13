"""The contract of all filters, and what goes wrong with sensors, once more: with the exported C as the engine."""

import inspect
from itertools import chain

import pytest
from tests.filters import test_contract, test_faults
from tests.reference import c_engine

import levelhead as lh

pytestmark = [pytest.mark.compiled, pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")]
PYTHON_ALONE = {"test_every_engine_says_the_same_of_faults"}  # compares engines that are none of C


@pytest.fixture(scope="module", autouse=True)
def _in_c():
    """``lh.fuse`` of these tests is C."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lh, "fuse", c_engine.fuse)
        yield


SUITES = dict(chain(vars(test_contract).items(), vars(test_faults).items()))
TESTS = {
    name: test
    for name, test in SUITES.items()
    if name.startswith("test_") and "lh.fuse(" in inspect.getsource(test) and name not in PYTHON_ALONE
}
assert len(TESTS) > 20
globals().update(TESTS)
clean = test_faults.clean


def test_the_engine_of_these_tests_is_c():
    assert lh.fuse is c_engine.fuse and lh.fuse(lh.simulate.lesson(), lh.Kalman()).name == "Kalman"
