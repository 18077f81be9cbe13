/* Here by hand, because the row has to stay in registers while all others pass; each number is rounded as in the loop
 * of which this is made. Eight columns are one vector, or two. */
typedef double lh_four __attribute__((vector_size(32), aligned(8)));
#define LH_FOUR(at) (*(lh_four *)(m + (at)))
#if defined(__AVX512F__)
typedef double lh_eight __attribute__((vector_size(64), aligned(8)));
#define LH_EIGHT(at) (*(lh_eight *)(m + (at)))
#define LH_LOAD(a, by) lh_eight a = LH_EIGHT(to + j + (by));
#define LH_SUBTRACT(a, by) a -= one * LH_EIGHT(at + (by));
#define LH_STORE(a, by) LH_EIGHT(to + j + (by)) = a;
#else
#define LH_LOAD(a, by) lh_four a##0 = LH_FOUR(to + j + (by)), a##1 = LH_FOUR(to + j + (by) + 4);
#define LH_SUBTRACT(a, by) a##0 -= one * LH_FOUR(at + (by)), a##1 -= one * LH_FOUR(at + (by) + 4);
#define LH_STORE(a, by) LH_FOUR(to + j + (by)) = a##0, LH_FOUR(to + j + (by) + 4) = a##1;
#endif
#define LH_EACH_OF_8(DO) DO(a, 0)
#define LH_EACH_OF_16(DO) LH_EACH_OF_8(DO) DO(b, 8)
#define LH_EACH_OF_24(DO) LH_EACH_OF_16(DO) DO(c, 16)
#define LH_EACH_OF_32(DO) LH_EACH_OF_24(DO) DO(d, 24)
#define LH_PASS(columns) \
    for (; j + columns <= width; j += columns) { \
        LH_EACH_OF_##columns(LH_LOAD) \
        for (int32_t k = 0; k < count; k++) { \
            const double one = m[weight + k * step]; \
            const int32_t at = row + k * stride + j; \
            LH_EACH_OF_##columns(LH_SUBTRACT) \
        } \
        LH_EACH_OF_##columns(LH_STORE) \
    }
LH_INLINE void $name(double *m, int32_t to, int32_t weight, int32_t step, int32_t row, int32_t stride,
    int32_t count, int32_t width)
{
    int32_t j = 0;
    LH_PASS(32)
    LH_PASS(24)
    LH_PASS(16)
    LH_PASS(8)
    for (; j + 4 <= width; j += 4) {
        lh_four sum = LH_FOUR(to + j);
        for (int32_t k = 0; k < count; k++) {
            sum -= m[weight + k * step] * LH_FOUR(row + k * stride + j);
        }
        LH_FOUR(to + j) = sum;
    }
    for (; j < width; j++) {
        for (int32_t k = 0; k < count; k++) {
            m[to + j] -= m[weight + k * step] * m[row + k * stride + j];
        }
    }
}
