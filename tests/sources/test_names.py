import pytest

from levelhead.errors import LevelheadError
from levelhead.sources.conclusions.sentences import notes
from levelhead.sources.interpret.roles import assign
from levelhead.sources.names.column_name import understand, unit_in

SENSORS = [
    ("gx", "gyr", "x", None),
    ("GyrX", "gyr", "x", None),
    ("gyro_x_dps", "gyr", "x", "dps"),
    ("wz", "gyr", "z", None),
    ("omega_y", "gyr", "y", None),
    ("Gyroscope X (deg/s)", "gyr", "x", "deg/s"),
    ("Gyr_X", "gyr", "x", None),
    ("angular_velocity.x", "gyr", "x", None),
    ("field.angular_velocity.z", "gyr", "z", None),
    ("gyro_rad[0]", "gyr", "0", "rad/s"),
    ("gyroADC[2]", "gyr", "2", None),
    ("imu_gyr_1", "gyr", "1", None),
    ("rotationRateX(rad/s)", "gyr", "x", "rad/s"),
    ("w_RS_S_x [rad s^-1]", "gyr", "x", "rad s^-1"),
    ("IMU Gyroscope X", "gyr", "x", None),
    ("Shimmer_Gyro_Y_CAL", "gyr", "y", None),
    ("xgyro", "gyr", "x", None),
    ("gyro_x_rad_per_s", "gyr", "x", "rad/s"),
    ("gyr2_x", "gyr", "x", None),
    ("ax", "acc", "x", None),
    ("ax_g", "acc", "x", "g"),
    ("AccX_mG", "acc", "x", "mg"),
    ("accel_z_ms2", "acc", "z", "m/s²"),
    ("gx_deg/s", "gyr", "x", "deg/s"),
    ("accelerometer_m_s2[1]", "acc", "1", "m/s²"),
    ("Accelerometer Y (g)", "acc", "y", "g"),
    ("linear_acceleration.x", "acc", "x", None),
    ("a_RS_S_z [m s^-2]", "acc", "z", "m s^-2"),
    ("IMU Acceleration Z", "acc", "z", None),
    ("gFx", "acc", "x", None),
    ("mx", "mag", "x", None),
    ("Magnetometer X (uT)", "mag", "x", "uT"),
    ("mag_y_nT", "mag", "y", "nt"),
    ("mag_y [relative]", "mag", "y", "relative"),
]


@pytest.mark.parametrize(("raw", "role", "axis", "unit"), SENSORS)
def test_sensor_names(raw: str, role: str, axis: str, unit: str | None) -> None:
    name = understand(raw)
    assert (name.role, name.axis) == (role, axis)
    assert unit_in(raw, role, "log.csv") == unit


TIMES = [
    ("t", None), ("time", None), ("Time (s)", "s"), ("timestamp", None), ("seconds", "seconds"), ("time_ms", "ms"),
    ("stamp_ns", "ns"), ("TimeUS", "us"), ("timems", "ms"), ("t [s]", "s"),
    ("timestamp [ns]", "ns"), ("millis", "millis"),
    ("seconds_elapsed", "seconds"), ("header.stamp", None),
]  # fmt: skip


@pytest.mark.parametrize(("raw", "unit"), TIMES)
def test_time_names(raw: str, unit: str | None) -> None:
    assert understand(raw).role == "t"
    assert unit_in(raw, "t", "log.csv") == unit


@pytest.mark.parametrize(
    "raw",
    ["temp", "temperature", "gyr_norm", "linear_acceleration_covariance_0", "userAcceleration.x", "gravity_x",
     "opt_pos.x", "gyro_bias_x", "dt", "FreeAcc_X",
     "angular_acceleration.x", "label", "gyr_temp", "pressure", "",
     "()", "x", "truth_acc_x"],
)  # fmt: skip
def test_names_that_are_no_sensor(raw: str) -> None:
    assert understand(raw).role == ""


@pytest.mark.parametrize(
    ("raw", "reference"),
    [("qw", True), ("opt_quat.x", True), ("Vicon Orientation W", True), ("truth_qz", True), ("truth_relative_qx", True),
     ("Quat_w", False), ("orientation.w", False), ("imu_quat_x", False)],
)  # fmt: skip
def test_quaternions_say_whether_they_are_a_reference(raw: str, reference: bool) -> None:
    name = understand(raw)
    assert (name.role, name.reference) == ("q", reference)


IMU = ["t", "gx", "gy", "gz", "ax", "ay", "az"]


def test_of_two_sensors_the_first_is_taken_and_both_are_named() -> None:
    names = [*IMU, "gyr2_x", "gyr2_y", "gyr2_z"]
    roles = assign(names, {}, "log.csv")
    assert roles.columns["gyr"] == (1, 2, 3)
    assert any("gx, gy, gz taken, not gyr2_x" in note for note in notes(roles.conclusions))
    assert assign(names, {"gyr": ["gyr2_x", "gyr2_y", "gyr2_z"]}, "log.csv").columns["gyr"] == (7, 8, 9)
    assert assign(names, {"gyr": ["gyr2"]}, "log.csv").columns["gyr"] == (7, 8, 9)
    assert assign(names, {"gyr": ["gyr2"]}, "log.csv").ignored == ("gx", "gy", "gz")


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (["t", "ax", "ay", "az"], "no gyroscope among the columns t, ax, ay, az"),
        (["t", "gx", "gy", "gz"], "no accelerometer among"),
        (["t", "gx", "gy", "ax", "ay", "az"], "the gyroscope has gx, gy but no column for z"),
        ([*IMU, "gx"], "two columns are named gx"),
        (["t", "gx_dps", "gy_dps", "gz", "ax", "ay", "az"], "differ in unit"),
        (["t", "gx (dgs/s)", "gy (dgs/s)", "gz (dgs/s)", "ax", "ay", "az"], "'dgs/s' is not a unit.*'degs?/s'"),
    ],
)
def test_what_is_wrong_with_columns(names: list[str], sentence: str) -> None:
    with pytest.raises(LevelheadError, match=sentence):
        assign(names, {}, "log.csv")


def test_hints_name_the_nearest_column() -> None:
    with pytest.raises(LevelheadError, match=r"no column 'gk' \(map gyr\); did you mean 'g"):
        assign(IMU, {"gyr": ["gk", "gy", "gz"]}, "log.csv")
    with pytest.raises(LevelheadError, match="both gyroscope and accelerometer"):
        assign(IMU, {"gyr": ["ax", "ay", "az"]}, "log.csv")


def test_a_temperature_called_T_is_no_time() -> None:
    assert assign([*IMU, "T"], {}, "log.csv").columns["t"] == (0,)


def test_a_bare_time_comes_before_a_qualified_one() -> None:
    assert assign([*IMU, "gps_time"], {}, "log.csv").columns["t"] == (0, 7)  # candidates, the plainest first
    assert assign(["gps_time", *IMU], {}, "log.csv").columns["t"] == (1, 0)


@pytest.mark.parametrize(
    ("names", "acc"),
    [
        (["linear_acc_x", "linear_acc_y", "linear_acc_z", "acc_x", "acc_y", "acc_z"], 3),
        (["ACC RAW X", "ACC CAL X", "ACC RAW Y", "ACC CAL Y", "ACC RAW Z", "ACC CAL Z"], 1),
        (["acc_uncalibrated_x", "acc_uncalibrated_y", "acc_uncalibrated_z", "acc_x", "acc_y", "acc_z"], 3),
        (["acc_highg_x", "acc_highg_y", "acc_highg_z", "acc_x", "acc_y", "acc_z"], 3),
    ],
)
def test_decoys_come_second(names: list[str], acc: int) -> None:
    roles = assign([*names, "gx", "gy", "gz"], {}, "log.csv")
    assert roles.columns["acc"][0] == acc


def test_of_several_units_the_gyroscope_and_the_accelerometer_are_of_one() -> None:
    axes = "xyz"
    names = [f"{sensor}_{side}_{a}" for side in ("left", "right") for sensor in ("acc", "gyr") for a in axes]
    first, second = assign(names, {}, "log.csv"), assign(names, {}, "log.csv", sensor="right")
    assert (first.columns["acc"][0], first.columns["gyr"][0]) == (0, 3)
    assert (second.columns["acc"][0], second.columns["gyr"][0]) == (6, 9)
    assert any(one.facts["other_sensor"] == "right" for one in first.conclusions)
    with pytest.raises(LevelheadError, match="no sensor 'middle'"):
        assign(names, {}, "log.csv", sensor="middle")


@pytest.mark.parametrize("unit", ["furlong", "parsec/s", "stone"])
def test_a_unit_that_is_not_known_is_refused_by_name(unit: str) -> None:
    names = [f"acc_{a} [{unit}]" for a in "xyz"]
    with pytest.raises(LevelheadError, match=f"'{unit}' is not a unit of the accelerometer"):
        assign([*names, "gx", "gy", "gz"], {}, "log.csv")
