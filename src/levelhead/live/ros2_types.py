"""The ROS 2 messages that a node publishes and reads, in the form of Cyclone DDS: types of ``sensor_msgs`` and others.

Names and fields are those of the ROS interface packages; ROS puts ``dds_`` and a final underscore into a type's name.
"""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int32, sequence, uint8, uint32


@final
@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """s and ns since 1970."""

    sec: int32
    nanosec: uint32


@final
@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """When, and in which frame."""

    stamp: Time
    frame_id: str


@final
@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    """A vector."""

    x: float64
    y: float64
    z: float64


@final
@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    """A rotation."""

    x: float64
    y: float64
    z: float64
    w: float64


@final
@dataclass
class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    """Orientation, rates in rad/s and specific force in m/s², each with its covariance."""

    header: Header
    orientation: Quaternion
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: array[float64, 9]


@final
@dataclass
class MagneticField(IdlStruct, typename="sensor_msgs::msg::dds_::MagneticField_"):
    """A field in T."""

    header: Header
    magnetic_field: Vector3
    magnetic_field_covariance: array[float64, 9]


@final
@dataclass
class Accel(IdlStruct, typename="geometry_msgs::msg::dds_::Accel_"):
    """Acceleration in m/s² and rad/s²."""

    linear: Vector3
    angular: Vector3


@final
@dataclass
class AccelWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::AccelWithCovariance_"):
    """An acceleration and its covariance, row by row."""

    accel: Accel
    covariance: array[float64, 36]


@final
@dataclass
class AccelWithCovarianceStamped(IdlStruct, typename="geometry_msgs::msg::dds_::AccelWithCovarianceStamped_"):
    """The same with its time and frame."""

    header: Header
    accel: AccelWithCovariance


@final
@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    """A value with its name."""

    key: str
    value: str


@final
@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    """The state of a part; level: 0 well, 1 warning, 2 error, 3 stale."""

    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@final
@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    """States of parts."""

    header: Header
    status: sequence[DiagnosticStatus]


@final
@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    """Translation and rotation."""

    translation: Vector3
    rotation: Quaternion


@final
@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    """From the child's frame to the header's."""

    header: Header
    child_frame_id: str
    transform: Transform


@final
@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    """Transforms."""

    transforms: sequence[TransformStamped]
