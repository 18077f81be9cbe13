/* 1 sigma of the attitude error about east, north and up, rad. */
${name}_vec3 ${name}_sigma(const $name *filter);
