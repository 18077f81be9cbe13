"""``levelhead explain``: what is printed, its exit code, and what is refused."""

import pytest

from levelhead import simulate
from levelhead.sources.formats.csv_writer import write_csv


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """clean.csv, spiked.csv (a gyroscope with spikes of 500 deg/s) and short.csv (5 s)."""
    made = tmp_path_factory.mktemp("explain")
    clean = simulate.recording("BMI160", "hand", 40, seed=2)
    write_csv(clean, made / "clean.csv")
    write_csv(clean[:500], made / "short.csv")
    spiked = simulate.apply_fault(clean, simulate.parse_fault("gyr_spikes=500@20+5"))
    write_csv(spiked.recording, made / "spiked.csv")
    return made


@pytest.mark.slow
def test_a_clean_log_and_one_with_a_symptom(levelhead, folder):
    said = levelhead("explain", folder / "clean.csv")
    assert said.code == 0 and "no symptom" in said.out and "ESKF" in said.out
    said = levelhead("explain", folder / "spiked.csv")
    assert said.code == 1
    assert "one reading of the gyroscope alone is 500 °/s off. Look for a bus" in said.out
    found = levelhead("explain", folder / "spiked.csv", "--json").json
    one = found["symptoms"][0]
    assert (one["symptom"], one["cause"], one["unit"], found["filter"]) == ("jump", "gyr_spikes", "deg", "ESKF")
    assert one["size"] == pytest.approx(5.0, abs=0.3) and 20.0 <= one["at_s"] <= 25.0


@pytest.mark.slow
def test_the_picture_of_the_evidence(levelhead, folder, tmp_path):
    pytest.importorskip("matplotlib", reason="matplotlib is not installed (extra levelhead[plot])")
    said = levelhead("explain", folder / "spiked.csv", "--plot", tmp_path / "evidence.svg")
    assert said.code == 1 and "written: " in said.out
    drawn = (tmp_path / "evidence.svg").read_text(encoding="utf-8")
    for words in ("spiked.csv, ESKF: jump", "1 gyr_spikes", "health bits that were set", "at rest"):
        assert f"<!-- {words} -->" in drawn
    said = levelhead("explain", folder / "spiked.csv", "--plot", tmp_path / "evidence.gif")
    assert said.code == 2 and "evidence.gif" in said.err and not (tmp_path / "evidence.gif").exists()


@pytest.mark.slow
def test_another_filter_is_explained(levelhead, folder):
    said = levelhead("explain", folder / "clean.csv", "-f", "Complementary", "--json")
    assert said.json["filter"].startswith("Complementary")
    assert {one["cause"] for one in said.json["symptoms"]} <= {"acceleration", "no_magnetometer"}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("none.csv",), "there is no file"),
        (("short.csv",), "4.99 s long; expected 10 s or more"),
        (("clean.csv", "--guard", "off"), "health bits"),
        (("clean.csv", "-f", "Kalmann"), "Kalman"),
        (("clean.csv", "--set", "kp"), "sets nothing"),
        (("clean.csv", "-o", "x.png"), "explain has no option -o; expected --plot FILE for the picture"),
        (("clean.csv", "-ox.png"), "explain has no option -o; expected --plot FILE for the picture"),
        (("clean.csv", "--out=x.json"), "explain has no option --out; expected --plot FILE for the picture"),
        (("clean.csv", "--outt", "x"), "Unknown option: --outt"),
    ],
)
def test_bad_input(refused, folder, words, sentence):
    assert sentence in refused("explain", folder / words[0], *words[1:])


@pytest.mark.parametrize("verb", ["explain", "stress", "noise", "calibrate"])
def test_a_log_that_needs_hints_is_refused_with_a_command_of_the_same_verb(refused, tmp_path, verb):
    rows = "\n".join(f"{i},1,2,16384,3,4,{i % 7}" for i in range(200))
    (tmp_path / "counts.csv").write_text(f"t,ax,ay,az,gx,gy,gz\n{rows}\n", "utf-8")
    words = refused(verb, tmp_path / "counts.csv")
    assert f"try: levelhead {verb} " in words
    assert "levelhead fuse" not in words
