${name}_vec3 ${name}_sigma(const $name *filter)
{
$answer
}
