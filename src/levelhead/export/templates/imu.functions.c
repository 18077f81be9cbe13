/* ---- What $name.h offers */

${table}void ${name}_init($name *filter)
{
$values
    ${name}_reset(filter);
}

void ${name}_reset($name *filter)
{
    $begin;
$told}

${mounted}static void three(const $real *v, $real *to)
{
$components
}

${corrected}bool ${name}_update($name *filter, const $real gyr_read[3], const $real acc_read[3], const $real mag_read[3], $real dt)
{
    if (!($zero < dt && dt < $longest)) {
        return false;
    }
$take
    $advance;
    return true;
}

int32_t ${name}_update_rows($name *filter, int32_t count, const $real *gyr, const $real *acc, const $real *mag, const $real *dt, $real *quat)
{
    int32_t taken = 0;
    for (int32_t i = 0; i < count; i++) {
        taken += ${name}_update(filter, gyr + 3 * i, acc + 3 * i, mag ? mag + 3 * i : mag, dt[i]);
        const ${name}_quat q = ${name}_quaternion(filter);
        quat[4 * i] = q.w;
        quat[4 * i + 1] = q.x;
        quat[4 * i + 2] = q.y;
        quat[4 * i + 3] = q.z;
    }
    return taken;
}

$answers
${name}_output ${name}_read(const $name *filter)
{
    ${name}_output found;
$read
    return found;
}

${name}_euler ${name}_roll_pitch_yaw(const $name *filter)
{
    const ${name}_quat q = ${name}_quaternion(filter);
    return $euler;
}

${name}_euler ${name}_degrees(const $name *filter)
{
    ${name}_euler angles = ${name}_roll_pitch_yaw(filter);
    angles.roll *= $degrees;
    angles.pitch *= $degrees;
    angles.yaw *= $degrees;
    return angles;
}

$real ${name}_bearing(const $name *filter)
{
    const $real yaw = ${name}_degrees(filter).yaw, bearing = $bearing_of;
    return bearing < $zero ? bearing + $turn : bearing;
}

${name}_vec3 ${name}_up(const $name *filter)
{
    const ${name}_quat q = ${name}_quaternion(filter);
    ${name}_vec3 up;
    up.x = $down$two * (q.x * q.z - q.w * q.y);
    up.y = $down$two * (q.y * q.z + q.w * q.x);
    up.z = $down($one - $two * (q.x * q.x + q.y * q.y));
    return up;
}

${name}_vec3 ${name}_linear_acceleration(const $name *filter, const $real acc_read[3])
{
    $force
    ${name}_vec3 free = ${name}_up(filter);
    free.x = $force_x - $gravity * free.x;
    free.y = $force_y - $gravity * free.y;
    free.z = $force_z - $gravity * free.z;
    return free;
}
