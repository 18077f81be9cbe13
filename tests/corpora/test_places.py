"""Which recordings a place holds."""

import os

import pytest

from levelhead.corpora.places import list_sources, local_copy
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
