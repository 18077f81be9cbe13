/* Faults of the last sample and the filter's response: bits LH_… from above; 0 means none. */
int32_t ${name}_health(const $name *filter);
