/* Bias of the gyroscope, rad/s$no_bias. */
${name}_vec3 ${name}_bias(const $name *filter);
