/* The numbers with which it was exported; starts at a known angle. */
void ${name}_init($name *filter, $real level);

/* Starts again at a known angle, with the parameters as they are: filter.params.… may be changed at any time. */
void ${name}_reset($name *filter, $real level);

/* One sample: a noisy level and its drifting rate, dt later; the level lives on a circle of that period (360 for
 * degrees), or on a line if it is 0. Units are yours: rate in units of the level per unit of dt.
 *
 * False, and the sample is not taken, if dt is not greater than 0 and below $longest, or level or rate is not finite.
 * report may be NULL.
 */
bool ${name}_update($name *filter, $real level, $real rate, $real dt, $real period, ${name}_report *report);
