/* ---- What $name.h offers */

/* What has to be kept from sample to sample. */
static void keep($name *filter, const $state *state)
{
$kept
}

void ${name}_init($name *filter, $real level)
{
$values
    ${name}_reset(filter, level);
}

void ${name}_reset($name *filter, $real level)
{
    const $state state = $begin;
    keep(filter, &state);
}

bool ${name}_update($name *filter, $real level, $real rate, $real dt, $real period, ${name}_report *report)
{
    const $real finite = (level - level) + (rate - rate); /* 0, or NaN if one of them is infinite or NaN */
    if (!($zero < dt && dt < $longest && finite == $zero)) {
        return false;
    }
    const $state before = {$restored};
    const $state state = $step;
    keep(filter, &state);
    if (report) {
        *report = $read;
    }
    return true;
}
