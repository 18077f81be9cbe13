/* Readings as an update takes them from these, by itself: for a log of what the filter was fed. */
${name}_readings ${name}_corrected(const $name *filter, const $real gyr[3], const $real acc[3], const $real mag[3]);

