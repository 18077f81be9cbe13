"""``levelhead corpus``: tables, the page, JSON, and one sentence for what cannot go on."""

import pytest
from tests.reference.corpus import GOOD, write_corpus

pytestmark = pytest.mark.slow
pytest.importorskip("fsspec")


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    return write_corpus(tmp_path_factory.mktemp("recordings"), seconds=3.0)


def test_tables_and_page(levelhead, recordings, tmp_path):
    out = tmp_path / "out"
    said = levelhead("corpus", "fuse", recordings, "-o", out, "--workers", "0", "--same-sensor", "(unit1)")
    assert said.code == 1  # one recording cannot be read
    for words in (f"fuse: {GOOD + 1} recordings, 1 without a result", "Means by group", "The worst 6",
                  "Gyroscope bias of each sensor", "Without a result", "walk/broken.csv"):  # fmt: skip
        assert words in said.out, words
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<img") == GOOD + 1 and "walk/broken.csv" in page  # the worst, and the sensor over time
    (out / "report.html").unlink()
    again = levelhead("corpus", "report", out, "--no-plot", "--json")
    assert again.code == 0 and again.json["tables"]["Without a result"][0]["recording"] == "walk/broken.csv"
    assert (out / "report.html").read_text(encoding="utf-8").count("<img") == 0


@pytest.mark.parametrize(
    ("verb", "words"), [("doctor", "most frequent findings"), ("bench", "vqf.VQF"), ("smooth", "ESKF")]
)
def test_other_verbs(levelhead, recordings, tmp_path, verb, words):
    more = ("-f", "default", "-f", "vqf.VQF") if verb == "bench" else ()
    if verb == "bench":
        pytest.importorskip("vqf")
    said = levelhead("corpus", verb, recordings / "hand", "-o", tmp_path, "--workers", "0", "--no-plot", *more)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert said.code == 0 and words in said.out + page


def test_refusals(refused, recordings, tmp_path):
    out = ("-o", tmp_path / "out", "--workers", "0")
    assert "no recordings match" in refused("corpus", "fuse", f"{recordings}/*.nothing", *out)
    assert "nothing at" in refused("corpus", "fuse", recordings / "nowhere", *out)
    assert "no place to look into" in refused("corpus", "fuse", *out)
    assert "holds no results" in refused("corpus", "report", tmp_path)
    (tmp_path / "file").write_text("")
    assert "is a file" in refused("corpus", "fuse", recordings, "-o", tmp_path / "file", "--workers", "0")
