/* The lesson's Kalman filter of one angle and the bias of its rate: R. E. Kalman, Transactions of the ASME 82 (1960); F of
   constant rate, H = (1, 0), and the usual Q and R of the Arduino lesson. */
#include "twin.h"

#define Q_ANGLE 0.001f
#define Q_BIAS 0.003f
#define R_MEASURE 0.03f

void twin_kalman_axis_init(twin_kalman_axis *f, float level)
{
    f->angle = level;
    f->bias = 0.0f;
    f->p[0][0] = f->p[0][1] = f->p[1][0] = f->p[1][1] = 0.0f;
}

bool twin_kalman_axis_update(twin_kalman_axis *f, float level, float rate, float dt, float period, void *report)
{
    (void)period, (void)report;
    f->angle += dt * (rate - f->bias);
    f->p[0][0] += dt * (dt * f->p[1][1] - f->p[0][1] - f->p[1][0] + Q_ANGLE);
    f->p[0][1] -= dt * f->p[1][1];
    f->p[1][0] -= dt * f->p[1][1];
    f->p[1][1] += Q_BIAS * dt;
    const float s = f->p[0][0] + R_MEASURE, k0 = f->p[0][0] / s, k1 = f->p[1][0] / s, y = level - f->angle;
    f->angle += k0 * y;
    f->bias += k1 * y;
    const float p00 = f->p[0][0], p01 = f->p[0][1];
    f->p[0][0] -= k0 * p00;
    f->p[0][1] -= k0 * p01;
    f->p[1][0] -= k1 * p00;
    f->p[1][1] -= k1 * p01;
    return true;
}
