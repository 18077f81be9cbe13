static bool alike(float got, float wanted)
{
    return fabsf(got - wanted) <= $bound * (1.0f + fabsf(wanted));
}

/* Rounding to float is left out of the comparison. */
static bool same(float got, float wanted)
{
    return alike(got, wanted);
}
