static void aid(void *memory, int32_t row, double value, double deviation, double age)
{
    Filter *filter = memory;
    $aid;
}

