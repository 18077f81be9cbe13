/* What the filters of the native engine offer to the Python module around them. */
#ifndef LEVELHEAD_NATIVE_H
#define LEVELHEAD_NATIVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LH_INLINE static inline __attribute__((always_inline))
#define LH_CALLED __attribute__((noinline)) /* in many places */
#define LH_RARE LH_CALLED

/* Whether this processor has vectors of four doubles, and of eight. */
#if defined(LH_WITH_WIDE)
#define lh_wide() __builtin_cpu_supports("avx2")
#define lh_widest() __builtin_cpu_supports("avx512f")
#else
#define lh_wide() 0
#define lh_widest() 0
#endif

/* The same file is compiled once for every processor and, where it pays, once for those with wide vectors. */
#if defined(LH_WIDEST)
#define LH_SYMBOL(name) name##_widest
#elif defined(LH_WIDE)
#define LH_SYMBOL(name) name##_wide
#else
#define LH_SYMBOL(name) name
#endif

/* One number of a state or of parameters, as Python packs it: a float, or a whole number or truth value. */
typedef union {
    double number;
    int64_t whole;
} lh_word;

/* Rows of a recording and of its track, flat; mag is NULL where there is none, first where nothing aids. dt is NULL where
 * the stamps t give the intervals; bias, sigma and health are NULL for the orientation alone. */
typedef struct {
    const double *t, *dt, *gyr, *acc, *mag;
    const int64_t *first, *row;
    const double *value, *deviation, *age;
    double *quat, *bias, *sigma;
    uint32_t *health;
    double *places;
} lh_rows;

/* Blocks that a run forward keeps for the smoother: their numbers, and the last sample of each. */
typedef struct {
    int32_t room;
    double *numbers, *end;
} lh_blocks;

/* A filter on an IMU, with the driver around it. ``memory`` is a block of ``size`` bytes. */
typedef struct {
    const char *name, *files, *digest; /* what it was generated from */
    const char *settings_format, *carry_format; /* as Python's struct names words */
    size_t size;
    ptrdiff_t settings, carry; /* words */
    void (*begin)(void *memory, const lh_word *settings);
    void (*set_settings)(void *memory, const lh_word *settings);
    void (*set_carry)(void *memory, const lh_word *carry);
    void (*get_carry)(const void *memory, lh_word *carry);
    void (*run)(void *memory, ptrdiff_t count, double last, const lh_rows *rows); /* NULL: has forward */
    void (*report)(const void *memory, double said[11]);
    void (*aid)(void *memory, int32_t row, double value, double deviation, double age); /* NULL: takes nothing */
    ptrdiff_t width; /* numbers of a block that forward keeps; NULL: the filter has no smoother */
    ptrdiff_t (*forward)(void *memory, ptrdiff_t start, ptrdiff_t count, double last, const lh_rows *rows,
                         const lh_blocks *blocks, int32_t *kept);
} lh_imu_filter;

/* A filter on one level and its rate. */
typedef struct {
    const char *name, *files, *digest, *params_format, *state_format;
    size_t size;
    ptrdiff_t params, state, report; /* words */
    void (*set_params)(void *memory, const lh_word *params);
    void (*set_state)(void *memory, const lh_word *state);
    void (*get_state)(const void *memory, lh_word *state);
    void (*run)(void *memory, ptrdiff_t count, const double *t, const double *level, const double *rate,
                double period, double *report);
    double (*tick)(void *memory, double period, double level, double rate, double dt);
} lh_axis_filter;

/* A stretch of a recording on the smoother's way back: blocks, their corrections, the rows of the track; the last three
 * of these with position and velocity. */
typedef struct {
    int32_t count, stop;
    double *t, *numbers, *end, *memory;
    double *turn, *before, *bias, *sigma;
    double *quat, *biases, *sigmas;
    double *nav_end, *nav_before, *nav;
} lh_stretch;

/* The smoother of a filter. */
typedef struct {
    const char *name, *files, *digest;
    ptrdiff_t width, memory; /* numbers: of a block, and of what the way back works with */
    bool aided; /* with position and velocity */
    void (*correct)(const lh_stretch *stretch);
} lh_smoother;

#endif
