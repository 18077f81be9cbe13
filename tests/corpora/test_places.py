"""Which recordings a place holds."""

import io
import os
import zipfile

import numpy as np
import pytest
from tests.reference.folder_server import serve_folder

from levelhead.corpora.places import is_gone, list_sources, local_copy
from levelhead.errors import LevelheadError

pytest.importorskip("fsspec")


def touch(folder, *names):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name)


def names(*places):
    return [source.name for source in list_sources(places)]


def test_a_folder_with_all_below_it_and_patterns(tmp_path):
    touch(tmp_path, "a/1.csv", "a/2.parquet", "b/1.csv", "b/notes.pdf", ".hidden.csv", "b/trials.json")
    assert names(tmp_path) == ["a/1.csv", "a/2.parquet", "b/1.csv"]
    assert names(tmp_path / "*" / "1.csv") == ["a/1.csv", "b/1.csv"]
    assert names(f"{tmp_path}/**/*.parquet") == ["a/2.parquet"]
    assert names(tmp_path / "a" / "1.csv") == ["1.csv"]
    assert names(f"file://{tmp_path}/a") == ["1.csv", "2.parquet"]
    assert names(tmp_path / "a", tmp_path / "a") == ["1.csv", "2.parquet"]  # the same files twice


def test_files_about_recordings_are_passed_over_and_named(tmp_path, caplog):
    touch(tmp_path, "a/INDEX.json", "a/PROBLEMS.json", "a/1.json", "README.txt", "index.csv")
    assert names(tmp_path) == ["a/1.json", "index.csv"]
    (said,) = caplog.messages
    assert said.startswith("passed over") and all(
        name in said for name in ("INDEX.json", "PROBLEMS.json", "README.txt")
    )
    assert "1.json" not in said and "index.csv" not in said


def test_results_are_no_recordings(tmp_path):
    touch(tmp_path, "a.csv", "results/corpus.json", "results/rows/part-000000.parquet", "results/tracks/a.csv.parquet")
    assert names(tmp_path) == ["a.csv"]


def test_folders_that_are_one_recording(tmp_path):
    touch(tmp_path, "V1/mav0/imu0/data.csv", "V1/mav0/cam0/data.csv", "bag/metadata.yaml", "bag/bag_0.db3", "c.csv")
    assert names(tmp_path) == ["V1", "bag", "c.csv"]


def test_two_recordings_with_one_name_are_refused(tmp_path):
    touch(tmp_path, "a/1.csv", "b/1.csv")
    with pytest.raises(LevelheadError, match=r"two recordings are called 1\.csv: .*a/1\.csv and .*b/1\.csv"):
        list_sources([tmp_path / "a", tmp_path / "b"])


@pytest.mark.parametrize("place", ["nowhere", "*.csv", "ftpx://host/x"])
def test_no_recordings(tmp_path, place, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LevelheadError, match="no recordings match|nothing at|cannot be read"):
        list_sources([place])


def test_a_stamp_changes_with_the_file(tmp_path):
    touch(tmp_path, "a.csv")
    before = list_sources([tmp_path])[0]
    assert list_sources([tmp_path])[0] == before
    os.utime(tmp_path / "a.csv", (1, 1))
    assert list_sources([tmp_path])[0].stamp != before.stamp


def test_a_copy_from_a_store_keeps_the_names_of_file_and_folder():
    import fsspec

    system = fsspec.filesystem("memory")
    system.pipe("/bucket/broad/one.csv", b"1,2,3")
    (source,) = list_sources(["memory://bucket"])
    assert source.name == "broad/one.csv" and source.size == 5
    with local_copy(source, {}) as path:
        assert path.parts[-2:] == ("broad", "one.csv") and path.read_bytes() == b"1,2,3"
    assert not path.exists()


@pytest.fixture
def web(tmp_path):
    """A folder as a web server lists it, on this machine."""
    site = tmp_path / "site"
    touch(site, "a.csv", "below/b.csv", "below/notes.pdf")
    with serve_folder(site) as url:
        yield url.rstrip("/")


def test_a_folder_of_a_web_server(web):
    pytest.importorskip("aiohttp")
    found = list_sources([f"{web}/"])
    assert [one.name for one in found] == ["a.csv", "below/b.csv"]
    assert [one.url for one in found] == [f"{web}/a.csv", f"{web}/below/b.csv"]
    assert names(f"{web}/below/b.csv") == ["b.csv"]
    with local_copy(found[1], {}) as path:
        assert path.read_text() == "below/b.csv"
    assert not is_gone(found[0].url, {}) and is_gone(f"{web}/c.csv", {})


def test_recordings_in_a_zip_stand_for_themselves_and_parts_of_one_do_not(tmp_path):
    t = np.arange(60) / 50.0
    gyr, acc = (np.random.default_rng(0).normal(0.0, 0.1, (60, 3)) + one for one in (0.0, [0.0, 0.0, 9.81]))
    log = io.StringIO()
    np.savetxt(log, np.column_stack([t, gyr, acc]), delimiter=",", comments="",
               header="t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s^2],ay [m/s^2],az [m/s^2]")  # fmt: skip
    with zipfile.ZipFile(tmp_path / "many.zip", "w") as many:
        for name in ("x/one.csv", "two.csv"):
            many.writestr(name, log.getvalue())
        many.writestr("labels.csv", "t,label\n0,walk\n1,rest\n")
    with zipfile.ZipFile(tmp_path / "single.zip", "w") as single:
        single.writestr("log.csv", log.getvalue())
        single.writestr("labels.csv", "t,label\n0,walk\n1,rest\n")
    found = {one.name: one for one in list_sources([tmp_path])}
    assert list(found) == ["many.zip/two.csv", "many.zip/x/one.csv", "single.zip"]
    inside = found["many.zip/x/one.csv"]
    with local_copy(inside, {}) as path:
        assert path.name == "one.csv" and path.read_text() == log.getvalue()
    assert inside.size == len(log.getvalue()) and not is_gone(inside.url, {})
    (tmp_path / "many.zip").unlink()
    assert is_gone(inside.url, {})


def test_a_folder_that_cannot_be_read_is_named(tmp_path, caplog, monkeypatch):
    touch(tmp_path, "open/a.csv", "shut/b.csv")
    honest = os.scandir

    def refuse(path):
        if str(path).endswith("shut"):
            raise PermissionError(13, "Permission denied", str(path))
        return honest(path)

    monkeypatch.setattr(os, "scandir", refuse)
    assert names(tmp_path) == ["open/a.csv"]
    assert caplog.messages == [f"passed over, because they cannot be read: {tmp_path / 'shut'}"]
