/* The explicit complementary filter with a PI controller: R. Mahony, T. Hamel, J.-M. Pflimlin, Nonlinear Complementary
   Filters on the Special Orthogonal Group, IEEE TAC 53 (2008), eqs. 32 to 34. */
#include "twin.h"

#define KP 1.0f
#define KI 0.02f

void twin_mahony_init(twin_mahony *q)
{
    q->w = 1.0f;
    q->x = q->y = q->z = 0.0f;
    q->integral[0] = q->integral[1] = q->integral[2] = 0.0f;
}

bool twin_mahony_update(twin_mahony *q, const float gyr[3], const float acc[3], const float mag[3], float dt)
{
    const float w = q->w, x = q->x, y = q->y, z = q->z;
    const float a = 1.0f / sqrtf(acc[0] * acc[0] + acc[1] * acc[1] + acc[2] * acc[2]);
    const float up[3] = {2.0f * (x * z - w * y), 2.0f * (w * x + y * z), 1.0f - 2.0f * (x * x + y * y)};
    float error[3] = {a * (acc[1] * up[2] - acc[2] * up[1]), a * (acc[2] * up[0] - acc[0] * up[2]),
                      a * (acc[0] * up[1] - acc[1] * up[0])};
    if (mag) {
        const float m = 1.0f / sqrtf(mag[0] * mag[0] + mag[1] * mag[1] + mag[2] * mag[2]);
        const float mx = mag[0] * m, my = mag[1] * m, mz = mag[2] * m;
        const float r00 = 1.0f - 2.0f * (y * y + z * z), r01 = 2.0f * (x * y - w * z), r02 = 2.0f * (x * z + w * y);
        const float r10 = 2.0f * (x * y + w * z), r11 = 1.0f - 2.0f * (x * x + z * z), r12 = 2.0f * (y * z - w * x);
        const float hx = r00 * mx + r01 * my + r02 * mz, hy = r10 * mx + r11 * my + r12 * mz;
        const float bz = up[0] * mx + up[1] * my + up[2] * mz, by = sqrtf(hx * hx + hy * hy); /* the field points north */
        const float f[3] = {by * r10 + bz * up[0], by * r11 + bz * up[1], by * r12 + bz * up[2]};
        error[0] += my * f[2] - mz * f[1];
        error[1] += mz * f[0] - mx * f[2];
        error[2] += mx * f[1] - my * f[0];
    }
    float half[3];
    for (int k = 0; k < 3; k++) {
        q->integral[k] += KI * error[k] * dt;
        half[k] = 0.5f * dt * (gyr[k] + KP * error[k] + q->integral[k]);
    }
    const float nw = w - x * half[0] - y * half[1] - z * half[2], nx = x + w * half[0] + y * half[2] - z * half[1];
    const float ny = y + w * half[1] - x * half[2] + z * half[0], nz = z + w * half[2] + x * half[1] - y * half[0];
    const float one = 1.0f / sqrtf(nw * nw + nx * nx + ny * ny + nz * nz);
    q->w = nw * one;
    q->x = nx * one;
    q->y = ny * one;
    q->z = nz * one;
    return true;
}
