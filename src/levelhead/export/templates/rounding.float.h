 * The same source runs in Python, in double: what comes out here differs by the rounding of float, and in its last digits
 * between compilers and processors. What comments say of accuracy is meant for double.
 * -ffast-math breaks it: a missing reading is NaN. No heap, no globals, nothing of libm but sqrtf.
