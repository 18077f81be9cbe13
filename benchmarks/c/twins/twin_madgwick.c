/* Gradient descent: S. Madgwick, An efficient orientation filter for inertial and inertial/magnetic sensor arrays, report,
   University of Bristol (2010), eqs. 15, 25 to 34, 44 to 46. The quaternion is that of the sensor in the earth. */
#include "twin.h"

#define BETA 0.1f

void twin_madgwick_init(twin_madgwick *q)
{
    q->w = 1.0f;
    q->x = q->y = q->z = 0.0f;
}

bool twin_madgwick_update(twin_madgwick *q, const float gyr[3], const float acc[3], const float mag[3], float dt)
{
    const float w = q->w, x = q->x, y = q->y, z = q->z;
    const float a = 1.0f / sqrtf(acc[0] * acc[0] + acc[1] * acc[1] + acc[2] * acc[2]);
    const float f0 = 2.0f * (x * z - w * y) - a * acc[0], f1 = 2.0f * (w * x + y * z) - a * acc[1];
    const float f2 = 1.0f - 2.0f * (x * x + y * y) - a * acc[2];
    float gw = -y * f0 + x * f1, gx = z * f0 + w * f1 - 2.0f * x * f2;
    float gy = -w * f0 + z * f1 - 2.0f * y * f2, gz = x * f0 + y * f1;
    if (mag) {
        const float m = 1.0f / sqrtf(mag[0] * mag[0] + mag[1] * mag[1] + mag[2] * mag[2]);
        const float mx = mag[0] * m, my = mag[1] * m, mz = mag[2] * m;
        const float hx = mx * (1.0f - 2.0f * (y * y + z * z)) + 2.0f * (my * (x * y - w * z) + mz * (x * z + w * y));
        const float hy = my * (1.0f - 2.0f * (x * x + z * z)) + 2.0f * (mx * (x * y + w * z) + mz * (y * z - w * x));
        const float bz = mz * (1.0f - 2.0f * (x * x + y * y)) + 2.0f * (mx * (x * z - w * y) + my * (w * x + y * z));
        const float by = sqrtf(hx * hx + hy * hy); /* the field points north */
        const float e0 = 2.0f * by * (x * y + w * z) + 2.0f * bz * (x * z - w * y) - mx;
        const float e1 = by * (1.0f - 2.0f * (x * x + z * z)) + 2.0f * bz * (w * x + y * z) - my;
        const float e2 = 2.0f * by * (y * z - w * x) + bz * (1.0f - 2.0f * (x * x + y * y)) - mz;
        gw += (by * z - bz * y) * e0 + bz * x * e1 - by * x * e2;
        gx += (by * y + bz * z) * e0 + (bz * w - 2.0f * by * x) * e1 - (by * w + 2.0f * bz * x) * e2;
        gy += (by * x - bz * w) * e0 + bz * z * e1 + (by * z - 2.0f * bz * y) * e2;
        gz += (by * w + bz * x) * e0 + (bz * y - 2.0f * by * z) * e1 + by * y * e2;
    }
    const float square = gw * gw + gx * gx + gy * gy + gz * gz;
    const float step = square > 0.0f ? BETA / sqrtf(square) : 0.0f;
    const float rx = 0.5f * gyr[0], ry = 0.5f * gyr[1], rz = 0.5f * gyr[2];
    const float nw = w + dt * (-x * rx - y * ry - z * rz - step * gw);
    const float nx = x + dt * (w * rx + y * rz - z * ry - step * gx);
    const float ny = y + dt * (w * ry - x * rz + z * rx - step * gy);
    const float nz = z + dt * (w * rz + x * ry - y * rx - step * gz);
    const float one = 1.0f / sqrtf(nw * nw + nx * nx + ny * ny + nz * nz);
    q->w = nw * one;
    q->x = nx * one;
    q->y = ny * one;
    q->z = nz * one;
    return true;
}
