/* Usual samples run straight through update; all else is rare and small. Written to be as short as C allows: it shows
   what of an export's size and time is the filter, and what the translation. */
#include "lean_mahony.h"
#include "lean.h"

#define KP 0.4f
#define KI 0.003f
#define K_MAG 0.5f
#define MAX_BIAS (5.7f * 0.017453292f)

/* An unusual sample: whether there is a step to do. */
static RARE bool unusual(lean_mahony *f, float *v, float dt)
{
    float unmeasured;
    const int kind = condition(&f->readings, f->bias, v, dt, &unmeasured);
    if (kind == START) {
        start_attitude(v + 3, v + 6, &f->w);
        f->bias[0] = f->bias[1] = f->bias[2] = f->age = 0.0f;
        return false;
    }
    if (unmeasured > 0.0f) {
        f->age = f->age / (1.0f + f->age * unmeasured / 0.03f);
    }
    if (kind == AFTER_GAP) {
        f->age = -dt; /* 0 after the step */
    }
    return true;
}

/* A direction's error beyond a right angle, at length one. */
static RARE void obtuse(const float *up, float *error)
{
    const float n = root(dot(error, error));
    if (n < 1e-09f) {
        const bool flat = fabsf(up[0]) < 0.8f;
        const float m = flat ? root(up[1] * up[1] + up[2] * up[2]) : root(up[0] * up[0] + up[1] * up[1]);
        error[0] = flat ? 0.0f : up[1] / m;
        error[1] = flat ? up[2] / m : -up[0] / m;
        error[2] = flat ? -up[1] / m : 0.0f;
        return;
    }
    for (int i = 0; i < 3; i++) {
        error[i] = error[i] / n;
    }
}

static RARE void bound(float *bias)
{
    for (int i = 0; i < 3; i++) {
        bias[i] = bias[i] > MAX_BIAS ? MAX_BIAS : bias[i] < -MAX_BIAS ? -MAX_BIAS : bias[i];
    }
}

bool lean_mahony_update(lean_mahony *f, const float gyr[3], const float acc[3], const float mag[3], float dt)
{
    static const float none[3];
    gyr = gyr ? gyr : none;
    acc = acc ? acc : none;
    mag = mag ? mag : none;
    if (!(0.0f < dt && dt < 1e9f)) {
        return false;
    }
    float gx = gyr[0], gy = gyr[1], gz = gyr[2], ax = acc[0], ay = acc[1], az = acc[2];
    float mx = mag[0], my = mag[1], mz = mag[2];
    float force2 = ax * ax + ay * ay + az * az, field2 = mx * mx + my * my + mz * mz;
    const float usual = f->readings.interval, slack = SLACK * dt;
    if (f->readings.started && gx * gx + gy * gy + gz * gz + force2 + field2 < READING2 && dt <= GAP
        && dt + SLACK * usual < 2.0f * usual) {
        f->readings.interval = usual + (dt - usual) / INTERVALS;
        f->readings.last[0] = gx;
        f->readings.last[1] = gy;
        f->readings.last[2] = gz;
        f->readings.rate_age = 0.0f;
    } else {
        float v[9] = {gx, gy, gz, ax, ay, az, mx, my, mz};
        if (!unusual(f, v, dt)) {
            return true;
        }
        gx = v[0];
        gy = v[1];
        gz = v[2];
        ax = v[3];
        ay = v[4];
        az = v[5];
        mx = v[6];
        my = v[7];
        mz = v[8];
        force2 = ax * ax + ay * ay + az * az;
        field2 = mx * mx + my * my + mz * mz;
    }
    const float rx = (gx - f->bias[0]) * dt, ry = (gy - f->bias[1]) * dt, rz = (gz - f->bias[2]) * dt;
    float s, c;
    half_angle(0.25f * (rx * rx + ry * ry + rz * rz), &s, &c);
    const float hx = rx * s, hy = ry * s, hz = rz * s, qw = f->w, qx = f->x, qy = f->y, qz = f->z;
    const float w = (qw * c - qx * hx) - (qy * hy + qz * hz), x = (qw * hx + qx * c) + (qy * hz - qz * hy);
    const float y = (qw * hy + qy * c) + (qz * hx - qx * hz), z = (qw * hz + qz * c) + (qx * hy - qy * hx);
    const float age = f->age + dt, steady = age + slack;
    const float ux = 2.0f * (x * z - w * y), uy = 2.0f * (w * x + y * z), uz = 1.0f - 2.0f * (x * x + y * y);
    float tx = 0.0f, ty = 0.0f, tz = 0.0f;
    const float n = root(force2);
    if (n > SHORTEST) {
        const float one = 1.0f / n;
        ax *= one;
        ay *= one;
        az *= one;
        tx = ay * uz - az * uy;
        ty = az * ux - ax * uz;
        tz = ax * uy - ay * ux;
        if (ax * ux + ay * uy + az * uz < 0.0f) {
            float error[3] = {tx, ty, tz};
            obtuse((const float[]){ux, uy, uz}, error);
            tx = error[0];
            ty = error[1];
            tz = error[2];
        }
    }
    const float kt = dt / ((age < 1.0f / KP ? age : 1.0f / KP) + dt);
    float ex = kt * tx, ey = kt * ty, ez = kt * tz, bx = f->bias[0], by = f->bias[1], bz = f->bias[2];
    const float step = KI * dt, limit2 = MAX_BIAS * MAX_BIAS;
    if (steady >= 1.0f / KP && KP * KP * (tx * tx + ty * ty + tz * tz) < limit2) {
        bx -= step * tx;
        by -= step * ty;
        bz -= step * tz;
    }
    if (field2 > NO_LENGTH) {
        const float kh = dt / ((age < 1.0f / (KP * K_MAG) ? age : 1.0f / (KP * K_MAG)) + dt);
        const float sx = 2.0f * (y * mz - z * my), sy = 2.0f * (z * mx - x * mz), sz = 2.0f * (x * my - y * mx);
        const float east = (mx + w * sx) + (y * sz - z * sy), north = (my + w * sy) + (z * sx - x * sz);
        const float level2 = east * east + north * north;
        if (!(level2 < SHORTEST)) {
            float sine = east / root(level2);
            if (north < 0.0f) {
                sine = east >= 0.0f ? 1.0f : -1.0f;
            }
            const float px = sine * ux, py = sine * uy, pz = sine * uz;
            ex += kh * px;
            ey += kh * py;
            ez += kh * pz;
            if (steady >= 1.0f / (KP * K_MAG) && KP * KP * K_MAG * K_MAG * (px * px + py * py + pz * pz) < limit2) {
                const float slow = step * K_MAG;
                bx -= slow * px;
                by -= slow * py;
                bz -= slow * pz;
            }
        }
    }
    f->bias[0] = bx;
    f->bias[1] = by;
    f->bias[2] = bz;
    if (bx * bx + by * by + bz * bz > limit2) {
        bound(f->bias);
    }
    ex *= 0.5f;
    ey *= 0.5f;
    ez *= 0.5f;
    const float nw = w - (x * ex + y * ey + z * ez), nx = x + (w * ex + (y * ez - z * ey));
    const float ny = y + (w * ey + (z * ex - x * ez)), nz = z + (w * ez + (x * ey - y * ex));
    const float excess = nw * nw + nx * nx + (ny * ny + nz * nz) - 1.0f;
    float one = 1.0f - excess * (0.5f - 0.375f * excess);
    if (excess > 1e-05f) {
        one = 1.0f / root(1.0f + excess);
    }
    f->w = nw * one;
    f->x = nx * one;
    f->y = ny * one;
    f->z = nz * one;
    f->age = age;
    return true;
}

void lean_mahony_init(lean_mahony *f)
{
    *f = (lean_mahony){.w = 1.0f};
}

lean_mahony_quat lean_mahony_quaternion(const lean_mahony *f)
{
    return (lean_mahony_quat){f->w, f->x, f->y, f->z};
}

lean_mahony_vec3 lean_mahony_bias(const lean_mahony *f)
{
    return (lean_mahony_vec3){f->bias[0], f->bias[1], f->bias[2]};
}
