 * The same source runs in Python, so what comes out is the same, to the bit. That holds where every
 * operation rounds once to the type that is written (FLT_EVAL_METHOD 0) and a * b + c is not contracted into one
 * operation: the source forbids that to gcc and clang. Contraction makes no result worse, only different in its last
 * digits.
 * -ffast-math breaks it: a missing reading is NaN. No heap, no globals, nothing of libm but sqrt.
