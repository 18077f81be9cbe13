/* Angles on a circle of the given period; period 0: on a line. */
#ifndef ANGLE_H
#define ANGLE_H

#include <math.h>

static inline double wrap(double angle, double period)
{
    if (period > 0.0 && !(-0.5 * period <= angle && angle < 0.5 * period))
        return angle - period * floor(angle / period + 0.5);
    return angle; /* nearly always: keeps the division out of the loop's chain of dependences */
}

#endif
