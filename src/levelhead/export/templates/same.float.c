static bool same(float got, float wanted)
{
    return fabsf(got - wanted) <= $bound * (1.0f + fabsf(wanted));
}
