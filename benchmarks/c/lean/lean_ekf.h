/* What `levelhead export EKF --lean --float` computes, by hand: the same outputs, bit for bit. */
#ifndef LEAN_EKF_H
#define LEAN_EKF_H

#include "lean_readings.h"

/* P: attitude, attitude with bias, bias. */
typedef struct {
    float axx, axy, axz, ayy, ayz, azz, cxx, cxy, cxz, cyx, cyy, cyz, czx, czy, czz, bxx, bxy, bxz, byy, byz, bzz;
} lean_covariance;

typedef struct {
    float w, x, y, z, bias[3], force[3], age, time, rate2, acc_time, deviation2, east, north, acc_out, mag_out;
    lean_covariance p;
    lean_readings readings;
} lean_ekf;

typedef struct {
    float w, x, y, z;
} lean_ekf_quat;

typedef struct {
    float x, y, z;
} lean_ekf_vec3;

void lean_ekf_init(lean_ekf *f);
bool lean_ekf_update(lean_ekf *f, const float gyr[3], const float acc[3], const float mag[3], float dt);
lean_ekf_quat lean_ekf_quaternion(const lean_ekf *f);
lean_ekf_vec3 lean_ekf_bias(const lean_ekf *f);

#endif
