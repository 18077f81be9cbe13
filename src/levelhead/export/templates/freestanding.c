#if defined(__GNUC__) && defined(__arm__) && defined(__ARM_FP) && (__ARM_FP & $has_root)
/* The instruction itself: gcc takes sqrt$f for a function that may set errno, and keeps a call of it beside. */
static inline __attribute__((always_inline)) $real lh_root($real x)
{
    $real root;
    __asm__($vsqrt);
    return root;
}
#define LH_ROOT(x) lh_root(x)
#endif

#if defined(LH_FREESTANDING)
/* No C library: what it would give, rounded as IEEE 754 asks. */
#if defined(LH_ROOT)
#elif defined(__wasm__) || defined(__SSE2__) || (defined(__ARM_FP) && (__ARM_FP & $has_root))
#define LH_ROOT(x) __builtin_sqrt$f(x)
#else
static $real lh_root($real x)
{
    union {
        $real number;
        $bits bits;
    } v;
    v.number = x;
    if (!(x > $zero) || v.bits >= ($bits)$infinite << $fraction) {
        return x < $zero ? (x - x) / (x - x) : x; /* of what is negative there is none; 0, infinity and NaN are their own */
    }
    int exponent = 0;
    if (!(v.bits >> $fraction)) {
        v.number *= ($real)(($bits)1 << $fraction);
        exponent = -$fraction;
    }
    exponent += (int)(v.bits >> $fraction) - $middle;
    $bits rest = (v.bits & ((($bits)1 << $fraction) - 1)) | ($bits)1 << $fraction;
    rest <<= $lift + (exponent & 1);
    $bits root = 0, remainder = 0;
    for (int i = 0; i < $fraction + 2; i++) { /* two digits of the number, one of its root */
        remainder = remainder << 2 | rest >> ($width - 2);
        rest <<= 2;
        const $bits trial = root << 2 | 1;
        root <<= 1;
        if (remainder >= trial) {
            remainder -= trial;
            root |= 1;
        }
    }
    root = (root + (root & 1)) >> 1; /* no root lies in the middle between two numbers */
    v.bits = root + (($bits)((exponent - (exponent & 1)) / 2 + $middle - 1) << $fraction);
    return v.number;
}
#define LH_ROOT(x) lh_root(x)
#endif
#define fabs$f(x) __builtin_fabs$f(x)
#define floor$f(x) (($real)($whole)(x) - ($real)((x) < ($real)($whole)(x)))
#else
#include <math.h>
#endif
#if defined(LH_ROOT)
#define sqrt$f(x) LH_ROOT(x)
#endif
