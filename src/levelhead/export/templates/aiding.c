/* Whether these are numbers, and sigma is one that can be. */
static bool is_reading($real value, $real sigma, $real age)
{
    return value - value == $zero && sigma - sigma == $zero && age - age == $zero && sigma > $zero;
}

static void aid($name *filter, int32_t row, $real value, $real sigma, $real age)
{
    $aid;
}

static bool aid_vector($name *filter, int32_t row, const $real value[3], const $real sigma[3], $real age)
{
    for (int32_t k = 0; k < 3; k++) {
        if (!is_reading(value[k], sigma[k], age)) {
            return false;
        }
    }
${into}    for (int32_t k = 0; k < 3; k++) {
        aid(filter, row + k, $enu[k], $deviation[k], age);
    }
    return true;
}

bool ${name}_update_position($name *filter, const $real position[3], const $real sigma[3], $real age)
{
    return aid_vector(filter, $position, position, sigma, age);
}

bool ${name}_update_velocity($name *filter, const $real velocity[3], const $real sigma[3], $real age)
{
    return aid_vector(filter, $velocity, velocity, sigma, age);
}

bool ${name}_update_zero_velocity($name *filter, $real sigma, $real age)
{
    const $real value[3] = {$zero, $zero, $zero}, deviation[3] = {sigma, sigma, sigma};
    return aid_vector(filter, $zero_velocity, value, deviation, age);
}

bool ${name}_update_height($name *filter, $real height, $real sigma, $real age)
{
    if (!is_reading(height, sigma, age)) {
        return false;
    }
    aid(filter, $height, height, sigma, age);
    return true;
}

${name}_nav_state ${name}_position(const $name *filter)
{
    ${name}_nav_state found;
    $place;
${turned}    return found;
}

void ${name}_begin_stance(${name}_stance *stance)
{
$begin_stance
}

$real ${name}_update_stance(${name}_stance *stance, const $real gyr[3], const $real acc[3], $real dt)
{
    $stand;
    return stance->sigma;
}
