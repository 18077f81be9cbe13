/* ``smoother_kernels.forward_stretch``: returns the sample after the last one. */
static ptrdiff_t forward(void *memory, ptrdiff_t start, ptrdiff_t count, double last, const lh_rows *rows,
                         const lh_blocks *blocks, int32_t *found)
{
    static const double none[3] = {0.0, 0.0, 0.0};
    Filter *filter = memory;
    $keep_start;
    int32_t kept = 1;
    ptrdiff_t i = start;
    for (; i < count && kept < blocks->room; i++) {
        const double *gyr = rows->gyr + 3 * i, *acc = rows->acc + 3 * i, *mag = rows->mag ? rows->mag + 3 * i : none;
        const double dt = rows->t[i] - last;
        last = rows->t[i];
        $advance;
        if ($is_block_end) {
            $keep;
            blocks->end[kept++] = (double)i;
        }
$aided
        Output out;
        $result;
        double *quat = rows->quat + 4 * i;
        quat[0] = out.quat.w, quat[1] = out.quat.x, quat[2] = out.quat.y, quat[3] = out.quat.z;
        rows->health[i] = (uint32_t)out.health;
$place
    }
    *found = kept;
    return i;
}
