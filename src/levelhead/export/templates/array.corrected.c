${name}_readings ${name}_corrected(const $name *filter, const $real gyr[3], const $real acc[3], const $real mag[3])
{
    $body
}

