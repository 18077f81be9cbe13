
/* A measurement from outside, $axes, with its 1 sigma: position in m, velocity in m/s, a velocity of zero
 * (a foot on the ground, a wheel that stands), and height in m by a barometer, whose zero may drift. age: s from it to the last sample, below 0 where it came after. It acts at the end of
 * a block. False, and it is not taken, if a number is not finite or sigma is not greater than 0.
 */
bool ${name}_update_position($name *filter, const $real position[3], const $real sigma[3], $real age);
bool ${name}_update_velocity($name *filter, const $real velocity[3], const $real sigma[3], $real age);
bool ${name}_update_zero_velocity($name *filter, $real sigma, $real age);
bool ${name}_update_height($name *filter, $real height, $real sigma, $real age);

/* Position and velocity, and their 1 sigma. */
${name}_nav_state ${name}_position(const $name *filter);

/* Whether the foot of a walker stands, with the sensor on the shoe: before the first sample, and with a sample (rad/s,
 * m/s², s). The answer is 1 sigma of a zero velocity in m/s, for update_zero_velocity with age 0; 0: the foot moves. */
void ${name}_begin_stance(${name}_stance *stance);
$real ${name}_update_stance(${name}_stance *stance, const $real gyr[3], const $real acc[3], $real dt);
