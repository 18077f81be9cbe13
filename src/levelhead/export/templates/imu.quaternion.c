${name}_quat ${name}_quaternion(const $name *filter)
{
$answer
}
