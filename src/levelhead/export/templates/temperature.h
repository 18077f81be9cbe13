/* Takes the sensor's temperature: the biases of the samples that follow are those at it, within $ranges. Not a number is
 * no reading. */
void ${name}_update_temperature($name *filter, $real celsius);

