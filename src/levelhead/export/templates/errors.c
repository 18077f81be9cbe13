
/* Some states, and their 1 sigma. */
static void learned(const $name *filter, int32_t first, int32_t count, $real unit, $real *value, $real *sigma)
{
    const $real *m = filter->carry.run.state.memory;
    for (int32_t k = 0; k < count; k++) {
        const $real variance = m[$p + (first + k) * ($row + 1)];
        value[k] = m[$mean + first + k] * unit;
        sigma[k] = $root(variance > $zero ? variance : $zero) * unit;
    }
}

${name}_learned ${name}_learned_errors(const $name *filter)
{
    ${name}_learned found;
    const $real norm = filter->carry.run.state.field_norm, there = norm > $zero ? $one : $zero;
$calls
    return found;
}
