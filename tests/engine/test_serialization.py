"""A saved stream goes on as if it had never stopped, to the bit; what is no saved stream is refused in a sentence."""

import json
import struct
import zlib

import numpy as np
import pytest
from tests.reference.engines import NATIVE
from tests.reference.hard import hard_recording

import levelhead as lh
from levelhead import filters
from levelhead.engine import serialization

EVERY = pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
# Where the hard recording is cut: before anything, before the first good sample, in the middle of missing readings,
# just before its gap, in its fast turn.
CUTS = (0, 2, 305, 400, 505)


def feed(live, recording, rows):
    """Everything that a stream says, as bytes: 0.0 and −0.0 are not the same here."""
    said = []
    for i in rows:
        quat = live.update(recording.gyr[i], recording.acc[i], recording.mag[i], t=float(recording.t[i]))
        said.append([*quat, *(live.bias or ()), *live.sigma, live.health])
    return np.array(said).tobytes()


@pytest.fixture(scope="module")
def recording():
    return hard_recording(True)[:530]


@EVERY
@pytest.mark.parametrize(
    ("before", "after"),
    [
        pytest.param("python", "native", marks=NATIVE.marks),
        pytest.param("native", "python", marks=NATIVE.marks),
        pytest.param("python", "compiled", marks=pytest.mark.compiled),
        pytest.param("compiled", "python", marks=pytest.mark.compiled),
    ],
)
def test_going_on_equals_never_having_stopped(flt, before, after, recording):
    whole = lh.Stream(flt.params(), engine=before)
    at = 0
    kept = {}
    for cut in CUTS:
        feed(whole, recording, range(at, cut))
        kept[cut] = whole.save()
        at = cut
    for cut, data in kept.items():
        reference, again = (lh.Stream.restore(data, engine=engine) for engine in (before, after))
        assert reference.params == again.params == flt.params()
        assert again.save() == data
        rows = range(cut, min(cut + 25, len(recording)))
        assert feed(again, recording, rows) == feed(reference, recording, rows)
        assert again.save() == reference.save()
    going_on = lh.Stream.restore(kept[305], engine=after)
    feed(going_on, recording, range(305, 505))
    assert going_on.save() == kept[505], "never having stopped"


@pytest.mark.compiled
def test_stamps_and_guard_survive(recording):
    live = lh.Stream(lh.Kalman(r_measure=0.5), guard=lh.Guard(gyr_range=250.0, rest_time=3.0), engine="python")
    feed(live, recording, range(50))
    again = lh.Stream.restore(live.save(), engine="python")
    with pytest.raises(lh.LevelheadError, match="stamps must increase"):
        again.update(recording.gyr[49], recording.acc[49], t=float(recording.t[49]))
    assert again.save() == live.save()
    assert serialization.from_bytes(live.save()).settings.guard == lh.Guard(gyr_range=250.0, rest_time=3.0)
    bare = lh.Stream(lh.EKF(), guard=None, engine="python")
    bare.update((0.0, 0.0, 0.1), (0.0, 0.0, 9.81), dt=0.01)
    again = lh.Stream.restore(bare.save(), engine="compiled")
    assert again.bias == bare.bias and again.save() == bare.save()
    again.update((0.0, 0.0, 0.1), (0.0, 0.0, 9.81), t=1000.0)  # no stamp was kept: any will do


@pytest.mark.compiled
def test_parameters_changed_on_the_fly_survive(recording):
    live = lh.Stream(lh.EKF(), engine="python")
    feed(live, recording, range(20))
    live.set(acc_tau=2.5)
    assert lh.Stream.restore(live.save(), engine="compiled").params == lh.EKF(acc_tau=2.5)


def test_in_a_file_and_back(recording, tmp_path):
    live = lh.Stream(lh.EKF(), engine="python")
    feed(live, recording, range(300))
    path = tmp_path / "live.levelhead"
    path.write_bytes(live.save())
    again = lh.Stream.restore(path.read_bytes(), engine="python")
    assert feed(again, recording, range(300, 420)) == feed(live, recording, range(300, 420))


@pytest.fixture(scope="module")
def data(recording):
    live = lh.Stream(lh.Kalman(), engine="python")
    feed(live, recording, range(30))
    return live.save()


def refused(data, words):
    with pytest.raises(lh.LevelheadError, match=words) as caught:
        lh.Stream.restore(data, engine="python")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "foreign", [b"", b"levelhead", b"PK\x03\x04 a zip", b"\x00" * 500, bytes(range(256)), "text", None]
)
def test_foreign_bytes_are_refused(foreign):
    refused(foreign, "these bytes are not a saved stream; expected the bytes of Stream.save")


def test_cut_off_and_damaged_bytes_are_refused(data):
    for end in (*range(len(serialization.MAGIC), len(serialization.MAGIC) + 8), 100, len(data) // 2, len(data) - 1):
        refused(data[:end], "cut off or damaged")
    refused(data + b"\n", "cut off or damaged")
    for at in range(len(serialization.MAGIC), len(data), 37):
        refused(data[:at] + bytes([data[at] ^ 16]) + data[at + 1 :], "cut off or damaged")


def resealed(data, body=b"", **changes):
    """Such bytes with another header or more numbers, and a checksum that fits."""
    header, _, numbers = data[len(serialization.MAGIC) : -4].partition(b"\n")
    text = json.dumps(json.loads(header) | changes).encode()
    whole = serialization.MAGIC + text + b"\n" + numbers + body
    return whole + struct.pack("<I", zlib.crc32(whole))


def test_another_version_is_refused(data):
    assert lh.Stream.restore(resealed(data), engine="python").params == lh.Kalman()
    refused(
        resealed(data, layout="0123456789abcdef", levelhead="0.0.9"), "saved by levelhead 0.0.9, whose Kalman keeps"
    )
    refused(resealed(data, body=b"12345678"), "keeps another state")
    refused(resealed(data, filter="Kalmann"), "Kalman")
    refused(resealed(data, params={"q_angel": 1.0}), "q_angle")
    refused(resealed(data, guard={"rest": 1.0}), "Guard has no parameter")


@pytest.mark.parametrize("header", [b"", b"not json", b"[]", b"{}", b'{"filter": "Kalman"}', b"\xff\xfe"])
def test_a_header_that_says_nothing_is_refused(header):
    whole = serialization.MAGIC + header + b"\n" + b"\x00" * 80
    refused(whole + struct.pack("<I", zlib.crc32(whole)), "header")
