/* The two-state Kalman filter (level, bias of the rate) on one axis, written by hand: the yardstick of speed.py.

   Same equations, same order of operations and same nine outputs per sample as levelhead's Kalman, so built without
   fused multiply-add it gives the same bits. */
#include <stddef.h>

#include "angle.h"

typedef struct {
    double q_angle, q_bias, r_measure, p_angle, p_bias;
    int q_per_sample, joseph;
} Params;

typedef struct {
    double level, rate, bias, p_level, p_cross, p_bias, gain_level, gain_bias, innovation;
} Axis;

static inline Axis step(const Params *params, Axis x, double level, double rate, double dt, double period)
{
    const double share = params->q_per_sample ? 1.0 : dt;
    const double r = params->r_measure;

    x.rate = rate - x.bias;
    x.level = wrap(x.level + dt * x.rate, period);
    const double p_level = x.p_level + dt * (dt * x.p_bias - 2.0 * x.p_cross) + params->q_angle * share;
    const double p_cross = x.p_cross - dt * x.p_bias;
    const double p_bias = x.p_bias + params->q_bias * share;

    x.gain_level = p_level / (p_level + r);
    x.gain_bias = p_cross / (p_level + r);
    x.innovation = wrap(level - x.level, period);
    if (params->joseph) {
        const double rest = 1.0 - x.gain_level;
        x.p_level = rest * rest * p_level + x.gain_level * x.gain_level * r;
        x.p_cross = rest * (p_cross - x.gain_bias * p_level) + x.gain_level * x.gain_bias * r;
        x.p_bias = p_bias - 2.0 * x.gain_bias * p_cross + x.gain_bias * x.gain_bias * (p_level + r);
    } else {
        x.p_level = p_level - x.gain_level * p_level;
        x.p_cross = p_cross - x.gain_level * p_cross;
        x.p_bias = p_bias - x.gain_bias * p_cross;
    }
    x.level = wrap(x.level + x.gain_level * x.innovation, period);
    x.bias = x.bias + x.gain_bias * x.innovation;
    return x;
}

void run(const Params *params, ptrdiff_t n, const double *t, const double *level, const double *rate, double period,
         Axis *out)
{
    Axis x = {level[0], 0.0, 0.0, params->p_angle, 0.0, params->p_bias, 0.0, 0.0, 0.0};
    out[0] = x;
    for (ptrdiff_t i = 1; i < n; i++) {
        x = step(params, x, level[i], rate[i], t[i] - t[i - 1], period);
        out[i] = x;
    }
}
