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

${name}_euler ${name}_degrees(const $name *filter)
{
    const ${name}_euler angles = ${name}_roll_pitch_yaw(filter);
    return (${name}_euler){$degrees * angles.roll, $degrees * angles.pitch, $degrees * angles.yaw};
}

$real ${name}_bearing(const $name *filter)
{
    const $real bearing = $quarter - ${name}_degrees(filter).yaw;
    return bearing < $zero ? bearing + $turn : bearing;
}

${name}_vec3 ${name}_up(const $name *filter)
{
    const ${name}_quat q = ${name}_read(filter).quat;
    return (${name}_vec3){
        $two * (q.x * q.z - q.w * q.y), $two * (q.y * q.z + q.w * q.x), $one - $two * (q.x * q.x + q.y * q.y)
    };
}

${name}_vec3 ${name}_linear_acceleration(const $name *filter, const $real acc[3])
{
    const ${name}_vec3 up = ${name}_up(filter);
    return (${name}_vec3){acc[0] - $gravity * up.x, acc[1] - $gravity * up.y, acc[2] - $gravity * up.z};
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
