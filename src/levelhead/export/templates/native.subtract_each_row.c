/* Here by hand, because the row has to stay in registers while all others pass; each number is rounded as in the loop
 * of which this is made. Eight columns are one vector, or two. */
typedef double lh_four __attribute__((vector_size(32), aligned(8)));
#define LH_FOUR(at) (*(lh_four *)(m + (at)))
#if defined(__AVX512F__)
typedef double lh_eight __attribute__((vector_size(64), aligned(8)));
#define LH_EIGHT(at) (*(lh_eight *)(m + (at)))
#define LH_LOAD(a, at) lh_eight a = LH_EIGHT(at)
#define LH_SUBTRACT(a, at) a -= one * LH_EIGHT(at)
#define LH_STORE(a, at) LH_EIGHT(at) = a
#else
#define LH_LOAD(a, at) lh_four a##0 = LH_FOUR(at), a##1 = LH_FOUR((at) + 4)
#define LH_SUBTRACT(a, at) a##0 -= one * LH_FOUR(at), a##1 -= one * LH_FOUR((at) + 4)
#define LH_STORE(a, at) LH_FOUR(at) = a##0, LH_FOUR((at) + 4) = a##1
#endif
LH_INLINE void $name(double *m, int32_t to, int32_t weight, int32_t step, int32_t row, int32_t stride,
    int32_t count, int32_t width)
{
    int32_t j = 0;
    for (; j + 32 <= width; j += 32) {
        LH_LOAD(a, to + j);
        LH_LOAD(b, to + j + 8);
        LH_LOAD(c, to + j + 16);
        LH_LOAD(d, to + j + 24);
        for (int32_t k = 0; k < count; k++) {
            const double one = m[weight + k * step];
            const int32_t at = row + k * stride + j;
            LH_SUBTRACT(a, at);
            LH_SUBTRACT(b, at + 8);
            LH_SUBTRACT(c, at + 16);
            LH_SUBTRACT(d, at + 24);
        }
        LH_STORE(a, to + j);
        LH_STORE(b, to + j + 8);
        LH_STORE(c, to + j + 16);
        LH_STORE(d, to + j + 24);
    }
    for (; j + 24 <= width; j += 24) {
        LH_LOAD(a, to + j);
        LH_LOAD(b, to + j + 8);
        LH_LOAD(c, to + j + 16);
        for (int32_t k = 0; k < count; k++) {
            const double one = m[weight + k * step];
            const int32_t at = row + k * stride + j;
            LH_SUBTRACT(a, at);
            LH_SUBTRACT(b, at + 8);
            LH_SUBTRACT(c, at + 16);
        }
        LH_STORE(a, to + j);
        LH_STORE(b, to + j + 8);
        LH_STORE(c, to + j + 16);
    }
    for (; j + 16 <= width; j += 16) {
        LH_LOAD(a, to + j);
        LH_LOAD(b, to + j + 8);
        for (int32_t k = 0; k < count; k++) {
            const double one = m[weight + k * step];
            const int32_t at = row + k * stride + j;
            LH_SUBTRACT(a, at);
            LH_SUBTRACT(b, at + 8);
        }
        LH_STORE(a, to + j);
        LH_STORE(b, to + j + 8);
    }
    for (; j < width; j += 4) {
        lh_four sum = LH_FOUR(to + j);
        for (int32_t k = 0; k < count; k++) {
            sum -= m[weight + k * step] * LH_FOUR(row + k * stride + j);
        }
        LH_FOUR(to + j) = sum;
    }
}
