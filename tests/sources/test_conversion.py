"""Files that levelhead does not read: one sentence with the converter, or with the reason why none helps."""

from pathlib import Path

import numpy as np
import pytest

from levelhead import LevelheadError, Recording, read


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("ride.fit", b"\x0e\x20\x2a\x08\xf0\x27\x06\x00.FIT\x82\x2f", "FitCSVTool"),
        ("ride.copy", b"\x0e\x20\x2a\x08\xf0\x27\x06\x00.FIT\x82\x2f", "FIT activity"),
        ("VID_0001.insv", b"\0\0\0\x20ftypmp41" + bytes(20), "Gyroflow"),
        ("aria.vrs", b"VisionReVRS " + bytes(20), "projectaria_tools"),
        ("LOG00001.BBL", b"H Product:Blackbox flight data recorder by Nicholas Sherlock\n", "blackbox_decode"),
        ("export.xml", b"<?xml version='1.0'?><!DOCTYPE HealthData [", "Apple Health export: it has no gyroscope"),
        ("track.gpx", b"<?xml version='1.0'?><gpx>", "GPS track"),
    ],
)
def test_the_sentence_names_the_converter(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LevelheadError, match=words) as caught:
        read(tmp_path / name)
    assert str(tmp_path / name) in str(caught.value)


@pytest.mark.slow
def test_a_timetable_names_the_line_that_exports_it(data_dir: Path) -> None:
    path = data_dir / "wild2" / "matlab_mobile_timetable.mat"
    if not path.exists():
        pytest.skip("no folder wild2/ among the real recordings")
    with pytest.raises(LevelheadError, match=r"writetable\(timetable2table\(synchronize\("):
        read(path)


def test_units_in_words_of_a_sentence(tmp_path: Path, hand: Recording) -> None:
    header = "t (in seconds),x (in G's),y (in G's),z (in G's)".replace("x", "acc x").replace("y", "acc y")
    header = header.replace(",z", ",acc z") + "".join(f",gyro {axis} (in radians/s)" for axis in "xyz")
    rows = np.column_stack([hand.t, hand.acc / 9.80665, hand.gyr])
    np.savetxt(tmp_path / "log.csv", rows, "%.17g", ",", header=header, comments="")
    back = read(tmp_path / "log.csv")
    np.testing.assert_allclose(back.acc, hand.acc, rtol=1e-12)
    np.testing.assert_allclose(back.gyr, hand.gyr, rtol=1e-12)
