"""Files of cameras and sensors, written byte by byte as their makers describe them, and read back."""

import struct
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.recording import Recording
from levelhead.units import GRAVITY

# GPMF: gopro/gpmf-parser, README ("Length", "Types", "GPMF keys"); MP4: ISO/IEC 14496-12.


def item(key: bytes, kind: bytes, size: int, content: bytes) -> bytes:
    repeat = len(content) // size
    return struct.pack(">4scBH", key, kind, size, repeat) + content + bytes(-len(content) % 4)


def nested(key: bytes, *items: bytes) -> bytes:
    content = b"".join(items)
    return struct.pack(">4sBBH", key, 0, 1, len(content)) + content


def stream(key: bytes, unit: bytes, values: np.ndarray, scale: int, orientation: bytes, stamp: int | None) -> bytes:
    """Readings (n, 3) along x, y, z, written in the order of ``orientation``."""
    written = np.empty_like(values)
    for i, letter in enumerate(orientation.decode()):
        written[:, i] = values[:, "XYZ".index(letter.upper())] * (1.0 if letter.isupper() else -1.0)
    whole = np.rint(written * scale).astype(">i2").tobytes()
    stamps = [] if stamp is None else [item(b"STMP", b"J", 8, struct.pack(">Q", stamp))]
    return nested(
        b"STRM", *stamps, item(b"STNM", b"c", 1, b"a sensor"), item(b"SIUN", b"c", len(unit), unit),
        item(b"ORIN", b"c", 1, orientation), item(b"SCAL", b"s", 2, struct.pack(">h", scale)),
        item(key, b"s", 6, whole),
    )  # fmt: skip


def box(kind: bytes, *contents: bytes) -> bytes:
    content = b"".join(contents)
    return struct.pack(">I4s", 8 + len(content), kind) + content


def full(kind: bytes, *contents: bytes) -> bytes:
    return box(kind, bytes(4), *contents)


def video(payloads: list[bytes], ticks: int, scale: int, per_chunk: int) -> bytes:
    """An MP4 whose only track holds the payloads, each ``ticks`` / ``scale`` s long, behind the media data."""
    head = box(b"ftyp", b"mp41", bytes(4), b"mp41")
    count = len(payloads)
    starts, at = [], len(head) + 8
    for k, payload in enumerate(payloads):
        starts += [at] if k % per_chunk == 0 else []
        at += len(payload)
    table = box(
        b"stbl",
        full(b"stsd", struct.pack(">I", 1), box(b"gpmd", bytes(8))),
        full(b"stts", struct.pack(">III", 1, count, ticks)),
        full(b"stsc", struct.pack(">IIII", 1, 1, per_chunk, 1)),
        full(b"stsz", struct.pack(f">II{count}I", 0, count, *map(len, payloads))),
        full(b"stco", struct.pack(f">I{len(starts)}I", len(starts), *starts)),
    )
    header = full(b"mdhd", struct.pack(">IIIIHH", 0, 0, scale, ticks * count, 0, 0))
    return head + box(b"mdat", *payloads) + box(b"moov", box(b"trak", box(b"mdia", header, box(b"minf", table))))


@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize("orientation", [b"ZXY", b"YxZ"])
def test_the_sensors_of_a_gopro(tmp_path: Path, hand: Recording, stamped: bool, orientation: bytes) -> None:
    each = 100  # samples in a payload of one second
    payloads = []
    for k in range(len(hand) // each):
        rows = slice(k * each, (k + 1) * each)
        stamp = 1_000_000 * k + 5_000 if stamped else None
        payloads.append(
            nested(
                b"DEVC", item(b"DVNM", b"c", 1, b"Hero9 Black"),
                stream(b"ACCL", b"m/s2", hand.acc[rows], 417, orientation, stamp),
                stream(b"GYRO", b"rad/s", hand.gyr[rows], 939, orientation, stamp),
            )
        )  # fmt: skip
    path = tmp_path / "GX010001.MP4"
    path.write_bytes(video(payloads, 1001, 1001, 3))
    read = lh.read(path)
    assert len(read) == len(hand)
    np.testing.assert_allclose(read.acc, hand.acc, atol=0.51 / 417)
    np.testing.assert_allclose(read.gyr, hand.gyr, atol=0.51 / 939)
    np.testing.assert_allclose(read.t - read.t[0], hand.t - hand.t[0], atol=1e-9)


def test_a_video_without_sensors_names_what_writes_them(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    path.write_bytes(box(b"ftyp", b"mp41", bytes(4)) + box(b"moov", box(b"mvhd", bytes(100))))
    with pytest.raises(lh.LevelheadError, match=r"without a GoPro's track.*Gyroflow"):
        lh.read(path)


# WitMotion: "Communication Protocol" of WT901, HWT905 (docs.wit-motion.com).


def packet(kind: int, content: bytes) -> bytes:
    body = bytes([0x55, kind]) + content
    return body + bytes([sum(body) % 256])


def shorts(values: np.ndarray, *more: int) -> bytes:
    return struct.pack("<4h", *np.rint(values).astype(int).tolist(), *more)


@pytest.mark.parametrize("dated", [True, False])
def test_packets_of_witmotion(tmp_path: Path, hand: Recording, dated: bool) -> None:
    acc, gyr = hand.acc / GRAVITY * 32768 / 16, np.degrees(hand.gyr) * 32768 / 2000
    data = b"\x55\x51\0"  # the end of a packet that was cut
    for k, t in enumerate(hand.t.tolist()):
        second, milli = divmod(round(1000 * t), 1000)
        if dated:
            data += packet(0x50, bytes([23, 11, 14, 22, 13, second]) + struct.pack("<H", milli))
        data += packet(0x51, shorts(acc[k], 2500)) + packet(0x52, shorts(gyr[k], 0))
        data += packet(0x53, shorts(np.zeros(3), 0)) + packet(0x54, shorts(np.array([100.0, 200.0, -300.0]), 0))
    path = tmp_path / "wit.bin"
    path.write_bytes(data)
    if not dated:
        with pytest.raises(lh.LevelheadError, match="--rate"):
            lh.read(path)
    read = lh.read(path, **({} if dated else {"rate": hand.rate}))
    assert len(read) == len(hand)
    np.testing.assert_allclose(read.acc, hand.acc, atol=0.51 * 16 / 32768 * GRAVITY)
    np.testing.assert_allclose(read.gyr, hand.gyr, atol=np.radians(0.51 * 2000 / 32768))
    if dated:
        assert read.meta["t0"] == 1_700_000_000 - 1_700_000_000 % 60 + hand.t[0]
        np.testing.assert_allclose(read.t, hand.t - hand.t[0], atol=1e-6)


def test_packets_of_witmotion_s_bluetooth_units(tmp_path: Path, hand: Recording) -> None:
    acc, gyr = hand.acc / GRAVITY * 32768 / 16, np.degrees(hand.gyr) * 32768 / 2000
    rows = np.rint(np.column_stack([acc, gyr, np.zeros((len(hand), 3))])).astype("<i2")
    (tmp_path / "ble.bin").write_bytes(b"".join(b"\x55\x61" + row.tobytes() for row in rows))
    read = lh.read(tmp_path / "ble.bin", rate=hand.rate)
    np.testing.assert_allclose(read.gyr, hand.gyr, atol=np.radians(0.51 * 2000 / 32768))


# MVNX: Xsens MVN User Manual, "MVNX".


def frames(made: Recording, tags: tuple[str, str]) -> str:
    lines = []
    for k, t in enumerate(made.t.tolist()):
        parts = "".join(
            f"<{tag}>{' '.join(f'{x:.9g}' for x in (*values[k], *(-values[k])))}</{tag}>"
            for tag, values in zip(tags, (made.acc, made.gyr), strict=True)
        )
        lines.append(f'<frame time="{round(1000 * t)}" index="{k}" type="normal">{parts}</frame>')
    return "\n".join(lines)


def mvnx(made: Recording, tags: tuple[str, str]) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?><mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="4">'
        '<subject label="Test" frameRate="100" segmentCount="2"><sensors><sensor label="Pelvis"/>'
        '<sensor label="RightFoot"/></sensors><frames segmentCount="2" sensorCount="2">'
        '<frame time="0" index="" type="identity"><orientation>1 0 0 0</orientation></frame>'
        f"{frames(made, tags)}</frames></subject></mvnx>"
    )


def test_the_sensors_of_a_suit(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "walk.mvnx"
    path.write_text(mvnx(hand, ("sensorAcceleration", "sensorAngularVelocity")))
    for sensor, sign in ((None, 1.0), ("RightFoot", -1.0)):
        read = lh.read(path, sensor=sensor)
        np.testing.assert_allclose(read.gyr, sign * hand.gyr, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(read.acc, sign * hand.acc, rtol=1e-8)


def test_segments_are_no_sensors(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "walk.mvnx"
    path.write_text(mvnx(hand, ("acceleration", "angularVelocity")))
    with pytest.raises(lh.LevelheadError, match="holds segments, and no readings of sensors"):
        lh.read(path)


@pytest.mark.parametrize("name", ["a.mp4", "a.bin", "a.mvnx"])
def test_damage_ends_with_a_sentence(tmp_path: Path, hand: Recording, name: str) -> None:
    rng = np.random.default_rng(0)
    whole = {
        "a.mp4": video([nested(b"DEVC", stream(b"ACCL", b"m/s2", hand.acc[:50], 400, b"XYZ", 0))], 100, 100, 1),
        "a.bin": packet(0x51, shorts(np.ones(3), 1)) * 50,
        "a.mvnx": mvnx(hand, ("a", "b")).encode(),
    }[name]
    for _ in range(60):
        data = bytearray(whole[: rng.integers(1, len(whole))])
        for _ in range(20):
            data[rng.integers(len(data))] = rng.integers(256)
        (tmp_path / name).write_bytes(bytes(data))
        with pytest.raises(lh.LevelheadError):
            lh.read(tmp_path / name)
