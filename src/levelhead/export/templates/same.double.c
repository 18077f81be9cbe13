/* Bit by bit. */
static bool same(double got, double wanted)
{
    return memcmp(&got, &wanted, sizeof got) == 0;
}
