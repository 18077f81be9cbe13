/* What was wrong with the last sample and what was done about it: bits LH_… from above; 0 is well. */
int32_t ${name}_health(const $name *filter);
