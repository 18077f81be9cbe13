/* Orientation, $frame to earth ($earth), unit quaternion, scalar first. */
${name}_quat ${name}_quaternion(const $name *filter);
