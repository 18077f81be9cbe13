/* Here by hand, because the row has to stay in registers while all others pass; each number is rounded as in the loop
 * of which this is made. */
typedef double lh_four __attribute__((vector_size(32), aligned(8)));
#define LH_FOUR(at) (*(const lh_four *)(m + (at)))
#define LH_STORE(at, sum) (*(lh_four *)(m + (at)) = (sum))
LH_INLINE void $name(double *m, int32_t to, int32_t weight, int32_t step, int32_t row, int32_t stride,
    int32_t count, int32_t width)
{
    int32_t j = 0;
    for (; j + 32 <= width; j += 32) {
        lh_four a = LH_FOUR(to + j), b = LH_FOUR(to + j + 4), c = LH_FOUR(to + j + 8), d = LH_FOUR(to + j + 12);
        lh_four e = LH_FOUR(to + j + 16), f = LH_FOUR(to + j + 20), g = LH_FOUR(to + j + 24), h = LH_FOUR(to + j + 28);
        for (int32_t k = 0; k < count; k++) {
            const double one = m[weight + k * step];
            const lh_four factor = {one, one, one, one};
            const int32_t at = row + k * stride + j;
            a -= factor * LH_FOUR(at), b -= factor * LH_FOUR(at + 4);
            c -= factor * LH_FOUR(at + 8), d -= factor * LH_FOUR(at + 12);
            e -= factor * LH_FOUR(at + 16), f -= factor * LH_FOUR(at + 20);
            g -= factor * LH_FOUR(at + 24), h -= factor * LH_FOUR(at + 28);
        }
        LH_STORE(to + j, a), LH_STORE(to + j + 4, b), LH_STORE(to + j + 8, c), LH_STORE(to + j + 12, d);
        LH_STORE(to + j + 16, e), LH_STORE(to + j + 20, f), LH_STORE(to + j + 24, g), LH_STORE(to + j + 28, h);
    }
    for (; j + 24 <= width; j += 24) {
        lh_four a = LH_FOUR(to + j), b = LH_FOUR(to + j + 4), c = LH_FOUR(to + j + 8), d = LH_FOUR(to + j + 12);
        lh_four e = LH_FOUR(to + j + 16), f = LH_FOUR(to + j + 20);
        for (int32_t k = 0; k < count; k++) {
            const double one = m[weight + k * step];
            const lh_four factor = {one, one, one, one};
            const int32_t at = row + k * stride + j;
            a -= factor * LH_FOUR(at), b -= factor * LH_FOUR(at + 4), c -= factor * LH_FOUR(at + 8);
            d -= factor * LH_FOUR(at + 12), e -= factor * LH_FOUR(at + 16), f -= factor * LH_FOUR(at + 20);
        }
        LH_STORE(to + j, a), LH_STORE(to + j + 4, b), LH_STORE(to + j + 8, c), LH_STORE(to + j + 12, d);
        LH_STORE(to + j + 16, e), LH_STORE(to + j + 20, f);
    }
    for (; j + 16 <= width; j += 16) {
        lh_four a = LH_FOUR(to + j), b = LH_FOUR(to + j + 4), c = LH_FOUR(to + j + 8), d = LH_FOUR(to + j + 12);
        for (int32_t k = 0; k < count; k++) {
            const double one = m[weight + k * step];
            const lh_four factor = {one, one, one, one};
            const int32_t at = row + k * stride + j;
            a -= factor * LH_FOUR(at), b -= factor * LH_FOUR(at + 4);
            c -= factor * LH_FOUR(at + 8), d -= factor * LH_FOUR(at + 12);
        }
        LH_STORE(to + j, a), LH_STORE(to + j + 4, b), LH_STORE(to + j + 8, c), LH_STORE(to + j + 12, d);
    }
    for (; j < width; j += 4) {
        lh_four sum = LH_FOUR(to + j);
        for (int32_t k = 0; k < count; k++) {
            const double one = m[weight + k * step];
            const lh_four factor = {one, one, one, one};
            sum -= factor * LH_FOUR(row + k * stride + j);
        }
        LH_STORE(to + j, sum);
    }
}
