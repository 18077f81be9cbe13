/* ---- What $name.h offers */

${table}void ${name}_init($name *filter)
{
$values
    ${name}_reset(filter);
}

void ${name}_reset($name *filter)
{
    filter->carry = $begin;
$told}

${mounted}static Vec3 three(const $real *v)
{
    return v ? (Vec3){$components} : (Vec3){$zero, $zero, $zero};
}

${corrected}bool ${name}_update($name *filter, const $real gyr[3], const $real acc[3], const $real mag[3], $real dt)
{
    if (!($zero < dt && dt < $longest)) {
        return false;
    }
$now    $advance;
    return true;
}

${name}_output ${name}_read(const $name *filter)
{
    return $result;
}

${name}_quat ${name}_quaternion(const $name *filter)
{
    return ${name}_read(filter).quat;
}

${name}_euler ${name}_roll_pitch_yaw(const $name *filter)
{
    return quat_to_euler(${name}_read(filter).quat);
}

${name}_vec3 ${name}_bias(const $name *filter)
{
    return ${name}_read(filter).bias;
}

${name}_vec3 ${name}_sigma(const $name *filter)
{
    return ${name}_read(filter).sigma;
}

int32_t ${name}_health(const $name *filter)
{
    return ${name}_read(filter).health;
}
