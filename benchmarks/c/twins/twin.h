/* Published filters as their authors give them, in float: what a board pays for the equations alone.

   No missing readings, no gaps, no sigma, no guard: an update takes whole samples at even intervals. Written from the
   papers, not from anybody's library. */
#ifndef TWIN_H
#define TWIN_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct {
    float w, x, y, z, integral[3];
} twin_mahony, twin_madgwick;

typedef struct {
    float angle, bias, p[2][2];
} twin_kalman_axis;

void twin_mahony_init(twin_mahony *filter);
bool twin_mahony_update(twin_mahony *filter, const float gyr[3], const float acc[3], const float mag[3], float dt);
void twin_madgwick_init(twin_madgwick *filter);
bool twin_madgwick_update(twin_madgwick *filter, const float gyr[3], const float acc[3], const float mag[3], float dt);
void twin_kalman_axis_init(twin_kalman_axis *filter, float level);
bool twin_kalman_axis_update(twin_kalman_axis *filter, float level, float rate, float dt, float period, void *report);

#endif
