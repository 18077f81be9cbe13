${name}_readings ${name}_corrected(const $name *filter, const $real gyr_read[3], const $real acc_read[3], const $real mag_read[3])
{
$body
    return now;
}
