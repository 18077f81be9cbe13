/* Bit by bit. */
static bool same(double got, double wanted)
{
    return memcmp(&got, &wanted, sizeof got) == 0;
}

/* But for the last digits. */
static bool alike(double got, double wanted)
{
    return fabs(got - wanted) <= 1e-9 * (1.0 + fabs(wanted));
}
