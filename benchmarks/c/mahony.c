/* Mahony's explicit complementary filter, written by hand: the yardstick of filters_c.py.

   Same equations and same order of operations as levelhead's Mahony with whole_field off, so built without fused
   multiply-add it gives the same bits. mag may be NULL. quat[0] is the start; whole rows without missing readings. */
#include <stddef.h>

#include "attitude.h"

typedef struct {
    double kp, ki, k_mag, max_bias;
} Params;

void run(const Params *params, ptrdiff_t n, const double *t, const double *gyr, const double *acc, const double *mag,
         Quat *quat, Vec3 *bias)
{
    const double kp = params->kp, k_mag = params->k_mag, limit = params->max_bias * DEGREE;
    Quat q = quat[0];
    Vec3 b = {0.0, 0.0, 0.0};
    double age = 0.0;
    bias[0] = b;
    for (ptrdiff_t i = 1; i < n; i++) {
        const double dt = t[i] - t[i - 1];
        const Vec3 g = row(gyr, i);
        const Quat ahead = turned(q, (g.x - b.x) * dt, (g.y - b.y) * dt, (g.z - b.z) * dt);
        age = older(age, dt);
        const Vec3 up = up_of(ahead), tilted = pull(normalize(row(acc, i)), up);
        const double kt = share(1.0 / kp, age, dt);
        Vec3 headed = {0.0, 0.0, 0.0}, rho = {kt * tilted.x, kt * tilted.y, kt * tilted.z};
        if (mag && present(row(mag, i))) {
            const double kh = share(1.0 / (kp * k_mag), age, dt);
            headed = levelled(ahead, up, row(mag, i));
            rho = (Vec3){rho.x + kh * headed.x, rho.y + kh * headed.y, rho.z + kh * headed.z};
        }
        double step = params->ki * dt;
        double square = tilted.x * tilted.x + tilted.y * tilted.y + tilted.z * tilted.z;
        if (age + SLACK * dt >= 1.0 / kp && kp * kp * square < limit * limit)
            b = (Vec3){b.x - step * tilted.x, b.y - step * tilted.y, b.z - step * tilted.z};
        square = headed.x * headed.x + headed.y * headed.y + headed.z * headed.z;
        if (age + SLACK * dt >= 1.0 / (kp * k_mag) && kp * kp * k_mag * k_mag * square < limit * limit) {
            step *= k_mag;
            b = (Vec3){b.x - step * headed.x, b.y - step * headed.y, b.z - step * headed.z};
        }
        b = (Vec3){within(b.x, limit), within(b.y, limit), within(b.z, limit)};
        q = nudged(ahead, rho.x, rho.y, rho.z);
        quat[i] = q;
        bias[i] = b;
    }
}
