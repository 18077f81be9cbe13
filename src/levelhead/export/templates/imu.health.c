int32_t ${name}_health(const $name *filter)
{
$answer
}
