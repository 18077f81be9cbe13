/* The complementary filter on one axis, written by hand: the yardstick of speed.py.

   Same equations, same order of operations and same three outputs per sample as levelhead's Complementary, so built
   without fused multiply-add it gives the same bits. */
#include <stddef.h>

#include "angle.h"

typedef struct {
    double level, rate, bias;
} Level;

void run(const double *tau, ptrdiff_t n, const double *t, const double *level, const double *rate, double period,
         Level *out)
{
    Level x = {level[0], 0.0, 0.0};
    out[0] = x;
    for (ptrdiff_t i = 1; i < n; i++) {
        const double dt = t[i] - t[i - 1];
        const double predicted = wrap(x.level + rate[i] * dt, period);
        x.level = wrap(predicted + dt / (*tau + dt) * wrap(level[i] - predicted, period), period);
        x.rate = rate[i];
        out[i] = x;
    }
}
