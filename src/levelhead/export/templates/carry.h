
/* What a filter has learned and where it stands, as plain bytes: EEPROM.put and EEPROM.get take them, and so does a file.
 * Parameters are not among them.
 */
typedef struct {
    uint32_t mark; /* of this filter and its layout */
    ${name}_carry carry;
} ${name}_saved;

void ${name}_get_carry(const $name *filter, ${name}_saved *to);

/* Goes on from there; the filter was initialised before. False, and nothing changes, if the bytes are of another filter
 * or another layout.
 */
bool ${name}_set_carry($name *filter, const ${name}_saved *from);
