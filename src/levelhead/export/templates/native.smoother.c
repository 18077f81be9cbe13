/* ``smoother_kernels.correct_stretch``. */
static void correct(const lh_stretch *s)
{
    $backward
    $compose_ends
    for (int32_t k = 1; k <= s->count; k++) {
        const int32_t first = (int32_t)s->end[k - 1] + 1, last = k < s->count ? (int32_t)s->end[k] : s->stop - 1;
        $spread_block
        $spread_nav
    }
}

const lh_smoother LH_SYMBOL($symbol) = {
    .name = "$name",
    .files = "$files",
    .digest = "$digest",
    .width = $width,
    .memory = $memory,
    .aided = $aided,
    .correct = correct,
};
