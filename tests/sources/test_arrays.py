import pickle
import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

from levelhead.errors import LevelheadError
from levelhead.recording import Recording, Truth
from levelhead.sources import read
from levelhead.sources.formats import npz
from levelhead.sources.formats.matlab import check_tags

h5py = pytest.importorskip("h5py")
scipy_io = pytest.importorskip("scipy.io")
sparse = pytest.importorskip("scipy.sparse")


def refused(path: Path, **hints: object) -> str:
    with pytest.raises(LevelheadError) as caught:
        read(path, **hints)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def broad(hand: Recording) -> dict[str, np.ndarray]:
    assert hand.truth is not None and hand.truth.moving is not None and hand.mag is not None
    return {
        "imu_gyr": hand.gyr, "imu_acc": hand.acc, "imu_mag": hand.mag, "opt_quat": hand.truth.quat,
        "sampling_rate": np.array([[100.0]]), "movement": hand.truth.moving[:, None],
    }  # fmt: skip


def check_broad(recording: Recording, hand: Recording) -> None:
    np.testing.assert_array_equal(recording.gyr, hand.gyr)
    np.testing.assert_array_equal(recording.acc, hand.acc)
    np.testing.assert_allclose(recording.t, hand.t, atol=1e-12)
    assert recording.truth is not None and recording.truth.north and hand.truth is not None
    np.testing.assert_array_equal(recording.truth.moving, hand.truth.moving)
    np.testing.assert_allclose(recording.truth.quat, hand.truth.quat, atol=1e-15)


def test_matlab_5(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "trial.mat"
    scipy_io.savemat(path, broad(hand))
    check_broad(read(path), hand)
    scipy_io.savemat(path, {"data": broad(hand)})
    check_broad_in_structure = read(path)
    np.testing.assert_array_equal(check_broad_in_structure.gyr, hand.gyr)
    content = path.read_bytes()
    for length in (5, 100, 200, len(content) // 2, len(content) - 9):
        path.write_bytes(content[:length])
        assert "truncated or damaged" in refused(path)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("suffix", [".mat", ".h5", ".hdf5"])
def test_matlab_7_3_is_hdf5_in_both_orientations(tmp_path: Path, hand: Recording, turned: bool, suffix: str) -> None:
    path = tmp_path / f"trial{suffix}"
    with h5py.File(path, "w", userblock_size=512 if suffix == ".mat" else 0) as file:
        for name, array in broad(hand).items():
            dataset = file.create_dataset(name, data=array.T if turned else array)
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
    check_broad(read(path), hand)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert "truncated or damaged" in refused(path)


def test_units_and_groups_in_hdf5(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["imu/gyro"] = np.degrees(hand.gyr)
        file["imu/gyro"].attrs["units"] = "deg/s"
        file["imu/accel"] = hand.acc
        file["imu/time"] = hand.t
    recording = read(path)
    np.testing.assert_allclose(recording.gyr, hand.gyr, rtol=1e-14)
    assert recording.meta["units"]["gyr"] == "deg/s"


def test_h5py_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n")
    monkeypatch.setitem(sys.modules, "h5py", None)
    assert "pip install 'levelhead[formats]'" in refused(path)


def test_corrupt_hdf5(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + b"garbage" * 50)
    assert "truncated or damaged" in refused(path)


def test_foreign_npz(tmp_path: Path, hand: Recording) -> None:
    path = tmp_path / "log.npz"
    np.savez(path, gyr=hand.gyr.astype(np.float32), acc=hand.acc, dt=0.01)
    recording = read(path)
    assert recording.rate == pytest.approx(100.0) and recording.meta["units"]["gyr"] == "rad/s"
    np.savez(path, gyr=hand.gyr, acc=hand.acc[:-1], dt=0.01)
    assert "acc.x has 1999 samples, but gyr.x has 2000" in refused(path)
    np.savez(path, gyr=hand.gyr, acc=hand.acc, fs=100.0)
    assert "gives its rate as 100 Hz" in refused(path, rate=50.0)
    assert read(path, rate=50.0, map={"t": []}).rate == pytest.approx(50.0)
    np.savez(path, turn=hand.gyr, force=hand.acc, fs=100.0)
    assert "no gyroscope" in refused(path)
    assert read(path, map={"gyr": ["turn"], "acc": "force"}).acc[0, 2] == hand.acc[0, 2]


def test_pickles_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    np.savez(path, gyr=np.array([{"a": 1}], dtype=object), allow_pickle=True)
    assert "holds a pickle" in refused(path)
    path.write_bytes(pickle.dumps({"a": 1}))
    assert "holds a pickle" in refused(path) or "not a .npz" in refused(path)


def test_a_reference_beside_the_samples(tmp_path: Path, hand: Recording) -> None:
    """The layout of shared/data/truth: q_ref_sensor is the truth where ref_ok, if its third axis is up."""
    assert hand.truth is not None
    path = tmp_path / "trial.npz"
    seen = np.arange(len(hand.t)) % 7 > 0
    arrays = {"t": hand.t, "gyr": hand.gyr, "acc": hand.acc, "ref_ok": seen}
    np.savez(path, **arrays, q_ref_sensor=hand.truth.quat)
    recording = read(path)
    assert recording.truth is not None and not recording.truth.north
    assert np.isnan(recording.truth.quat[~seen]).all()
    np.testing.assert_array_equal(recording.truth.quat[seen], hand.truth.quat[seen])
    w, x, y, z = hand.truth.quat.T
    s = np.sqrt(0.5)  # the world turned by 90° about its x axis: y is up
    np.savez(path, **arrays, q_ref_sensor=np.column_stack([w + x, x - w, y + z, z - y]) * s)
    recording = read(path)
    said = [note for note in recording.meta["notes"] if note.startswith("truth")]
    assert recording.truth is None and "left out" in said[0] and "not to (0, 0, 1)" in said[0]


def test_own_npz_is_exact(tmp_path: Path, hand: Recording) -> None:
    rng = np.random.default_rng(0)
    n = 40
    gyr = rng.normal(0.0, 1e3, (n, 3))  # no evidence is asked of levelhead's own files
    gyr[3] = np.nan
    truth = Truth(
        np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), bias=rng.normal(size=(n, 3)), moving=np.arange(n) > 5, north=False
    )
    t = 1e9 + np.cumsum(rng.uniform(0.1, 1.0, n))
    recording = Recording(t, gyr, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), truth, {"notes": ["µ"], "t0": 3.5})
    path = tmp_path / "log.npz"
    npz.write_npz(recording, path)
    back = read(path)
    for name in ("t", "gyr", "acc", "mag"):
        assert getattr(back, name).tobytes() == getattr(recording, name).tobytes()
    assert back.truth is not None and back.truth.bias is not None and not back.truth.north
    assert back.truth.quat.tobytes() == truth.quat.tobytes()
    np.testing.assert_array_equal(back.truth.bias, truth.bias)
    np.testing.assert_array_equal(back.truth.moving, truth.moving)
    assert back.meta["notes"] == ["µ"] and back.meta["t0"] == 3.5 and back.meta["source"] == str(path)
    assert "hints do not apply" in refused(path, rate=100.0)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert "truncated or damaged" in refused(path)


def test_writing_where_nothing_can_be_written(tmp_path: Path, hand: Recording) -> None:
    with pytest.raises(LevelheadError, match="there is no folder"):
        npz.write_npz(hand, tmp_path / "no" / "log.npz")
    with pytest.raises(LevelheadError, match="it is a folder"):
        npz.write_npz(hand, tmp_path)


def test_parquet(tmp_path: Path, hand: Recording) -> None:
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    columns = {
        "timestamp": pa.array((hand.t * 1e6).round().astype(np.int64) + 1_700_000_000_000_000, pa.timestamp("us"))
    }
    for name, values in (("gyr", np.degrees(hand.gyr)), ("acc", hand.acc)):
        columns |= {f"{name}_{axis}": values[:, i] for i, axis in enumerate("xyz")}
    columns["label"] = pa.array(["a"] * len(hand))
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns), path)
    recording = read(path)
    np.testing.assert_allclose(recording.gyr, hand.gyr, rtol=1e-14)
    np.testing.assert_allclose(recording.t, hand.t, atol=1e-9)
    assert recording.meta["units"]["gyr"] == "deg/s" and recording.meta["t0"] == 1.7e9
    path.write_bytes(path.read_bytes()[:500])
    assert "not a Parquet file or it is damaged" in refused(path)


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("kind", [0, 8, 14, 19, 77])
def test_a_damaged_type_in_a_matlab_file_is_a_sentence(tmp_path: Path, kind: int, compressed: bool) -> None:
    """SciPy takes it for an index, and the process would end without a word (scipy 1.17)."""
    path = tmp_path / "log.mat"
    scipy_io.savemat(path, {"gyr": np.ones((400, 3)), "acc": np.ones((400, 3))})
    raw = bytearray(path.read_bytes())
    tag = struct.pack("<II", 9, 9600)  # doubles
    assert raw.count(tag) == 2
    raw[(at := raw.index(tag)) : at + 4] = struct.pack("<I", kind)
    if compressed:
        body = zlib.compress(raw[128:])
        raw[128:] = struct.pack("<II", 15, len(body)) + body
    path.write_bytes(raw)
    assert f"log.mat is not a MATLAB file, or it is truncated or damaged (data of type {kind})" in refused(path)


def test_every_class_of_matlab_passes_the_check_of_its_tags(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    cells = np.array([np.arange(3), "words", {"deep": np.ones((2, 2))}], dtype=object)
    flags = {
        "a": cells,
        "b": {"x": [1.5, 2], "y": "ü"},
        "c": sparse.csc_matrix(np.eye(3)),
        "d": np.array([True, False]),
    }
    for compressed in (False, True):
        scipy_io.savemat(path, {**flags, "e": np.ones(3) * 1j, "f": np.int8([1, 2])}, do_compression=compressed)
        check_tags(path.read_bytes())


def check_hand(path: Path, hand: Recording, **hints: object) -> None:
    recording = read(path, **hints)
    np.testing.assert_allclose(recording.gyr, hand.gyr, atol=1e-6)
    np.testing.assert_allclose(recording.acc, hand.acc, atol=1e-5)
    np.testing.assert_allclose(recording.t - recording.t[0], hand.t - hand.t[0], atol=1e-3)


def columns(hand: Recording) -> np.ndarray:
    return np.column_stack([hand.t, hand.acc, hand.gyr])


NAMES = ("time", "ax", "ay", "az", "gx", "gy", "gz")


def test_tables_in_hdf5(tmp_path: Path, hand: Recording) -> None:
    """Compound types, as PyTables writes them, with scalar and with vector fields; a matrix of pandas."""
    scalars = np.rec.fromarrays(columns(hand).T, names=",".join(NAMES))
    kind = [("time", "f8"), ("accel", "f8", 3), ("gyro", "f8", 3)]
    vectors = np.array(list(zip(hand.t, hand.acc, hand.gyr, strict=True)), dtype=kind)
    for name, content in (("scalars", scalars), ("vectors", vectors)):
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            file["log/imu"] = content
        check_hand(tmp_path / f"{name}.h5", hand)
    with h5py.File(tmp_path / "pandas.h5", "w") as file:
        file["df/block0_items"], file["df/block0_values"] = [name.encode() for name in NAMES], columns(hand)
        file["df/axis1"] = np.arange(len(hand))
    check_hand(tmp_path / "pandas.h5", hand)


def test_the_rate_of_a_group_in_hdf5(tmp_path: Path, hand: Recording) -> None:
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.attrs["Sample Rate"] = 100.0
        file["gyr"], file["acc"] = hand.gyr, hand.acc
    check_hand(tmp_path / "log.h5", hand)
    with h5py.File(tmp_path / "log.h5", "a") as file:
        file.create_group("emg").attrs["rate"] = 2000.0
    assert "--rate" in refused(tmp_path / "log.h5")  # two rates, and nothing shows whose they are


def test_an_array_of_structures_in_matlab(tmp_path: Path, hand: Recording) -> None:
    rows = [(np.array([[t]]), acc, gyr) for t, acc, gyr in zip(hand.t, hand.acc, hand.gyr, strict=True)]
    kind = [("t", object), ("acc", object), ("gyr", object)]
    scipy_io.savemat(tmp_path / "log.mat", {"imu": np.array(rows, dtype=kind)})
    check_hand(tmp_path / "log.mat", hand)


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".mat"])
def test_a_matrix_without_names(tmp_path: Path, hand: Recording, suffix: str) -> None:
    """Its columns are found by their numbers, as in a text without header, and have the same hints."""
    path = tmp_path / f"log{suffix}"
    save = {".npy": np.save, ".npz": lambda to, what: np.savez(to, data=what)}
    save.get(suffix, lambda to, what: scipy_io.savemat(to, {"data": what}))(path, columns(hand))
    check_hand(path, hand)
    check_hand(path, hand, map={"t": ["1"], "acc": ["2", "3", "4"], "gyr": ["5", "6", "7"]})
    name = "column" if suffix == ".npy" else "data"
    check_hand(path, hand, map={key: [f"{name}[{i}]" for i in at] for key, at in
                                {"t": (0,), "acc": (1, 2, 3), "gyr": (4, 5, 6)}.items()})  # fmt: skip


@pytest.mark.parametrize("suffix", [".parquet", ".feather", ".arrow"])
def test_vectors_in_columns_of_arrow(tmp_path: Path, hand: Recording, suffix: str) -> None:
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather, parquet

    stamps = pa.array((1.7e15 + 1e6 * hand.t).astype(np.int64)).cast(pa.timestamp("us"))
    fixed = pa.FixedSizeListArray.from_arrays(pa.array(hand.gyr.ravel()), 3)
    table = pa.table({"stamp": stamps, "acc": pa.array(hand.acc.tolist()), "gyr": fixed})
    write = parquet.write_table if suffix == ".parquet" else feather.write_feather
    write(table, str(tmp_path / f"log{suffix}"))
    check_hand(tmp_path / f"log{suffix}", hand)
    (tmp_path / f"bad{suffix}").write_bytes(b"ARROW1\0\0 nothing")
    assert "damaged" in refused(tmp_path / f"bad{suffix}")
