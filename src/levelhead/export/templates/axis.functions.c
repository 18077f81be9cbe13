/* ---- What $name.h offers */

void ${name}_init($name *filter, $real level)
{
$values
    ${name}_reset(filter, level);
}

void ${name}_reset($name *filter, $real level)
{
    const $first state = $begin;
$kept_first
}

bool ${name}_update($name *filter, $real level, $real rate, $real dt, $real period, ${name}_report *report)
{
    const $real finite = (level - level) + (rate - rate); /* 0, or NaN if one of them is infinite or NaN */
    if (!($zero < dt && dt < $longest && finite == $zero)) {
        return false;
    }
    const $state state = $step;
$kept
    if (report) {
        *report = $read;
    }
    return true;
}
