 * The same source runs in Python, so what comes out is the same, to the bit. That holds where every
 * operation rounds once to the type that is written (FLT_EVAL_METHOD 0) and a * b + c is not contracted into one
 * operation: gcc needs -ffp-contract=off, which -std=c99 implies but -std=gnu99 does not; clang is told so in the source.
 * Contraction, where the processor has it, makes no result worse, only different in its last digits.
 * -ffast-math breaks it: a missing reading is NaN. No heap, no globals, nothing of libm but sqrt.
