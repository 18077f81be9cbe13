/* 1 sigma of the attitude error about $axes, rad. */
${name}_vec3 ${name}_sigma(const $name *filter);
