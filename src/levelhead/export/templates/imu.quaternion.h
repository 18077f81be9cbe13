/* Orientation, $frame to earth (x east, y north, z up), unit quaternion, scalar first. */
${name}_quat ${name}_quaternion(const $name *filter);
