"""A corpus in an object store: moto's server speaks S3 over HTTP, so that s3fs and botocore run as they do outside."""

import pytest
from tests.reference.corpus import GOOD

import levelhead as lh

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]  # of botocore's own code
TIMES = ["read_s", "run_s", "url", "stamp", "error"]


@pytest.fixture
def bucket(recordings, monkeypatch):
    """The recordings in s3://recordings/unit, whose keys and endpoint are in the environment."""
    fsspec = pytest.importorskip("fsspec")
    pytest.importorskip("s3fs")  # here, since each process that collects the tests would wait two seconds for them
    server = pytest.importorskip("moto.server")
    running = server.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    running.start()
    _, port = running.get_host_and_port()
    for name, value in {
        "AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}", "AWS_CONFIG_FILE": "/dev/null",
    }.items():  # fmt: skip
        monkeypatch.setenv(name, value)
    system = fsspec.filesystem("s3", skip_instance_cache=True)
    system.mkdir("recordings")
    system.put(str(recordings), "recordings/unit", recursive=True)
    yield "s3://recordings/unit", system
    fsspec.filesystem("s3").clear_instance_cache()
    running.stop()


@pytest.mark.full
def test_rows_are_those_of_the_folder_and_a_changed_object_is_run_again(bucket, recordings, tmp_path):
    place, system = bucket
    options = {"out": tmp_path / "out", "workers": 2}
    table = lh.corpus(place, **options)
    assert table.drop_columns(TIMES).equals(lh.corpus(recordings, workers=0).drop_columns(TIMES))
    (bad,) = [row for row in table.to_pylist() if row["error"]]
    assert bad["error"].startswith("s3://recordings/unit/walk/broken.csv") and "/tmp" not in bad["error"]
    assert lh.corpus(place, **options).equals(table)  # by ETag: nothing was run again
    system.put(str(recordings / "hand" / "unit1_day0.csv"), "recordings/unit/walk/broken.csv")
    system.invalidate_cache()
    again = lh.corpus(f"{place}/walk/*.csv", "fuse", workers=0)
    assert again.num_rows == GOOD // 2 + 1 and again["error"].null_count == again.num_rows
