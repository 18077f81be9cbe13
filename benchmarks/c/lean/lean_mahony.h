/* What `levelhead export Mahony --lean --float` computes, by hand: the same outputs, bit for bit. */
#ifndef LEAN_MAHONY_H
#define LEAN_MAHONY_H

#include "lean_readings.h"

typedef struct {
    float w, x, y, z, bias[3], age;
    lean_readings readings;
} lean_mahony;

typedef struct {
    float w, x, y, z;
} lean_mahony_quat;

typedef struct {
    float x, y, z;
} lean_mahony_vec3;

void lean_mahony_init(lean_mahony *f);
bool lean_mahony_update(lean_mahony *f, const float gyr[3], const float acc[3], const float mag[3], float dt);
lean_mahony_quat lean_mahony_quaternion(const lean_mahony *f);
lean_mahony_vec3 lean_mahony_bias(const lean_mahony *f);

#endif
