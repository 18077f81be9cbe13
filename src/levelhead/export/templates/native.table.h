/* All filters of the native engine. */
#ifndef LEVELHEAD_NATIVE_TABLE_H
#define LEVELHEAD_NATIVE_TABLE_H

#define LH_IMU_FILTERS(X) $imu
#define LH_AXIS_FILTERS(X) $axis
#define LH_SMOOTHERS(X) $smoother
#define LH_WIDE_FILTERS(X) $wide
#define LH_LONGEST $longest /* s, between two samples */

#endif
