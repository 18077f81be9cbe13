"""A reference that lost its body is left out; one that only stands aside of the sensor, or a sensor's fault, is not."""

from dataclasses import replace

import numpy as np
import pytest

from levelhead import simulate
from levelhead.bench.contradiction import REFERENCE_ENDS, trust_until_contradiction
from levelhead.bench.datasets import list_logs, load_recording
from levelhead.bench.survey import survey
from levelhead.errors import LevelheadError
from levelhead.rotations import product
from levelhead.sources.formats.npz import write_npz


@pytest.fixture(scope="module")
def swung():
    return simulate.recording("BMI160", "hand", 40.0, seed=5)


def flipped(recording, start, end):
    """Two markers exchanged for some time: the body of the reference is turned by half a turn about its x axis."""
    quat = recording.truth.quat.copy()
    rows = (recording.t >= start) & (recording.t < end)
    quat[rows] = product(quat[rows], np.array([0.0, 1.0, 0.0, 0.0]))
    return replace(recording, truth=replace(recording.truth, quat=quat))


def test_exchanged_markers_end_the_reference(swung):
    found = trust_until_contradiction(flipped(swung, 21.0, 23.0))
    assert found.meta[REFERENCE_ENDS] == pytest.approx(21.0, abs=0.3)
    known = ~np.isnan(found.truth.quat[:, 0])
    assert (known == (found.t < found.meta[REFERENCE_ENDS])).all()


def test_a_body_aside_of_the_sensor_and_faults_of_the_sensor_are_no_contradiction(swung):
    askew = product(swung.truth.quat, np.array([np.cos(0.05), 0.0, np.sin(0.05), 0.0]))  # 5.7°
    sound = replace(swung, truth=replace(swung.truth, quat=askew))
    for fault in ("gyr_clipping=150", "bias_ramp=20@5+30", "dropped=40", "bursts", "gyr_spikes", "loose_mount=10@20"):
        faulted = simulate.apply_fault(sound, simulate.parse_fault(fault)).recording
        assert trust_until_contradiction(faulted) is faulted, fault


def test_the_survey_says_what_is_left_out(swung, tmp_path):
    write_npz(flipped(swung, 21.0, 23.0), tmp_path / "lost.npz")
    entries, left_out = survey([tmp_path], with_mag=False)
    assert [entry.name for entry in entries] == ["lost"]
    assert len(left_out) == 1 and left_out[0].startswith("lost.npz from 2") and "reference turns" in left_out[0]


def test_of_all_recordings_two_have_lost_their_body(data_dir):
    ends = {}
    for path in list_logs([data_dir]):
        try:
            found = load_recording(path, with_mag=True)
        except LevelheadError:
            continue
        if REFERENCE_ENDS in found.meta:
            ends[path.stem] = found.meta[REFERENCE_ENDS]
    assert ends == {
        "TStick_Test05_Trial2": pytest.approx(33.7, abs=0.5),
        "TStick_Test06_Trial1": pytest.approx(87.4, abs=0.5),
    }


def test_a_reference_that_is_none_is_refused(swung, tmp_path):
    """The inverse of every orientation: a convention that somebody else has."""
    quat = swung.truth.quat * [1.0, -1.0, -1.0, -1.0]
    write_npz(replace(swung, truth=replace(swung.truth, quat=quat)), tmp_path / "inverse.npz")
    with pytest.raises(LevelheadError, match=r"contradicts the gyroscope after 3.4 s; expected orientations"):
        survey([tmp_path], with_mag=False)
