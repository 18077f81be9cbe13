void ${name}_update_temperature($name *filter, $real celsius)
{
    $real off;
    if (!(celsius - celsius == $zero)) {
        return;
    }
$lines
}
