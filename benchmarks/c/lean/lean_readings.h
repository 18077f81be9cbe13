/* The memory of the readings that lean filters by hand keep. */
#ifndef LEAN_READINGS_H
#define LEAN_READINGS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    float last[3], rate_age, interval;
    bool started;
} lean_readings;

#endif
