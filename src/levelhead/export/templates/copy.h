
/* A copy that lives on by itself. Copying by assignment would leave it with the arrays of the first one. */
void ${name}_copy($name *to, const $name *from);
