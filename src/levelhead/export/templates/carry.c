
void ${name}_get_carry(const $name *filter, ${name}_saved *to)
{
    to->mark = UINT32_C($mark);
    to->carry = filter->carry;
}

bool ${name}_set_carry($name *filter, const ${name}_saved *from)
{
    if (from->mark != UINT32_C($mark)) {
        return false;
    }
    filter->carry = from->carry;
    return true;
}
