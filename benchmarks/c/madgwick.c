/* Madgwick's gradient descent filter, written by hand: the yardstick of filters_c.py.

   Same equations and same order of operations as levelhead's Madgwick, so built without fused multiply-add it gives the
   same bits. mag may be NULL. quat[0] is the start; whole rows without missing readings. */
#include <stddef.h>

#include "attitude.h"

typedef struct {
    double beta, zeta;
} Params;

typedef struct {
    double x, y, z, scalar;
} Slope;

static inline Slope slope(Vec3 s, Vec3 e, Vec3 d)
{
    return (Slope){s.y * e.z - s.z * e.y, s.z * e.x - s.x * e.z, s.x * e.y - s.y * e.x,
                   (e.x - s.x) * (e.x - d.x) + (e.y - s.y) * (e.y - d.y) + (e.z - s.z) * (e.z - d.z)};
}

static inline Slope downhill(Quat q, Vec3 acc, Vec3 mag, int has_mag)
{
    Slope f = {0.0, 0.0, 0.0, 0.0};
    if (present(acc)) {
        const Vec3 s = normalize(acc), up = up_of(q);
        f = slope(s, up, (Vec3){0.0, 0.0, 1.0});
        if (dot(s, up) < 0.0) {
            const Vec3 p = pull(s, up);
            return (Slope){p.x, p.y, p.z, 0.0};
        }
    }
    if (has_mag && present(mag)) {
        const Vec3 s = normalize(mag), h = rotate(q, s);
        if (h.y < 0.0) {
            const Vec3 p = levelled(q, up_of(q), s);
            return (Slope){f.x + p.x, f.y + p.y, f.z + p.z, f.scalar};
        }
        const Vec3 d = {0.0, sqrt(h.x * h.x + h.y * h.y), h.z};
        const Slope m = slope(s, rotate((Quat){q.w, -q.x, -q.y, -q.z}, d), d);
        return (Slope){f.x + m.x, f.y + m.y, f.z + m.z, f.scalar + m.scalar};
    }
    return f;
}

void run(const Params *params, ptrdiff_t n, const double *t, const double *gyr, const double *acc, const double *mag,
         Quat *quat, Vec3 *bias)
{
    Quat q = quat[0];
    Vec3 b = {0.0, 0.0, 0.0};
    double age = 0.0;
    bias[0] = b;
    for (ptrdiff_t i = 1; i < n; i++) {
        const double dt = t[i] - t[i - 1];
        const Vec3 g = row(gyr, i), a = row(acc, i), m = mag ? row(mag, i) : (Vec3){0.0, 0.0, 0.0};
        const Quat ahead = turned(q, (g.x - b.x) * dt, (g.y - b.y) * dt, (g.z - b.z) * dt);
        age = older(age, dt);
        const int has_mag = mag && present(m);
        const Slope f = downhill(ahead, a, m, has_mag);
        const double most = 1.0 / (has_mag ? 2.0 : 1.0);
        const double square = 4.0 * (f.x * f.x + f.y * f.y + f.z * f.z + f.scalar * f.scalar);
        double k = square < 1e-30 ? 0.0 : least(4.0 * params->beta * dt / sqrt(square), most);
        if (age + SLACK * dt < 3.0) {
            const double young = least(share(3.0, age, dt), most);
            k = young > k ? young : k;
        } else if (params->zeta > 0.0) {
            const double step = params->zeta / params->beta * k;
            b = (Vec3){within(b.x - step * f.x, 0.35), within(b.y - step * f.y, 0.35), within(b.z - step * f.z, 0.35)};
        }
        q = nudged(ahead, k * f.x, k * f.y, k * f.z);
        quat[i] = q;
        bias[i] = b;
    }
}
