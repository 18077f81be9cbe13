/* FILTER exported and by hand on the same hard samples: the first that differs in a bit, or -1. */
#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define EXPORTED(call) JOIN(JOIN(lh_, FILTER), call)
#define BY_HAND(call) JOIN(JOIN(lean_, FILTER), call)
#include EXPORTED_H
#include BY_HAND_H
#include <math.h>
#include <stdio.h>
#include <string.h>

static uint32_t seed = 1;

static float uniform(void)
{
    seed = seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return (float)(seed >> 8) / 8388608.0f - 1.0f;
}

/* Rest and motion, up to 4,000 °/s and 30 m/s²; missing and absent readings, lost samples, gaps, a sensor upside down. */
static float sample(int i, float *v, const float **given)
{
    const int kind = (i / 500) % 6;
    const float fast = kind == 1 ? 70.0f : kind == 5 ? 0.0f : 0.5f, far = kind == 2 ? 30.0f : 1.0f;
    for (int k = 0; k < 3; k++) {
        v[k] = fast * uniform();
        v[3 + k] = far * uniform() + (k == 2 ? (kind == 3 ? -9.8f : 9.8f) : 0.0f);
        v[6 + k] = 30.0f * uniform();
        given[k] = v + 3 * k;
    }
    for (int k = 0; k < 3 && kind == 4; k++) {
        const float which = uniform();
        if (which > 0.8f) {
            v[3 * k + 1] = which > 0.95f ? NAN : 3e9f;
        }
        given[k] = k > 0 && which < -0.9f ? 0 : given[k];
    }
    const float pause = uniform();
    return pause > 0.995f ? 0.7f : pause > 0.97f ? 0.05f : pause < -0.999f ? 0.0f : 0.01f + 0.002f * uniform();
}

int main(void)
{
    int differs = -1;
    for (int run = 0; run < 50 && differs < 0; run++) {
        EXPORTED() first;
        BY_HAND() second;
        EXPORTED(_init)(&first);
        BY_HAND(_init)(&second);
        for (int i = 0; i < 6000 && differs < 0; i++) {
            float v[9];
            const float *given[3];
            const float dt = sample(i + 700 * run, v, given);
            const bool a = EXPORTED(_update)(&first, given[0], given[1], given[2], dt);
            const bool b = BY_HAND(_update)(&second, given[0], given[1], given[2], dt);
            const EXPORTED(_output) one = EXPORTED(_read)(&first);
            const BY_HAND(_quat) q = BY_HAND(_quaternion)(&second);
            const BY_HAND(_vec3) w = BY_HAND(_bias)(&second);
            if (a != b || memcmp(&one.quat, &q, sizeof q) || memcmp(&one.bias, &w, sizeof w)) {
                differs = i + 6000 * run;
            }
        }
    }
    printf("%d\n", differs);
    return differs >= 0;
}
