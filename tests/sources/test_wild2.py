"""The second collection: the verdict of benchmarks/reader/wild2.py on each log, its commands executed."""

import json
from pathlib import Path

import pytest
from tests.reference import wild2

VERDICTS = {
    "xio_fusion.csv": "right", "repoimu_pendulum.csv": "right", "uav_ros_columns.csv": "right",
    "rostopic_echo_degs.csv": "right", "horse_session.csv": "right", "gait_noheader_temp.csv": "right",
    "xsens_mtw_40hz.txt": "right", "wristmotion_swim.csv": "right", "airpods_headphone.zip": "right",
    "semicolon_inG": "right", "everywhereml_gestures.csv": "command", "pandas_numbered.csv": "command",
    "realsense_noheader_quat.txt": "command", "androsensor_import.csv": "command", "ins_sim_index.txt": "command",
    "st_tennis_highg.csv": "command", "nubots_pair": "command", "pdr_linear_acc.csv": "refused",
    "matlab_mobile_timetable.mat": "refused", "one_line_four_imus.txt": "refused", "garmin.fit": "refused",
    "empatica_acc.csv": "refused", "robot_fall_quat.txt": "refused", "nrfconnect_hex.txt": "refused",
    "sensorlogger_nograv": "refused", "sensorlogger_basket": "refused",
}  # fmt: skip


@pytest.fixture(scope="module")
def key(data_dir: Path) -> dict[str, dict]:
    if not (data_dir / "wild2").is_dir():
        pytest.skip("no folder wild2/ among the real recordings")
    return {entry["file"]: entry for entry in json.loads((data_dir / "wild2" / "INDEX.json").read_text())}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(VERDICTS))
def test_verdict(data_dir: Path, key: dict[str, dict], name: str) -> None:
    verdict, why = wild2.judge(data_dir / "wild2" / name, key[name])
    assert verdict == VERDICTS[name], why


@pytest.mark.slow
def test_a_spinning_rocket_in_the_units_of_its_user(data_dir: Path, key: dict[str, dict]) -> None:
    import levelhead as lh

    recording = lh.read(data_dir / "wild2" / "rocket_mag_sep", units=key["rocket_mag_sep"]["know"]["units"])
    assert not wild2.differences(recording, key["rocket_mag_sep"]["know"])
