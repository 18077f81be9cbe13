/* What lean filters by hand have in common: readings that are missing or lost, the attitude at the start. */
#ifndef LEAN_H
#define LEAN_H

#include "lean_readings.h"
#include <math.h>

#pragma GCC optimize("fp-contract=off", "no-tree-slp-vectorize", "no-math-errno", "no-trapping-math")
#define RARE __attribute__((noinline, cold))

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

enum { START, STEP, AFTER_GAP };

/* TRIAD of force and field, as far as they are measured; Shepperd's quaternion. */
static RARE void start_attitude(const float *acc, const float *mag, float *to)
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
    for (int i = 0; i < 4; i++) {
        to[i] = q[i] / n;
    }
}

/* Missing readings, lost samples, a gap. v: rate, force, field; ``unmeasured`` rad² of the rotation. */
static RARE int condition(lean_readings *f, const float *bias, float *v, float dt, float *unmeasured)
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
        f->interval = f->rate_age = 0.0f;
        f->started = dot(v + 3, v + 3) > NO_LENGTH;
        return START;
    }
    const float usual = f->interval, twice = 2.0f * usual;
    const bool more = dt + SLACK * usual >= twice, gap = dt > GAP;
    float lost = 0.0f;
    if (more && usual == 0.0f) {
        f->interval = dt;
    } else {
        f->interval = usual + ((twice < dt ? twice : dt) - usual) / INTERVALS;
        lost = more ? dt - usual : 0.0f;
    }
    const float before = f->rate_age, now = before + dt;
    f->rate_age = missing ? now : 0.0f;
    *unmeasured = 0.0f;
    if (missing) {
        const float after = TURN * now;
        if (!(after <= LEAST_ROTATION)) {
            *unmeasured = after * after - (TURN * before > LEAST_ROTATION ? TURN * before * (TURN * before) : 0.0f);
        }
    } else if (!gap && lost > 0.0f) {
        float change[3];
        const float share = 0.5f * (lost / dt), rate2 = dot(v, v), last2 = dot(last, last);
        for (int i = 0; i < 3; i++) {
            change[i] = v[i] - last[i];
            v[i] = v[i] - change[i] * share;
        }
        *unmeasured = lost * lost * (0.083333336f * dot(change, change) + 0.06f * (last2 > rate2 ? last2 : rate2));
    }
    if (gap || (missing && before + SLACK * dt >= GAP)) {
        for (int i = 0; i < 3; i++) {
            v[i] = bias[i];
        }
    }
    return gap ? AFTER_GAP : STEP;
}

static RARE void half_angle_far(float square, float *s, float *c)
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

/* sin(angle/2)/angle and cos(angle/2) of square = (angle/2)², rad². */
static inline __attribute__((always_inline)) void half_angle(float square, float *s, float *c)
{
    const float fourth = square * square;
    *s = (0.5f - square * (1.0f / 12.0f)) + fourth * (1.0f / 240.0f - square * (1.0f / 10080.0f));
    *c = (1.0f - square * 0.5f) + fourth * (1.0f / 24.0f - square * (1.0f / 720.0f));
    if (square > SHORT) {
        half_angle_far(square, s, c);
    }
}

#endif
