/* What the two attitude filters share; same order of operations as levelhead's kernels. */
#ifndef ATTITUDE_H
#define ATTITUDE_H

#include <math.h>
#include <stddef.h>

#define DEGREE (3.14159265358979323846 / 180.0)
#define SLACK 0.3819660112501051 /* of an interval, kernels/elapsed.py */

typedef struct {
    double x, y, z;
} Vec3;

typedef struct {
    double w, x, y, z;
} Quat;

static inline int present(Vec3 v) { return v.x != 0.0 || v.y != 0.0 || v.z != 0.0; }

static inline Vec3 normalize(Vec3 a)
{
    const double n = sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
    if (n > 1e-140)
    {
        const double one = 1.0 / n;
        return (Vec3){a.x * one, a.y * one, a.z * one};
    }
    return (Vec3){0.0, 0.0, 0.0};
}

static inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline Vec3 up_of(Quat q)
{
    return (Vec3){2.0 * (q.x * q.z - q.w * q.y), 2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y)};
}

static inline Vec3 rotate(Quat q, Vec3 v)
{
    const double tx = 2.0 * (q.y * v.z - q.z * v.y);
    const double ty = 2.0 * (q.z * v.x - q.x * v.z);
    const double tz = 2.0 * (q.x * v.y - q.y * v.x);
    return (Vec3){v.x + q.w * tx + q.y * tz - q.z * ty, v.y + q.w * ty + q.z * tx - q.x * tz,
                  v.z + q.w * tz + q.x * ty - q.y * tx};
}

static inline Vec3 across(Vec3 v)
{
    if (fabs(v.x) < 0.8) {
        const double n = sqrt(v.y * v.y + v.z * v.z);
        return (Vec3){0.0, v.z / n, -v.y / n};
    }
    const double n = sqrt(v.x * v.x + v.y * v.y);
    return (Vec3){v.y / n, -v.x / n, 0.0};
}

static inline Vec3 pull(Vec3 s, Vec3 e)
{
    const Vec3 c = {s.y * e.z - s.z * e.y, s.z * e.x - s.x * e.z, s.x * e.y - s.y * e.x};
    if (dot(s, e) < 0.0) {
        const double n = sqrt(c.x * c.x + c.y * c.y + c.z * c.z);
        if (n < 1e-9)
            return across(e);
        return (Vec3){c.x / n, c.y / n, c.z / n};
    }
    return c;
}

static inline Vec3 levelled(Quat q, Vec3 up, Vec3 m)
{
    const double tx = 2.0 * (q.y * m.z - q.z * m.y);
    const double ty = 2.0 * (q.z * m.x - q.x * m.z);
    const double tz = 2.0 * (q.x * m.y - q.y * m.x);
    const double east = (m.x + q.w * tx) + (q.y * tz - q.z * ty);
    const double north = (m.y + q.w * ty) + (q.z * tx - q.x * tz);
    const double square = east * east + north * north;
    if (square < 1e-140)
        return (Vec3){0.0, 0.0, 0.0};
    double sine = east / sqrt(square);
    if (north < 0.0)
        sine = east >= 0.0 ? 1.0 : -1.0;
    return (Vec3){sine * up.x, sine * up.y, sine * up.z};
}

static inline Quat turned(Quat q, double x, double y, double z)
{
    const double square = 0.25 * (x * x + y * y + z * z), fourth = square * square;
    double s, c;
    if (fourth > 1e-6) {
        if (square < 0.01) {
            s = 0.5 - square * (1.0 / 12.0 - square * (1.0 / 240.0 - square * (1.0 / 10080.0 - square / 725760.0)));
            c = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square / 40320.0)));
        } else {
            const double half = sqrt(square);
            s = 0.5 * sin(half) / half;
            c = cos(half);
        }
        x *= s, y *= s, z *= s;
        return (Quat){q.w * c - q.x * x - q.y * y - q.z * z, q.w * x + q.x * c + q.y * z - q.z * y,
                      q.w * y - q.x * z + q.y * c + q.z * x, q.w * z + q.x * y - q.y * x + q.z * c};
    }
    s = (0.5 - square * (1.0 / 12.0)) + fourth * (1.0 / 240.0 - square * (1.0 / 10080.0));
    c = (1.0 - square * 0.5) + fourth * (1.0 / 24.0 - square * (1.0 / 720.0));
    x *= s, y *= s, z *= s;
    return (Quat){(q.w * c - q.x * x) - (q.y * y + q.z * z), (q.w * x + q.x * c) + (q.y * z - q.z * y),
                  (q.w * y + q.y * c) + (q.z * x - q.x * z), (q.w * z + q.z * c) + (q.x * y - q.y * x)};
}

static inline Quat nudged(Quat q, double x, double y, double z)
{
    x *= 0.5, y *= 0.5, z *= 0.5;
    const double w = q.w - (q.x * x + q.y * y + q.z * z);
    const double i = q.x + (q.w * x + (q.y * z - q.z * y));
    const double j = q.y + (q.w * y + (q.z * x - q.x * z));
    const double k = q.z + (q.w * z + (q.x * y - q.y * x));
    const double excess = (w * w + i * i) + (j * j + k * k) - 1.0;
    double s = 1.0 - excess * (0.5 - 0.375 * excess);
    if (excess > 1e-5)
        s = 1.0 / sqrt(1.0 + excess);
    return (Quat){w * s, i * s, j * s, k * s};
}

static inline double older(double age, double dt)
{
    if (dt > 0.5)
        return 0.0;
    return age + dt < 1e6 ? age + dt : 1e6;
}

static inline double least(double a, double b) { return b < a ? b : a; }

static inline double share(double tau, double age, double dt) { return dt / (least(tau, age) + dt); }

static inline double within(double x, double limit) { return fmax(-limit, fmin(x, limit)); }

static inline Vec3 row(const double *v, ptrdiff_t i) { return (Vec3){v[3 * i], v[3 * i + 1], v[3 * i + 2]}; }

#endif
