/* The numbers with which it was exported, and a filter that has seen nothing yet. */
void ${name}_init($name *filter);

/* $reset */
void ${name}_reset($name *filter);

/* One sample. gyr in rad/s, acc in m/s², mag in $field, dt in seconds since the last sample.
 *
 * acc and mag may be NULL: no new reading. NaN marks a reading that ought to be there and is not; it is bridged. The
 * first sample with an accelerometer reading sets the attitude to start from; its dt does not matter. False, and the
 * sample is not taken, if dt is not greater than 0 and below $longest.$without_mag
 */
bool ${name}_update($name *filter, const $real gyr[3], const $real acc[3], const $real mag[3], $real dt);

/* Many samples, row after row: gyr, acc, mag (or NULL) 3 numbers each, dt 1, and quat takes 4. How many were taken. */
int32_t ${name}_update_rows($name *filter, int32_t count, const $real *gyr, const $real *acc, const $real *mag, const $real *dt, $real *quat);

${corrected}/* All that the filter says after the last sample. */
${name}_output ${name}_read(const $name *filter);

$answers
/* Roll, pitch and yaw in rad: intrinsic z-y-x angles; yaw is $yaw. */
${name}_euler ${name}_roll_pitch_yaw(const $name *filter);

/* The same in degrees. */
${name}_euler ${name}_degrees(const $name *filter);

/* Compass bearing of the x axis, degrees clockwise from north, 0 to 360: magnetic north with a magnetometer, where the
 * start pointed without one. Undefined where x is vertical. */
$real ${name}_bearing(const $name *filter);

/* Up, as a unit vector in the frame of the $frame; gravity points the other way. */
${name}_vec3 ${name}_up(const $name *filter);

/* A specific force as an update takes it, less gravity: the acceleration of the $frame in its own frame, m/s². */
${name}_vec3 ${name}_linear_acceleration(const $name *filter, const $real acc[3]);
$saving