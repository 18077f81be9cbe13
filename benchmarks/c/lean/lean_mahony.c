/* Usual samples run straight through update; all else is rare and small. Written to be as short as C allows: it shows
   what of an export's size and time is the filter, and what the translation. */
#include "lean_mahony.h"
#include <math.h>

#pragma GCC optimize("fp-contract=off", "no-tree-slp-vectorize", "no-math-errno", "no-trapping-math")
#define RARE __attribute__((noinline, cold))

#define KP 0.4f
#define KI 0.003f
#define K_MAG 0.5f
#define MAX_BIAS (5.7f * 0.017453292f)
#define READING2 1e18f
#define SLACK 0.38196602f
#define GAP 0.5000005f
#define INTERVALS 16.0f
#define LEAST_ROTATION 0.09599311f
#define NO_LENGTH 1e-30f
#define SHORTEST 1e-18f
#define PARALLEL 1e-06f
#define SHORT 1e-3f
#define SMALL 0.01f
#define TURN 1.0f

#if defined(__arm__) && defined(__ARM_FP) && (__ARM_FP & 4)
static inline __attribute__((always_inline)) float root(float x)
{
    float found;
    __asm__("vsqrt.f32 %0, %1" : "=t"(found) : "t"(x));
    return found;
}
#else
#define root(x) sqrtf(x)
#endif

static float dot(const float *a, const float *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const float *a, const float *b, float *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static void unit(const float *a, float *to)
{
    const float n = root(dot(a, a)), one = n > SHORTEST ? 1.0f / n : 0.0f;
    for (int i = 0; i < 3; i++) {
        to[i] = n > SHORTEST ? a[i] * one : 0.0f;
    }
}

/* TRIAD of force and field, as far as they are measured; Shepperd's quaternion. */
static RARE void start(lean_mahony *f, const float *acc, const float *mag)
{
    float m[9], *const east = m, *const north = m + 3, *const up = m + 6;
    unit(acc, up);
    if (up[0] == 0.0f && up[1] == 0.0f && up[2] == 0.0f) {
        up[2] = 1.0f;
    }
    float field[3];
    unit(mag, field);
    cross(field, up, east);
    const float length = root(dot(east, east));
    if (length > PARALLEL) {
        const float one = 1.0f / length;
        for (int i = 0; i < 3; i++) {
            east[i] *= one;
        }
        cross(up, east, north);
    } else {
        const float across = root(up[1] * up[1] + up[2] * up[2]), one = across > 0.0f ? 1.0f / across : 0.0f;
        north[0] = 0.0f;
        north[1] = across > 0.0f ? up[2] * one : 1.0f;
        north[2] = across > 0.0f ? -up[1] * one : 0.0f;
        cross(north, up, east);
    }
    const float trace = m[0] + m[4] + m[8];
    float q[4] = {1.0f + trace, m[7] - m[5], m[2] - m[6], m[3] - m[1]};
    if (!(trace >= m[0] && trace >= m[4] && trace >= m[8])) {
        const int i = m[0] >= m[4] && m[0] >= m[8] ? 0 : m[4] >= m[8] ? 1 : 2, j = (i + 1) % 3, k = (i + 2) % 3;
        q[0] = m[3 * k + j] - m[3 * j + k];
        q[1 + i] = 1.0f + 2.0f * m[4 * i] - trace;
        q[1 + j] = m[3 * i + j] + m[3 * j + i];
        q[1 + k] = m[3 * i + k] + m[3 * k + i];
    }
    const float n = root(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    f->w = q[0] / n;
    f->x = q[1] / n;
    f->y = q[2] / n;
    f->z = q[3] / n;
    f->bias[0] = f->bias[1] = f->bias[2] = f->age = f->interval = f->rate_age = 0.0f;
    f->started = dot(acc, acc) > NO_LENGTH;
}

/* A first sample, missing readings, lost samples, a gap. v: rate, force, field. Whether there is a step to do. */
static RARE bool condition(lean_mahony *f, float *v, float dt)
{
    bool missing = false;
    for (int sensor = 0; sensor < 3; sensor++) {
        float *const one = v + 3 * sensor;
        if (!(dot(one, one) < READING2)) {
            missing |= sensor == 0;
            for (int i = 0; i < 3; i++) {
                one[i] = sensor ? 0.0f : f->last[i];
            }
        }
    }
    float last[3];
    for (int i = 0; i < 3; i++) {
        last[i] = f->last[i];
        f->last[i] = v[i];
    }
    if (!f->started) {
        start(f, v + 3, v + 6);
        return false;
    }
    const float usual = f->interval, twice = 2.0f * usual;
    const bool more = dt + SLACK * usual >= twice;
    float lost = 0.0f, unmeasured = 0.0f;
    if (more && usual == 0.0f) {
        f->interval = dt;
    } else {
        f->interval = usual + ((twice < dt ? twice : dt) - usual) / INTERVALS;
        lost = more ? dt - usual : 0.0f;
    }
    const float before = f->rate_age, now = before + dt;
    const bool gap = dt > GAP;
    f->rate_age = missing ? now : 0.0f;
    if (missing) {
        const float after = TURN * now;
        if (!(after <= LEAST_ROTATION)) {
            unmeasured = after * after - (TURN * before > LEAST_ROTATION ? TURN * before * (TURN * before) : 0.0f);
        }
    } else if (!gap && lost > 0.0f) {
        float change[3];
        const float share = 0.5f * (lost / dt), rate2 = dot(v, v), last2 = dot(last, last);
        for (int i = 0; i < 3; i++) {
            change[i] = v[i] - last[i];
            v[i] = v[i] - change[i] * share;
        }
        unmeasured = lost * lost * (0.083333336f * dot(change, change) + 0.06f * (last2 > rate2 ? last2 : rate2));
    }
    if (unmeasured > 0.0f) {
        f->age = f->age / (1.0f + f->age * unmeasured / 0.03f);
    }
    if (gap || (missing && before + SLACK * dt >= GAP)) {
        for (int i = 0; i < 3; i++) {
            v[i] = f->bias[i];
        }
    }
    if (gap) {
        f->age = -dt; /* 0 after the step */
    }
    return true;
}

/* sin(angle/2)/angle and cos(angle/2) of square = (angle/2)². */
static RARE void half_angle(float square, float *s, float *c)
{
    if (square < SMALL) {
        const float fourth = square * square;
        *s = 0.5f - square * (1.0f / 12.0f)
            + fourth * (1.0f / 240.0f - square * (1.0f / 10080.0f) + fourth * (1.0f / 725760.0f));
        *c = 1.0f - 0.5f * square
            + fourth * (1.0f / 24.0f - square * (1.0f / 720.0f) + fourth * (1.0f / 40320.0f));
        return;
    }
    const float half = root(square), k = half * 0.63661975f + 12582912.0f - 12582912.0f;
    const float r = half - k * 1.5703125f - k * 0.0004837513f - k * 7.54979e-08f, u = r * r;
    float a = 1.5918136e-10f, b = 1.1382636e-11f;
    static const float sine[] = {2.5051133e-08f, 2.7557317e-06f, 0.0001984127f, 0.008333334f, 0.16666667f};
    static const float cosine[] = {2.0876145e-09f, 2.7557317e-07f, 2.4801588e-05f, 0.0013888889f, 0.041666668f, 0.5f};
    for (int i = 0; i < 5; i++) {
        a = sine[i] - u * a;
    }
    for (int i = 0; i < 6; i++) {
        b = cosine[i] - u * b;
    }
    a = r - r * (u * a);
    b = 1.0f - u * b;
    const float quadrant = k - 4.0f * (0.25f * k + 12582912.0f - 12582912.0f);
    const bool even = quadrant == 0.0f || quadrant == 2.0f || quadrant == -2.0f;
    float sin = even ? a : b, cos = even ? b : a;
    if (quadrant == 2.0f || quadrant == -2.0f || quadrant == -1.0f) {
        sin = -sin;
    }
    if (quadrant == 1.0f || quadrant == 2.0f || quadrant == -2.0f) {
        cos = -cos;
    }
    *s = 0.5f * sin / half;
    *c = cos;
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
    const float usual = f->interval, slack = SLACK * dt;
    if (f->started && gx * gx + gy * gy + gz * gz + force2 + field2 < READING2 && dt <= GAP
        && dt + SLACK * usual < 2.0f * usual) {
        f->interval = usual + (dt - usual) / INTERVALS;
        f->last[0] = gx;
        f->last[1] = gy;
        f->last[2] = gz;
        f->rate_age = 0.0f;
    } else {
        float v[9] = {gx, gy, gz, ax, ay, az, mx, my, mz};
        if (!condition(f, v, dt)) {
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
    const float square = 0.25f * (rx * rx + ry * ry + rz * rz), fourth = square * square;
    float s = (0.5f - square * (1.0f / 12.0f)) + fourth * (1.0f / 240.0f - square * (1.0f / 10080.0f));
    float c = (1.0f - square * 0.5f) + fourth * (1.0f / 24.0f - square * (1.0f / 720.0f));
    if (square > SHORT) {
        half_angle(square, &s, &c);
    }
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
