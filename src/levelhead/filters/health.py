"""Health bits: the faults of a sample and the filter's response to them."""

GYR_MISSING = 1  # the last rate was held
ACC_MISSING = 2  # nothing corrected tilt
MAG_MISSING = 4  # a magnetometer exists, but gave nothing now
GAP = 8  # too long since the last sample: the rate was not integrated across
NEAR_VERTICAL = 16  # pitch near ±90°: roll and yaw are not defined there, tilt is carried by the gyroscope
GYR_SATURATED = 32  # at full scale: it turned at least so fast
ACC_SATURATED = 64  # at full scale: the rest is extrapolated
GYR_STUCK = 128  # an axis repeats one value
ACC_STUCK = 256  # an axis repeats one value: not used
ACC_REJECTED = 512  # too far from g and from the prediction: not used
MAG_REJECTED = 1024  # norm or dip are not those of the field learned: not used
MAG_LEARNED = 4096  # a new field was taken for the earth's: from here on heading follows it
AID_REJECTED = 8192  # position, velocity or height far from the prediction: not used
TURN_MISSED = 16384  # the velocity that a wrong tilt makes shows it: σ grows, and gravity corrects tilt
GYR_SPIKE = 32768  # the rate before was far from those around it: not used
IRON_FOUND = 65536  # the offset of a raw magnetometer is beyond doubt: from here on it is taken off
AT_REST = 2048  # nothing wrong: the sensor is still, and its bias is being learned

NAMES = {
    GYR_MISSING: "gyroscope missing, last rate held",
    ACC_MISSING: "accelerometer missing, tilt not corrected",
    MAG_MISSING: "magnetometer missing, heading not corrected",
    GAP: "gap in time, rate not integrated across",
    NEAR_VERTICAL: "pitch near ±90°, roll and yaw ambiguous",
    GYR_SATURATED: "gyroscope at full scale, turned faster than it can measure",
    ACC_SATURATED: "accelerometer at full scale, pushed harder than it can measure",
    GYR_STUCK: "a gyroscope axis stuck at one value",
    ACC_STUCK: "an accelerometer axis stuck at one value, not used",
    ACC_REJECTED: "accelerating, accelerometer not used",
    MAG_REJECTED: "magnetic disturbance, magnetometer not used",
    MAG_LEARNED: "a new magnetic field accepted as the earth's",
    AID_REJECTED: "position, velocity or height far from the prediction, not used",
    TURN_MISSED: "a turn was not measured, tilt is being corrected",
    GYR_SPIKE: "a spike of the gyroscope, not used",
    IRON_FOUND: "offset of a raw magnetometer found, taken off from here on",
    AT_REST: "at rest, gyroscope bias learned",
}
FAULTS = sum(NAMES) - AT_REST
