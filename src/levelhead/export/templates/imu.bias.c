${name}_vec3 ${name}_bias(const $name *filter)
{
$answer
}
