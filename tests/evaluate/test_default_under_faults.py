"""The default filter is held to three sentences for every fault: it recovers, it says so, it is never surer than right.

The bounds are what the house states elsewhere and are not read off from results: recovery within the time that the
filter itself states (``settles``, within 2°); whatever moves an angle by more than these 2° is said by health or by a
σ of twice its size; and a fault adds at most one percent of samples beyond 4 σ, which is the aim for real recordings.
What the filter does not keep stands below as a strict xfail with its cause.
"""

from functools import cache

import pytest

from levelhead import filters, simulate
from levelhead.engine import fuse
from levelhead.evaluate.fault_response import measure_response
from levelhead.simulate.fault import KINDS

SETTLES = filters.of(filters.default()).settles
MOTIONS = {"hand": 1, "walking": 2, "drone": 3}  # style: seed
DURATION = 260.0  # s: after the start of a fault there is the longest time that the filter states, and its last second
MORE_BEYOND = 0.01  # share of samples

NAMES = [kind.name for kind in KINDS]
CLIPS = "a full scale that nobody told is only found beyond 4 rad/s; below it the rate at the limit is believed"
RAMP = "that a bias walks faster is found after it has: (27) follows 1 deg/s in a minute some 15 s late"
MOUNT = "nothing measures how the sensor sits on its body; the filter is right about the sensor"
UNITS = "ten seconds at 57 times the rate can end with a heading that is half a turn off and fits the field for seconds"
MAGNET = "hard iron that comes later is learned more slowly than the filter states for rest; its σ says so"
RELATIVE = "heading stays relative after a lost turn: ESKF turns to north only with north_rate, 0 by default"
UNKEPT = {
    ("gyr_clipping", "says so"): CLIPS,
    ("gyr_clipping", "never surer than right"): CLIPS,
    ("bias_ramp", "recovers"): RAMP,
    ("bias_ramp", "never surer than right"): RAMP,
    ("loose_mount", "recovers"): MOUNT,
    ("loose_mount", "says so"): MOUNT,
    ("loose_mount", "never surer than right"): MOUNT,
    ("mag_staying", "recovers"): MAGNET,
    ("gyr_units", "recovers"): RELATIVE,
    ("gyr_units", "never surer than right"): UNITS,
}


@cache
def sound(style):
    recording = simulate.recording("BMI160", style, DURATION, seed=MOTIONS[style], mag="HMC5883L")
    return recording, fuse(recording)


@cache
def responses(name):
    """Style of motion -> response to the fault of its usual size."""
    found = {}
    for style in MOTIONS:
        recording, track = sound(style)
        faulted = simulate.apply_fault(recording, simulate.parse_fault(name))
        found[style] = measure_response(faulted, fuse(faulted.recording), recording, track, "default")
    return found


def each(sentence):
    marked = [
        pytest.param(name, marks=pytest.mark.xfail(reason=UNKEPT[name, sentence], strict=True))
        if (name, sentence) in UNKEPT
        else name
        for name in NAMES
    ]
    return pytest.mark.parametrize("name", marked)


@pytest.mark.slow
@each("recovers")
def test_it_recovers(name):
    for style, one in responses(name).items():
        assert one.tilt_recovery is not None and one.tilt_recovery <= SETTLES.tilt, f"tilt, {style}"
        assert one.heading_recovery is not None and one.heading_recovery <= SETTLES.heading, f"heading, {style}"


@each("says so")
def test_it_says_so(name):
    for style, one in responses(name).items():
        assert one.harmless or one.is_said, style


@each("never surer than right")
def test_it_is_never_surer_than_right(name):
    for style, one in responses(name).items():
        assert one.beyond <= one.usual_beyond + MORE_BEYOND, style
