"""The verdict of benchmarks/reader/wild.py on the smaller real logs."""

import json
from pathlib import Path

import pytest
from tests.reference import wild

from levelhead import LevelheadError, read

RIGHT = {
    "xsens_mtw_counter.txt", "xsens_mtx_latlon.txt", "xsens_mtmanager_comma.txt", "shimmer3.csv", "yei_3space.txt",
    "metawear", "androsensor_semicolon.csv", "mpu_pms67.csv", "robot_units_in_names.csv", "microstrain_gx3.csv",
    "gnss_ins_sim_bosch",
}  # fmt: skip
GUESS = {
    "razor9dof.csv", "sensorlogger_uncal", "sensorlogger_original.zip", "phyphox_degs", "unity_phone_covs.csv",
    "mpu6050_vidplot.csv", "bike_epochms.csv", "labyrinth_noheader.csv", "witmotion_txt.txt", "charge_challenge.csv",
    "magicleap2.csv", "ese650_imuRaw1.mat",
}  # fmt: skip
REFUSED = {
    "xsens_dot_realtime.csv": "no gyroscope",
    "iso_time_pair": "gravity removed", "bno055_text_nogyro.txt": "no gyroscope",
    "boat_bno085_nogyro.csv": "no gyroscope", "gsa_cansat_decimalcomma.csv": "too few samples",
}  # fmt: skip
COMMAND = {"mpu_noheadertime_gdps.csv", "zupt_noheader_mps2.csv", "uci_har"}


@pytest.fixture(scope="module")
def key(data_dir: Path) -> dict[str, dict]:
    if not (data_dir / "wild").is_dir():
        pytest.skip("no folder wild/ among the real recordings")
    return {entry["file"]: entry for entry in json.loads((data_dir / "wild" / "INDEX.json").read_text())}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(RIGHT | GUESS | COMMAND))
def test_numbers_are_those_of_a_decoder_of_its_own(data_dir: Path, key: dict[str, dict], name: str) -> None:
    verdict, why = wild.judge(data_dir / "wild" / name, key[name])
    expected = {"right"} if name in RIGHT else {"right", "guess"} if name in GUESS else {"command"}
    assert verdict in expected, why
    assert (
        name == "ese650_imuRaw1.mat" or verdict != "guess" or not ("rows are the decoder's" in why or "off by" in why)
    ), why


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(REFUSED))
def test_what_cannot_be_fused_is_refused_for_its_reason(data_dir: Path, key: dict[str, dict], name: str) -> None:
    with pytest.raises(LevelheadError, match=REFUSED[name]):
        read(data_dir / "wild" / name)
