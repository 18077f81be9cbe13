"""Health bits: what was wrong with a sample, said instead of hidden."""

GYR_MISSING = 1  # the last rate was held
ACC_MISSING = 2  # nothing corrected tilt
MAG_MISSING = 4  # a magnetometer exists, but gave nothing now
GAP = 8  # too long since the last sample: the rate was not integrated across
NEAR_VERTICAL = 16  # pitch near ±90°: roll and yaw are not defined there, tilt is carried by the gyroscope

NAMES = {
    GYR_MISSING: "gyroscope missing, last rate held",
    ACC_MISSING: "accelerometer missing, tilt not corrected",
    MAG_MISSING: "magnetometer missing, heading not corrected",
    GAP: "gap in time, rate not integrated across",
    NEAR_VERTICAL: "pitch near ±90°, roll and yaw ambiguous",
}
